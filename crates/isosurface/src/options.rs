//! Settings and findings of an extraction.

use serde::Serialize;

/// Settings of [`surface`](crate::surface) and [`curve`](crate::curve).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// A vertex is on f = 0 when the next Newton step would move it by no more than this, in cells; 0 to 1. That step is
    /// still made, and as Newton's method squares the error, vertices are usually far better.
    pub tolerance: f64,
    /// Most steps per vertex. Along an edge each step at least halves the last one or the bracket, so the default is
    /// enough for the default tolerance even where f is flat or kinked.
    pub newton_steps: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: 1e-9, newton_steps: 80 }
    }
}

/// What an extraction found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Report {
    /// Cells (squares in 2D) that the zero set passes through.
    pub cells: usize,
    /// Cells with two loops joined by a tunnel; squares in 2D where the asymptotic decider was asked.
    pub ambiguous: usize,
    /// Cells whose interior could not be decided; their loops were closed by discs.
    pub unclear: usize,
    /// Vertices on caps, where the zero set leaves the lattice.
    pub capped: usize,
    /// Vertices that are not on f = 0 to [`Options::tolerance`]: new vertices inside a cell where the function has no zero
    /// nearby, or samples that are not the function's. Vertices on caps, and those held off a node, are not among them.
    pub unreached: usize,
}
