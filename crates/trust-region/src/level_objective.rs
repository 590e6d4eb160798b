//! The objective on one level, everything coarser being fixed.

use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;
use zeroset_bspline::{BlockField, IndexSet, Level};
use zeroset_multigrid::{BandCollocation, BandEnergy, BandOperator, BandRows, inner_product};

use crate::deviation::normal_deviation;
use crate::level_options::LevelOptions;
use crate::level_report::LevelErrors;
use crate::rows::dot;
use crate::sides::{Bounded, Sides};
use crate::twicing::Moved;

/// Points with their area weights.
#[derive(Debug, Clone)]
pub(crate) struct Weighted<const D: usize> {
    pub(crate) points: Vec<[f64; D]>,
    /// Square roots of the weights, whose mean over all points is one.
    pub(crate) roots: Vec<f64>,
    /// The unit normal along which the function is to rise at each point; zero where none is known. None at all if empty.
    pub(crate) normals: Vec<[f64; D]>,
}

impl<const D: usize> Weighted<D> {
    /// No points.
    pub(crate) fn none() -> Self {
        Self { points: vec![], roots: vec![], normals: vec![] }
    }
}

/// How many numbers one parallel task takes.
pub(crate) const CHUNK: usize = 4096;

/// Fewer held-out points say nothing about a level.
const FEWEST: usize = 24;

/// Squared Sampson distance, `f²/‖∇f‖²` with gradients no shorter than the floor.
pub(crate) fn squared_distance<const D: usize>(value: f64, gradient: &[f64; D], floor: f64) -> f64 {
    (value / dot(gradient, gradient).sqrt().max(floor)).powi(2)
}

/// Points that are held out, with the unit normals of a smooth function there; no normals before there is such a function.
///
/// Their error is the mean of `|f(Pᵢ)| / (∇f(Pᵢ) · nᵢ)`, the distance along the normal. (Among noisy points a function that
/// follows the noise has zeros everywhere: the Sampson distance finds one at the side, however wrong the function is.)
#[derive(Debug, Clone)]
pub(crate) struct Judge<const D: usize> {
    weighted: Weighted<D>,
    normals: Vec<[f64; D]>,
}

/// Slopes along the normal count as at least this share of the mean gradient.
const FLATTEST: f64 = 0.2;

impl<const D: usize> Judge<D> {
    /// No normals yet.
    pub(crate) fn new(weighted: Weighted<D>) -> Self {
        Self { weighted, normals: vec![] }
    }

    /// Nothing is held out.
    pub(crate) fn none() -> Self {
        Self::new(Weighted::none())
    }

    pub(crate) fn points(&self) -> &[[f64; D]] {
        &self.weighted.points
    }

    pub(crate) fn has_no_normals(&self) -> bool {
        self.normals.is_empty()
    }

    /// Takes the directions of gradients at all points, in their order.
    pub(crate) fn take_normals(&mut self, gradients: &[[f64; D]]) {
        self.normals = gradients.iter().map(|g| g.map(|x| x / dot(g, g).sqrt().max(f64::MIN_POSITIVE))).collect();
    }

    /// The error over some of the points; none without normals, or if they are too few.
    pub(crate) fn error(&self, indices: impl Iterator<Item = usize>, found: &[(f64, [f64; D])]) -> Option<f64> {
        if self.normals.is_empty() || found.len() < FEWEST {
            return None;
        }
        let (mut sum, mut area) = (0.0, 0.0);
        for (index, (value, gradient)) in indices.zip(found) {
            let share = self.weighted.roots[index].powi(2);
            sum += share * value.abs() / dot(gradient, &self.normals[index]).max(FLATTEST);
            area += share;
        }
        Some(sum / area)
    }
}

/// Those of the points that lie in a level's cells.
#[derive(Debug)]
struct Part<const D: usize> {
    collocation: BandCollocation<D>,
    /// In the order of the collocation.
    roots: Vec<f64>,
    /// In that order too, if there are any.
    normals: Vec<[f64; D]>,
    /// `Σ aᵢ`.
    area: f64,
}

/// Slopes along the normal below this are too small. (Where walls are thinner than the cells a smooth function would rather
/// stay near zero between them than rise and fall: its Sampson distances are small all the same.)
const STEEP: f64 = 0.5;

/// What slopes along the normals are held to.
#[derive(Debug, Clone, Copy)]
enum Slope {
    /// Not to be too small.
    Steep,
    /// 1.
    Unit,
}

impl Slope {
    /// By how much a slope differs from what is wanted.
    fn miss(self, slope: f64) -> f64 {
        match self {
            Self::Steep => (slope - STEEP).min(0.0),
            Self::Unit => slope - 1.0,
        }
    }
}

impl<const D: usize> Part<D> {
    fn new(level: &Level<D>, weighted: &Weighted<D>) -> Self {
        let collocation = BandCollocation::new(level, &weighted.points);
        let chosen = || collocation.indices().par_iter().with_min_len(CHUNK).map(|i| *i as usize);
        let roots: Vec<f64> = chosen().map(|i| weighted.roots[i]).collect();
        let normals =
            if weighted.normals.is_empty() { vec![] } else { chosen().map(|i| weighted.normals[i]).collect() };
        Self { area: inner_product(&roots, &roots), collocation, roots, normals }
    }

    /// `√aᵢ min(0, ∂f/∂nᵢ − ½)` of the points with normals, or `√aᵢ (∂f/∂nᵢ − 1)`.
    fn slopes(&self, found: &[(f64, [f64; D])], wanted: Slope) -> Vec<f64> {
        let rows = self.normals.par_iter().zip(found).zip(&self.roots).with_min_len(CHUNK);
        let is_known = |normal: &[f64; D]| normal.iter().any(|n| *n != 0.0);
        rows.map(|((n, (_, g)), a)| if is_known(n) { a * wanted.miss(dot(g, n)) } else { 0.0 }).collect()
    }

    fn at(&self, total: &BlockField<D>, floor: f64, wanted: Slope) -> Sampson<D> {
        let found = self.collocation.values_and_gradients(total);
        let slopes = self.slopes(&found, wanted);
        let slope_error = inner_product(&slopes, &slopes);
        let mut sampson = Sampson { found, floor, error: 0.0, slopes, slope_error };
        let residuals = sampson.residuals(&self.roots);
        sampson.error = inner_product(&residuals, &residuals);
        sampson
    }

    fn rms(&self, error: f64) -> f64 {
        (error / self.area).sqrt()
    }

    /// The standard deviation of the Sampson distances if they are normal, by their median: outliers do not count.
    fn spread(&self, sampson: &Sampson<D>) -> f64 {
        let distance = |(value, gradient): &(f64, [f64; D])| value / sampson.divisor(gradient);
        normal_deviation(sampson.found.par_iter().with_min_len(CHUNK).map(distance).collect())
    }
}

/// Sampson distances at one function.
#[derive(Debug, Clone)]
struct Sampson<const D: usize> {
    /// `f(Pᵢ)` and `∇f(Pᵢ)`.
    found: Vec<(f64, [f64; D])>,
    /// Gradients count as no shorter.
    floor: f64,
    /// `Σ aᵢ rᵢ²`.
    error: f64,
    /// By how much slopes along the normals differ from what is wanted, and the sum of their squares.
    slopes: Vec<f64>,
    slope_error: f64,
}

impl<const D: usize> Sampson<D> {
    /// By which a value is divided.
    fn divisor(&self, gradient: &[f64; D]) -> f64 {
        dot(gradient, gradient).sqrt().max(self.floor)
    }

    /// `√aᵢ rᵢ`, from the roots.
    fn residuals(&self, roots: &[f64]) -> Vec<f64> {
        let residual = |((value, gradient), root): (&(f64, [f64; D]), &f64)| root * value / self.divisor(gradient);
        self.found.par_iter().zip(roots).with_min_len(CHUNK).map(residual).collect()
    }
}

/// `R(δ) = Σ aᵢ f(Pᵢ)²/‖∇f(Pᵢ)‖² + m² Σ aᵢ min(0, ∂f/∂nᵢ − ½)² + Σ l² + w E(f)` with `f = f_coarse + δ`, where m is the normal
/// length and l what places off the surface lack. With unit slopes `∂f/∂nᵢ − 1` takes the place of the minimum.
#[derive(Debug)]
pub(crate) struct LevelObjective<'a, const D: usize> {
    active: Arc<IndexSet<D>>,
    /// All that are fitted, and those of them that lie in the cells.
    points: &'a [[f64; D]],
    fitted: Part<D>,
    bounded: Bounded<D>,
    /// The points that are held out.
    judged: BandCollocation<D>,
    /// With weight 1.
    energy: BandEnergy<D>,
    floor: f64,
    normal_length: f64,
    slope: Slope,
    /// Coefficients of the coarser function, its energy, and `H f_coarse`.
    coarse: &'a BlockField<D>,
    coarse_energy: f64,
    coarse_gradient: Vec<f64>,
}

/// Corrections with what is known about them.
#[derive(Debug, Clone)]
pub(crate) struct LevelState<const D: usize> {
    pub(crate) corrections: Vec<f64>,
    sampson: Sampson<D>,
    /// `H f`.
    gradient: Vec<f64>,
    pub(crate) energy: f64,
    /// `m²` times the squares of what slopes differ by.
    slope_error: f64,
    /// What places off the surface lack.
    lacks: Vec<f64>,
}

impl<const D: usize> LevelState<D> {
    /// The corrections alone.
    pub(crate) fn into_corrections(self) -> Vec<f64> {
        self.corrections
    }

    /// `R` for a weight.
    pub(crate) fn objective(&self, weight: f64) -> f64 {
        self.sampson.error + self.slope_error + dot(&self.lacks, &self.lacks) + weight * self.energy
    }
}

impl<'a, const D: usize> LevelObjective<'a, D> {
    /// A level without corrections; `coarse_energy` is the energy of the spline so far.
    pub(crate) fn new(
        level: &'a Level<D>,
        fitted: &'a Weighted<D>,
        judged: &[[f64; D]],
        sides: &Sides<D>,
        coarse_energy: f64,
        options: &LevelOptions,
    ) -> Self {
        let fairness = options.fairness();
        let active = Arc::clone(level.active());
        let energy = BandEnergy::new(Arc::clone(&active), level.cell_sides(), fairness);
        let coarse = level.total();
        let mut coarse_gradient = vec![0.0; active.len()];
        energy.apply(coarse, None, &mut coarse_gradient);
        let judged = BandCollocation::new(level, judged);
        Self {
            active,
            points: &fitted.points,
            fitted: Part::new(level, fitted),
            bounded: Bounded::new(level, sides),
            judged,
            energy,
            floor: options.gradient_floor,
            normal_length: options.normal_length,
            slope: if options.unit_slopes { Slope::Unit } else { Slope::Steep },
            coarse,
            coarse_energy,
            coarse_gradient,
        }
    }

    /// The standard deviation of the points' Sampson distances if they are normal.
    pub(crate) fn spread(&self, state: &LevelState<D>) -> f64 {
        self.fitted.spread(&state.sampson)
    }

    /// By how much the zero set has moved from one state to another at the fitted points in the cells, to first order.
    pub(crate) fn moved(&self, before: &LevelState<D>, after: &LevelState<D>) -> Moved<D> {
        let found = |state: &LevelState<D>, i: usize| state.sampson.found[i];
        let distance = |i: usize| {
            let ((old, _), (new, gradient)) = (found(before, i), found(after, i));
            (new - old) / dot(&gradient, &gradient).sqrt().max(FLATTEST)
        };
        Moved {
            points: self.fitted.collocation.indices().iter().map(|i| self.points[*i as usize]).collect(),
            areas: self.fitted.roots.iter().map(|root| root * root).collect(),
            distances: (0..self.fitted.roots.len()).into_par_iter().with_min_len(CHUNK).map(distance).collect(),
        }
    }

    /// Points that lie in the cells.
    pub(crate) fn points(&self) -> usize {
        self.fitted.roots.len() + self.judged.indices().len()
    }

    /// A place for the coefficients of a function. (Zeros: memory that only [`LevelObjective::at`] touches, in parallel.)
    pub(crate) fn coefficients(&self) -> BlockField<D> {
        BlockField::zeros(Arc::clone(self.coarse.set()))
    }

    /// Evaluates corrections; the function's coefficients are left in `total`.
    pub(crate) fn at(&self, corrections: Vec<f64>, total: &mut BlockField<D>) -> LevelState<D> {
        total.assign(self.coarse);
        total.add(&self.active, &corrections);
        let mut gradient = vec![0.0; corrections.len()];
        self.energy.apply_to_active(&corrections, &mut gradient);
        let both = gradient.par_iter_mut().zip(&self.coarse_gradient).with_min_len(CHUNK);
        both.for_each(|(change, coarse)| *change += coarse);
        // E(f + δ) − E(f) = δᵀ (2 H f + H δ) = δᵀ (H f + H (f + δ)).
        let change = inner_product(&corrections, &self.coarse_gradient) + inner_product(&corrections, &gradient);
        let sampson = self.fitted.at(total, self.floor, self.slope);
        let slope_error = self.normal_length.powi(2) * sampson.slope_error;
        let lacks = self.bounded.lacks(total);
        LevelState { corrections, sampson, gradient, energy: self.coarse_energy + change, slope_error, lacks }
    }

    /// Errors at a state whose function has the coefficients `total`.
    pub(crate) fn errors(&self, state: &LevelState<D>, total: &BlockField<D>, judge: &Judge<D>) -> LevelErrors {
        LevelErrors {
            sampson_rms: self.fitted.rms(state.sampson.error),
            held_out: judge.error(self.judged_indices(), &self.judged.values_and_gradients(total)),
            energy: state.energy,
        }
    }

    /// Gradients at the `count` points that are held out of a function with the coefficients `total`; zero outside the cells.
    pub(crate) fn judged_gradients(&self, total: &BlockField<D>, count: usize) -> Vec<[f64; D]> {
        let found = self.judged.values_and_gradients(total);
        let mut gradients = vec![[0.0; D]; count];
        self.judged_indices().zip(found).for_each(|(index, (_, gradient))| gradients[index] = gradient);
        gradients
    }

    fn judged_indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.judged.indices().iter().map(|i| *i as usize)
    }

    /// The Gauss–Newton model at a state: operator `JᵀJ + wH` and right side `−(Jᵀr + w H f)`, half the derivatives of R.
    pub(crate) fn model(&self, state: &LevelState<D>, weight: f64) -> (BandOperator<'_, D>, Vec<f64>) {
        let (operator, mut right) = self.increment_model(state, weight);
        let both = right.par_iter_mut().zip(&state.gradient).with_min_len(CHUNK);
        both.for_each(|(b, h)| *b -= weight * h);
        (operator, right)
    }

    /// The same where the energy is that of the increment alone: the right side is `−Jᵀr`.
    pub(crate) fn increment_model(&self, state: &LevelState<D>, weight: f64) -> (BandOperator<'_, D>, Vec<f64>) {
        let (sampson, roots) = (&state.sampson, &self.fitted.roots);
        let (residuals, slopes) = (sampson.residuals(roots), &sampson.slopes);
        let found = || sampson.found.par_iter().with_min_len(CHUNK);
        let alpha: Vec<f64> =
            found().zip(roots).map(|((_, gradient), root)| root / sampson.divisor(gradient)).collect();
        let beta = |((_, gradient), residual): (&(f64, [f64; D]), &f64)| {
            let square = dot(gradient, gradient);
            // Where the floor holds, the divisor is a constant.
            let factor = if square.sqrt() < self.floor { 0.0 } else { -residual / square };
            gradient.map(|g| factor * g)
        };
        let beta: Vec<[f64; D]> = found().zip(&residuals).map(beta).collect();
        let missed: Vec<usize> = (0..slopes.len()).filter(|i| slopes[*i] != 0.0).collect();
        let along = |i: usize| self.fitted.normals[i].map(|n| self.normal_length * self.fitted.roots[i] * n);
        let missed_slopes: Vec<f64> = missed.iter().map(|i| self.normal_length * slopes[*i]).collect();
        let mut rows = vec![BandRows { collocation: Cow::Borrowed(&self.fitted.collocation), alpha, beta }];
        let mut right_sides: Vec<&[f64]> = vec![&residuals];
        if !missed.is_empty() {
            let collocation = Cow::Owned(self.fitted.collocation.subset(|i| slopes[i] != 0.0));
            let (alpha, beta) = (vec![0.0; missed.len()], missed.iter().map(|i| along(*i)).collect());
            rows.push(BandRows { collocation, alpha, beta });
            right_sides.push(&missed_slopes);
        }
        let lacking = self.bounded.rows(&state.lacks).map(|(bounded, lacks)| {
            rows.push(bounded);
            lacks
        });
        right_sides.extend(lacking.as_deref());
        let mut right = vec![0.0; self.active.len()];
        let add = |sums: &mut [f64]| {
            for (rows, y) in rows.iter().zip(right_sides) {
                rows.collocation.add_transposed(&rows.alpha, &rows.beta, y, &self.active, sums);
            }
        };
        self.energy.sums(add, &mut right);
        right.par_iter_mut().with_min_len(CHUNK).for_each(|b| *b = -*b);
        let energy = self.energy.with_fairness(self.energy.fairness().scaled(weight));
        (BandOperator::new(rows, energy), right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::{CellBand, HierarchicalSpline, KnotVector, Spline};

    #[test]
    fn the_model_has_the_slope_of_the_objective() {
        let knots = KnotVector::uniform(3, -1.0, 0.25, 8).unwrap();
        let at = |k: usize| knots.knots()[k + 2];
        let coefficients = (0..121).map(|i| at(i / 11) - 0.5 + 0.3 * at(i % 11).powi(2)).collect();
        let root = Spline::from_flat([knots.clone(), knots.clone()], coefficients).unwrap();
        let points: Vec<[f64; 2]> =
            (0..40).map(|i| f64::from(i) / 40.0).map(|t| [0.5 - 0.2 * t, -0.4 + 0.8 * t]).collect();
        let band = CellBand::new(root.knots(), &points, &[1; 40], [3, 3]).unwrap();
        let mut spline = HierarchicalSpline::new(root).unwrap();
        spline.push_level(Arc::clone(&band.active()[0])).unwrap();
        // The function's gradient is about (1, 0.6 y): half of the normals are too far from it, and some are not known.
        let normal = |i: usize| [[1.0, 0.0], [-0.6, 0.8], [0.0, 0.0], [0.0, 1.0]][i % 4];
        let weighted = Weighted {
            roots: (0..40).map(|i| 0.7 + 0.02 * f64::from(i)).collect(),
            points,
            normals: (0..40).map(normal).collect(),
        };
        for (third_order, unit_slopes) in [(None, false), (Some(0.5), false), (Some(0.5), true)] {
            let options = LevelOptions { third_order, normal_length: 0.1, unit_slopes, ..LevelOptions::default() };
            let objective = LevelObjective::new(&spline.levels()[0], &weighted, &[], &Sides::default(), 3.0, &options);
            let mut total = objective.coefficients();
            let size = spline.levels()[0].active().len();
            let numbers = |seed: usize| -> Vec<f64> {
                (0..size).map(|i| 0.02 * ((i * 37 + seed) % 101) as f64 / 101.0 - 0.01).collect()
            };
            let (delta, direction, weight) = (numbers(5), numbers(50), 1e-3);
            let state = objective.at(delta.clone(), &mut total);
            let (operator, right) = objective.model(&state, weight);
            let mut moved = |t: f64| {
                let delta = delta.iter().zip(&direction).map(|(d, g)| d + t * g).collect();
                objective.at(delta, &mut total).objective(weight)
            };
            let (after, here, before) = (moved(1e-4), moved(0.0), moved(-1e-4));
            let (slope, exact) = ((after - before) / 2e-4, -2.0 * dot(&right, &direction));
            // Step² times third derivatives: the directions change gradients by a few percent.
            assert!((slope - exact).abs() < 1e-6 * exact.abs(), "{slope} {exact}");
            let mut applied = vec![0.0; size];
            operator.apply(&direction, &mut applied);
            let (curvature, model) = ((after - 2.0 * here + before) / 1e-8, 2.0 * dot(&direction, &applied));
            // Gauss and Newton leave out the residuals' own curvature; here distances are below a tenth.
            assert!((curvature - model).abs() < 0.2 * model, "{curvature} {model}");
            let errors = objective.errors(&state, &total, &Judge::none());
            assert!(errors.held_out.is_none() && objective.points() == 40);
        }
    }
}
