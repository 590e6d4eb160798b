//! What the ladder did.

use serde::Serialize;

use crate::referee::Judgement;

/// What a fit begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The generalized eigenvector.
    Eigenvector,
    /// Directions in which the other points push each one away ([`Referee::repulsion`](crate::Referee::repulsion)).
    Repulsion,
    /// The normals of the best candidate so far.
    Leader,
    /// The normals of one with a longer smoothing length and doubtless sides, which left points behind.
    RunnerUp,
    /// Normals known from elsewhere.
    Normals,
    /// The normals of the best candidate so far, with pieces of the curve turned round.
    Turned,
    /// Unit normals with which the smoothest function has the least energy.
    UnitNormals,
}

/// Two searches for unit normals with which the smoothest function has the least energy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnitNormals {
    /// The energy that was reached from the normals of the best candidate, in frame units,
    pub from_leader: f64,
    /// and from the eigenvector.
    pub from_eigenvector: f64,
    /// The share of the points at which both have about the same normal.
    pub agreement: f64,
    /// Whether the function of the lower one is positive on all faces of the box, as outside of a closed surface.
    pub closed: bool,
}

/// Two searches agree where no more normals differ than one in a hundred.
const AGREEMENT: f64 = 0.99;

impl UnitNormals {
    /// Whether both searches came to the same normals, of a closed surface: then nearly all sides were right. Those of an open sheet agree as
    /// well, and tell nothing of an inside.
    pub fn agree(&self) -> bool {
        self.agreement >= AGREEMENT && self.closed
    }
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
    /// The searches for unit normals, where few points asked for them.
    pub unit_normals: Option<UnitNormals>,
}

impl LadderReport {
    /// The chosen candidate.
    pub fn choice(&self) -> Option<&Candidate> {
        self.candidates.get(self.chosen)
    }

    /// Whether f̂ has unit normals that were found from two starts.
    pub fn has_agreed(&self) -> bool {
        let has_them = self.choice().is_some_and(|choice| choice.start == Start::UnitNormals);
        has_them && self.unit_normals.as_ref().is_some_and(UnitNormals::agree)
    }

    /// With the candidates of another ladder after its own, of which that one's is chosen.
    pub fn followed_by(mut self, other: Self) -> Self {
        self.chosen = self.candidates.len() + other.chosen;
        self.candidates.extend(other.candidates);
        self.unit_normals = other.unit_normals.or(self.unit_normals);
        self
    }
}
