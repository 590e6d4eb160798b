//! What a refinement level by level did.

use serde::Serialize;

/// Errors of one function: over all points, or over those in a level's cells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LevelErrors {
    /// Root mean square Sampson distance of the fitted points, in the unit of the points.
    pub sampson_rms: f64,
    /// Mean distance of the held-out points from the zero set along the normals of the function after the very first step,
    /// if there are enough points to judge by and that step has been done.
    pub held_out: Option<f64>,
    /// The energy over the whole box, at the scale at which the initial function's gradients have root mean square 1.
    pub energy: f64,
}

/// One Gauss–Newton step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LevelStep {
    /// Weight of the energy.
    pub weight: f64,
    /// The smoothing length ℓ that this weight means.
    pub smoothing_length: f64,
    /// Decrease of the objective over the decrease that the model predicted.
    pub gain_ratio: f64,
    /// Whether the step was taken.
    pub accepted: bool,
    /// Conjugate-gradient steps: products with the normal operator.
    pub cg_steps: usize,
    /// Objective with this weight before and after.
    pub objective: [f64; 2],
    /// Errors of the function that is kept.
    pub errors: LevelErrors,
}

/// What a fit had left over, smoothed and added once more ([`twice`](crate::twice)).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Twicing {
    /// The smoothing length.
    pub smoothing_length: f64,
    /// Conjugate-gradient steps: products with the normal operator.
    pub cg_steps: usize,
    /// By how much all of it would move the zero set at the points: root mean square, in the unit of the points.
    pub moved_rms: f64,
    /// The same if nothing were left over but noise.
    pub noise_rms: f64,
    /// The share of it that was added, on average over the level's functions.
    pub kept: f64,
}

/// One level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LevelSummary {
    /// 0 is the dense lattice near the points.
    pub level: usize,
    /// Side of the cells.
    pub cell: f64,
    /// Active functions: the unknowns.
    pub active: usize,
    /// Cells.
    pub cells: usize,
    /// Points that lie in the cells, those held out included; where many share a cell, one may stand for them.
    pub points: usize,
    /// Errors before the first step, over the points in the cells.
    pub initial: LevelErrors,
    /// All steps, with errors over the points in the cells.
    pub steps: Vec<LevelStep>,
    /// The step whose function was kept; none if the level brought nothing and was left out.
    pub best_step: Option<usize>,
    /// Wall time.
    pub seconds: f64,
}

/// What [`refine_levels`](crate::refine_levels) did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LevelsReport {
    /// Points that were fitted.
    pub fitted_points: usize,
    /// Points that were held out.
    pub held_out_points: usize,
    /// Errors of the initial function.
    pub initial: LevelErrors,
    /// Errors of the best function while points were held out.
    pub result: LevelErrors,
    /// The levels that were tried, coarse to fine.
    pub levels: Vec<LevelSummary>,
    /// The levels that were refined once more, with the points that had been held out.
    pub levels_with_all: Vec<LevelSummary>,
    /// Whether a level brought nothing and ended the cascade.
    pub stopped_early: bool,
    /// The smoothing length at which the noise ended the steps, if it did.
    pub noise_length: Option<f64>,
    /// Mean of `‖∇f‖` at the points before the result was divided by it.
    pub mean_slope: f64,
    /// What [`twice`](crate::twice) has added afterwards, if it was called for; errors and levels are those before.
    pub twicings: Vec<Twicing>,
    /// Places off the surface that were held on their side.
    pub held_places: usize,
    /// Points of the returned function whose gradient is below the floor.
    pub floored: usize,
}
