//! Where the zero set crosses the lattice: gaps between points, and points that are off it.
//!
//! Between points that are farther apart than the lattice's nodes the distance to the points does not vanish on the
//! surface but reaches half a spacing, so that `sign · d` jumps there, and in a wall or a gap as thin as that it says
//! nothing. The sign changes along lattice edges at places that f̂ knows well: those that no point is near are added.
//!
//! A point that none of these places is near lies on no part of the surface: fitting it would make a speck around it.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use ndarray::ArrayD;

use crate::lattice::domain::multi_index;
use crate::points::spacing::distances_to;

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

/// Share of the crossings within reach of the nearest of the points: as far as `least` all of them reach, and each as far as `reach` says,
/// which is asked of no others than those that matter. None of none are.
pub fn supported_share<const D: usize>(
    crossings: &[[f64; D]],
    points: &[[f64; D]],
    least: f64,
    reach: impl Fn(usize) -> f64,
) -> f64 {
    let Ok(tree) = ImmutableKdTree::<f64, D>::new_from_slice(points) else { return 0.0 };
    let supported = |crossing: &&[f64; D]| {
        let nearest = tree.query(crossing).nearest_one::<SquaredEuclidean<f64>>().execute();
        let distance = nearest.distance.sqrt();
        distance <= least || distance <= reach(nearest.item as usize)
    };
    crossings.iter().filter(supported).count() as f64 / crossings.len().max(1) as f64
}

/// How far points may lie from the crossings: those of their own surface are nearer.
#[derive(Debug, Clone, Copy)]
pub struct Closeness<'a, const D: usize> {
    /// `N × D`.
    pub points: &'a [[f64; D]],
    /// The spacing around each of them.
    pub local: &'a [f64],
    /// What the crossings can show: cells and smoothing length.
    pub detail: f64,
    /// The standard deviation of the points' noise.
    pub noise: f64,
}

impl<const D: usize> Closeness<'_, D> {
    /// Which points are far from all crossings. None, if they were so many that the surface must be wrong, or without crossings.
    pub fn off_the_surface(&self, crossings: &[[f64; D]]) -> Vec<bool> {
        let none = vec![false; self.points.len()];
        if crossings.is_empty() {
            return none;
        }
        let far = self.far(crossings);
        if count(&far) as f64 > MOST_OFF * self.points.len() as f64 { none } else { far }
    }

    /// Whether other crossings, of which there may be none, leave no more points than these, but for a few.
    pub fn is_kept(&self, others: &[[f64; D]], crossings: &[[f64; D]]) -> bool {
        let left = |crossings| count(&self.far(crossings)) as f64;
        !others.is_empty() && left(others) <= left(crossings) + MOST_LEFT * self.points.len() as f64
    }

    fn far(&self, crossings: &[[f64; D]]) -> Vec<bool> {
        let reach = |local: f64| (OFF * local.max(self.detail)).max(OFF_NOISE * self.noise);
        distances_to(crossings, self.points).iter().zip(self.local).map(|(d, s)| *d > reach(*s)).collect()
    }
}

fn count(far: &[bool]) -> usize {
    far.iter().filter(|far| **far).count()
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
    fn each_point_supports_what_it_reaches() {
        let crossings: Vec<[f64; 2]> = (0..8).map(|i| [f64::from(i), 0.0]).collect();
        let share = |reach: &[f64]| supported_share(&crossings, &[[0.0, 0.0], [7.0, 0.0]], 0.0, |i| reach[i]);
        assert_eq!([share(&[1.0, 3.0]), share(&[1.0, 1.0]), share(&[9.0, 9.0])], [0.75, 0.5, 1.0]);
        assert_eq!(supported_share(&[], &crossings, 1.0, |_| 1.0), 0.0);
    }

    #[test]
    fn others_are_as_near_if_they_leave_few_points() {
        let line = |count: u32| (0..count).map(|i| [0.0, f64::from(i)]).collect::<Vec<_>>();
        let points = line(100);
        let closeness = Closeness { points: &points, local: &[0.5; 100], detail: 0.5, noise: 0.0 };
        let as_near = |others: &[[f64; 2]]| closeness.is_kept(others, &points);
        assert!(as_near(&line(98)) && !as_near(&line(97)) && !as_near(&[]));
        assert!(closeness.is_kept(&line(98), &[]));
    }

    #[test]
    fn points_off_the_line_are_found_unless_they_are_many() {
        let axis: Vec<f64> = (0..13).map(|i| 0.5 * f64::from(i)).collect();
        let value = ArrayD::from_shape_fn(vec![13, 13], |i| axis[i[0]] - 0.3);
        let crossings = crossings(&value, &value, &[axis.clone(), axis]);
        let x = |i: usize| if i % 40 == 7 { 3.0 } else { 0.3 };
        let points: Vec<[f64; 2]> = (0..120).map(|i| [x(i), 0.05 * i as f64]).collect();
        let off = |points: &[[f64; 2]], noise: f64| {
            let local = vec![0.05; points.len()];
            count(&Closeness { points, local: &local, detail: 0.5, noise }.off_the_surface(&crossings))
        };
        assert_eq!(off(&points, 0.0), 3);
        // Within five standard deviations.
        assert_eq!(off(&points, 0.6), 0);
        assert_eq!(off(&points.iter().map(|p| [p[0] + 2.0, p[1]]).collect::<Vec<_>>(), 0.0), 0);
    }
}
