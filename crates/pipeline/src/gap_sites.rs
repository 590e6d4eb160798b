//! Places on the surface where no point is: the distance is measured from them too.
//!
//! Between points that are farther apart than the lattice's nodes the distance to the points does not vanish on the
//! surface but reaches half a spacing, so that `sign · d` jumps there, and in a wall or a gap as thin as that it says
//! nothing. The sign changes along lattice edges at places that f̂ knows well: those that no point is near are added.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use ndarray::ArrayD;

use crate::domain::multi_index;

/// A point nearer than so many spacings (or cells, if those are larger) makes a site of its own needless.
const NEAR: f64 = 0.3;

/// Roots of the field along the lattice edges on which the sign of `phi` changes, as far as they are away from `points`.
///
/// `value` is what the sign was taken from and `phi` carries the cleaned sign, on the lattice of `nodes`; `scale` is the
/// larger of spacing and cell, frame units.
pub fn gap_sites<const D: usize>(
    value: &ArrayD<f64>,
    phi: &ArrayD<f64>,
    nodes: &[Vec<f64>; D],
    points: &[[f64; D]],
    scale: f64,
) -> Vec<[f64; D]> {
    let Ok(tree) = ImmutableKdTree::<f64, D>::new_from_slice(points) else { return Vec::new() };
    let (Some(values), Some(signs)) = (value.as_slice(), phi.as_slice()) else { return Vec::new() };
    let shape: [usize; D] = std::array::from_fn(|axis| nodes[axis].len());
    let mut sites = Vec::new();
    for flat in 0..values.len() {
        let index = multi_index(flat, &shape);
        let mut stride = 1;
        for axis in (0..D).rev() {
            if index[axis] + 1 < shape[axis] {
                let next = flat + stride;
                if (signs[flat] < 0.0) != (signs[next] < 0.0) {
                    let (a, b) = (values[flat], values[next]);
                    // Where cleaning has made the boundary, f̂ has no root: the middle will do.
                    let t = if (a < 0.0) != (b < 0.0) { a / (a - b) } else { 0.5 };
                    let mut site: [f64; D] = std::array::from_fn(|k| nodes[k][index[k]]);
                    site[axis] += t * (nodes[axis][index[axis] + 1] - nodes[axis][index[axis]]);
                    let square = tree.query(&site).nearest_one::<SquaredEuclidean<f64>>().execute().distance;
                    if square > (NEAR * scale).powi(2) {
                        sites.push(site);
                    }
                }
            }
            stride *= shape[axis];
        }
    }
    sites
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_and_only_they() {
        // The line x = 0.3 on cells of 0.5, with a point at every third node of y.
        let axis: Vec<f64> = (0..13).map(|i| 0.5 * f64::from(i)).collect();
        let value = ArrayD::from_shape_fn(vec![13, 13], |i| axis[i[0]] - 0.3);
        let points: Vec<[f64; 2]> = (0..5).map(|i| [0.3, 1.5 * f64::from(i)]).collect();
        let sites = gap_sites(&value, &value, &[axis.clone(), axis], &points, 0.5);
        assert_eq!(sites.len(), 8);
        // A linear root, up to rounding.
        assert!(sites.iter().all(|site| (site[0] - 0.3).abs() < 1e-15 && site[1] % 1.5 != 0.0));
    }
}
