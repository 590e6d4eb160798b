//! Settings of the refinement level by level.

use std::f64::consts::PI;

use thiserror::Error;
use zeroset_bspline::{EnergyError, HierarchyError, KnotError};
use zeroset_multigrid::Fairness;
use zeroset_watch::CancelToken;

use crate::error::{Error, check_rules};

/// A smoothing length so little above the smallest is the smallest, and no step of its own.
const NEARLY: f64 = 1.05;
/// No fit is taken to leave less than this share of the noise's variance: below it what is known of degrees of freedom no longer holds.
const LEAST_LEFT: f64 = 0.1;

/// Settings of [`refine_levels`](crate::refine_levels). Lengths are in the unit of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelOptions {
    /// Density ρ of the points: per unit length in 2D, per unit area in 3D. Positive.
    pub density: f64,
    /// Smoothing length ℓ of the very first step: one that is too large rather than too small, for it only falls. Each level
    /// starts with the ℓ that was the best on the level before. Positive.
    pub smoothing_length: f64,
    /// Where the smoothing length stops falling, on all levels. Not negative; 0 for nowhere.
    pub smallest_smoothing_length: f64,
    /// Where the noise is known, ℓ falls at least to this, whatever the Sampson distances: of many points with much noise they hardly depend on
    /// it. Positive; infinity for no such length.
    pub largest_smoothing_length: f64,
    /// The weight is multiplied by this after every step of a level. In (0, 1].
    pub decay: f64,
    /// Which energy: none for the thin-plate energy, `w = ρ ℓ³`; a length λ for `∫‖∇³f‖² + ∫‖∇²f‖²/λ²`, `w = ρ ℓ⁵`.
    pub third_order: Option<f64>,
    /// Standard deviation of the points' distances from their surface, where it is known and not small beside their spacing:
    /// ℓ falls until the Sampson distances are as large as that, and held-out points are not asked (Morozov 1966). Positive.
    pub noise: Option<f64>,
    /// Whether Sampson distances are to be smaller than the noise by what a fit of that ℓ follows of it, by its effective degrees of
    /// freedom on a flat set of evenly spaced points (Wahba 1983). Below the best ℓ that hardly changes any more, so that the smallest ℓ has
    /// to be a sensible one.
    pub degrees_of_freedom: bool,
    /// Once the mean error of the held-out points is below this, there are no more steps and no finer levels. Not negative; 0 for
    /// never.
    pub close_enough: f64,
    /// A level ends after so many steps in a row that bring nothing; the finest, whose steps cost most, one step earlier if a step
    /// of it has brought something. At least 1.
    pub patience: usize,
    /// But none that bring nothing are counted while ℓ is above this: where the first function is far from the points, their error
    /// may rise before it falls. Positive; infinity to count all.
    pub patient_above: f64,
    /// Most Gauss–Newton steps per level. At least 1.
    pub steps: usize,
    /// Most conjugate-gradient steps for each, of one product with the operator. At least 1.
    pub cg_steps: usize,
    /// The same on the first level, the dense one, which has to find what is smooth over many cells. At least 1.
    pub first_cg_steps: usize,
    /// Conjugate gradients end when the residual has fallen to this share. In [0, 1).
    pub cg_tolerance: f64,
    /// Share of the points that is held out while ℓ is looked for, chosen by a hash of their position; 0 for none, and then
    /// all steps are done. In [0, 0.5].
    pub holdout: f64,
    /// Points that lie in the same cube with sides of this length are held out together: of points in lines those beside a held-out one, which
    /// would tell it otherwise. Not negative; 0 for each alone.
    pub holdout_side: f64,
    /// Changes which points are held out.
    pub seed: u64,
    /// Gradients shorter than this share of their root mean square count as if they had just this length. In (0, 1).
    pub gradient_floor: f64,
    /// Where normals are given: a slope along the normal that is too small by 1 counts as much as a distance of this
    /// length. Not negative; 0 for no heed to normals.
    pub normal_length: f64,
    /// Whether slopes along the normals are held to 1, from below and above; otherwise they are too small only below ½. For noisy points:
    /// f is a distance to them, on both sides of walls that are hardly thicker than the noise.
    pub unit_slopes: bool,
    /// Whether on levels that a finer one can follow one point may stand for those near it, with their weights: saves time where there
    /// are many points per cell, and loses what averaging over their noise would bring.
    pub merge: bool,
    /// Looked at after every step; once it is cancelled no level makes more than one, and the result is the best function so far.
    pub cancel: CancelToken,
}

impl Default for LevelOptions {
    /// For points at distance 0.02 on a curve in a frame of size 1.
    fn default() -> Self {
        Self {
            density: 50.0,
            smoothing_length: 0.01,
            smallest_smoothing_length: 0.0,
            largest_smoothing_length: f64::INFINITY,
            decay: 0.1,
            third_order: None,
            noise: None,
            degrees_of_freedom: false,
            close_enough: 0.0,
            patience: 2,
            patient_above: f64::INFINITY,
            steps: 8,
            cg_steps: 24,
            first_cg_steps: 24,
            cg_tolerance: 1e-3,
            holdout: 0.05,
            holdout_side: 0.0,
            seed: 0,
            gradient_floor: 1e-3,
            normal_length: 0.004,
            unit_slopes: false,
            merge: false,
            cancel: CancelToken::new(),
        }
    }
}

/// Why a refinement level by level failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LevelError {
    /// The points, their areas or an option are not valid.
    #[error(transparent)]
    Refine(#[from] Error),
    /// The levels do not fit the initial function.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
    /// The initial function's knots admit no energy.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The box of the initial function admits no coarser lattice.
    #[error(transparent)]
    Knots(#[from] KnotError),
}

impl LevelOptions {
    /// Settings for points at a typical distance `spacing` from each other on a curve (`D` = 2) or surface (`D` = 3).
    pub fn for_spacing<const D: usize>(spacing: f64) -> Self {
        Self {
            density: spacing.powi(1 - D as i32),
            smoothing_length: 0.5 * spacing,
            normal_length: 0.2 * spacing,
            ..Self::default()
        }
    }

    /// The energy with weight 1.
    pub(crate) fn fairness(&self) -> Fairness {
        self.third_order.map_or(Fairness::thin_plate(1.0), |length| Fairness::third_order(1.0, length))
    }

    /// Data on a set of codimension 1 against an energy of order k: `w = ρ ℓ^(2k − 1)`.
    fn power(&self) -> f64 {
        if self.third_order.is_some() { 5.0 } else { 3.0 }
    }

    /// The standard deviation of the Sampson distances of points whose noise has a deviation of 1, fitted with a smoothing length.
    ///
    /// Of a wave with wave number ω along a flat set of `D − 1` dimensions a fit leaves `S = 1 / (1 + c (ℓω)^q)`, with `q = 2k − 1` and
    /// `1/c = ∫ dη / (1 + η²)^k / 2π`, for f is as smooth as it can be across the set. The distances' variance is `1 − tr(2S − S²)`
    /// per point, an integral over all ω.
    pub(crate) fn left_of_noise<const D: usize>(&self, length: f64) -> f64 {
        if !self.degrees_of_freedom {
            return 1.0;
        }
        let share = self.dimension_share::<D>();
        (1.0 - (1.0 + share) * self.modes_per_point::<D>(length)).max(LEAST_LEFT).sqrt()
    }

    /// The variance of what a fit smooths out of what is left of noise with a deviation of 1, per point: `tr((S L)²)`, with S as above.
    /// `left` holds the coefficients of L as a polynomial in `1 − S`, that of `1 − S` first; there is no constant.
    pub(crate) fn noise_smoothed<const D: usize>(&self, length: f64, left: &[f64]) -> f64 {
        let share = self.dimension_share::<D>();
        let modes = (1.0 - share) * self.modes_per_point::<D>(length);
        // tr(S² (1 − S)ⁿ): beta functions.
        let moment = |n: usize| (0..n).map(|j| (share + j as f64) / (j + 2) as f64).product::<f64>() * modes;
        let product =
            |(i, a): (usize, &f64)| left.iter().enumerate().map(|(j, b)| a * b * moment(i + j + 2)).sum::<f64>();
        left.iter().enumerate().map(product).sum()
    }

    /// `(D − 1) / q`.
    fn dimension_share<const D: usize>(&self) -> f64 {
        (D - 1) as f64 / self.power()
    }

    /// `tr S` per point, with S as above.
    fn modes_per_point<const D: usize>(&self, length: f64) -> f64 {
        let (q, share) = (self.power(), self.dimension_share::<D>());
        let (c, sphere): (f64, f64) = (if q == 5.0 { 16.0 / 3.0 } else { 4.0 }, if D == 2 { PI } else { 2.0 * PI });
        let integral = PI / (q * (PI * share).sin());
        integral * c.powf(-share) / (sphere * self.density * length.powi(D as i32 - 1))
    }

    /// The smoothing length so many steps after a given one.
    pub(crate) fn after(&self, length: f64, steps: usize) -> f64 {
        length * self.decay.powf(steps as f64 / self.power())
    }

    /// The smoothing lengths of a level's steps: from that of the first they fall to the smallest, or to `coarse` if that
    /// comes before.
    pub(crate) fn lengths(&self, first: f64, coarse: f64) -> Vec<f64> {
        let smallest = self.smallest_smoothing_length.max(coarse.min(first));
        let length = |step: usize| {
            let length = self.after(first, step);
            if length > NEARLY * smallest { length } else { smallest }
        };
        let useful = |step: &usize| *step == 0 || self.decay == 1.0 || length(step - 1) > smallest;
        (0..self.steps).take_while(useful).map(length).collect()
    }

    /// `w` for a smoothing length and a given share of the points.
    pub(crate) fn weight(&self, length: f64, share: f64) -> f64 {
        self.density * share * length.powf(self.power())
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let share = |x: f64| (0.0..1.0).contains(&x);
        let rules = [
            ("density", self.density, positive(self.density), "a positive, finite number is needed"),
            ("smoothing_length", self.smoothing_length, positive(self.smoothing_length), "a positive length is needed"),
            (
                "smallest_smoothing_length",
                self.smallest_smoothing_length,
                self.smallest_smoothing_length.is_finite() && self.smallest_smoothing_length >= 0.0,
                "a length of at least zero is needed",
            ),
            (
                "largest_smoothing_length",
                self.largest_smoothing_length,
                self.largest_smoothing_length > 0.0,
                "a positive length is needed",
            ),
            ("decay", self.decay, positive(self.decay) && self.decay <= 1.0, "must lie in (0, 1]"),
            (
                "third_order",
                self.third_order.unwrap_or(1.0),
                self.third_order.is_none_or(positive),
                "a positive length is needed",
            ),
            ("noise", self.noise.unwrap_or(1.0), self.noise.is_none_or(positive), "a positive length is needed"),
            (
                "close_enough",
                self.close_enough,
                self.close_enough.is_finite() && self.close_enough >= 0.0,
                "a length of at least zero is needed",
            ),
            ("patience", self.patience as f64, self.patience >= 1, "at least one step is needed"),
            ("patient_above", self.patient_above, self.patient_above > 0.0, "a positive length is needed"),
            ("steps", self.steps as f64, self.steps >= 1, "at least one step is needed"),
            ("cg_steps", self.cg_steps as f64, self.cg_steps >= 1, "at least one step is needed"),
            ("first_cg_steps", self.first_cg_steps as f64, self.first_cg_steps >= 1, "at least one step is needed"),
            ("cg_tolerance", self.cg_tolerance, share(self.cg_tolerance), "must lie in [0, 1)"),
            ("holdout", self.holdout, (0.0..=0.5).contains(&self.holdout), "must lie in [0, 0.5]"),
            (
                "holdout_side",
                self.holdout_side,
                self.holdout_side.is_finite() && self.holdout_side >= 0.0,
                "a length of at least zero is needed",
            ),
            (
                "normal_length",
                self.normal_length,
                self.normal_length.is_finite() && self.normal_length >= 0.0,
                "a length of at least zero is needed",
            ),
            (
                "gradient_floor",
                self.gradient_floor,
                share(self.gradient_floor) && self.gradient_floor > 0.0,
                "must lie in (0, 1)",
            ),
        ];
        check_rules(rules)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_fit_leaves_of_noise() {
        let left = |third_order: Option<f64>, dimension: usize, length: f64| {
            let options =
                LevelOptions { density: 1.0, third_order, degrees_of_freedom: true, ..LevelOptions::default() };
            if dimension == 2 { options.left_of_noise::<2>(length) } else { options.left_of_noise::<3>(length) }
        };
        for (third_order, c, q) in [(None, 4.0, 3), (Some(1.0), 16.0 / 3.0, 5)] {
            for dimension in [2, 3] {
                // Over all wave numbers up to 200, by the midpoint rule; what is beyond is below 200 to the power −1 at most.
                let length = 1.3;
                let at = |i: u32| 1e-3 * (f64::from(i) + 0.5);
                let followed = |w: f64| 1.0 - (1.0 - (1.0 + c * (length * w).powi(q)).recip()).powi(2);
                let measure = |w: f64| if dimension == 2 { 1.0 / PI } else { w / (2.0 * PI) };
                let sum: f64 = (0..200_000).map(|i| 1e-3 * followed(at(i)) * measure(at(i))).sum();
                let found = left(third_order, dimension, length).powi(2);
                assert!((found - (1.0 - sum)).abs() < 1e-3, "{third_order:?} {dimension}: {found} {sum}");
            }
        }
        // What a fit smooths out of noise of which something is left already, by the same rule.
        for (third_order, c, q) in [(None, 4.0, 3), (Some(1.0), 16.0 / 3.0, 5)] {
            let options = LevelOptions { density: 3.0, third_order, ..LevelOptions::default() };
            let sum = |measure: &dyn Fn(f64) -> f64| -> f64 {
                let at = |i: u32| 1e-3 * (f64::from(i) + 0.5);
                let fit = |w: f64| (1.0 + c * (1.3 * w).powi(q)).recip();
                let smoothed = |w: f64| (fit(w) * (0.7 * (1.0 - fit(w)) + 0.3 * (1.0 - fit(w)).powi(2))).powi(2);
                (0..200_000).map(|i| 1e-3 * smoothed(at(i)) * measure(at(i)) / 3.0).sum()
            };
            let left = [0.7, 0.3];
            let (curve, surface) = (options.noise_smoothed::<2>(1.3, &left), options.noise_smoothed::<3>(1.3, &left));
            // The rule's error and what is beyond 200 are smaller.
            assert!((curve / sum(&|_| 1.0 / PI) - 1.0).abs() < 1e-5, "{curve}");
            assert!((surface / sum(&|w| w / (2.0 * PI)) - 1.0).abs() < 1e-5, "{surface}");
        }
        // Nothing is left of what is below the spacing, and all of it where it is not asked for.
        assert_eq!(left(None, 3, 1e-3), LEAST_LEFT.sqrt());
        assert_eq!(LevelOptions::default().left_of_noise::<3>(1.0), 1.0);
    }
}
