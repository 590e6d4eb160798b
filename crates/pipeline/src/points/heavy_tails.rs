//! Noise with heavy tails: what points weigh where some are much noisier than the rest.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use serde::Serialize;
use zeroset_bspline::Evaluation;
use zeroset_trust_region::normal_deviation;

use crate::points::kd_tree::tree_of;

/// A point is compared with so many neighbours.
const NEIGHBOURS: usize = 15;
/// Slopes count as at least this share of the mean one.
const FLATTEST: f64 = 0.2;
/// Loss lengths that are tried, in standard deviations of the noise.
const LENGTHS: [f64; 7] = [2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0];
/// One is taken if it leaves an estimate less than this share of the variance that least squares have. (Found: 0.96 and more for normal noise
/// of 0.25 to 2 % of the diagonal on seven models; 0.57 to 0.90 where a fifth or a tenth of the points have five times the noise of the others.)
const WORTHWHILE: f64 = 0.9;
/// Distances beyond so many standard deviations are in the tails. What few points have missed, or the fit, is in one place, and
const TAIL: f64 = 3.0;
/// is no noise if around points in the tails so many times more are in the tails than everywhere. (0.5 to 1.2 for noise, 3.5 to 11 beside
/// thin walls that a virtual scan has blurred.)
const TOGETHER: f64 = 2.0;

/// How points far off have lost their weight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HeavyTails {
    /// The loss length c, in the data's unit: a point that is farther from the surface than its neighbours by e weighs `(1 + (e/c)²)⁻²` of
    /// what it would otherwise.
    pub loss_length: f64,
    /// Points that weigh less than half: those with e above 0.64 c.
    pub points: usize,
}

/// The noise of each point: what its signed distance from a fit differs by from the median of its neighbours'. What neighbours have in
/// common is no noise, but what the fit has smoothed away.
#[derive(Debug)]
pub struct Noise<const D: usize> {
    distances: Vec<f64>,
    own: Vec<f64>,
    feet: Vec<[f64; D]>,
    tree: ImmutableKdTree<f64, D>,
}

impl<const D: usize> Noise<D> {
    /// Around the zero set of a function with such values and gradients `at` the points, whatever its scale. Neighbours are those whose feet
    /// on it are: in space, those that noise has taken as far as the point itself are the nearest.
    ///
    /// The points must be finite, and at least two.
    pub fn around(at: &Evaluation<D>, points: &[[f64; D]]) -> Self {
        let slopes: Vec<f64> = at.gradients.iter().map(|g| g.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
        let flattest = (FLATTEST * slopes.iter().sum::<f64>() / slopes.len() as f64).max(f64::MIN_POSITIVE);
        let (distances, feet): (Vec<f64>, Vec<[f64; D]>) = points
            .iter()
            .zip(at.values.iter().zip(at.gradients.iter().zip(slopes)))
            .map(|(point, (value, (gradient, slope)))| {
                let slope = slope.max(flattest);
                let distance = value / slope;
                (distance, std::array::from_fn(|axis| point[axis] - distance * gradient[axis] / slope))
            })
            .unzip();
        let mut noise = Self { distances, own: vec![], tree: tree_of(&feet), feet };
        let own = |index: usize| {
            let mut others: Vec<f64> = noise.neighbours(index).map(|other| noise.distances[other]).collect();
            let middle = others.len() / 2;
            noise.distances[index] - *others.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        noise.own = (0..points.len()).into_par_iter().map(own).collect();
        noise
    }

    /// What each point's distance has in common with its neighbours': by how much the fit misses them all.
    pub fn shared(&self) -> Vec<f64> {
        self.distances.iter().zip(&self.own).map(|(distance, own)| distance - own).collect()
    }

    /// The others whose feet are nearest.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> {
        // A foot is its own nearest neighbour, or one that is at the same place.
        let wanted = NonZero::<usize>::MIN.saturating_add(NEIGHBOURS.min(self.feet.len() - 1));
        let found = self.tree.query(&self.feet[index]).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        found.into_iter().map(|near| near.item as usize).filter(move |other| *other != index)
    }

    /// The loss length with which an estimate from points with this noise, and with areas as weights, varies least, by
    /// `Σ a² ψ² / (Σ a ψ')²`, ψ half the derivative of the loss (Huber 1964). None if least squares are hardly worse, as for normal noise, or
    /// if what is far off is no noise.
    pub fn loss_length(&self, areas: &[f64]) -> Option<f64> {
        let deviation = normal_deviation(self.own.clone());
        let variance = |length: f64| {
            let (mut squares, mut slopes) = (0.0, 0.0);
            for (e, area) in self.own.iter().zip(areas) {
                let divisor = divisor(*e, length);
                squares += (area * e / divisor.powi(2)).powi(2);
                slopes += area * (4.0 - 3.0 * divisor) / divisor.powi(3);
            }
            if slopes > 0.0 { squares / (slopes * slopes) } else { f64::INFINITY }
        };
        let tried = LENGTHS.iter().map(|c| c * deviation).map(|length| (length, variance(length)));
        let (length, least) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let worthwhile = least < WORTHWHILE * variance(f64::INFINITY);
        (worthwhile && self.is_everywhere(TAIL * deviation)).then_some(length)
    }

    /// Whether points with more noise than this are hardly more common around each other than among all.
    fn is_everywhere(&self, most: f64) -> bool {
        let is_far = |index: &usize| self.own[*index].abs() > most;
        let far: Vec<usize> = (0..self.own.len()).filter(is_far).collect();
        let around = |index: &usize| {
            self.neighbours(*index).fold((0, 0), |(far, all), other| (far + usize::from(is_far(&other)), all + 1))
        };
        let (near, all) = far.par_iter().map(around).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        near as f64 * self.own.len() as f64 <= TOGETHER * far.len() as f64 * all as f64
    }

    /// The weight of each point, of 1 for those without noise: that of the loss of Geman and McClure (1985), `e²/(1 + (e/c)²)`, as least squares.
    pub fn weights(&self, loss_length: f64) -> Vec<f64> {
        self.own.iter().map(|e| divisor(*e, loss_length).powi(-2)).collect()
    }
}

/// `1 + (e/c)²`.
fn divisor(e: f64, length: f64) -> f64 {
    1.0 + (e / length).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::Domain;
    use crate::lattice::domain::tests::spline;
    use zeroset_bspline::{Derivatives, Spline};

    /// The distance from a circle of radius 0.4, and points as far from it as is said of each number.
    fn circle_and_points(noise: &dyn Fn(usize) -> f64) -> (Spline<2>, Vec<[f64; 2]>) {
        let circle = spline(&Domain::<2>::around(&[1.0, 1.0], 32), 1, |[x, y]| x.hypot(y) - 0.4);
        let at = |i: usize| (i as f64 * std::f64::consts::TAU / 2000.0).sin_cos();
        let points = (0..2000).map(|i| (at(i), 0.4 + noise(i))).map(|((s, c), r)| [r * c, r * s]).collect();
        (circle, points)
    }

    /// The noise of such points.
    fn around_a_circle(noise: &dyn Fn(usize) -> f64) -> Noise<2> {
        let (circle, points) = circle_and_points(noise);
        Noise::around(&circle.evaluate(&points, Derivatives::Gradient), &points)
    }

    /// A number in (0, 1) for each.
    fn lot(i: usize) -> f64 {
        (i as f64 * 0.754_877_666) % 1.0
    }

    /// A number from a normal distribution with standard deviation 0.001 for each (Box and Muller 1958).
    fn normal(i: usize) -> f64 {
        0.001 * (-2.0 * (1.0 - lot(i)).ln()).sqrt() * (i as f64 * 0.569_840_291 * std::f64::consts::TAU).cos()
    }

    #[test]
    fn heavy_tails_are_told_from_normal_noise_and_from_what_is_in_one_place() {
        let length = |noise: &dyn Fn(usize) -> f64| around_a_circle(noise).loss_length(&[1.0; 2000]);
        assert_eq!(length(&normal), None);
        // Every seventh point has five times the noise.
        let wide = |i: usize| if i % 7 == 3 { 5.0 } else { 1.0 };
        let found = length(&|i| wide(i) * normal(i)).unwrap();
        assert!((0.002..0.005).contains(&found), "{found}");
        // As many, but side by side: every second one of a sixth of the circle.
        let side_by_side = |i: usize| if i < 570 && i.is_multiple_of(2) { 5.0 } else { 1.0 };
        assert_eq!(length(&|i| side_by_side(i) * normal(i)), None);
        // Whatever the function's scale, and where it is nearly flat at one of the points.
        let (circle, points) = circle_and_points(&|i| wide(i) * normal(i));
        let mut at = circle.evaluate(&points, Derivatives::Gradient);
        at.values.iter_mut().chain(at.gradients.iter_mut().flatten()).for_each(|x| *x *= 1e-3);
        at.gradients[700] = [1e-9, 0.0];
        let scaled = Noise::around(&at, &points).loss_length(&[1.0; 2000]).unwrap();
        // One point of 2000 hardly matters.
        assert!((scaled / found - 1.0).abs() < 0.01, "{scaled} for {found}");
        // A bump that the fit knows nothing of is what neighbours have in common.
        let bump = |i: usize| if i < 300 { 0.01 * (i as f64 / 300.0 * std::f64::consts::PI).sin() } else { 0.0 };
        assert_eq!(length(&|i| bump(i) + normal(i)), None);
    }

    #[test]
    fn a_point_weighs_what_it_is_farther_off_than_its_neighbours_leaves_it() {
        let alone = |i: usize| if i == 1000 { 0.02 } else { 0.0 };
        let weights = |noise: &dyn Fn(usize) -> f64| around_a_circle(noise).weights(0.01);
        // (1 + 2²)⁻², but for the error of a spline.
        let found = weights(&alone);
        assert!((found[1000] - 0.04).abs() < 1e-3, "{}", found[1000]);
        assert!(found.iter().enumerate().all(|(i, weight)| i == 1000 || *weight > 0.999));
        // All of them on one side of the zero set, as a fit leaves a shape that it cannot follow: that they share.
        assert!(weights(&|_| 0.02).iter().all(|weight| *weight > 0.999));
        let shared = |noise: &dyn Fn(usize) -> f64| around_a_circle(noise).shared();
        assert!(shared(&|_| 0.02).iter().all(|shared| (shared - 0.02).abs() < 1e-3));
        assert!(shared(&alone)[1000].abs() < 1e-3);
    }
}
