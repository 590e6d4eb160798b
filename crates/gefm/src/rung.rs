//! One lattice of the ladder: the normal equations there, and the fits that they give.

use zeroset_bspline::{Collocation, KnotVector, Spline};
use zeroset_multigrid::{Multigrid, MultigridError};

use crate::error::GefmError;
use crate::fit::normalise;
use crate::gradient_form::{apply_b, area_vectors};
use crate::ladder_options::LadderOptions;
use crate::lanczos::smallest_eigenpair;
use crate::normal_solver::Iterative;
use crate::p_continuation::{ContinuationOptions, continue_exponent};

/// Most iterations per exponent: candidates that need more have never turned out well.
pub(crate) const MOST_ITERATIONS: usize = 40;

/// Relative residual of the eigenvector, and of the solves for it,
pub(crate) const SPECTRAL: f64 = 1e-2;
/// which is sought in so many steps at most,
pub(crate) const MOST_LANCZOS_STEPS: usize = 24;
/// and the exponents of the continuation after it.
pub(crate) const EXPONENTS: [f64; 2] = [1.5, 1.0];

/// The points on one lattice, with a smoothing length that may be changed.
pub(crate) struct Rung<'a, const D: usize> {
    points: &'a [[f64; D]],
    areas: &'a [f64],
    options: &'a LadderOptions<D>,
    multigrid: Multigrid<D>,
    collocation: Collocation<D>,
    /// What the points pull at.
    pull: Vec<f64>,
    /// Halvings of the base lattice.
    pub(crate) halvings: u32,
    ratio: f64,
}

/// A fit, and how many iterations its continuation took.
pub(crate) type Found<const D: usize> = Result<(Spline<D>, usize), GefmError>;

impl<'a, const D: usize> Rung<'a, D> {
    /// The lattice after `halvings` of `base`, with a smoothing length of `ratio` spacings; the eigenvector is
    /// sought from unit pulls at the points along `directions`.
    ///
    /// # Errors
    /// If the normal equations cannot be set up, or a point lies outside the lattice.
    pub(crate) fn new(
        (points, areas): (&'a [[f64; D]], &'a [f64]),
        base: &[KnotVector; D],
        halvings: u32,
        ratio: f64,
        directions: &[[f64; D]],
        options: &'a LadderOptions<D>,
    ) -> Result<Self, GefmError> {
        let multigrid = Multigrid::new(base, halvings, points, areas, options.weight(ratio))?;
        let (collocation, pull) = pulled(&multigrid, (points, areas), directions)?;
        Ok(Self { points, areas, options, multigrid, collocation, pull, halvings, ratio })
    }

    /// The next finer lattice, with a smoothing length and directions of its own.
    ///
    /// # Errors
    /// As [`Rung::new`].
    pub(crate) fn refined(mut self, ratio: f64, directions: &[[f64; D]]) -> Result<Self, GefmError> {
        self.set_ratio(ratio)?;
        let multigrid = self.multigrid.refined(self.points, self.areas)?;
        let (collocation, pull) = pulled(&multigrid, (self.points, self.areas), directions)?;
        Ok(Self { multigrid, collocation, pull, halvings: self.halvings + 1, ..self })
    }

    /// The smoothing length, in spacings.
    pub(crate) fn ratio(&self) -> f64 {
        self.ratio
    }

    /// The lattice.
    pub(crate) fn knots(&self) -> &[KnotVector; D] {
        self.multigrid.knots()
    }

    /// Number of control coefficients.
    pub(crate) fn unknowns(&self) -> usize {
        self.multigrid.size()
    }

    /// Changes the smoothing length.
    ///
    /// # Errors
    /// If the normal equations cannot be solved with it.
    pub(crate) fn set_ratio(&mut self, ratio: f64) -> Result<(), GefmError> {
        if ratio != self.ratio {
            self.multigrid = self.multigrid.reweighted(self.options.weight(ratio))?;
            self.ratio = ratio;
        }
        Ok(())
    }

    /// The fit at p = 1 that starts from another one, on a lattice of no more `halvings`.
    pub(crate) fn continued(&self, start: &Spline<D>, halvings: u32) -> Found<D> {
        let mut start = start.clone();
        for _ in halvings..self.halvings {
            start = start.halved().map_err(MultigridError::from)?;
        }
        self.at_exponents(start.as_flat().to_vec(), &[1.0])
    }

    /// The fit to normals known from elsewhere: as they are, or with the continuation at p = 1 after it.
    pub(crate) fn oriented(&self, normals: &[[f64; D]], as_they_are: bool) -> Found<D> {
        self.options.cancel.check()?;
        let mut pull = vec![0.0; self.pull.len()];
        self.collocation.add_gradients_transposed(&area_vectors(normals, self.areas), &mut pull);
        let f = Iterative::new(&self.multigrid, self.options.tolerance).solve_from_zero(&pull, self.options.tolerance);
        self.at_exponents(f, if as_they_are { &[] } else { &[1.0] })
    }

    /// The fit from scratch: the eigenvector, or about it, for the continuation only needs to begin near it.
    pub(crate) fn spectral(&self) -> Found<D> {
        self.options.cancel.check()?;
        let solver = Iterative::new(&self.multigrid, self.options.tolerance);
        let apply_b = |f: &[f64]| apply_b(&self.collocation, self.areas, f);
        let solve = |right: &[f64]| solver.solve_from_zero(right, SPECTRAL);
        let pair = smallest_eigenpair(solve, apply_b, self.pull.clone(), SPECTRAL, MOST_LANCZOS_STEPS);
        let (f, _) = pair.ok_or(GefmError::NoGradient)?;
        self.at_exponents(f, &EXPONENTS)
    }

    fn at_exponents(&self, f: Vec<f64>, exponents: &[f64]) -> Found<D> {
        let settings = ContinuationOptions {
            exponents: exponents.to_vec(),
            most_iterations: MOST_ITERATIONS,
            cancel: self.options.cancel.clone(),
            ..ContinuationOptions::default()
        };
        let solver = Iterative::new(&self.multigrid, self.options.tolerance);
        let (f, report) = continue_exponent(&self.collocation, &solver, self.areas, f, &settings)?;
        let f = normalise(&self.collocation, self.points, self.areas, self.multigrid.knots(), f)?;
        Ok((f, report.stages.iter().map(|stage| stage.iterations).sum()))
    }
}

/// The points on the finest lattice, and unit pulls there along `directions` as the coefficients feel them.
fn pulled<const D: usize>(
    multigrid: &Multigrid<D>,
    (points, areas): (&[[f64; D]], &[f64]),
    directions: &[[f64; D]],
) -> Result<(Collocation<D>, Vec<f64>), GefmError> {
    let collocation = Collocation::new(multigrid.knots(), points)?;
    let mut pull = vec![0.0; collocation.coefficient_count()];
    collocation.add_gradients_transposed(&area_vectors(directions, areas), &mut pull);
    Ok((collocation, pull))
}
