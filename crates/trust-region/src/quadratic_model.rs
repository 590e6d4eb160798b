//! The local quadratic model of section 2.3, step a.

use std::cell::Cell;
use zeroset_bspline::DerivativeEnergy;

use crate::rows::{Rows, dot};

/// `Q(g) = R(f) + bᵀg + ½ gᵀMg` with the Gauss–Newton matrix: `b = 2 (Jᵀr + w H f)`, `M = 2 (JᵀJ + w H)`.
#[derive(Debug)]
pub(crate) struct QuadraticModel<'a, const D: usize> {
    pub(crate) jacobian: Rows<'a, D>,
    pub(crate) energy: &'a DerivativeEnergy<D>,
    pub(crate) weight: f64,
    /// `b`.
    pub(crate) gradient: Vec<f64>,
    /// Half the derivative of the normalisation: steps stay orthogonal to it.
    pub(crate) normal: Vec<f64>,
    applications: Cell<usize>,
}

impl<'a, const D: usize> QuadraticModel<'a, D> {
    /// `energy_gradient` is `H f`.
    pub(crate) fn new(
        jacobian: Rows<'a, D>,
        residuals: &[f64],
        energy: &'a DerivativeEnergy<D>,
        energy_gradient: &[f64],
        weight: f64,
        normal: Vec<f64>,
    ) -> Self {
        let mut gradient: Vec<f64> = energy_gradient.iter().map(|h| weight * h).collect();
        jacobian.add_transposed(residuals, &mut gradient);
        gradient.iter_mut().for_each(|b| *b *= 2.0);
        Self { jacobian, energy, weight, gradient, normal, applications: Cell::new(0) }
    }

    /// `M g`.
    pub(crate) fn apply(&self, g: &[f64]) -> Vec<f64> {
        self.applications.set(self.applications.get() + 1);
        let mut out = self.energy.apply(g);
        out.iter_mut().for_each(|h| *h *= self.weight);
        self.jacobian.add_transposed(&self.jacobian.apply(g), &mut out);
        out.iter_mut().for_each(|m| *m *= 2.0);
        out
    }

    /// The diagonal of `M`, from that of `H`.
    pub(crate) fn diagonal(&self, energy_diagonal: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = energy_diagonal.iter().map(|h| self.weight * h).collect();
        self.jacobian.add_squares(&mut out);
        out.iter_mut().for_each(|m| *m *= 2.0);
        out
    }

    /// How often `M` was applied.
    pub(crate) fn applications(&self) -> usize {
        self.applications.get()
    }
}

/// The steps that the normalisation allows, `{g : normalᵀ g = 0}`, seen through a preconditioner P: residuals count only
/// up to multiples of the normal (the projected conjugate gradients of Gould, Hribar and Nocedal 2001).
#[derive(Debug)]
pub(crate) struct Complement {
    normal: Vec<f64>,
    /// `P⁻¹ normal`, over `normalᵀ P⁻¹ normal`.
    direction: Vec<f64>,
}

impl Complement {
    pub(crate) fn new(normal: &[f64], preconditioned: Vec<f64>) -> Self {
        let size = dot(normal, &preconditioned);
        let mut direction = preconditioned;
        direction.iter_mut().for_each(|d| *d /= size);
        Self { normal: normal.to_vec(), direction }
    }

    /// Removes from `P⁻¹ r` its part across the constraint.
    pub(crate) fn project(&self, z: &mut [f64]) {
        // Twice: the second pass takes away the rounding of the first.
        for _ in 0..2 {
            let across = dot(&self.normal, z);
            z.iter_mut().zip(&self.direction).for_each(|(z, d)| *z -= across * d);
        }
    }
}
