//! What the view draws, as bytes: a surface with 16 bits per coordinate, and points.
//!
//! In this order, little endian: `V × 3` u16 positions in the box from `lower` on with the sides `size`; `V × 2` i8 normals, unfolded
//! from an octahedron (Meyer, Süßmuth, Sußner, Stamminger and Greiner, 2010); `P × 3` u16 points in the same box; the `3 T` corners, each as its difference
//! from the one before, zigzag, in groups of seven bits with the lowest first.

use crate::base64;
use crate::page::Surface;
use crate::thinned::Thinned;

/// More triangles make a page that is slow to open, and no better picture.
pub(crate) const MOST_TRIANGLES: usize = 500_000;
/// More points would hide the surface.
pub(crate) const MOST_POINTS: usize = 100_000;

/// The bytes as text, and what belongs to them.
pub(crate) struct ViewData {
    pub base64: String,
    pub vertices: usize,
    pub triangles: usize,
    pub points: usize,
    /// Sides of the box.
    pub size: [f64; 3],
    /// Vertices nearer to each other than about this were merged.
    pub merged: Option<f64>,
}

impl ViewData {
    /// None where there is nothing to see.
    pub fn of(surface: &Surface) -> Option<Self> {
        let thinned = Thinned::of(surface, MOST_TRIANGLES);
        let points: Vec<&[f64; 3]> =
            surface.points.iter().step_by(surface.points.len().div_ceil(MOST_POINTS).max(1)).collect();
        let everything = || thinned.vertices.iter().chain(points.iter().copied());
        let lower = everything().fold([f64::INFINITY; 3], |m, p| std::array::from_fn(|k| m[k].min(p[k])));
        let upper = everything().fold([f64::NEG_INFINITY; 3], |m, p| std::array::from_fn(|k| m[k].max(p[k])));
        let size: [f64; 3] = std::array::from_fn(|k| upper[k] - lower[k]);
        if size.iter().any(|side| !side.is_finite()) {
            return None;
        }
        let mut bytes = Vec::with_capacity(8 * thinned.vertices.len() + 6 * points.len() + 6 * thinned.triangles.len());
        let place = |bytes: &mut Vec<u8>, p: &[f64; 3]| {
            for k in 0..3 {
                let share = if size[k] > 0.0 { (p[k] - lower[k]) / size[k] } else { 0.5 };
                bytes.extend(((share * f64::from(u16::MAX)).round() as u16).to_le_bytes());
            }
        };
        thinned.vertices.iter().for_each(|p| place(&mut bytes, p));
        thinned.normals.iter().for_each(|n| bytes.extend(octahedral(*n).map(i8::cast_unsigned)));
        points.iter().for_each(|p| place(&mut bytes, p));
        let mut last = 0;
        for &corner in thinned.triangles.iter().flatten() {
            let difference = i64::from(corner) - last;
            last = i64::from(corner);
            let mut rest = (difference << 1 ^ difference >> 63).cast_unsigned();
            while rest > 127 {
                bytes.push((rest & 127) as u8 | 128);
                rest >>= 7;
            }
            bytes.push(rest as u8);
        }
        Some(Self {
            base64: base64::encode(&bytes),
            vertices: thinned.vertices.len(),
            triangles: thinned.triangles.len(),
            points: points.len(),
            size,
            merged: thinned.merged,
        })
    }
}

/// A direction as a place in a square: projected on the octahedron `|x| + |y| + |z| = 1`, whose lower half is unfolded.
fn octahedral(normal: [f64; 3]) -> [i8; 2] {
    let length: f64 = normal.iter().map(|c| c.abs()).sum();
    if !(length.is_finite() && length > 0.0) {
        return [0; 2];
    }
    let [x, y, z] = normal.map(|c| c / length);
    let folded =
        if z < 0.0 { [(1.0 - y.abs()) * 1f64.copysign(x), (1.0 - x.abs()) * 1f64.copysign(y)] } else { [x, y] };
    folded.map(|c| (127.0 * c).round() as i8)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Triples<T> = Vec<[T; 3]>;

    /// Vertices and triangles of a wavy sheet of `2 n²` triangles, far from the origin, and normals that will do.
    fn sheet(n: u32) -> (Triples<f64>, Triples<u32>, Triples<f64>) {
        let at = |k: u32| f64::from(k) / f64::from(n);
        let vertices = (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j)));
        let vertices: Vec<[f64; 3]> = vertices.map(|(i, j)| [5e6 + at(i), at(j), 0.1 * (9.0 * at(i)).sin()]).collect();
        let corner = |i, j| i * (n + 1) + j;
        let triangles = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)];
            [[a, b, d], [a, d, c]]
        });
        let normals = vec![[0.0, 0.0, 1.0]; vertices.len()];
        (vertices, triangles.collect(), normals)
    }

    #[test]
    fn what_is_decoded_is_what_was_given() {
        let (vertices, triangles, normals) = sheet(9);
        let points = [[5e6 - 1.0, 0.0, 0.0], [5e6, 2.0, 0.0]];
        let surface = Surface { vertices: &vertices, normals: &normals, triangles: &triangles, points: &points };
        let data = ViewData::of(&surface).unwrap();
        assert_eq!((data.vertices, data.triangles, data.points, data.merged), (100, 162, 2, None));
        assert_eq!([data.size[0], data.size[1]], [2.0, 2.0]);
        let digit =
            |c: u8| b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/".iter().position(|d| *d == c);
        let bytes: Vec<u8> = data
            .base64
            .as_bytes()
            .chunks(4)
            .flat_map(|four| {
                let group = four.iter().fold(0u32, |group, c| group << 6 | digit(*c).unwrap_or(0) as u32);
                group.to_be_bytes()[1..].to_vec()
            })
            .collect();
        let lowest = vertices.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        for (k, vertex) in vertices.iter().enumerate() {
            for axis in 0..3 {
                let at = 6 * k + 2 * axis;
                let share = f64::from(u16::from_le_bytes([bytes[at], bytes[at + 1]])) / 65535.0;
                let lower = [5e6 - 1.0, 0.0, lowest][axis];
                // Half a step of 16 bits.
                assert!((lower + share * data.size[axis] - vertex[axis]).abs() < 8e-6 * data.size[axis]);
            }
        }
        let (mut at, mut last, mut corners) = (800 + 12, 0i64, Vec::new());
        while corners.len() < 486 {
            let (mut value, mut shift) = (0u64, 0);
            loop {
                value |= u64::from(bytes[at] & 127) << shift;
                shift += 7;
                at += 1;
                if bytes[at - 1] < 128 {
                    break;
                }
            }
            last += (value >> 1) as i64 ^ -((value & 1) as i64);
            corners.push(last as u32);
        }
        assert_eq!(corners, triangles.as_flattened());
    }

    #[test]
    fn directions_come_back() {
        for normal in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.6, -0.48, -0.64], [-0.6, 0.48, 0.64]] {
            let [u, v] = octahedral(normal).map(|c| f64::from(c) / 127.0);
            let z = 1.0 - u.abs() - v.abs();
            let fold = (-z).max(0.0);
            let back = [u - fold * 1f64.copysign(u), v - fold * 1f64.copysign(v), z];
            let length = back.iter().map(|c| c * c).sum::<f64>().sqrt();
            let cosine: f64 = (0..3).map(|k| back[k] / length * normal[k]).sum();
            // About a degree: 127 steps from the middle of the square to its side.
            assert!(cosine > 0.9998, "{normal:?} {back:?}");
        }
    }

    #[test]
    fn a_huge_surface_is_thinned_and_the_page_stays_small() {
        let (vertices, triangles, normals) = sheet(900);
        assert!(triangles.len() > 3 * MOST_TRIANGLES);
        let points = vec![[5e6, 0.0, 0.0]; 250_001];
        let surface = Surface { vertices: &vertices, normals: &normals, triangles: &triangles, points: &points };
        let data = ViewData::of(&surface).unwrap();
        assert!((MOST_TRIANGLES / 4..=MOST_TRIANGLES).contains(&data.triangles), "{}", data.triangles);
        assert!(data.merged.is_some() && data.points <= MOST_POINTS && data.points > MOST_POINTS / 2);
        // A page must stay below 20 MB.
        assert!(data.base64.len() < 10_000_000, "{}", data.base64.len());
        let empty = Surface { vertices: &[], normals: &[], triangles: &[], points: &[] };
        assert!(ViewData::of(&empty).is_none());
    }
}
