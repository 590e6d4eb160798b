//! Conjugate gradients preconditioned by the V-cycle.

use crate::multigrid::Multigrid;
use crate::vectors::{add_scaled, inner_product, scale_and_add};

/// Settings of [`Multigrid::solve`].
#[derive(Debug, Clone, PartialEq)]
pub struct SolveOptions {
    /// When to stop: the residual `b − A x` relative to the right side `b`, both in the norm `‖r‖ = √(rᵀ B r)` of the
    /// preconditioner `B`, one V-cycle. As `B ≈ A⁻¹` it is nearly the error relative to the solution in the norm of `A`. In
    /// `(0, 1)`.
    pub tolerance: f64,
    /// Most iterations, each of one V-cycle.
    pub most_iterations: usize,
    /// Whether to multiply the start by the number that makes its error smallest in the norm of `A`, `(bᵀx)/(xᵀAx)`. It
    /// costs nothing, and then `bᵀx` never falls below that of the best multiple of the start.
    pub scale_start: bool,
    /// The norm of the right side in the norm above, where the caller knows it well enough (the last report's
    /// `right_norm` for nearly the same right side): saves a V-cycle when the start is not zero.
    pub right_norm: Option<f64>,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { tolerance: 1e-3, most_iterations: 100, scale_start: false, right_norm: None }
    }
}

/// What [`Multigrid::solve`] did.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveReport {
    /// Iterations done.
    pub iterations: usize,
    /// The residual before the first iteration and after each, relative to the right side, in the preconditioner's norm.
    pub residuals: Vec<f64>,
    /// The norm of the right side in the preconditioner's norm, or what was given for it.
    pub right_norm: f64,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// `xᵀ A x` of the result, as the residual tells it.
    pub energy: f64,
}

impl<const D: usize> Multigrid<D> {
    /// Solves `A x = b` from the start that is in `x`.
    ///
    /// # Panics
    /// If `right` or `x` do not have one entry per unknown.
    #[track_caller]
    pub fn solve(&self, right: &[f64], x: &mut [f64], options: &SolveOptions) -> SolveReport {
        assert!(right.len() == self.size() && x.len() == self.size(), "one entry per unknown");
        self.operator().in_pool(|| self.iterate(right, x, options))
    }

    fn iterate(&self, right: &[f64], x: &mut [f64], options: &SolveOptions) -> SolveReport {
        let size = self.size();
        let (mut residual, mut z, mut applied) = (right.to_vec(), vec![0.0; size], vec![0.0; size]);
        let from_zero = x.iter().all(|x| *x == 0.0);
        if !from_zero {
            self.apply(x, &mut applied);
            if options.scale_start {
                let energy = inner_product(x, &applied);
                let factor = if energy > 0.0 { inner_product(right, x) / energy } else { 0.0 };
                x.iter_mut().for_each(|x| *x *= factor);
                add_scaled(&mut residual, -factor, &applied);
            } else {
                add_scaled(&mut residual, -1.0, &applied);
            }
        }
        self.precondition(&residual, &mut z);
        let mut square = inner_product(&residual, &z);
        let right_norm = match options.right_norm {
            Some(norm) => norm,
            None if from_zero => square.sqrt(),
            None => {
                self.precondition(right, &mut applied);
                inner_product(right, &applied).sqrt()
            }
        };
        // Nothing on the right: what remains of the start is measured by itself.
        let unit = if right_norm > 0.0 { right_norm } else { 1.0 };

        let mut report = SolveReport {
            iterations: 0,
            residuals: vec![square.sqrt() / unit],
            right_norm,
            converged: square.sqrt() <= options.tolerance * right_norm,
            energy: 0.0,
        };
        let mut direction = z.clone();
        while !report.converged && report.iterations < options.most_iterations {
            self.apply(&direction, &mut applied);
            let step = square / inner_product(&direction, &applied);
            // The limit of f64, or numbers that were not finite.
            if !(step.is_finite() && step > 0.0) {
                break;
            }
            add_scaled(x, step, &direction);
            add_scaled(&mut residual, -step, &applied);
            self.precondition(&residual, &mut z);
            let before = std::mem::replace(&mut square, inner_product(&residual, &z));
            scale_and_add(&mut direction, square / before, &z);
            report.iterations += 1;
            report.residuals.push(square.sqrt() / unit);
            report.converged = square.sqrt() <= options.tolerance * right_norm;
        }
        report.energy = inner_product(x, right) - inner_product(x, &residual);
        report
    }
}
