//! Surfaces with fewer triangles, to be looked at.

use std::collections::{HashMap, HashSet};

use crate::page::Surface;

/// A surface for the view.
pub(crate) struct Thinned {
    pub vertices: Vec<[f64; 3]>,
    pub normals: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// Side of the cubes whose vertices were merged; none where all are there.
    pub merged: Option<f64>,
}

/// A surface passes through about so many cubes for every square of a cube's side, with two triangles each.
const TRIANGLES_PER_SQUARE: f64 = 3.0;
/// Cubes grow by this while there are too many triangles.
const GROWTH: f64 = 1.2;

impl Thinned {
    /// At most `most` triangles: those of the surface, or where it has more, what is left of them when the vertices in each cube
    /// of a grid are merged (Rossignac and Borrel, 1993).
    pub fn of(surface: &Surface, most: usize) -> Self {
        let (vertices, normals, triangles) =
            (surface.vertices.to_vec(), surface.normals.to_vec(), surface.triangles.to_vec());
        let all = Self { vertices, normals, triangles, merged: None };
        if all.triangles.len() <= most {
            return all;
        }
        let mut side = (TRIANGLES_PER_SQUARE * all.area() / most as f64).sqrt();
        loop {
            let fewer = all.merged_in(side);
            if fewer.triangles.len() <= most {
                return fewer;
            }
            side *= GROWTH;
        }
    }

    fn area(&self) -> f64 {
        let doubled = self.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|v| self.vertices[v as usize]);
            let cross = |k: usize| {
                let (l, m) = ((k + 1) % 3, (k + 2) % 3);
                (b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l])
            };
            (0..3).map(|k| cross(k).powi(2)).sum::<f64>().sqrt()
        });
        0.5 * doubled.sum::<f64>()
    }

    fn merged_in(&self, side: f64) -> Self {
        let mut cubes: HashMap<[i64; 3], u32> = HashMap::new();
        // Sums of the vertices in each cube, and how many there are; sums of their normals.
        let mut sums: Vec<([f64; 3], f64)> = Vec::new();
        let mut normals: Vec<[f64; 3]> = Vec::new();
        let mut cube_of = Vec::with_capacity(self.vertices.len());
        for (vertex, normal) in self.vertices.iter().zip(&self.normals) {
            let cube = vertex.map(|c| (c / side).floor() as i64);
            let index = *cubes.entry(cube).or_insert_with(|| {
                sums.push(([0.0; 3], 0.0));
                normals.push([0.0; 3]);
                sums.len() as u32 - 1
            });
            let (sum, number) = &mut sums[index as usize];
            (0..3).for_each(|k| sum[k] += vertex[k]);
            (0..3).for_each(|k| normals[index as usize][k] += normal[k]);
            *number += 1.0;
            cube_of.push(index);
        }
        let mut seen = HashSet::new();
        let triangles = self.triangles.iter().map(|triangle| triangle.map(|v| cube_of[v as usize]));
        let triangles = triangles
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .filter(|&[a, b, c]| {
                // The same triangle whichever corner is named first.
                let least = a.min(b).min(c);
                seen.insert(if least == a {
                    [a, b, c]
                } else if least == b {
                    [b, c, a]
                } else {
                    [c, a, b]
                })
            })
            .collect();
        let vertices = sums.into_iter().map(|(sum, number)| sum.map(|c| c / number)).collect();
        Self { vertices, normals, triangles, merged: Some(side) }
    }
}
