//! Settings of the refinement.

use crate::error::{Error, check_rules};

/// Which scale the function is kept at; the zero set does not depend on it, the energy does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Normalisation {
    /// `mean ‖∇f(Pᵢ)‖² = 1`, equation (8). Steps `g` satisfy `fᵀBg = 0`: they are orthogonal to `f` in the inner product
    /// of B, so that they keep the constraint to first order.
    MeanGradient,
    /// `‖f‖ = 1`, step c of section 2.3, with steps orthogonal to `f` in the Euclidean inner product. At every iteration
    /// the weight is multiplied by the squared norm that the coefficients have under equation (8), so that a smoothing
    /// length means the same on every lattice.
    ///
    /// The minimum is another one than under equation (8), and a worse one: here a function can lower its energy, relative
    /// to its norm, by growing far from the points.
    CoefficientNorm,
}

/// What speeds up the conjugate gradients. The trust region is a ball in the preconditioner's norm `√(gᵀPg)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preconditioner {
    /// [`Preconditioner::Cholesky`] up to [`Options::direct_limit`] coefficients; above, [`Preconditioner::Multigrid`], or with
    /// [`Options::stiffness`] [`Preconditioner::Chebyshev`].
    Automatic,
    /// `JᵀJ + wH`, assembled and factored: its norm is that of the model itself.
    Cholesky,
    /// A V-cycle for `Σ aᵢ qᵢqᵢᵀ/‖∇f(Pᵢ)‖² + wH`, where halving the cells of a lattice of at most [`Options::direct_limit`] coefficients leads
    /// to the knots; otherwise [`Preconditioner::Chebyshev`].
    Multigrid,
    /// A Chebyshev polynomial of three terms in the operator scaled by its diagonal.
    Chebyshev,
    /// The diagonal of the operator.
    Jacobi,
    /// None: the trust region is the paper's `gᵀg ≤ e_k²`.
    None,
}

/// How the trust-region sub-problem is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SubProblem {
    /// Truncated conjugate gradients (Steihaug 1983, Toint 1981).
    Steihaug,
    /// The exact solution (Moré and Sorensen 1983) in the Euclidean norm, dense: small lattices only, at most
    /// [`MOST_EXACT`](crate::MOST_EXACT) coefficients. No preconditioner is used.
    Exact,
}

/// Settings of [`refine`](crate::refine). Lengths are in the unit of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Density ρ of the points: per unit length in 2D, per unit area in 3D. Positive.
    pub density: f64,
    /// Smoothing length ℓ₀ of the first step: `w₀ = ρ ℓ₀³`. Positive.
    pub smoothing_length: f64,
    /// Where the smoothing length stops falling. Positive; at least `smoothing_length` means a constant weight.
    pub smallest_smoothing_length: f64,
    /// The paper's σ: the weight is multiplied by it after every accepted step. In (0, 1].
    pub decay: f64,
    /// Scale of the function.
    pub normalisation: Normalisation,
    /// Method for the sub-problem.
    pub sub_problem: SubProblem,
    /// Preconditioner of Steihaug's method.
    pub preconditioner: Preconditioner,
    /// Largest number of coefficients for which [`Preconditioner::Automatic`] and the coarsest lattice of [`Preconditioner::Multigrid`] are
    /// factored: with more, factors take longer than products with the operator, and much memory, and the result is the same to a few
    /// digits.
    pub direct_limit: usize,
    /// Most conjugate-gradient steps per sub-problem: truncation regularises too. At least 1.
    pub most_cg_steps: usize,
    /// Conjugate gradients end when the gradient of the model has fallen by this factor. In [0, 1).
    pub cg_tolerance: f64,
    /// First trust radius e₀, in the preconditioner's norm; by default the length of the first step without a bound.
    pub radius: Option<f64>,
    /// The radius is too small when it falls below this share of the first. In [0, 1).
    pub smallest_radius: f64,
    /// Most iterations, rejected steps included.
    pub most_iterations: usize,
    /// Stop once the root mean square Sampson distance is at most this.
    pub target_error: Option<f64>,
    /// With the weight at its floor, stop when an iteration lowers the objective by no more than this share. In [0, 1).
    pub relative_decrease: f64,
    /// Share of the points that is held out, chosen by a hash of their position; 0 for none. In [0, 0.5]. About 24 points
    /// are held out at least; of fewer than 120 points none are.
    pub holdout: f64,
    /// Stop after so many accepted steps in a row that did not lower the product of held-out error and energy. At least 1.
    pub patience: usize,
    /// Changes which points are held out.
    pub seed: u64,
    /// Stiffness κ of the anchor, one per control coefficient in C order, or empty for none: `Σ κ_k (c_k − c̄_k)²` is added to
    /// the energy, c̄ being the coefficients of the initial shape. Finite, at least 0, in length^(D−4). The initial shape
    /// should then have gradients of about length 1, a signed distance.
    pub stiffness: Vec<f64>,
    /// Gradients shorter than this share of their root mean square count as if they had just this length. In (0, 1).
    pub gradient_floor: f64,
}

impl Options {
    /// Settings for points at a typical distance `spacing` from each other on a curve (`D` = 2) or surface (`D` = 3):
    /// ρ = s^−(D−1), ℓ from 4 s down to s/20.
    pub fn for_spacing<const D: usize>(spacing: f64) -> Self {
        Self {
            density: spacing.powi(1 - D as i32),
            smoothing_length: 4.0 * spacing,
            smallest_smoothing_length: 0.05 * spacing,
            ..Self::default()
        }
    }

    /// The paper's own form: `‖f‖ = 1` and the trust region `gᵀg ≤ e_k²`, nothing held out. Set the density, the
    /// smoothing length and the stopping rules as usual.
    pub fn paper() -> Self {
        Self {
            normalisation: Normalisation::CoefficientNorm,
            preconditioner: Preconditioner::None,
            most_cg_steps: 1000,
            holdout: 0.0,
            ..Self::default()
        }
    }

    /// The weight `w_k = max(σᵏ w₀, floor)` after `accepted` accepted steps, for a given share of the points.
    pub(crate) fn weight(&self, accepted: usize, share: f64) -> f64 {
        let exponent = i32::try_from(accepted).unwrap_or(i32::MAX);
        let start = self.density * share * self.smoothing_length.powi(3);
        (start * self.decay.powi(exponent)).max(self.smallest_weight(share))
    }

    /// The floor of the weight.
    pub(crate) fn smallest_weight(&self, share: f64) -> f64 {
        self.density * share * self.smallest_smoothing_length.min(self.smoothing_length).powi(3)
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
                positive(self.smallest_smoothing_length),
                "a positive length is needed",
            ),
            ("decay", self.decay, positive(self.decay) && self.decay <= 1.0, "must lie in (0, 1]"),
            ("most_cg_steps", self.most_cg_steps as f64, self.most_cg_steps >= 1, "at least one step is needed"),
            ("cg_tolerance", self.cg_tolerance, share(self.cg_tolerance), "must lie in [0, 1)"),
            ("radius", self.radius.unwrap_or(1.0), self.radius.is_none_or(positive), "a positive radius is needed"),
            ("smallest_radius", self.smallest_radius, share(self.smallest_radius), "must lie in [0, 1)"),
            (
                "target_error",
                self.target_error.unwrap_or(0.0),
                self.target_error.is_none_or(|t| t.is_finite() && t >= 0.0),
                "a length of at least zero is needed",
            ),
            ("relative_decrease", self.relative_decrease, share(self.relative_decrease), "must lie in [0, 1)"),
            ("holdout", self.holdout, (0.0..=0.5).contains(&self.holdout), "must lie in [0, 0.5]"),
            ("patience", self.patience as f64, self.patience >= 1, "at least one step is needed"),
            (
                "gradient_floor",
                self.gradient_floor,
                share(self.gradient_floor) && self.gradient_floor > 0.0,
                "must lie in (0, 1)",
            ),
        ];
        if let Some(&value) = self.stiffness.iter().find(|k| !(k.is_finite() && **k >= 0.0)) {
            return Err(Error::Option { name: "stiffness", value, range: "a finite number of at least 0 is needed" });
        }
        check_rules(rules)
    }
}

impl Default for Options {
    /// For points at distance 0.02 on a curve in a frame of size 1.
    fn default() -> Self {
        Self {
            density: 50.0,
            smoothing_length: 0.08,
            smallest_smoothing_length: 0.001,
            decay: 0.1,
            normalisation: Normalisation::MeanGradient,
            sub_problem: SubProblem::Steihaug,
            preconditioner: Preconditioner::Automatic,
            direct_limit: 2_000,
            most_cg_steps: 12,
            cg_tolerance: 1e-3,
            radius: None,
            smallest_radius: 1e-8,
            most_iterations: 30,
            target_error: None,
            relative_decrease: 1e-3,
            holdout: 0.05,
            patience: 2,
            seed: 0,
            stiffness: Vec::new(),
            gradient_floor: 1e-3,
        }
    }
}
