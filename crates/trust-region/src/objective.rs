//! The objective `R(f) = Err(f) + w Eng(f)` and the scale at which it is measured.

use zeroset_bspline::DerivativeEnergy;

use crate::anchor::Anchor;
use crate::error::Error;
use crate::options::Normalisation;
use crate::quadratic_model::QuadraticModel;
use crate::report::Errors;
use crate::rows::dot;
use crate::sampson::{SampsonError, SampsonState};

/// Points, energy and scale.
#[derive(Debug)]
pub(crate) struct Objective<const D: usize> {
    pub(crate) fitted: SampsonError<D>,
    pub(crate) held_out: Option<SampsonError<D>>,
    pub(crate) energy: DerivativeEnergy<D>,
    pub(crate) anchor: Anchor,
    pub(crate) normalisation: Normalisation,
}

/// A normalised function with what is known about it.
#[derive(Debug, Clone)]
pub(crate) struct Current<const D: usize> {
    pub(crate) f: Vec<f64>,
    pub(crate) state: SampsonState<D>,
    /// `H f`.
    energy_gradient: Vec<f64>,
    /// `fᵀ H f`.
    energy: f64,
    /// Energy of the anchor.
    anchor: f64,
}

impl<const D: usize> Objective<D> {
    /// Normalises a function and evaluates it.
    ///
    /// # Errors
    /// If its gradients vanish at the points or numbers overflow.
    pub(crate) fn at(&self, mut f: Vec<f64>) -> Result<Current<D>, Error> {
        let size = match self.normalisation {
            Normalisation::MeanGradient => self.fitted.at(&f)?.mean_square_gradient.sqrt(),
            Normalisation::CoefficientNorm => dot(&f, &f).sqrt(),
        };
        if !(size.is_finite() && size > 0.0) {
            return Err(Error::NoGradient);
        }
        f.iter_mut().for_each(|c| *c /= size);
        let state = self.fitted.at(&f)?;
        let energy_gradient = self.energy.apply(&f);
        let energy = dot(&f, &energy_gradient);
        let anchor = self.anchor.energy(&f);
        Ok(Current { f, state, energy_gradient, energy, anchor })
    }

    /// The quadratic model at a function, for a weight at the scale of equation (8).
    pub(crate) fn model(&self, current: &Current<D>, weight: f64) -> QuadraticModel<'_, D> {
        let normal = match self.normalisation {
            Normalisation::MeanGradient => self.fitted.mean_gradient_normal(&current.state),
            Normalisation::CoefficientNorm => current.f.clone(),
        };
        let mut fairness_gradient = current.energy_gradient.clone();
        self.anchor.add_gradient(&current.f, 1.0, &mut fairness_gradient);
        QuadraticModel::new(
            self.fitted.jacobian(&current.state),
            &current.state.residuals,
            (&self.energy, &self.anchor),
            &fairness_gradient,
            // 1 under equation (8); under ‖f‖ = 1 the squared norm that f has under equation (8).
            weight / current.state.mean_square_gradient,
            normal,
        )
    }

    pub(crate) fn errors(&self, current: &Current<D>) -> Result<Errors, Error> {
        let rms = |error: f64, of: &SampsonError<D>| (error / of.total_area()).sqrt();
        let held_out_rms = match &self.held_out {
            Some(held_out) => Some(rms(held_out.at(&current.f)?.error, held_out)),
            None => None,
        };
        Ok(Errors {
            sampson_error: current.state.error,
            sampson_rms: rms(current.state.error, &self.fitted),
            held_out_rms,
            energy: current.energy / current.state.mean_square_gradient,
        })
    }
}

impl<const D: usize> Current<D> {
    /// `R(f)` for a weight at the scale of `f`.
    pub(crate) fn objective(&self, weight: f64) -> f64 {
        self.state.error + weight * (self.energy + self.anchor)
    }
}
