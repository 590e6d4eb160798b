//! Redistancing: f becomes a distance around its zero set, which stays where it is.
//!
//! The Sampson distance does not change when f is multiplied, and fairness likes small slopes: a refined function has its zeros in the
//! right place, but its slope there is anything from a half up. Whoever takes its values for distances wants slope 1.

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;
use zeroset_bspline::{Derivatives, HierarchicalSpline, IndexSet, Level};
use zeroset_multigrid::{
    BandCollocation, BandEnergy, BandOperator, BandRows, Fairness, Truncation, inner_product, solve_truncated,
};
use zeroset_watch::CancelToken;

use crate::error::{Error, check_rules};
use crate::level_objective::CHUNK;
use crate::level_options::LevelError;
use crate::rows::dot;

/// Gradients shorter than this say nothing of a direction.
const FLAT: f64 = 1e-6;

/// What is known of the distance; lengths in the unit of f's coordinates.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KnownDistances<const D: usize> {
    /// Places on the zero set, a few for each cell of the finest level.
    pub zeros: Vec<[f64; D]>,
    /// The share of curve or surface that each stands for, relative to their mean.
    pub areas: Vec<f64>,
    /// Places off the zero set.
    pub places: Vec<[f64; D]>,
    /// Their distances from it, not negative; f says on which side they are.
    pub distances: Vec<f64>,
}

/// Settings of [`redistance`]. Lengths are in the unit of f's coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct RedistanceOptions {
    /// Zeros per unit length in 2D, per unit area in 3D. Positive.
    pub density: f64,
    /// Smoothing length of a correction, in cells of its level. Positive.
    pub smoothing: f64,
    /// The length λ in the energy `∫‖∇³δ‖² + ∫‖∇²δ‖²/λ²` of a correction. Positive.
    pub third_order: f64,
    /// A slope that differs from 1 by 1 counts as much as a zero that has moved by this length. Not negative.
    pub slope_length: f64,
    /// A distance that is wrong counts as much as a zero that has moved by this share of the error. Not negative.
    pub distance_share: f64,
    /// Most conjugate-gradient steps per level. At least 1.
    pub cg_steps: usize,
    /// Looked at before every level.
    pub cancel: CancelToken,
}

/// Conjugate gradients end when the residual has fallen to this share.
const CG_TOLERANCE: f64 = 1e-3;

/// What redistancing did.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct RedistanceReport {
    /// Places on the zero set.
    pub zeros: usize,
    /// Places off it.
    pub places: usize,
    /// Conjugate-gradient steps on each level, the dense one first.
    pub cg_steps: Vec<usize>,
    /// Root mean square of f at the zeros before and after: how far the zero set has moved.
    pub zero_rms: [f64; 2],
    /// Root mean square of `‖∇f‖ − 1` there before and after.
    pub slope_rms: [f64; 2],
}

/// The function with the smallest correction δ of each level, from the dense one to the finest, that gives it unit slope on its zero set:
/// each lowers
///
/// ```text
/// Σ aᵢ f(zᵢ)² + m² Σ aᵢ (‖∇f(zᵢ)‖ − 1)² + v² Σ (|f(xⱼ)| − dⱼ)² + w E(δ),      w = ρ ℓ⁵,
/// ```
///
/// with ‖∇f‖ along the present normals, in one linear step. E is the energy of the correction alone: detail that f has is neither
/// smoothed nor fitted again. On the dense level the functions of `near` are corrected. f must have about the scale of a distance already.
///
/// # Errors
/// If an option is not valid, numbers of places do not fit, one of them is not finite, or `near` does not belong to the dense lattice.
pub fn redistance<const D: usize>(
    mut f: HierarchicalSpline<D>,
    near: &Arc<IndexSet<D>>,
    known: &KnownDistances<D>,
    options: &RedistanceOptions,
) -> Result<(HierarchicalSpline<D>, RedistanceReport), LevelError> {
    options.check()?;
    known.check()?;
    let mut report =
        RedistanceReport { zeros: known.zeros.len(), places: known.places.len(), ..RedistanceReport::default() };
    (report.zero_rms[0], report.slope_rms[0]) = known.errors(&f);
    for number in 0..=f.levels().len() {
        if options.cancel.is_cancelled() {
            break;
        }
        let dense = if number == 0 { Some(Level::of_dense(f.root(), Arc::clone(near))?) } else { None };
        let level = dense.as_ref().unwrap_or_else(|| &f.levels()[number - 1]);
        let (correction, steps) = correction(&f, level, known, options);
        report.cg_steps.push(steps);
        f = with_correction(&f, number, dense.as_ref(), &correction)?;
    }
    (report.zero_rms[1], report.slope_rms[1]) = known.errors(&f);
    Ok((f, report))
}

/// f with δ added on one level, by its number from the dense one, 0, on; that one is given by the functions that δ is for.
pub(crate) fn with_correction<const D: usize>(
    f: &HierarchicalSpline<D>,
    number: usize,
    dense: Option<&Level<D>>,
    correction: &[f64],
) -> Result<HierarchicalSpline<D>, LevelError> {
    let root = match dense {
        Some(level) => level.corrected(f.root(), correction)?,
        None => f.root().clone(),
    };
    let corrections = f.levels().iter().enumerate().map(|(index, level)| {
        let mut all = level.corrections().to_vec();
        if index + 1 == number {
            all.iter_mut().zip(correction).for_each(|(sum, x)| *sum += x);
        }
        (Arc::clone(level.active()), all)
    });
    Ok(HierarchicalSpline::with_levels(root, corrections)?)
}

/// δ of one level, and how many steps of conjugate gradients it took.
fn correction<const D: usize>(
    f: &HierarchicalSpline<D>,
    level: &Level<D>,
    known: &KnownDistances<D>,
    options: &RedistanceOptions,
) -> (Vec<f64>, usize) {
    let on = BandCollocation::new(level, &known.zeros);
    let chosen = |all: &[[f64; D]], indices: &[u32]| -> Vec<[f64; D]> {
        indices.par_iter().with_min_len(CHUNK).map(|i| all[*i as usize]).collect()
    };
    let at = f.evaluate(&chosen(&known.zeros, on.indices()), Derivatives::Gradient);
    let roots: Vec<f64> = on.indices().iter().map(|i| known.areas[*i as usize].sqrt()).collect();
    let values: Vec<f64> = roots.iter().zip(&at.values).map(|(a, f)| a * f).collect();
    let m = options.slope_length;
    let lengths: Vec<f64> = at.gradients.iter().map(|g| dot(g, g).sqrt().max(FLAT)).collect();
    let slopes: Vec<f64> = roots.iter().zip(&lengths).map(|(a, length)| m * a * (length - 1.0)).collect();
    let each = roots.iter().zip(&lengths).zip(&at.gradients);
    let normals: Vec<[f64; D]> = each.map(|((a, length), g)| g.map(|g| m * a * g / length)).collect();

    let off = BandCollocation::new(level, &known.places);
    let found = f.evaluate(&chosen(&known.places, off.indices()), Derivatives::Value).values;
    let v = options.distance_share;
    let wanted = off.indices().iter().map(|i| known.distances[*i as usize]);
    let distances: Vec<f64> = found.iter().zip(wanted).map(|(f, d)| v * (f - d.copysign(*f))).collect();

    let zero = [0.0; D];
    let rows = vec![
        BandRows { beta: vec![zero; roots.len()], alpha: roots, collocation: Cow::Borrowed(&on) },
        BandRows { alpha: vec![0.0; normals.len()], beta: normals, collocation: Cow::Borrowed(&on) },
        BandRows { alpha: vec![v; found.len()], beta: vec![zero; found.len()], collocation: Cow::Borrowed(&off) },
    ];
    let active = level.active();
    let weight = options.density * (options.smoothing * level.cell_side()).powi(5);
    let fairness = Fairness::third_order(weight, options.third_order);
    let energy = BandEnergy::new(Arc::clone(active), level.cell_sides(), fairness);
    let mut right = vec![0.0; active.len()];
    let add = |sums: &mut [f64]| {
        for (rows, residuals) in rows.iter().zip([&values, &slopes, &distances]) {
            rows.collocation.add_transposed(&rows.alpha, &rows.beta, residuals, active, sums);
        }
    };
    energy.sums(add, &mut right);
    right.iter_mut().for_each(|b| *b = -*b);
    let truncation = Truncation { most_steps: options.cg_steps, tolerance: CG_TOLERANCE, radius: f64::INFINITY };
    let step = solve_truncated(&BandOperator::new(rows, energy), &right, &truncation);
    (step.x, step.steps)
}

impl<const D: usize> KnownDistances<D> {
    fn check(&self) -> Result<(), Error> {
        if self.areas.len() != self.zeros.len() {
            return Err(Error::Areas { found: self.areas.len(), needed: self.zeros.len() });
        }
        if let Some(index) = self.areas.iter().position(|a| !(a.is_finite() && *a >= 0.0)) {
            return Err(Error::BadArea(index));
        }
        if self.distances.len() != self.places.len() {
            return Err(Error::Distances { distances: self.distances.len(), places: self.places.len() });
        }
        let is_bad = |x: &[f64; D]| x.iter().any(|x| !x.is_finite());
        let bad = self.places.iter().zip(&self.distances).position(|(x, d)| is_bad(x) || !(d.is_finite() && *d >= 0.0));
        match bad.or_else(|| self.zeros.iter().position(is_bad)) {
            Some(index) => Err(Error::Place { index }),
            None => Ok(()),
        }
    }

    /// Root mean squares of f and of `‖∇f‖ − 1` at the zeros.
    fn errors(&self, f: &HierarchicalSpline<D>) -> (f64, f64) {
        let at = f.evaluate(&self.zeros, Derivatives::Gradient);
        let slopes: Vec<f64> = at.gradients.iter().map(|g| dot(g, g).sqrt() - 1.0).collect();
        let rms = |x: &[f64]| (inner_product(x, x) / x.len().max(1) as f64).sqrt();
        (rms(&at.values), rms(&slopes))
    }
}

impl RedistanceOptions {
    fn check(&self) -> Result<(), Error> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let not_negative = |x: f64| x.is_finite() && x >= 0.0;
        check_rules([
            ("density", self.density, positive(self.density), "a positive, finite number is needed"),
            ("smoothing", self.smoothing, positive(self.smoothing), "a positive length is needed"),
            ("third_order", self.third_order, positive(self.third_order), "a positive length is needed"),
            ("slope_length", self.slope_length, not_negative(self.slope_length), "a length of at least zero is needed"),
            (
                "distance_share",
                self.distance_share,
                not_negative(self.distance_share),
                "a number of at least zero is needed",
            ),
            ("cg_steps", self.cg_steps as f64, self.cg_steps >= 1, "at least one step is needed"),
        ])
    }
}
