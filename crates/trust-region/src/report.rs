//! What a refinement did.

use serde::Serialize;

/// How a sub-problem ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SubProblemEnd {
    /// The model's minimum, to the tolerance, lies inside the trust region.
    Interior,
    /// The step ended on the boundary of the trust region.
    Boundary,
    /// A direction along which the model falls without bound led to the boundary.
    NegativeCurvature,
    /// The conjugate gradients were cut off inside the trust region.
    Truncated,
}

/// The rule that ended the iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StoppingRule {
    /// The root mean square Sampson distance fell to [`Options::target_error`](crate::Options::target_error).
    SampsonErrorReached,
    /// With the weight at its floor the objective hardly fell any more.
    RelativeDecrease,
    /// Steps were rejected until the trust radius had become too small.
    RadiusTooSmall,
    /// The iterations were used up.
    IterationLimit,
    /// The product of held-out error and energy stopped falling.
    HoldOut,
    /// The observer asked to stop.
    Cancelled,
}

/// Errors of one function.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Equation (5) over the fitted points: `Σ aᵢ rᵢ²`, in squared units of the points.
    pub sampson_error: f64,
    /// `√(Σ aᵢ rᵢ² / Σ aᵢ)`, in the unit of the points.
    pub sampson_rms: f64,
    /// The same over the held-out points, if there are any.
    pub held_out_rms: Option<f64>,
    /// Thin-plate energy, equation (3), at the scale of equation (8).
    pub energy: f64,
}

/// One iteration of section 2.3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Iteration {
    /// Counts from 0, rejected steps included.
    pub iteration: usize,
    /// Weight `w_k` of the energy at the scale of equation (8).
    pub weight: f64,
    /// The smoothing length ℓ that this weight means.
    pub smoothing_length: f64,
    /// `R(f^k)` with this weight, before the step.
    pub objective_before: f64,
    /// `R` with this weight after the step; the same as before where the step was rejected.
    pub objective: f64,
    /// Errors of the function that is kept.
    pub errors: Errors,
    /// Length of the step in the norm of the trust region.
    pub step_norm: f64,
    /// Trust radius `e_k` of this step; none where the first step was tried without a bound.
    pub radius: Option<f64>,
    /// Decrease of `R` over the decrease that the model predicted.
    pub gain_ratio: f64,
    /// Whether the step was taken.
    pub accepted: bool,
    /// Conjugate-gradient steps.
    pub cg_steps: usize,
    /// How the sub-problem ended.
    pub sub_problem: SubProblemEnd,
    /// Points whose gradient is below the floor.
    pub floored: usize,
}

/// What [`refine`](crate::refine) did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Points that were fitted.
    pub fitted_points: usize,
    /// Points that were held out.
    pub held_out_points: usize,
    /// Number of control coefficients.
    pub coefficients: usize,
    /// Errors of the initial function.
    pub initial: Errors,
    /// Errors at the best iteration, before the last steps, for which no point is held out any more.
    pub result: Errors,
    /// Index of the iteration that gave the returned function; none for the initial one.
    pub best_iteration: Option<usize>,
    /// All iterations.
    pub iterations: Vec<Iteration>,
    /// Why it ended.
    pub stopping_rule: StoppingRule,
    /// Products with `JᵀJ + wH`, those of the preconditioner included.
    pub operator_applications: usize,
    /// Sparse factorisations.
    pub factorisations: usize,
    /// Points of the returned function whose gradient is below the floor.
    pub floored: usize,
    /// Wall time.
    pub seconds: f64,
}
