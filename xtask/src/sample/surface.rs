//! Triangles from which points are drawn by area.

use anyhow::{Result, bail};

use super::triangles::Triangle;
use zeroset_tests::Random;

/// Triangles of positive area.
pub struct Surface {
    triangles: Vec<Triangle>,
    /// Area of each triangle and all before it.
    areas: Vec<f64>,
}

impl Surface {
    /// Triangles without area are left out: they have no points to give.
    pub fn new(all: Vec<Triangle>) -> Result<Self> {
        if all.is_empty() {
            bail!("the mesh has no triangles");
        }
        let (mut triangles, mut areas, mut sum) = (Vec::with_capacity(all.len()), Vec::with_capacity(all.len()), 0.0);
        for triangle in all {
            let area = 0.5 * length(&normal(&triangle));
            // An area that is not a number counts too, so that the sum shows it.
            if area != 0.0 {
                sum += area;
                triangles.push(triangle);
                areas.push(sum);
            }
        }
        if sum == 0.0 {
            bail!("the mesh has no area: all its triangles are lines or points, or too small for numbers of 64 bits");
        }
        if !f64::is_finite(sum) {
            bail!("the mesh's area is not a finite number: scale its coordinates");
        }
        Ok(Self { triangles, areas })
    }

    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// A point that lies in every part of the surface with a chance equal to its share of the area, moved along its triangle's
    /// normal by Gaussian noise.
    pub fn point(&self, random: &mut Random, noise: f64) -> [f64; 3] {
        let place = random.uniform() * self.area();
        let triangle = &self.triangles[self.areas.partition_point(|area| *area <= place).min(self.areas.len() - 1)];
        let (mut u, mut v) = (random.uniform(), random.uniform());
        if u + v > 1.0 {
            // The other half of the parallelogram, turned onto the triangle.
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let [a, b, c] = triangle;
        let mut point = std::array::from_fn(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
        if noise > 0.0 {
            let normal = normal(triangle);
            let height = noise * random.gaussian() / length(&normal);
            (0..3).for_each(|k| point[k] += height * normal[k]);
        }
        point
    }

    /// Points anywhere in the bounding box, a fifth larger.
    pub fn strays(&self, count: usize, random: &mut Random) -> Vec<[f64; 3]> {
        let corners = || self.triangles.iter().flatten();
        let sides: [[f64; 2]; 3] = std::array::from_fn(|k| {
            let low = corners().map(|corner| corner[k]).fold(f64::INFINITY, f64::min);
            let high = corners().map(|corner| corner[k]).fold(f64::NEG_INFINITY, f64::max);
            [0.5 * (low + high), 0.5 * ROOM * (high - low)]
        });
        (0..count).map(|_| sides.map(|[middle, half]| random.between(middle - half, middle + half))).collect()
    }
}

/// How much larger than the bounding box the one is over which strays are strewn.
const ROOM: f64 = 1.2;

/// Twice the area along the normal that corners in counter-clockwise order show towards.
pub fn normal([a, b, c]: &Triangle) -> [f64; 3] {
    let (u, v): ([f64; 3], [f64; 3]) = (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
    std::array::from_fn(|k| u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3])
}

/// Without overflow or underflow of squares.
pub fn length([x, y, z]: &[f64; 3]) -> f64 {
    x.hypot(*y).hypot(*z)
}
