//! Fits with third derivatives as fairness, for points that are too few for second ones.

use zeroset_bspline::{Collocation, DerivativeEnergy, KnotVector};
use zeroset_multigrid::NormalEquations;

use crate::error::GefmError;
use crate::fit::normalise;
use crate::gradient_form::{apply_b, area_vectors};
use crate::ladder_options::LadderOptions;
use crate::lanczos::smallest_eigenpair;
use crate::p_continuation::{ContinuationOptions, continue_exponent};
use crate::rung::{EXPONENTS, Found, MOST_ITERATIONS, MOST_LANCZOS_STEPS, SPECTRAL};

/// The points on one lattice, where `A = Σ aᵢ qᵢqᵢᵀ + w H₃` is factored, H₃ the matrix of `∫‖∇³f‖²`.
///
/// What second derivatives keep from bending they keep from turning round within a wall: f has to rise and fall on less than the points'
/// spacing there, `2 y² − ⅛` across it. Of that third derivatives see nothing.
pub(crate) struct ThirdOrder<'a, const D: usize> {
    points: &'a [[f64; D]],
    areas: &'a [f64],
    options: &'a LadderOptions<D>,
    knots: [KnotVector; D],
    collocation: Collocation<D>,
    equations: NormalEquations<D>,
    pull: Vec<f64>,
}

impl<'a, const D: usize> ThirdOrder<'a, D> {
    /// On the lattice of `knots`; the eigenvector is sought from unit pulls at the points along `directions`.
    ///
    /// # Errors
    /// If the degree is below 3, or a point lies outside the lattice.
    pub(crate) fn new(
        (points, areas): (&'a [[f64; D]], &'a [f64]),
        knots: &[KnotVector; D],
        directions: &[[f64; D]],
        options: &'a LadderOptions<D>,
    ) -> Result<Self, GefmError> {
        let equations = NormalEquations::new(&DerivativeEnergy::new(knots, 3)?);
        let collocation = Collocation::new(knots, points)?;
        let mut pull = vec![0.0; equations.size()];
        collocation.add_gradients_transposed(&area_vectors(directions, areas), &mut pull);
        Ok(Self { points, areas, options, knots: knots.clone(), collocation, equations, pull })
    }

    /// The fit from scratch with a smoothing length of `ratio` spacings.
    pub(crate) fn spectral(&self, ratio: f64) -> Found<D> {
        self.options.cancel.check()?;
        let weight = self.options.third_order_weight(ratio);
        let factor = self.equations.factor(&self.equations.weighted(&self.collocation, self.areas, weight)?)?;
        let apply_b = |f: &[f64]| apply_b(&self.collocation, self.areas, f);
        let start = self.pull.clone();
        let pair = smallest_eigenpair(|right| factor.solve(right), apply_b, start, SPECTRAL, MOST_LANCZOS_STEPS);
        let (f, _) = pair.ok_or(GefmError::NoGradient)?;
        let settings = ContinuationOptions {
            exponents: EXPONENTS.to_vec(),
            most_iterations: MOST_ITERATIONS,
            cancel: self.options.cancel.clone(),
            ..ContinuationOptions::default()
        };
        let (f, report) = continue_exponent(&self.collocation, &factor, self.areas, f, &settings)?;
        let f = normalise(&self.collocation, self.points, self.areas, &self.knots, f)?;
        Ok((f, report.stages.iter().map(|stage| stage.iterations).sum()))
    }
}
