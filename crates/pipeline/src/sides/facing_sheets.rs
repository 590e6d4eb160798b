//! Sheets that face each other: the two walls of a gap, the two sides of a wall.

use rayon::prelude::*;

use crate::points::kd_tree::{tree_of, within};

/// Normals whose cosine is below this face each other.
const OPPOSED: f64 = -0.7;

/// The share of the points that have another one within `reach` whose normal is opposite, where `normals` are unit normals, one per point,
/// zero where there is none.
pub fn facing_share<const D: usize>(points: &[[f64; D]], normals: &[[f64; D]], reach: f64) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    let tree = tree_of(points);
    let dot = |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let is_faced = |(point, normal): &(&[f64; D], &[f64; D])| {
        within(&tree, point, reach).any(|other| dot(normal, &normals[other]) < OPPOSED)
    };
    let faced = points.par_iter().zip(normals).filter(is_faced).count();
    faced as f64 / points.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_are_faced_and_edges_are_not() {
        // A plate of side 1 on one half of which a second one lies 0.1 above; and a wall at right angles at its end.
        let plate = |z: f64, up: f64, from: i32| {
            (from..20).flat_map(move |i| (0..20).map(move |j| ([f64::from(i), f64::from(j), z], [0.0, 0.0, up])))
        };
        let wall = (0..20).flat_map(|j| (0..5).map(move |k| ([0.0, f64::from(j), f64::from(k)], [1.0, 0.0, 0.0])));
        let (points, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
            plate(0.0, 1.0, 0).chain(plate(2.0, -1.0, 10)).chain(wall).map(|(p, n)| (p.map(|x| 0.05 * x), n)).unzip();
        // Both walls of the gap, of 700 points.
        let share = facing_share(&points, &normals, 0.101);
        assert!((share - 400.0 / 700.0).abs() < 1e-12, "{share}");
        assert_eq!(facing_share(&points, &normals, 0.09), 0.0);
        assert_eq!(facing_share(&points, &vec![[0.0; 3]; 700], 1.0), 0.0, "without normals");
        assert_eq!(facing_share::<3>(&[], &[], 1.0), 0.0);
    }
}
