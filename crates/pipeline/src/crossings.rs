//! Where the zero set crosses the lattice: gaps between points, and points that are off it.
//!
//! Between points that are farther apart than the lattice's nodes the distance to the points does not vanish on the
//! surface but reaches half a spacing, so that `sign · d` jumps there, and in a wall or a gap as thin as that it says
//! nothing. The sign changes along lattice edges at places that f̂ knows well: those that no point is near are added.
//!
//! A point that none of these places is near lies on no part of the surface: fitting it would make a speck around it.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use ndarray::ArrayD;

use crate::domain::multi_index;
use crate::spacing::distances_to;

/// A point nearer than so many spacings (or cells, if those are larger) makes a site of its own needless.
const NEAR: f64 = 0.3;
/// A point farther than so many spacings there (or cells, or smoothing lengths of f̂, if those are larger), or standard
/// deviations of the noise, is off.
const OFF: f64 = 1.0;
const OFF_NOISE: f64 = 5.0;
/// If more points than this share are off, it is the surface that is missing.
const MOST_OFF: f64 = 0.1;
/// No more points than this share may other crossings leave.
const MOST_LEFT: f64 = 0.02;

/// Roots of the field along the lattice edges on which the sign of `phi` changes.
///
/// `value` is what the sign was taken from and `phi` carries the cleaned sign, on the lattice of `nodes`; frame units.
pub fn crossings<const D: usize>(value: &ArrayD<f64>, phi: &ArrayD<f64>, nodes: &[Vec<f64>; D]) -> Vec<[f64; D]> {
    let (Some(values), Some(signs)) = (value.as_slice(), phi.as_slice()) else { return Vec::new() };
    let shape: [usize; D] = std::array::from_fn(|axis| nodes[axis].len());
    let mut found = Vec::new();
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
                    found.push(site);
                }
            }
            stride *= shape[axis];
        }
    }
    found
}

/// Those of the crossings that are away from `points`; `scale` is the larger of spacing and cell.
pub fn gaps<const D: usize>(crossings: &[[f64; D]], points: &[[f64; D]], scale: f64) -> Vec<[f64; D]> {
    let Ok(tree) = ImmutableKdTree::<f64, D>::new_from_slice(points) else { return Vec::new() };
    let square = |site| tree.query(site).nearest_one::<SquaredEuclidean<f64>>().execute().distance;
    crossings.iter().filter(|site| square(*site) > (NEAR * scale).powi(2)).copied().collect()
}

/// Which points are far from all crossings, given their `local` spacing, the `detail` that the crossings can show (cells and
/// smoothing length), and the standard deviation of their noise. None, if they were so many that the surface must be wrong.
pub fn off_the_surface<const D: usize>(
    crossings: &[[f64; D]],
    points: &[[f64; D]],
    local: &[f64],
    detail: f64,
    noise: f64,
) -> Vec<bool> {
    if crossings.is_empty() {
        return vec![false; points.len()];
    }
    let off = far_from(crossings, points, local, detail, noise);
    let count = off.iter().filter(|off| **off).count();
    if count as f64 > MOST_OFF * points.len() as f64 { vec![false; points.len()] } else { off }
}

/// Whether other crossings, of which there may be none, are as near to the points, but for a few.
pub fn are_as_near<const D: usize>(
    others: &[[f64; D]],
    crossings: &[[f64; D]],
    points: &[[f64; D]],
    local: &[f64],
    detail: f64,
    noise: f64,
) -> bool {
    let far = |crossings| far_from(crossings, points, local, detail, noise).iter().filter(|off| **off).count();
    !others.is_empty() && far(others) as f64 <= far(crossings) as f64 + MOST_LEFT * points.len() as f64
}

fn far_from<const D: usize>(
    crossings: &[[f64; D]],
    points: &[[f64; D]],
    local: &[f64],
    detail: f64,
    noise: f64,
) -> Vec<bool> {
    let reach = |local: f64| (OFF * local.max(detail)).max(OFF_NOISE * noise);
    distances_to(crossings, points).iter().zip(local).map(|(d, s)| *d > reach(*s)).collect()
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
        let sites = gaps(&crossings(&value, &value, &[axis.clone(), axis]), &points, 0.5);
        assert_eq!(sites.len(), 8);
        // A linear root, up to rounding.
        assert!(sites.iter().all(|site| (site[0] - 0.3).abs() < 1e-15 && site[1] % 1.5 != 0.0));
    }

    #[test]
    fn others_are_as_near_if_they_leave_few_points() {
        let line = |count: u32| (0..count).map(|i| [0.0, f64::from(i)]).collect::<Vec<_>>();
        let points = line(100);
        let as_near = |others: &[[f64; 2]]| are_as_near(others, &points, &points, &[0.5; 100], 0.5, 0.0);
        assert!(as_near(&line(98)) && !as_near(&line(97)) && !as_near(&[]));
        assert!(are_as_near(&line(98), &[], &points, &[0.5; 100], 0.5, 0.0));
    }

    #[test]
    fn points_off_the_line_are_found_unless_they_are_many() {
        let axis: Vec<f64> = (0..13).map(|i| 0.5 * f64::from(i)).collect();
        let value = ArrayD::from_shape_fn(vec![13, 13], |i| axis[i[0]] - 0.3);
        let crossings = crossings(&value, &value, &[axis.clone(), axis]);
        let x = |i: usize| if i % 40 == 7 { 3.0 } else { 0.3 };
        let points: Vec<[f64; 2]> = (0..120).map(|i| [x(i), 0.05 * i as f64]).collect();
        let off = |points: &[[f64; 2]], noise: f64| {
            let off = off_the_surface(&crossings, points, &vec![0.05; points.len()], 0.5, noise);
            off.iter().filter(|off| **off).count()
        };
        assert_eq!(off(&points, 0.0), 3);
        // Within five standard deviations.
        assert_eq!(off(&points, 0.6), 0);
        assert_eq!(off(&points.iter().map(|p| [p[0] + 2.0, p[1]]).collect::<Vec<_>>(), 0.0), 0);
    }
}
