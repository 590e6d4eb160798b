//! The points on one lattice, and the fits from there with any solver of the normal equations.

use zeroset_bspline::{Collocation, KnotVector, Spline};
use zeroset_watch::CancelToken;

use crate::error::GefmError;
use crate::fit::normalise;
use crate::gradient_form::{apply_b, area_vectors};
use crate::lanczos::smallest_eigenpair;
use crate::normal_solver::NormalSolver;
use crate::p_continuation::{ContinuationOptions, continue_exponent};

/// Most iterations per exponent: candidates that need more have never turned out well.
const MOST_ITERATIONS: usize = 40;
/// Relative residual of the eigenvector, and of the solves for it,
pub(crate) const SPECTRAL: f64 = 1e-2;
/// which is sought in so many steps at most,
const MOST_LANCZOS_STEPS: usize = 24;
/// and the exponents of the continuation after it.
const EXPONENTS: [f64; 2] = [1.5, 1.0];

/// A fit, and how many iterations its continuation took.
pub(crate) type Found<const D: usize> = Result<(Spline<D>, usize), GefmError>;

/// The points on one lattice, with unit pulls at them.
pub(crate) struct PulledPoints<'a, const D: usize> {
    points: &'a [[f64; D]],
    areas: &'a [f64],
    knots: [KnotVector; D],
    collocation: Collocation<D>,
    /// The unit pulls as the coefficients feel them.
    pull: Vec<f64>,
    cancel: &'a CancelToken,
}

impl<'a, const D: usize> PulledPoints<'a, D> {
    /// On the lattice of `knots`, pulled along `directions`.
    ///
    /// # Errors
    /// If a point lies outside the lattice.
    pub(crate) fn new(
        (points, areas): (&'a [[f64; D]], &'a [f64]),
        knots: &[KnotVector; D],
        directions: &[[f64; D]],
        cancel: &'a CancelToken,
    ) -> Result<Self, GefmError> {
        let collocation = Collocation::new(knots, points)?;
        let pull = pulls(&collocation, areas, directions);
        Ok(Self { points, areas, knots: knots.clone(), collocation, pull, cancel })
    }

    /// The same points on another lattice.
    ///
    /// # Errors
    /// As [`PulledPoints::new`].
    pub(crate) fn on(self, knots: &[KnotVector; D], directions: &[[f64; D]]) -> Result<Self, GefmError> {
        Self::new((self.points, self.areas), knots, directions, self.cancel)
    }

    /// The points with their weights.
    pub(crate) fn weighted(&self) -> (&'a [[f64; D]], &'a [f64]) {
        (self.points, self.areas)
    }

    /// Their basis functions.
    pub(crate) fn collocation(&self) -> &Collocation<D> {
        &self.collocation
    }

    /// Unit pulls along other directions.
    pub(crate) fn pulls(&self, directions: &[[f64; D]]) -> Vec<f64> {
        pulls(&self.collocation, self.areas, directions)
    }

    /// The fit from scratch: the eigenvector, or about it, for the continuation only needs to begin near it. `solve` may be rougher than
    /// the continuation's solver.
    pub(crate) fn spectral(&self, solve: impl Fn(&[f64]) -> Vec<f64>, solver: &impl NormalSolver) -> Found<D> {
        self.cancel.check()?;
        let apply_b = |f: &[f64]| apply_b(&self.collocation, self.areas, f);
        let pair = smallest_eigenpair(solve, apply_b, self.pull.clone(), SPECTRAL, MOST_LANCZOS_STEPS);
        let (f, _) = pair.ok_or(GefmError::NoGradient)?;
        self.at_exponents(f, &EXPONENTS, solver)
    }

    /// The continuation from coefficients `f`, one exponent after the other.
    pub(crate) fn at_exponents(&self, f: Vec<f64>, exponents: &[f64], solver: &impl NormalSolver) -> Found<D> {
        let settings = ContinuationOptions {
            exponents: exponents.to_vec(),
            most_iterations: MOST_ITERATIONS,
            cancel: self.cancel.clone(),
            ..ContinuationOptions::default()
        };
        let (f, report) = continue_exponent(&self.collocation, solver, self.areas, f, &settings)?;
        let f = normalise(&self.collocation, self.points, self.areas, &self.knots, f)?;
        Ok((f, report.stages.iter().map(|stage| stage.iterations).sum()))
    }
}

fn pulls<const D: usize>(collocation: &Collocation<D>, areas: &[f64], directions: &[[f64; D]]) -> Vec<f64> {
    let mut pull = vec![0.0; collocation.coefficient_count()];
    collocation.add_gradients_transposed(&area_vectors(directions, areas), &mut pull);
    pull
}
