//! The local quadratic model of section 2.3, step a.

use std::cell::Cell;
use zeroset_bspline::DerivativeEnergy;

use crate::anchor::Anchor;
use crate::rows::{Rows, dot};

/// `Q(g) = R(f) + bᵀg + ½ gᵀMg` with the Gauss–Newton matrix: `b = 2 (Jᵀr + w H f)`, `M = 2 (JᵀJ + w H)`, and with the
/// anchor `b = 2 (Jᵀr + w (H f + K (f − f̄)))`, `M = 2 (JᵀJ + w (H + K))`, K the diagonal matrix of its stiffness.
#[derive(Debug)]
pub(crate) struct QuadraticModel<'a, const D: usize> {
    pub(crate) jacobian: Rows<'a, D>,
    pub(crate) energy: &'a DerivativeEnergy<D>,
    pub(crate) anchor: &'a Anchor,
    pub(crate) weight: f64,
    /// `b`.
    pub(crate) gradient: Vec<f64>,
    /// Half the derivative of the normalisation: steps stay orthogonal to it.
    pub(crate) normal: Vec<f64>,
    applications: Cell<usize>,
}

impl<'a, const D: usize> QuadraticModel<'a, D> {
    /// `fairness_gradient` is `H f + K (f − f̄)`.
    pub(crate) fn new(
        jacobian: Rows<'a, D>,
        residuals: &[f64],
        (energy, anchor): (&'a DerivativeEnergy<D>, &'a Anchor),
        fairness_gradient: &[f64],
        weight: f64,
        normal: Vec<f64>,
    ) -> Self {
        let mut gradient: Vec<f64> = fairness_gradient.iter().map(|h| weight * h).collect();
        jacobian.add_transposed(residuals, &mut gradient);
        gradient.iter_mut().for_each(|b| *b *= 2.0);
        Self { jacobian, energy, anchor, weight, gradient, normal, applications: Cell::new(0) }
    }

    /// `M g`.
    pub(crate) fn apply(&self, g: &[f64]) -> Vec<f64> {
        self.applications.set(self.applications.get() + 1);
        let mut out = self.energy.apply(g);
        out.iter_mut().for_each(|h| *h *= self.weight);
        self.anchor.add_applied(g, self.weight, &mut out);
        self.jacobian.add_transposed(&self.jacobian.apply(g), &mut out);
        out.iter_mut().for_each(|m| *m *= 2.0);
        out
    }

    /// The diagonal of `M`, from that of `H`.
    pub(crate) fn diagonal(&self, energy_diagonal: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = energy_diagonal.iter().map(|h| self.weight * h).collect();
        out.iter_mut().zip(self.anchor.stiffness()).for_each(|(out, k)| *out += self.weight * k);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::objective::Objective;
    use crate::options::Normalisation;
    use crate::sampson::SampsonError;
    use proptest::prelude::*;
    use zeroset_bspline::KnotVector;
    use zeroset_multigrid::NormalEquations;

    const WEIGHT: f64 = 1e-3;

    fn knots() -> [KnotVector; 2] {
        [KnotVector::uniform(3, 0.0, 0.25, 4).unwrap(), KnotVector::clamped(2, &[0.0, 0.3, 0.5, 1.0]).unwrap()]
    }

    fn objective(points: &[[f64; 2]], normalisation: Normalisation) -> Objective<2> {
        Objective {
            fitted: SampsonError::new(&knots(), points.to_vec(), &vec![1.0; points.len()], 1e-6).unwrap(),
            held_out: None,
            energy: DerivativeEnergy::thin_plate(&knots()).unwrap(),
            anchor: Anchor::default(),
            normalisation,
        }
    }

    /// Coefficients of `x − 0.4`.
    fn ramp() -> Vec<f64> {
        (0..35).map(|i| (i / 5) as f64 * 0.25 - 0.25 - 0.4).collect()
    }

    fn moved(f: &[f64], g: &[f64], t: f64) -> Vec<f64> {
        f.iter().zip(g).map(|(f, g)| f + t * g).collect()
    }

    proptest! {
        #[test]
        fn it_is_true_to_second_order_where_the_points_are_fitted(
            heights in proptest::collection::vec(0.0..=1.0f64, 3..20),
            g in proptest::collection::vec(-1.0..1.0f64, 35),
        ) {
            // On x = 0.4 all residuals of the ramp vanish: Gauss–Newton drops nothing.
            let points: Vec<[f64; 2]> = heights.iter().map(|&y| [0.4, y]).collect();
            let objective = objective(&points, Normalisation::MeanGradient);
            let current = objective.at(ramp()).unwrap();
            let model = objective.model(&current, WEIGHT);
            let error = |t: f64| {
                let f = moved(&current.f, &g, t);
                let hf = objective.energy.apply(&f);
                let truth = objective.fitted.at(&f).unwrap().error + WEIGHT * dot(&f, &hf);
                let scaled: Vec<f64> = g.iter().map(|g| t * g).collect();
                let predicted = current.objective(WEIGHT) + dot(&model.gradient, &scaled)
                    + 0.5 * dot(&scaled, &model.apply(&scaled));
                truth - predicted
            };
            // Third order: at most 20 terms g(P)² ‖∇g‖/‖∇f‖ t³, slopes of g up to 14; and half the step leaves an eighth
            // up to fourth-order terms.
            let (whole, half) = (error(1e-3), error(5e-4));
            prop_assert!(whole.abs() < 20.0 * 3.0 * 14.0 * 1e-9, "{whole}");
            prop_assert!((whole - 8.0 * half).abs() < 0.1 * whole.abs() + 1e-10, "{whole} {half}");
        }

        #[test]
        fn its_gradient_is_that_of_the_normalised_objective(
            points in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0f64], 3..20),
            noise in proptest::collection::vec(-0.05..0.05f64, 35),
            g in proptest::collection::vec(-1.0..1.0f64, 35),
            by_norm in any::<bool>(),
        ) {
            let normalisation = if by_norm { Normalisation::CoefficientNorm } else { Normalisation::MeanGradient };
            let objective = objective(&points, normalisation);
            let current = objective.at(moved(&ramp(), &noise, 1.0)).unwrap();
            let model = objective.model(&current, WEIGHT);
            // Into the complement of f, where the normalisation does not change to first order.
            let mut g = g;
            Complement::new(&model.normal, model.normal.clone()).project(&mut g);
            let at = |t: f64| objective.at(moved(&current.f, &g, t)).unwrap().objective(model.weight);
            let step = 1e-5;
            let difference = (at(step) - at(-step)) / (2.0 * step);
            let predicted = dot(&model.gradient, &g);
            let size = current.objective(model.weight) + predicted.abs();
            // Step² times third derivatives of about (14 / ‖∇f‖)³, ‖∇f‖ being 1, or 0.2 under ‖f‖ = 1.
            prop_assert!((difference - predicted).abs() < 1e-4 * size, "{difference} {predicted}");
        }

        #[test]
        fn it_agrees_with_the_assembled_matrix(
            points in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0f64], 3..20),
            noise in proptest::collection::vec(-0.05..0.05f64, 35),
            g in proptest::collection::vec(-1.0..1.0f64, 35),
        ) {
            let objective = objective(&points, Normalisation::MeanGradient);
            let current = objective.at(moved(&ramp(), &noise, 1.0)).unwrap();
            let model = objective.model(&current, WEIGHT);
            let equations = NormalEquations::new(&objective.energy);
            let rows = &model.jacobian;
            let matrix = equations.rows(rows.collocation(), &rows.alpha, Some(&rows.beta), model.weight).unwrap();
            let (free, assembled) = (model.apply(&g), matrix.apply(&g));
            let size = free.iter().map(|v| v.abs()).fold(0.0, f64::max);
            for (a, b) in free.iter().zip(&assembled) {
                // The same products in another order.
                prop_assert!((a - 2.0 * b).abs() <= 1e-12 * size);
            }
            let diagonal = model.diagonal(&objective.energy.diagonal());
            for (a, b) in diagonal.iter().zip(matrix.diagonal()) {
                prop_assert!((a - 2.0 * b).abs() <= 1e-12 * a.abs());
            }
        }
    }
}
