//! What the ladder did.

use serde::Serialize;

use crate::referee::Judgement;

/// What a fit begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The generalized eigenvector.
    Eigenvector,
    /// The normals of the best candidate so far.
    Leader,
    /// Normals known from elsewhere.
    Normals,
}

/// One fit and what the referee said.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Of the derivatives that its fairness is made of: 2, or 3 where few points asked for it.
    pub order: usize,
    /// Halvings of the base lattice.
    pub halvings: u32,
    /// Number of control coefficients.
    pub unknowns: usize,
    /// Smoothing length in spacings.
    pub ratio: f64,
    /// What the fit began with.
    pub start: Start,
    /// Iterations of the continuation.
    pub iterations: usize,
    /// Standard deviation of the points' distances from the surface, as far as this fit tells ([`noise_deviation`](crate::noise_deviation)),
    /// in spacings; none where the referee was content, and nothing had to be told from noise.
    pub noise: Option<f64>,
    /// Points that lie off its zero set together with those around them ([`Patches`](crate::Patches)).
    pub off: usize,
    /// The verdict.
    pub judgement: Judgement,
}

/// What [`climb`](crate::climb) did.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct LadderReport {
    /// All candidates in order.
    pub candidates: Vec<Candidate>,
    /// Index of the one that was chosen.
    pub chosen: usize,
}

impl LadderReport {
    /// The chosen candidate.
    pub fn choice(&self) -> Option<&Candidate> {
        self.candidates.get(self.chosen)
    }

    /// With the candidates of another ladder after its own, of which that one's is chosen.
    pub fn followed_by(mut self, other: Self) -> Self {
        self.chosen = self.candidates.len() + other.chosen;
        self.candidates.extend(other.candidates);
        self
    }
}
