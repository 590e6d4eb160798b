//! The ladder: several smoothing lengths on a coarse lattice, the referee chooses, then finer lattices.
//!
//! No smoothing length fits all data: above half a wall's thickness it welds the wall's sides, below the noise it makes
//! many sheets. And no lattice does: cells wider than a wall cannot hold its two sides. So candidates are fitted from
//! scratch at several lengths on the first lattice until the [`Referee`] is content with one, and the best climbs. On each
//! finer lattice the continuation starts from the normals found so far, at p = 1; the eigenvector is sought again only
//! where the referee doubts all that there is, since p = 1 cannot leave a bad start.

use serde::Serialize;
use tracing::debug;
use zeroset_bspline::{Collocation, Derivatives, KnotVector, Spline};
use zeroset_multigrid::Multigrid;

use crate::error::GefmError;
use crate::fit::{Options, fit, normalise};
use crate::lanczos::{dot, smallest_eigenpair};
use crate::normal_solver::{Iterative, NormalSolver};
use crate::p_continuation::{ContinuationOptions, continue_exponent};
use crate::referee::{Judgement, Referee};

/// Settings of [`climb`].
#[derive(Debug, Clone, PartialEq)]
pub struct LadderOptions {
    /// Spacing s of the points, frame units.
    pub spacing: f64,
    /// Density ρ of the points: per unit length in 2D, per unit area in 3D, in frame units.
    pub density: f64,
    /// Smoothing lengths to try, in spacings, the likeliest first.
    pub ratios: Vec<f64>,
    /// The first lattice: so many halvings of the base lattice.
    pub first: u32,
    /// The last lattice that may be climbed to.
    pub last: u32,
    /// No further lengths are tried once a candidate scores less.
    pub content: f64,
    /// Above this score of the best candidate the eigenvector is sought again on the next lattice.
    pub doubtful: f64,
    /// Relative residual of the solves on finer lattices.
    pub tolerance: f64,
}

impl LadderOptions {
    /// The defaults for points with spacing `spacing` and density `density`.
    pub fn new(spacing: f64, density: f64) -> Self {
        Self {
            spacing,
            density,
            ratios: vec![0.4, 0.8, 0.2, 1.6, 3.2],
            first: 0,
            last: 1,
            content: 0.1,
            doubtful: 0.25,
            tolerance: 1e-3,
        }
    }
}

/// One fit and what the referee said.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Halvings of the base lattice.
    pub halvings: u32,
    /// Number of control coefficients.
    pub unknowns: usize,
    /// Smoothing length in spacings.
    pub ratio: f64,
    /// Whether it was found from scratch, by an eigenvector, and not from the normals of an earlier candidate.
    pub spectral: bool,
    /// Iterations of the continuation.
    pub iterations: usize,
    /// The verdict.
    pub judgement: Judgement,
}

/// What [`climb`] did.
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
}

/// Where a candidate comes from; the fields are those of [`Candidate`].
#[derive(Clone, Copy)]
struct Origin {
    halvings: u32,
    ratio: f64,
    spectral: bool,
}

/// The best so far.
struct Leader<const D: usize> {
    f: Spline<D>,
    index: usize,
    score: f64,
    ratio: f64,
    winding: Vec<f64>,
}

/// Finds f̂: a spline whose sign tells inside (negative) from outside. Also gives the referee's `W` at each point, ½
/// where all is well.
///
/// `areas` holds one weight per point, of mean 1; 0 for a point that is not to be heard. `base` is the coarsest lattice;
/// it should have no more than a few thousand coefficients.
///
/// # Errors
/// As [`fit`](fn@crate::fit); a candidate that fails is passed over as long as another one does not.
pub fn climb<const D: usize>(
    points: &[[f64; D]],
    areas: &[f64],
    base: &[KnotVector; D],
    options: &LadderOptions,
) -> Result<(Spline<D>, Vec<f64>, LadderReport), GefmError> {
    let mut knots = base.clone();
    for _ in 0..options.first {
        knots = knots.each_ref().map(KnotVector::halved);
    }
    let referee = Referee::new(points, areas, options.spacing, options.density, &knots)?;
    let mut ladder = Ladder { points, areas, base, options, referee, report: LadderReport::default(), leader: None };
    let mut failure = None;
    for &ratio in &options.ratios {
        let smoothing_length = ratio * options.spacing;
        let continuation = ContinuationOptions { most_iterations: MOST_ITERATIONS, ..ContinuationOptions::default() };
        let settings = Options { smoothing_length, density: options.density, continuation, ..Options::default() };
        match fit(points, areas, &knots, &settings) {
            Ok((f, report)) => {
                let iterations = report.continuation.stages.iter().map(|stage| stage.iterations).sum();
                ladder.judge(f, Origin { halvings: options.first, ratio, spectral: true }, iterations)?;
            }
            Err(error) => failure = Some(error),
        }
        if ladder.leader.as_ref().is_some_and(|leader| leader.score < options.content) {
            break;
        }
    }
    for halvings in options.first + 1..=options.last {
        ladder.rung(halvings)?;
    }
    let Some(leader) = ladder.leader else { return Err(failure.unwrap_or(GefmError::NoPoints)) };
    let report = LadderReport { chosen: leader.index, ..ladder.report };
    Ok((leader.f, leader.winding, report))
}

/// Most iterations per exponent: candidates that need more have never turned out well.
const MOST_ITERATIONS: usize = 40;
/// A finer candidate is taken if its score is above the leader's by no more than this: it sees more detail, and the score
/// of right answers differs by about as much from lattice to lattice.
const SLACK: f64 = 0.01;

struct Ladder<'a, const D: usize> {
    points: &'a [[f64; D]],
    areas: &'a [f64],
    base: &'a [KnotVector; D],
    options: &'a LadderOptions,
    referee: Referee<'a, D>,
    report: LadderReport,
    leader: Option<Leader<D>>,
}

impl<const D: usize> Ladder<'_, D> {
    fn judge(&mut self, f: Spline<D>, origin: Origin, iterations: usize) -> Result<(), GefmError> {
        let Origin { halvings, ratio, spectral } = origin;
        let slack = if spectral { 0.0 } else { SLACK };
        let (judgement, winding) = self.referee.judge(&f)?;
        let unknowns = f.shape().iter().product();
        debug!(halvings, unknowns, ratio, spectral, iterations, score = judgement.score, "candidate");
        let score = judgement.score;
        let index = self.report.candidates.len();
        self.report.candidates.push(Candidate { halvings, unknowns, ratio, spectral, iterations, judgement });
        if self.leader.as_ref().is_none_or(|leader| score < leader.score + slack) {
            self.leader = Some(Leader { f, index, score, ratio, winding });
        }
        Ok(())
    }

    /// Candidates on the lattice after so many halvings.
    fn rung(&mut self, halvings: u32) -> Result<(), GefmError> {
        let Some(leader) = &self.leader else { return Ok(()) };
        let (ratio, score) = (leader.ratio, leader.score);
        let gradients = leader.f.evaluate(self.points, Derivatives::Gradient).gradients;
        let weight = |ratio: f64| self.options.density * (ratio * self.options.spacing).powi(3);
        let mut multigrid = Multigrid::new(self.base, halvings, self.points, self.areas, weight(ratio))?;
        let collocation = Collocation::new(multigrid.knots(), self.points)?;

        let pulls: Vec<[f64; D]> = gradients
            .iter()
            .zip(self.areas)
            .map(|(g, area)| {
                let norm = dot(g, g).sqrt();
                g.map(|g| if norm > 0.0 { area * g / norm } else { 0.0 })
            })
            .collect();
        let mut right = vec![0.0; multigrid.size()];
        collocation.add_gradients_transposed(&pulls, &mut right);
        let mut f = vec![0.0; multigrid.size()];
        self.solver(&multigrid).solve(&right, &mut f);
        self.continued(&multigrid, &collocation, f, &[1.0], Origin { halvings, ratio, spectral: false })?;

        if score > self.options.doubtful {
            for &ratio in self.options.ratios.iter().filter(|ratio| (0.1..1.0).contains(*ratio)) {
                multigrid = multigrid.reweighted(weight(ratio))?;
                let solver = self.solver(&multigrid);
                let solve = |right: &[f64]| {
                    let mut f = vec![0.0; right.len()];
                    solver.solve(right, &mut f);
                    f
                };
                let apply_b = |f: &[f64]| {
                    let mut gradients = collocation.gradients(f);
                    gradients.iter_mut().zip(self.areas).for_each(|(g, a)| *g = g.map(|g| g * a));
                    let mut out = vec![0.0; f.len()];
                    collocation.add_gradients_transposed(&gradients, &mut out);
                    out
                };
                // The continuation only needs to begin near the eigenvector.
                let Some((f, _)) = smallest_eigenpair(solve, apply_b, right.clone(), 1e-2, 24) else { continue };
                self.continued(&multigrid, &collocation, f, &[1.5, 1.0], Origin { halvings, ratio, spectral: true })?;
            }
        }
        Ok(())
    }

    fn solver<'m>(&self, multigrid: &'m Multigrid<D>) -> Iterative<'m, D> {
        Iterative { multigrid, tolerance: self.options.tolerance }
    }

    fn continued(
        &mut self,
        multigrid: &Multigrid<D>,
        collocation: &Collocation<D>,
        f: Vec<f64>,
        exponents: &[f64],
        origin: Origin,
    ) -> Result<(), GefmError> {
        let settings = ContinuationOptions {
            exponents: exponents.to_vec(),
            most_iterations: MOST_ITERATIONS,
            ..ContinuationOptions::default()
        };
        let solver = self.solver(multigrid);
        let (f, report) = continue_exponent(collocation, &solver, self.areas, f, &settings)?;
        let f = normalise(collocation, self.points, self.areas, multigrid.knots(), f)?;
        let iterations = report.stages.iter().map(|stage| stage.iterations).sum();
        self.judge(f, origin, iterations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn knots(half: f64, cells: usize) -> [KnotVector; 2] {
        let knots = KnotVector::uniform(3, -half, 2.0 * half / cells as f64, cells).unwrap();
        [knots.clone(), knots]
    }

    #[test]
    fn a_wall_thinner_than_a_cell_needs_the_short_length() {
        // A bar 0.9 × 0.03 on cells of 0.075, points 0.01 apart: ℓ above half the wall welds its sides.
        let mut points: Vec<[f64; 2]> = Vec::new();
        points.extend((0..90).map(|i| [-0.445 + 0.01 * f64::from(i), -0.015]));
        points.extend((0..90).map(|i| [-0.445 + 0.01 * f64::from(i), 0.015]));
        points.extend([[-0.45, -0.005], [-0.45, 0.005], [0.45, -0.005], [0.45, 0.005]]);
        let options = LadderOptions { ratios: vec![3.2, 0.4], ..LadderOptions::new(0.01, 100.0) };
        let ones = vec![1.0; points.len()];
        let (f, _, report) = climb(&points, &ones, &knots(0.6, 16), &options).unwrap();
        let right = points[..180].iter().filter(|p| f.value_and_gradient(p).1[1] * p[1] > 0.0).count();
        assert_eq!(right, 180, "{report:?}");
        let choice = report.choice().unwrap();
        assert_eq!(choice.ratio, 0.4);
        let welded = report.candidates.iter().find(|c| c.ratio == 3.2).unwrap();
        assert!(welded.judgement.score > 2.0 * choice.judgement.score, "{report:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn inexact_solves_never_lower_the_objective(
            radii in proptest::collection::vec(0.25..0.45f64, 120),
            normals in proptest::collection::vec(-1.0..1.0f64, 240),
            tolerance in 1e-3..0.5f64,
        ) {
            let angle = |i: usize| i as f64 / 120.0 * std::f64::consts::TAU;
            let points: Vec<[f64; 2]> =
                radii.iter().enumerate().map(|(i, r)| [r * angle(i).cos(), r * angle(i).sin()]).collect();
            let areas = vec![1.0; 120];
            let multigrid = Multigrid::new(&knots(0.6, 6), 2, &points, &areas, 60.0 * 0.02f64.powi(3)).unwrap();
            let collocation = Collocation::new(multigrid.knots(), &points).unwrap();
            let start: Vec<[f64; 2]> = normals.chunks(2).map(|n| [n[0], n[1]]).collect();
            let mut right = vec![0.0; multigrid.size()];
            collocation.add_gradients_transposed(&start, &mut right);
            let solver = Iterative { multigrid: &multigrid, tolerance };
            let mut f = vec![0.0; multigrid.size()];
            solver.solve(&right, &mut f);
            let (_, report) =
                continue_exponent(&collocation, &solver, &areas, f, &ContinuationOptions::default()).unwrap();
            for stage in &report.stages {
                // Monotone at any tolerance; the slack is rounding.
                prop_assert!(stage.objective.windows(2).all(|j| j[1] >= j[0] * (1.0 - 1e-12)), "{:?}", stage);
            }
        }
    }
}
