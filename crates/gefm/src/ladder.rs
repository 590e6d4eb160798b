//! The ladder: several smoothing lengths on a coarse lattice, the referee chooses, then finer lattices.
//!
//! No smoothing length fits all data: above half a wall's thickness it welds the wall's sides, below the noise it makes
//! many sheets. And no lattice does: cells wider than a wall cannot hold its two sides. So candidates are fitted from
//! scratch at several lengths on the first lattice until the [`Referee`] is content with one, and the best climbs. On each
//! finer lattice the continuation starts from the normals found so far, at p = 1; the eigenvector is sought again only
//! where the referee doubts all that there is, since p = 1 cannot leave a bad start. In the plane, where each gap cuts a curve in two, pieces of the
//! best are turned round as winding numbers would have them.

use tracing::debug;
use zeroset_bspline::{Derivatives, KnotVector, Spline};

use crate::error::GefmError;
use crate::ladder_options::{KnownNormals, LadderOptions};
use crate::ladder_report::{Candidate, LadderReport, Start};
use crate::noise::{LAYERED, LEAST_NOISE, layers, noise_deviation};
use crate::patches::Patches;
use crate::pieces::{pieces, turned};
use crate::pulled_points::Found;
use crate::referee::Referee;
use crate::rung::Rung;
use crate::verdict::{RANDOM, Verdict, WELDED};

mod few_points;

pub use few_points::MOST_FACTORED;

/// The best so far.
struct Leader<const D: usize> {
    f: Spline<D>,
    verdict: Verdict,
    winding: Vec<f64>,
    /// Of the points that are heard, from its zero set.
    distances: Vec<f64>,
    /// Whether its fairness is of third order, or it began with the normals of one of which that is so.
    third_order: bool,
}

/// What a candidate is fitted with: the order of its fairness, its lattice, and its smoothing length in spacings.
#[derive(Debug, Clone, Copy)]
struct Trial {
    order: usize,
    halvings: u32,
    unknowns: usize,
    ratio: f64,
}

impl Trial {
    /// On that lattice, with its length.
    fn second_order<const D: usize>(rung: &Rung<D>) -> Self {
        Self { order: 2, halvings: rung.halvings, unknowns: rung.unknowns(), ratio: rung.ratio() }
    }
}

/// Finds f̂: a spline whose sign tells inside (negative) from outside. Also gives the referee's `W` at each point, ½
/// where all is well.
///
/// `areas` holds one weight per point, of mean 1; 0 for a point that is not to be heard. `base` is the coarsest lattice of
/// the V-cycle; it should have no more than a few hundred to a few thousand coefficients.
///
/// # Errors
/// If there are no points, lengths do not fit, a point lies outside the lattice, no gradient is left, or the ladder was
/// cancelled. A candidate that fails is passed over as long as another one does not.
pub fn climb<const D: usize>(
    points: &[[f64; D]],
    areas: &[f64],
    base: &[KnotVector; D],
    options: &LadderOptions<D>,
) -> Result<(Spline<D>, Vec<f64>, LadderReport), GefmError> {
    if points.is_empty() {
        return Err(GefmError::NoPoints);
    }
    if areas.len() != points.len() {
        return Err(GefmError::Areas { found: areas.len(), needed: points.len() });
    }
    if let Some(found) = options.normals.vectors().map(<[_]>::len).filter(|found| *found != points.len()) {
        return Err(GefmError::Normals { found, needed: points.len() });
    }
    let (length, density) = (options.spacing, options.density);
    if !(length.is_finite() && density.is_finite() && length > 0.0 && density > 0.0) {
        return Err(GefmError::Smoothing { length, density });
    }
    // Among the threads at once: otherwise every short parallel loop would have to wake them, and be waited for.
    rayon::scope(|_| climb_among_threads(points, areas, base, options))
}

fn climb_among_threads<const D: usize>(
    points: &[[f64; D]],
    areas: &[f64],
    base: &[KnotVector; D],
    options: &LadderOptions<D>,
) -> Result<(Spline<D>, Vec<f64>, LadderReport), GefmError> {
    let mut ladder = Ladder::new((points, areas), base, options)?;
    for halvings in options.first..=options.last {
        if !ladder.worth_climbing(halvings) {
            break;
        }
        ladder.climb(halvings)?;
    }
    let Some(leader) = ladder.leader else { return Err(ladder.failure.unwrap_or(GefmError::NoGradient)) };
    Ok((leader.f, leader.winding, ladder.report))
}

/// The lattice after so many halvings of `base`.
fn halved<const D: usize>(base: &[KnotVector; D], halvings: u32) -> [KnotVector; D] {
    (0..halvings).fold(base.clone(), |knots, _| knots.each_ref().map(KnotVector::halved))
}

/// Cells narrower than the median distance of the points over this share resolve noise only.
const NOISE: f64 = 0.25;
/// Finer cells have never changed a side where no point was farther from the zero set than so many times the detail wanted, and W nowhere
/// farther from ½ than the other number: what is thinner than the cells shows in one or the other.
const MISSED: f64 = 0.75;
const BESIDE: f64 = 0.45;
/// Where more than this share of the points lie off together with those around them, what does not show in W is wrong: gaps or walls have been
/// filled or passed by.
const LEFT: f64 = 0.1;
/// And where more than this share of the points are of a wall or a gap thinner than the cells, there are holes in it between them, though all
/// have the right side.
const FACING: f64 = 0.02;
/// A finer candidate is taken if its score is above the leader's by no more than this: it sees more detail, and the score
/// of right answers differs by about as much from lattice to lattice.
const SLACK: f64 = 0.01;
/// Lengths above so many spacings are for noise of at least as many as the second, where all others are about random: where one of those has
/// the sides right, it keeps more of the shape.
const LAST_RESORT: f64 = 3.2;
const DEEP: f64 = 1.0;
/// And above this one there is more noise than walls that are too thin can make of it.
const HOPELESS: f64 = 0.8;
/// Pieces are turned round so many times at most.
const MOST_TURNS: usize = 3;

struct Ladder<'a, const D: usize> {
    points: &'a [[f64; D]],
    areas: &'a [f64],
    base: &'a [KnotVector; D],
    options: &'a LadderOptions<D>,
    /// The points that weigh anything, and what lies around each of them.
    heard: Vec<usize>,
    patches: Patches,
    referee: Referee<'a, D>,
    report: LadderReport,
    leader: Option<Leader<D>>,
    /// Of those that were not preferred to it and have welded no walls, the best by its score in the last search from scratch.
    runner_up: Option<Leader<D>>,
    /// What candidates from scratch begin with in the last search.
    origin: Start,
    /// Directions in which each point is pushed away by the others, once they are asked for.
    repulsion: Option<Vec<[f64; D]>>,
    /// The lattice that was climbed to last.
    rung: Option<Rung<'a, D>>,
    /// Why a candidate was passed over.
    failure: Option<GefmError>,
}

impl<'a, const D: usize> Ladder<'a, D> {
    /// Before the first candidate.
    fn new(
        (points, areas): (&'a [[f64; D]], &'a [f64]),
        base: &'a [KnotVector; D],
        options: &'a LadderOptions<D>,
    ) -> Result<Self, GefmError> {
        let knots = halved(base, options.first);
        let referee = Referee::new(points, areas, options.spacing, options.density, &knots)?;
        let heard: Vec<usize> = (0..points.len()).filter(|i| areas[*i] > 0.0).collect();
        let patches = Patches::new(&heard.iter().map(|i| points[*i]).collect::<Vec<_>>(), options.spacing);
        Ok(Self {
            points,
            areas,
            base,
            options,
            heard,
            patches,
            referee,
            report: LadderReport::default(),
            leader: None,
            runner_up: None,
            origin: Start::Eigenvector,
            repulsion: None,
            rung: None,
            failure: None,
        })
    }

    /// Whether points may still be on the wrong side; or else the cells after so many halvings are wide against the noise, and
    /// there is something that wider ones did not get.
    fn worth_climbing(&self, halvings: u32) -> bool {
        let Some(leader) = &self.leader else { return true };
        if self.report.has_agreed() {
            return false;
        }
        if leader.verdict.score > self.options.hopeless {
            return false;
        }
        if self.leaves_points(leader) || leader.verdict.beyond_noise > self.options.doubtful {
            return true;
        }
        // What lowers the error of W best is not always right, but with narrower cells it is then put right.
        if self.report.choice().is_some_and(|choice| choice.start == Start::Repulsion) {
            return true;
        }
        let (_, low, high) = self.base[0].cells().next().unwrap_or_default();
        let cell = (high - low) / f64::from(1u32 << halvings);
        let mut distances: Vec<f64> = leader.distances.iter().map(|d| d.abs()).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let beside = |(winding, area): (&f64, &f64)| *area > 0.0 && (winding - 0.5).abs() > BESIDE;
        let missed = || {
            distances.last().is_some_and(|largest| *largest > MISSED * self.options.detail)
                || leader.winding.iter().zip(self.areas).any(beside)
                || self.facing_share(2.0 * cell) > FACING
        };
        distances[distances.len() / 2] < NOISE * cell && missed()
    }

    /// The share of the points near which, within `reach`, another one is on a sheet that faces theirs.
    fn facing_share(&self, reach: f64) -> f64 {
        self.patches.facing_share(&self.of_heard(self.points), &self.of_heard(&self.directions()), reach)
    }

    /// What belongs to the points that are heard.
    fn of_heard<T: Copy>(&self, all: &[T]) -> Vec<T> {
        self.heard.iter().map(|i| all[*i]).collect()
    }

    /// Whether more than a few points lie off it together with those around them.
    fn leaves_points(&self, leader: &Leader<D>) -> bool {
        leader.verdict.off as f64 > LEFT * self.heard.len() as f64
    }

    /// Sampson distances of the points that are heard.
    fn distances(&self, f: &Spline<D>) -> Vec<f64> {
        self.of_heard(&f.evaluate(self.points, Derivatives::Gradient).sampson_distances())
    }

    /// Candidates on the lattice after so many halvings.
    fn climb(&mut self, halvings: u32) -> Result<(), GefmError> {
        let ratio = self.leader.as_ref().map_or(self.options.likeliest, |leader| leader.verdict.ratio);
        let points = (self.points, self.areas);
        self.options.cancel.check()?;
        let mut rung = match self.rung.take() {
            Some(rung) => rung.refined(ratio, &self.directions())?,
            None => Rung::new(points, self.base, halvings, ratio, &self.directions(), self.options)?,
        };
        if self.leader.is_some() {
            self.consider(&rung, self.next())?;
            // Wide cells may have called for a length that narrower ones do not need, or for one several times as long.
            let mut shorter = self.shorter(ratio);
            while let Some(ratio) = shorter {
                rung.set_ratio(ratio)?;
                self.consider(&rung, self.next())?;
                let goes_on = self.leader.as_ref().is_some_and(|leader| self.leaves_points(leader));
                shorter = self.shorter(ratio).filter(|_| goes_on);
            }
        }
        match &self.leader {
            // Of points that want third order, second order has no better sides on finer lattices.
            Some(leader) if leader.third_order || leader.verdict.beyond_noise <= self.options.doubtful => {}
            known => {
                rung.set_ratio(known.as_ref().map_or(ratio, |leader| leader.verdict.ratio))?;
                self.search(&mut rung)?;
                self.search_third_order(&rung)?;
            }
        }
        self.turn_pieces(&mut rung)?;
        self.rung = Some(rung);
        Ok(())
    }

    /// Candidates in the plane with those pieces of the leader turned round that winding numbers would have so. (In space the points go all the
    /// way around any gap, so that there is one piece; of open curves winding numbers say nothing.) Of sides that were about
    /// random one is taken only if it leaves no doubt: with pieces turned round at will those of points that bound nothing look better than they are.
    fn turn_pieces(&mut self, rung: &mut Rung<D>) -> Result<(), GefmError> {
        if D != 2 || self.options.open || matches!(self.options.normals, KnownNormals::Trust(_)) {
            return Ok(());
        }
        for _ in 0..MOST_TURNS {
            let Some(known) = self.leader.as_ref().map(|leader| leader.verdict) else { break };
            let gradients = self.directions();
            let mut pieces = pieces(&self.of_heard(self.points), &self.of_heard(&gradients), &self.patches);
            pieces.iter_mut().flatten().for_each(|index| *index = self.heard[*index]);
            let Some(normals) = turned(&self.referee, &gradients, &pieces, &self.options.cancel)? else { break };
            rung.set_ratio(known.ratio)?;
            let found = self.tried(rung.oriented(&normals, false), Trial::second_order(rung), Start::Turned)?;
            if found.score >= known.score || found.is_same(&known) {
                break;
            }
        }
        Ok(())
    }

    /// Where the points are pulled: along the leader's normals, or, as long as there is none, away from their centroid. The
    /// latter is never orthogonal to a right answer f, since `Σ aᵢ (Pᵢ − c)·∇f(Pᵢ)` is then D times the volume inside.
    fn directions(&self) -> Vec<[f64; D]> {
        match &self.leader {
            Some(leader) => leader.f.evaluate(self.points, Derivatives::Gradient).gradients,
            None => self.away_from_centroid(),
        }
    }

    /// Away from the centroid of the points.
    fn away_from_centroid(&self) -> Vec<[f64; D]> {
        let total: f64 = self.areas.iter().sum();
        let centroid: [f64; D] = std::array::from_fn(|axis| {
            self.points.iter().zip(self.areas).map(|(p, a)| a * p[axis]).sum::<f64>() / total
        });
        self.points.iter().map(|p| std::array::from_fn(|axis| p[axis] - centroid[axis])).collect()
    }

    /// The next shorter length, of those above the likeliest.
    fn shorter(&self, ratio: f64) -> Option<f64> {
        let below =
            self.options.ratios.iter().copied().filter(|other| *other < ratio && *other >= self.options.likeliest);
        below.max_by(f64::total_cmp)
    }

    /// What a candidate starts with where there is a leader.
    fn next(&self) -> Start {
        match self.options.normals {
            KnownNormals::Trust(_) => Start::Normals,
            _ => Start::Leader,
        }
    }

    /// What a candidate starts with that is to be independent of the leader.
    fn scratch(&self) -> Start {
        match self.options.normals {
            KnownNormals::Trust(_) => Start::Normals,
            _ => self.origin,
        }
    }

    /// Whether it can be better to begin with repulsion: of an open surface the scores say nothing, and in the plane pieces are turned round.
    fn may_begin_with_repulsion(&self) -> bool {
        D == 3 && self.options.repulsion && !self.options.open && self.scratch() == Start::Eigenvector
    }

    /// Candidates from scratch, after the one from known normals if they are but a hint and it is not good enough: with the length
    /// of the rung, then with those that this one leads to. In space, where the best of the first lattice is still about random, what led to it
    /// was chance, and what was passed over may be right: so all are looked at there.
    fn search(&mut self, rung: &mut Rung<D>) -> Result<(), GefmError> {
        let hint = matches!(self.options.normals, KnownNormals::Hint(_));
        if hint && self.consider(rung, Start::Normals)?.score < self.options.content {
            return Ok(());
        }
        let before = self.report.candidates.len();
        let continued = self.leader_on(rung);
        self.origin = Start::Eigenvector;
        let mut first = self.consider(rung, self.scratch())?;
        if self.options.open && continued.is_some_and(|continued| first.fits() && first.is_same(&continued)) {
            return Ok(());
        }
        if self.may_begin_with_repulsion() && first.score > RANDOM {
            let other = self.consider(rung, Start::Repulsion)?;
            if other.score < RANDOM {
                (self.origin, first) = (Start::Repulsion, other);
            }
        }
        self.runner_up = None;
        self.search_from(first, rung)?;
        self.continue_runner_up(rung)?;
        let options = self.options;
        if D == 3 && rung.halvings == options.first {
            let tried: Vec<f64> = self.report.candidates[before..].iter().map(|candidate| candidate.ratio).collect();
            for ratio in options.ratios.iter().copied().filter(|ratio| *ratio <= LAST_RESORT && !tried.contains(ratio))
            {
                if self.is_random() {
                    rung.set_ratio(ratio)?;
                    self.consider(rung, self.scratch())?;
                }
            }
        }
        Ok(())
    }

    /// Where the leader is doubtful, a candidate with its length that begins with the normals of one with a longer length that is not, and was
    /// not preferred for the points that it leaves behind. (From sides that are as doubtful come others that look better than they are.)
    /// Not with trusted normals, which decide the sides whatever the referee says.
    fn continue_runner_up(&mut self, rung: &mut Rung<D>) -> Result<(), GefmError> {
        let (Some(leader), Some(other)) = (&self.leader, self.runner_up.take()) else { return Ok(()) };
        if matches!(self.options.normals, KnownNormals::Trust(_)) {
            return Ok(());
        }
        let (Verdict { ratio, score, .. }, doubtful) = (leader.verdict, self.options.doubtful);
        if score >= doubtful && other.verdict.score < doubtful && other.verdict.ratio > ratio {
            rung.set_ratio(ratio)?;
            self.tried(rung.continued(&other.f, rung.halvings), Trial::second_order(rung), Start::RunnerUp)?;
        }
        Ok(())
    }

    /// What is known of the leader, if it is a candidate on this lattice with its length.
    fn leader_on(&self, rung: &Rung<D>) -> Option<Verdict> {
        let here = self.report.choice()?.halvings == rung.halvings;
        self.leader.as_ref().map(|leader| leader.verdict).filter(|verdict| here && verdict.ratio == rung.ratio())
    }

    /// Whether the sides of the leader are about random.
    fn is_random(&self) -> bool {
        self.leader.as_ref().is_none_or(|leader| leader.verdict.score > RANDOM)
    }

    /// Candidates from scratch after the `first`, with longer lengths as long as each is better than the one before, or, if none is or all
    /// are about random, with shorter ones. One longer length that is worse is passed over where the first was about random: under noise all
    /// those that are too short are, and so are their scores. In the plane, where noise may be many spacings, more of them are where it was
    /// hopeless.
    fn search_from(&mut self, first: Verdict, rung: &mut Rung<D>) -> Result<(), GefmError> {
        let first_ratio = rung.ratio();
        let longer: Vec<f64> = self.options.ratios.iter().copied().filter(|other| *other > first_ratio).collect();
        let shorter: Vec<f64> =
            self.options.ratios.iter().rev().copied().filter(|other| *other < first_ratio).collect();
        let hopeless = D == 2 && first.score > HOPELESS;
        for (direction, patient) in [(longer, first.score > RANDOM), (shorter, false)] {
            let (mut last, mut better, mut patient) = (first, false, patient);
            for ratio in direction {
                if last.score < self.options.content {
                    return Ok(());
                }
                if ratio > first_ratio.max(LAST_RESORT) && !(self.is_random() && last.noise > DEEP) {
                    break;
                }
                rung.set_ratio(ratio)?;
                let found = self.consider(rung, self.scratch())?;
                if self.is_better(&found, &last) {
                    (last, better, patient) = (found, true, hopeless && found.score > RANDOM);
                } else if patient {
                    patient = hopeless;
                } else {
                    break;
                }
            }
            // Among sides that are all about random, the better ones do not show the way; nor do those that have welded walls.
            let welded = self.leader.as_ref().is_some_and(|leader| leader.verdict.layered);
            if better && last.score < RANDOM && !welded {
                break;
            }
        }
        Ok(())
    }

    /// Fits and judges; the score is infinite if the fit failed.
    ///
    /// # Errors
    /// If the ladder was cancelled.
    fn consider(&mut self, rung: &Rung<D>, start: Start) -> Result<Verdict, GefmError> {
        let found = match (start, &self.leader, self.options.normals.vectors()) {
            (Start::Normals, _, Some(normals)) => {
                rung.oriented(normals, matches!(self.options.normals, KnownNormals::Trust(_)))
            }
            (Start::Leader, Some(leader), _) => {
                rung.continued(&leader.f, self.report.candidates[self.report.chosen].halvings)
            }
            (Start::Repulsion, ..) => {
                let normals = match self.repulsion.take() {
                    Some(normals) => normals,
                    None => self.referee.repulsion()?,
                };
                let found = rung.oriented(&normals, false);
                self.repulsion = Some(normals);
                found
            }
            _ => rung.spectral(),
        };
        self.tried(found, Trial::second_order(rung), start)
    }

    /// Judges what was found; the score is infinite if the fit failed.
    ///
    /// # Errors
    /// If the ladder was cancelled.
    fn tried(&mut self, found: Found<D>, trial: Trial, start: Start) -> Result<Verdict, GefmError> {
        let judged = self.judge(found, trial, start);
        Ok(self.passed_over(judged)?.unwrap_or(Verdict::failed(trial.ratio)))
    }

    /// Nothing of what failed, and why in the end, unless it was cancelled.
    fn passed_over<T>(&mut self, found: Result<T, GefmError>) -> Result<Option<T>, GefmError> {
        match found {
            Ok(found) => Ok(Some(found)),
            Err(cancelled @ GefmError::Cancelled(_)) => Err(cancelled),
            Err(error) => {
                self.failure = Some(error);
                Ok(None)
            }
        }
    }

    fn judge(&mut self, found: Found<D>, trial: Trial, start: Start) -> Result<Verdict, GefmError> {
        let other = self.assess(found?, trial, start)?;
        let verdict = other.verdict;
        let is_usable = match (trial.order, start) {
            (3, _) => verdict.beyond_noise < HOPELESS && self.is_held(&other.f),
            (_, Start::Turned) => verdict.score < self.options.doubtful || !self.is_random(),
            (_, Start::RunnerUp) => {
                self.leader.as_ref().is_none_or(|leader| verdict.off <= leader.verdict.off.saturating_add(self.few()))
            }
            _ => true,
        };
        let differs = |known: &Verdict| known.ratio != trial.ratio || known.welded != verdict.welded;
        let is_better = is_usable
            && match &self.leader {
                Some(leader) if differs(&leader.verdict) => self.is_better(&verdict, &leader.verdict),
                Some(leader) => verdict.score < leader.verdict.score + if start == self.next() { SLACK } else { 0.0 },
                None => true,
            };
        if is_better {
            self.lead(other);
        } else if !(verdict.layered || verdict.welded)
            && self.runner_up.as_ref().is_none_or(|known| verdict.score < known.verdict.score)
        {
            self.runner_up = Some(other);
        }
        Ok(verdict)
    }

    /// Makes the candidate that was reported last the best so far.
    fn lead(&mut self, other: Leader<D>) {
        self.report.chosen = self.report.candidates.len() - 1;
        self.leader = Some(other);
    }

    /// Reports a candidate, with what the referee and its distances say of it.
    fn assess(
        &mut self,
        (f, iterations): (Spline<D>, usize),
        trial: Trial,
        start: Start,
    ) -> Result<Leader<D>, GefmError> {
        let (judgement, winding) = self.referee.judge(&f)?;
        let (Trial { order, halvings, unknowns, ratio }, score) = (trial, judgement.score);
        let noise = (score >= self.options.content).then(|| noise_deviation(&f, self.points) / self.options.spacing);
        let seen = noise.unwrap_or(0.0);
        let distances = self.distances(&f);
        let off = self.patches.off(&distances, seen * self.options.spacing).len();
        let own_noise = seen * self.patches.own_share(&distances).sqrt();
        let layers = layers(&distances, seen * self.options.spacing, self.options.spacing);
        debug!(order, halvings, unknowns, ratio, ?start, iterations, score, noise, own_noise, off, layers, "candidate");
        let (beyond_noise, layered) = (judgement.beyond_noise(seen), layers.is_some_and(|layers| layers > LAYERED));
        let wide_cells = halvings == self.options.first;
        let welded = order == 2 && seen > WELDED && self.shows_no_noise(ratio);
        let verdict = Verdict { score, beyond_noise, ratio, noise: seen, own_noise, wide_cells, off, layered, welded };
        self.report.candidates.push(Candidate {
            order,
            halvings,
            unknowns,
            ratio,
            start,
            iterations,
            noise,
            off,
            judgement,
        });
        let began = start == Start::Leader && self.leader.as_ref().is_some_and(|leader| leader.third_order);
        Ok(Leader { f, verdict, winding, distances, third_order: order == 3 || began })
    }

    /// Whether a length below `ratio` saw no noise on the first lattice, whose cells cannot hide any.
    fn shows_no_noise(&self, ratio: f64) -> bool {
        let on_wide_cells =
            |known: &&Candidate| known.order == 2 && known.halvings == self.options.first && known.ratio < ratio;
        let mut noises = self.report.candidates.iter().filter(on_wide_cells).filter_map(|known| known.noise);
        noises.any(|noise| noise < LEAST_NOISE)
    }

    /// So many more points may lie off one candidate than off another: in space fewer than a patch, in the plane any, for there they are those
    /// of tips and bays.
    fn few(&self) -> usize {
        if D == 2 { usize::MAX } else { self.patches.least() }
    }

    /// Whether a candidate with another length is to be preferred.
    fn is_better(&self, found: &Verdict, known: &Verdict) -> bool {
        let (few, doubtful) = (self.few(), self.options.doubtful);
        if found.ratio > known.ratio {
            known.yields_to(found, doubtful, few)
        } else {
            !found.yields_to(known, doubtful, few)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanczos::dot;

    pub(super) fn knots(half: f64, cells: usize) -> [KnotVector; 2] {
        let knots = KnotVector::uniform(3, -half, 2.0 * half / cells as f64, cells).unwrap();
        [knots.clone(), knots]
    }

    /// Random numbers from 0 to 1: a linear congruence.
    fn congruence(mut state: u64) -> impl FnMut() -> f64 {
        move || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    #[test]
    fn a_wall_thinner_than_a_cell_needs_the_short_length() {
        // A bar 0.9 × 0.03 on cells of 0.075, points 0.01 apart: ℓ above half the wall welds its sides.
        let mut points: Vec<[f64; 2]> = Vec::new();
        points.extend((0..90).map(|i| [-0.445 + 0.01 * f64::from(i), -0.015]));
        points.extend((0..90).map(|i| [-0.445 + 0.01 * f64::from(i), 0.015]));
        points.extend([[-0.45, -0.005], [-0.45, 0.005], [0.45, -0.005], [0.45, 0.005]]);
        let options =
            LadderOptions { ratios: vec![0.4, 3.2], likeliest: 3.2, last: 2, ..LadderOptions::new(0.01, 100.0) };
        let ones = vec![1.0; points.len()];
        let (f, _, report) = climb(&points, &ones, &knots(0.6, 8), &options).unwrap();
        let right = points[..180].iter().filter(|p| f.value_and_gradient(p).1[1] * p[1] > 0.0).count();
        assert_eq!(right, 180, "{report:?}");
        let choice = report.choice().unwrap();
        assert_eq!(choice.ratio, 0.4);
        let welded = &report.candidates[0];
        assert_eq!(welded.ratio, 3.2);
        assert!(welded.judgement.score > 2.0 * choice.judgement.score, "{report:?}");
    }

    #[test]
    fn lengths_that_weld_a_wall_do_not_show_the_way() {
        // A box with one side open, of walls as thick as their points are apart: outside, rims and inside counterclockwise.
        let (spacing, half) = (0.02, 0.4);
        let (mut points, mut normals): (Vec<[f64; 2]>, Vec<[f64; 2]>) = (vec![], vec![]);
        let mut along = |a: [f64; 2], b: [f64; 2]| {
            let ab = [b[0] - a[0], b[1] - a[1]];
            let length = ab[0].hypot(ab[1]);
            let count = (length / spacing).round();
            let at = |i: u32| std::array::from_fn(|axis| a[axis] + (f64::from(i) + 0.5) / count * ab[axis]);
            points.extend((0..count as u32).map(at));
            normals.extend((0..count as u32).map(|_| [ab[1] / length, -ab[0] / length]));
        };
        let inner = half - spacing;
        let corners = [[-half, half], [-half, -half], [half, -half], [half, half]];
        let inside = [[inner, half], [inner, -inner], [-inner, -inner], [-inner, half]];
        let around: Vec<[f64; 2]> = corners.into_iter().chain(inside).collect();
        (0..8).for_each(|i| along(around[i], around[(i + 1) % 8]));
        let options = LadderOptions { last: 2, ..LadderOptions::new(spacing, 1.0 / spacing) };
        let (f, _, report) = climb(&points, &vec![1.0; points.len()], &knots(0.6, 8), &options).unwrap();
        let scores: Vec<_> = report.candidates.iter().map(|found| (found.ratio, found.judgement.score)).collect();
        assert!(scores[1].1 < scores[0].1 && scores[1].1 < RANDOM, "a longer one that is better: {scores:?}");
        assert_eq!(report.choice().unwrap().ratio, 0.2, "{scores:?}");
        let along_normal = |(p, n): (&[f64; 2], &[f64; 2])| {
            let (_, gradient) = f.value_and_gradient(p);
            gradient[0] * n[0] + gradient[1] * n[1]
        };
        let right = points.iter().zip(&normals).filter(|both| along_normal(*both) > 0.0).count();
        assert_eq!(right, points.len());
    }

    /// Of a length of six spacings, with three of which the sides are about random. With less noise it is not tried.
    #[test]
    fn noise_of_many_spacings_asks_for_a_long_length() {
        // A curve with three lobes and a circumference of 2.8; what the sixth neighbour says of the spacing grows with the root of the noise.
        for (noise, spacing, is_tried) in [(0.035, 0.0086, true), (0.01, 0.0046, false)] {
            let mut uniform = congruence(3);
            let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let at = |i: u32| (f64::from(i) * 0.618_033_988_75).fract() * std::f64::consts::TAU;
            let radius = |angle: f64| 0.35 * (1.0 + 0.3 * (3.0 * angle).cos());
            let mut noisy = |x: f64| x + noise * normal();
            let points: Vec<[f64; 2]> = (0..1000)
                .map(at)
                .map(|angle| [noisy(radius(angle) * angle.cos()), noisy(radius(angle) * angle.sin())])
                .collect();
            let options = LadderOptions { last: 3, ..LadderOptions::new(spacing, 1.0 / spacing) };
            let (_, _, report) = climb(&points, &[1.0; 1000], &knots(0.6, 24), &options).unwrap();
            let tried: Vec<f64> = report.candidates.iter().map(|found| found.ratio).collect();
            assert_eq!(tried.contains(&6.4), is_tried, "{noise}: {tried:?}");
            assert!(report.choice().unwrap().judgement.score < RANDOM, "{report:?}");
        }
    }

    #[test]
    fn sides_that_are_random_do_not_show_the_way() {
        // A plate 1 × 0.7 × 0.02, less than a spacing thick, with its rim.
        let mut uniform = congruence(5);
        let wall = |i: usize| if i.is_multiple_of(2) { 0.01 } else { -0.01 };
        let mut points: Vec<[f64; 3]> =
            (0..2380).map(|i| [uniform() - 0.5, 0.7 * (uniform() - 0.5), wall(i)]).collect();
        let rim = |t: f64, z: f64| match 3.4 * t {
            t if t < 1.0 => [t - 0.5, -0.35, z],
            t if t < 2.0 => [t - 1.5, 0.35, z],
            t if t < 2.7 => [-0.5, t - 2.35, z],
            t => [0.5, t - 3.05, z],
        };
        points.extend((0..119).map(|_| rim(uniform(), 0.02 * uniform() - 0.01)));
        let knots = [6, 5, 2].map(|half| KnotVector::uniform(3, -0.125 * f64::from(half), 0.125, 2 * half as usize));
        let knots = knots.map(Result::unwrap);
        let spacing = (1.4f64 / 2500.0).sqrt();
        let options = LadderOptions { last: 1, repulsion: false, ..LadderOptions::new(spacing, spacing.powi(-2)) };
        let (f, _, report) = climb(&points, &[1.0; 2499], &knots, &options).unwrap();
        let scores: Vec<_> = report.candidates.iter().map(|found| (found.ratio, found.judgement.score)).collect();
        assert!(scores[0].1 > RANDOM && scores[1].1 < scores[0].1, "a longer one that is better: {scores:?}");
        assert_eq!(report.choice().unwrap().ratio, 0.2, "{scores:?}");
        let right = points[..2380].iter().filter(|p| f.value_and_gradient(p).1[2] * p[2] > 0.0).count();
        assert!(right >= 2370, "{right}");
    }

    /// Up to two halvings, from the eigenvector alone: for tests of what random sides lead to, which repulsion tells.
    fn without_repulsion(spacing: f64) -> LadderOptions<3> {
        LadderOptions { last: 2, repulsion: false, ..LadderOptions::new(spacing, spacing.powi(-2)) }
    }

    /// The share of the points whose side is right, by their normals, and the ladder's report.
    fn climbed(
        points: &[[f64; 3]],
        normals: &[[f64; 3]],
        knots: &[KnotVector; 3],
        options: &LadderOptions<3>,
    ) -> (f64, LadderReport) {
        let (f, _, report) = climb(points, &vec![1.0; points.len()], knots, options).unwrap();
        let is_right = |(p, n): &(&[f64; 3], &[f64; 3])| dot(&f.value_and_gradient(p).1, *n) > 0.0;
        let right = points.iter().zip(normals).filter(is_right).count();
        (right as f64 / points.len() as f64, report)
    }

    /// A random direction, any as likely as any other.
    fn direction(random: &mut impl FnMut() -> f64) -> [f64; 3] {
        let (z, angle) = (2.0 * random() - 1.0, std::f64::consts::TAU * random());
        let ring = (1.0 - z * z).sqrt();
        [ring * angle.cos(), ring * angle.sin(), z]
    }

    /// Of points of concentric spheres, by radius, direction and whether the outside is outward, the share whose side is right, and the ladder's report.
    fn of_spheres(points: &[(f64, [f64; 3], bool)], spacing: f64) -> (f64, LadderReport) {
        let at = |&(radius, direction, outward): &(f64, [f64; 3], bool)| {
            (direction.map(|x| radius * x), direction.map(|x| if outward { x } else { -x }))
        };
        let (points, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) = points.iter().map(at).unzip();
        let knots = [0; 3].map(|_| KnotVector::uniform(3, -1.25, 0.25, 10).unwrap());
        climbed(&points, &normals, &knots, &without_repulsion(spacing))
    }

    /// Random points of a sphere and of another one inside, a spacing away.
    fn shell() -> (f64, LadderReport) {
        let (count, mut random) = (6000_usize, congruence(1));
        let spacing = (7.6 * std::f64::consts::PI / count as f64).sqrt();
        let radius = |i: usize| if i.is_multiple_of(2) { 1.0 } else { 1.0 - spacing };
        let points: Vec<_> = (0..count).map(|i| (radius(i), direction(&mut random), i.is_multiple_of(2))).collect();
        of_spheres(&points, spacing)
    }

    #[test]
    fn walls_that_a_shorter_length_has_parted_are_not_welded_for_their_score() {
        // Two shells, one in the other, each of them 1.2 spacings thick.
        let (count, spacing, mut random) = (1500, 0.148, congruence(1));
        let radii = [1.0, 0.822, 0.75, 0.572];
        let total: f64 = radii.iter().map(|r| r * r).sum();
        let mut sphere = || {
            let mut rest = total * random();
            let found = radii.iter().position(|r| {
                rest -= r * r;
                rest < 0.0
            });
            let sphere = found.unwrap_or(0);
            (radii[sphere], direction(&mut random), sphere.is_multiple_of(2))
        };
        let points: Vec<_> = (0..count).map(|_| sphere()).collect();
        let (_, report) = of_spheres(&points, spacing);
        let best = report.candidates.iter().min_by(|a, b| a.judgement.score.total_cmp(&b.judgement.score)).unwrap();
        assert!(best.noise.unwrap() > 1.0, "the best score has welded them: {report:?}");
        assert!(report.choice().unwrap().noise.unwrap() < LEAST_NOISE, "{report:?}");
    }

    #[test]
    fn a_short_length_goes_on_from_the_sides_of_a_longer_one() {
        // A flat ellipsoid; of the leader's normals those at one end are the wrong way round.
        let (count, mut random) = (1500, congruence(1));
        let spacing = (6.6 / count as f64).sqrt();
        let (points, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) = (0..count)
            .map(|_| direction(&mut random))
            .map(|d| ([d[0], d[1], 0.15 * d[2]], [0.15 * d[0], 0.15 * d[1], d[2]]))
            .unzip();
        let knots = [0; 3].map(|_| KnotVector::uniform(3, -1.25, 0.25, 10).unwrap());
        let ones = vec![1.0; count];
        // Wrong beyond an `x`: the candidates' starts, and how many sides are wrong in the end.
        let found = |x: f64, trusted: bool| {
            let turned: Vec<[f64; 3]> =
                points.iter().zip(&normals).map(|(p, n)| if p[0] > x { n.map(|x| -x) } else { *n }).collect();
            let known = if trusted { KnownNormals::Trust(turned.clone()) } else { KnownNormals::None };
            let options = LadderOptions { normals: known, ..LadderOptions::new(spacing, spacing.powi(-2)) };
            let mut ladder = Ladder::new((&points, &ones), &knots, &options).unwrap();
            let mut rung = Rung::new((&points, &ones), &knots, 0, 0.4, &normals, &options).unwrap();
            ladder.tried(rung.oriented(&turned, true), Trial::second_order(&rung), Start::Normals).unwrap();
            rung.set_ratio(0.8).unwrap();
            let longer =
                ladder.tried(rung.oriented(&normals, false), Trial::second_order(&rung), Start::Normals).unwrap();
            assert!(longer.off > 400 && ladder.report.chosen == 0, "{:?}", ladder.report);
            ladder.continue_runner_up(&mut rung).unwrap();
            let starts: Vec<Start> = ladder.report.candidates.iter().map(|candidate| candidate.start).collect();
            let f = ladder.leader.unwrap().f;
            let is_wrong = |(p, n): &(&[f64; 3], &[f64; 3])| dot(&f.value_and_gradient(p).1, *n) < 0.0;
            (starts, points.iter().zip(&normals).filter(is_wrong).count())
        };
        assert_eq!(found(0.9, false), (vec![Start::Normals, Start::Normals, Start::RunnerUp], 0));
        let (starts, wrong) = found(0.93, false);
        assert!(starts.len() == 2 && wrong > 0, "hardly doubtful: {starts:?}, {wrong}");
        let (starts, wrong) = found(0.9, true);
        assert!(starts.len() == 2 && wrong > 0, "trusted: {starts:?}, {wrong}");
    }

    #[test]
    fn pieces_between_the_gaps_of_random_points_are_turned_round() {
        let (count, mut random) = (2000, congruence(1));
        let radius = |t: f64| 0.4 * (1.0 + 0.1 * (9.0 * t).cos() + 0.02 * (60.0 * t).cos());
        let points: Vec<[f64; 2]> = (0..count)
            .map(|_| {
                let t = std::f64::consts::TAU * random();
                <[f64; 2]>::from(t.sin_cos()).map(|x| radius(t) * x)
            })
            .collect();
        let spacing = 3.5 / f64::from(count);
        let options = LadderOptions { last: 1, ..LadderOptions::new(spacing, 1.0 / spacing) };
        let (f, _, report) = climb(&points, &vec![1.0; points.len()], &knots(0.6, 48), &options).unwrap();
        assert!(points.iter().all(|p| dot(&f.value_and_gradient(p).1, p) > 0.0), "{report:?}");
        assert_eq!(report.choice().unwrap().start, Start::Turned);
        let mut from_scratch = report.candidates.iter().filter(|candidate| candidate.start == Start::Eigenvector);
        assert!(from_scratch.all(|candidate| candidate.judgement.score > 0.3), "{report:?}");
    }

    #[test]
    fn walls_thinner_than_the_cells_ask_for_finer_ones() {
        let (right, report) = shell();
        assert_eq!(right, 1.0);
        let coarse = report.candidates.iter().rev().find(|candidate| candidate.halvings == 1).unwrap();
        assert_eq!((coarse.off, report.choice().unwrap().halvings), (0, 2), "{report:?}");
    }

    /// Random points of four blades, 1.6 spacings thick and 2.5 apart, on a base, the share of them whose side is right with these options, and
    /// the ladder's report.
    fn comb(options: impl Fn(f64) -> LadderOptions<3>) -> (f64, LadderReport) {
        let (count, mut random) = (3000, congruence(1));
        // Both sides of all blades, 1 × 1 each, are nearly all of the area.
        let spacing = (8.0 / count as f64).sqrt();
        let (wall, pitch) = (1.6 * spacing, 4.1 * spacing);
        let half = 0.5 * (3.0 * pitch + wall);
        let blade = |k: usize| [pitch * k as f64 - half, pitch * k as f64 - half + wall];
        let mut boxes = vec![[[-half, -0.5, -0.58], [half, 0.5, -0.5]]];
        boxes.extend((0..4).map(blade).map(|[from, to]| [[from, -0.5, -0.5], [to, 0.5, 0.5]]));
        let side = |[low, high]: &[[f64; 3]; 2], axis: usize| high[axis] - low[axis];
        let area = |b: usize, face: usize| -> f64 {
            (0..3).filter(|axis| *axis != face / 2).map(|axis| side(&boxes[b], axis)).product()
        };
        let faces: Vec<(usize, usize)> = (0..5).flat_map(|b| (0..6).map(move |face| (b, face))).collect();
        let total: f64 = faces.iter().map(|(b, face)| area(*b, *face)).sum();
        let (mut points, mut normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) = (vec![], vec![]);
        while points.len() < count {
            let mut rest = total * random();
            let chosen = faces.iter().find(|(b, face)| {
                rest -= area(*b, *face);
                rest < 0.0
            });
            let Some(&(b, face)) = chosen else { continue };
            let mut p: [f64; 3] = std::array::from_fn(|axis| boxes[b][0][axis] + random() * side(&boxes[b], axis));
            p[face / 2] = boxes[b][face % 2][face / 2];
            let holds = |other: &[[f64; 3]; 2]| (0..3).all(|axis| (other[0][axis]..=other[1][axis]).contains(&p[axis]));
            if boxes.iter().enumerate().all(|(k, other)| k == b || !holds(other)) {
                points.push(p);
                normals.push(std::array::from_fn(|axis| match face {
                    face if face / 2 != axis => 0.0,
                    face => (face % 2) as f64 * 2.0 - 1.0,
                }));
            }
        }
        let knots = [half, 0.5, 0.58].map(|half| {
            let cells = 2 * (half / 0.3 + 1.5).ceil() as usize;
            KnotVector::uniform(3, -0.15 * cells as f64, 0.3, cells).unwrap()
        });
        climbed(&points, &normals, &knots, &options(spacing))
    }

    #[test]
    fn what_leaves_points_behind_leads_to_shorter_lengths() {
        let (right, report) = comb(without_repulsion);
        let scores: Vec<_> =
            report.candidates.iter().map(|c| (c.halvings, c.ratio, c.judgement.score, c.off)).collect();
        // Only a body around all blades is better than random sides on wide cells, and so good that the referee is content.
        let body = report.candidates.iter().rfind(|c| c.halvings == 1).unwrap();
        assert!(body.ratio == 3.2 && body.judgement.score < 0.4 && body.off > 1000, "{scores:?}");
        assert_eq!((report.choice().unwrap().ratio, report.choice().unwrap().off), (0.4, 0), "{scores:?}");
        assert!(right > 0.99, "{right} {scores:?}");
    }

    #[test]
    fn repulsion_tells_the_sides_of_blades() {
        let with_repulsion = |spacing| LadderOptions { repulsion: true, ..without_repulsion(spacing) };
        let (right, report) = comb(with_repulsion);
        assert!(right > 0.95, "{right} {report:?}");
        let [first, second, others @ ..] = &report.candidates[..] else { panic!("{report:?}") };
        assert_eq!([first.start, second.start], [Start::Eigenvector, Start::Repulsion]);
        assert_eq!(first.ratio, second.ratio);
        assert!(first.judgement.score > RANDOM && second.judgement.score < 0.25, "{report:?}");
        // What was better begins the search for other lengths, too, and what began with it climbs.
        assert!(others.iter().all(|other| other.start != Start::Eigenvector), "{report:?}");
        assert_eq!((report.choice().unwrap().halvings, report.choice().unwrap().start), (2, Start::Leader));
    }

    #[test]
    fn an_open_curve_that_is_found_again_needs_no_other_length() {
        let spacing = 0.005;
        let wave = |x: f64| [x, 0.1 * (9.0 * x).sin()];
        let points: Vec<[f64; 2]> = (0..200).map(|i| wave(-0.5 + spacing * f64::from(i))).collect();
        let [found, every] = [true, false].map(|open| {
            let options = LadderOptions { open, last: 2, ..LadderOptions::new(spacing, 1.0 / spacing) };
            climb(&points, &[1.0; 200], &knots(0.6, 8), &options).unwrap()
        });
        let finest = |report: &LadderReport| -> Vec<Start> {
            report.candidates.iter().filter(|c| c.halvings == 2).map(|c| c.start).collect()
        };
        assert_eq!(finest(&found.2), [Start::Leader, Start::Eigenvector], "{:?}", found.2);
        assert!(found.2.candidates.iter().all(|c| c.judgement.score > RANDOM), "which says nothing: {:?}", found.2);
        assert!(finest(&every.2).len() > 2, "{:?}", every.2);
        for (f, ..) in [&found, &every] {
            let up = points.iter().filter(|p| f.value_and_gradient(p).1[1] > 0.0).count();
            assert!(up == 0 || up == 200, "all on one side: {up}");
        }
    }

    #[test]
    fn finer_lattices_are_for_what_wider_cells_did_not_get() {
        let climbed = |points: &[[f64; 2]], spacing: f64, detail: f64| {
            let options = LadderOptions { last: 3, detail, ..LadderOptions::new(spacing, 1.0 / spacing) };
            let (_, _, report) = climb(points, &vec![1.0; points.len()], &knots(0.6, 8), &options).unwrap();
            report.candidates.iter().map(|candidate| candidate.halvings).max()
        };
        let spacing = 0.4 * std::f64::consts::TAU / 400.0;
        let circle = |i: i32| (f64::from(i) / 400.0 * std::f64::consts::TAU).sin_cos();
        let mut points: Vec<[f64; 2]> = (0..400).map(circle).map(|(s, c)| [0.4 * c, 0.4 * s]).collect();
        assert_eq!(climbed(&points, spacing, spacing), Some(1));
        assert_eq!(climbed(&points, spacing, 1e-6 * spacing), Some(3), "a part of many more");
        // A groove three spacings wide and twelve deep, on cells of twelve spacings.
        points.retain(|p| p[0] < 0.0 || p[1].abs() > 1.5 * spacing);
        let side = |y: f64| (0..12).map(move |i| [0.4 - f64::from(i) * spacing, y * spacing]);
        points.extend(
            side(-1.5).chain(side(1.5)).chain((0..2).map(|i| [0.4 - 12.0 * spacing, (f64::from(i) - 0.5) * spacing])),
        );
        assert_eq!(climbed(&points, spacing, spacing), Some(3));
    }

    #[test]
    fn finer_lattices_are_not_for_what_is_hopeless() {
        // Points all over a square. (Of a length of six spacings winding numbers think better.)
        let points: Vec<[f64; 2]> = (0..2000)
            .map(|i| [0.754_877_666, 0.569_840_296].map(|step| 0.8 * (f64::from(i) * step).fract() - 0.4))
            .collect();
        let lattices = |hopeless: f64| {
            let options = LadderOptions { hopeless, ..LadderOptions::new(0.01, 100.0).up_to(0.032) };
            let (_, _, report) = climb(&points, &vec![1.0; points.len()], &knots(0.6, 8), &options).unwrap();
            report.candidates.iter().map(|candidate| candidate.halvings).max()
        };
        assert_eq!((lattices(0.3), lattices(f64::INFINITY)), (Some(1), Some(3)));
    }

    #[test]
    fn among_random_sides_no_length_is_passed_over() {
        // Points all over a cube.
        let points: Vec<[f64; 3]> = (0..1500)
            .map(|i| {
                [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|step| 0.8 * (f64::from(i) * step).fract() - 0.4)
            })
            .collect();
        let knots = [0; 3].map(|_| KnotVector::uniform(3, -0.6, 0.15, 8).unwrap());
        let scores = |repulsion: bool| -> Vec<(f64, f64)> {
            let options = LadderOptions { last: 1, repulsion, ..LadderOptions::new(0.06, 280.0) };
            let (_, _, report) = climb(&points, &[1.0; 1500], &knots, &options).unwrap();
            report.candidates.iter().map(|found| (found.ratio, found.judgement.score)).collect()
        };
        // With repulsion the sides agree, and only their noise tells that the points bound nothing.
        let [(_, eigenvector), (_, repulsion), ..] = scores(true)[..] else { panic!("no second start") };
        assert!(eigenvector > RANDOM && repulsion < 0.25, "{eigenvector} {repulsion}");
        let scores = scores(false);
        assert!(scores[..4].iter().all(|(_, score)| *score > RANDOM), "{scores:?}");
        assert_eq!(scores.iter().map(|(ratio, _)| *ratio).collect::<Vec<_>>(), [0.4, 0.8, 1.6, 0.2, 3.2]);
    }

    #[test]
    fn a_cancelled_ladder_is_not_climbed() {
        let points = [[0.3, 0.0], [0.0, 0.3], [-0.3, 0.0], [0.0, -0.3]];
        let options = LadderOptions::new(0.4, 2.5);
        options.cancel.cancel();
        let result = climb(&points, &[1.0; 4], &knots(0.6, 8), &options);
        assert!(matches!(result, Err(GefmError::Cancelled(_))));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let points = [[0.3, 0.0], [0.0, 0.3], [-0.3, 0.0], [0.0, -0.3]];
        let climb = |points: &[[f64; 2]], areas: &[f64], spacing, density| {
            climb(points, areas, &knots(0.6, 8), &LadderOptions::new(spacing, density)).unwrap_err()
        };
        assert!(matches!(climb(&[], &[], 0.4, 2.5), GefmError::NoPoints));
        assert!(matches!(climb(&points, &[1.0; 3], 0.4, 2.5), GefmError::Areas { found: 3, needed: 4 }));
        for (spacing, density) in [(0.0, 2.5), (f64::NAN, 2.5), (0.4, -1.0), (0.4, f64::INFINITY)] {
            assert!(matches!(climb(&points, &[1.0; 4], spacing, density), GefmError::Smoothing { .. }));
        }
    }

    #[test]
    fn lengths_too_short_for_the_noise_do_not_end_the_search() {
        // A circle of 300 points, each displaced by up to three spacings along each axis (a linear congruence).
        let mut state = 1u64;
        let mut noise = || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let spacing = 0.4 * std::f64::consts::TAU / 300.0;
        let points: Vec<[f64; 2]> = (0..300)
            .map(|i| (f64::from(i) / 300.0 * std::f64::consts::TAU).sin_cos())
            .map(|(s, c)| [0.38 * c + 6.0 * spacing * noise(), 0.38 * s + 6.0 * spacing * noise()])
            .collect();
        let options = LadderOptions { last: 1, ..LadderOptions::new(spacing, 1.0 / spacing) };
        let (f, _, report) = climb(&points, &[1.0; 300], &knots(0.6, 12), &options).unwrap();
        let scores: Vec<f64> = report.candidates.iter().map(|candidate| candidate.judgement.score).collect();
        assert!(scores[1] > scores[0] && scores[0] > RANDOM, "both too short, the longer one worse: {scores:?}");
        let right =
            points.iter().filter(|p| f.value_and_gradient(p).1.iter().zip(*p).map(|(g, x)| g * x).sum::<f64>() > 0.0);
        assert_eq!(right.count(), 300, "{report:?}");
    }

    #[test]
    fn known_normals_are_a_start_or_the_law() {
        // A circle.
        let points: Vec<[f64; 2]> = (0..200)
            .map(|i| (f64::from(i) / 200.0 * std::f64::consts::TAU).sin_cos())
            .map(|(s, c)| [0.4 * c, 0.4 * s])
            .collect();
        let spacing = 0.4 * std::f64::consts::TAU / 200.0;
        let good: Vec<[f64; 2]> = points.iter().map(|p| p.map(|x| 7.0 * x)).collect();
        let turned = |is_wrong: fn(usize) -> bool| -> Vec<[f64; 2]> {
            good.iter().enumerate().map(|(i, n)| if is_wrong(i) { n.map(|x| -x) } else { *n }).collect()
        };
        let found = |normals| {
            let options = LadderOptions { last: 1, normals, ..LadderOptions::new(spacing, 1.0 / spacing) };
            let (f, _, report) = climb(&points, &[1.0; 200], &knots(0.6, 12), &options).unwrap();
            let right = points
                .iter()
                .filter(|p| f.value_and_gradient(p).1.iter().zip(*p).map(|(g, x)| g * x).sum::<f64>() > 0.0);
            (right.count(), report.candidates.iter().map(|candidate| candidate.start).collect::<Vec<_>>())
        };
        assert_eq!(found(KnownNormals::Hint(good.clone())), (200, vec![Start::Normals]));
        assert_eq!(found(KnownNormals::Trust(good.clone())), (200, vec![Start::Normals]));
        // A common sign is no matter.
        assert_eq!(found(KnownNormals::Trust(turned(|_| true))), (200, vec![Start::Normals]));
        // Wrong ones are put right, or given up.
        assert_eq!(found(KnownNormals::Hint(turned(|i| i % 5 == 0))).0, 200);
        let (right, starts) = found(KnownNormals::Hint(turned(|i| i < 100)));
        assert!(right == 200 && starts.contains(&Start::Eigenvector), "{starts:?}");
        // Where they are the law a wrong half is half of the points.
        let (right, starts) = found(KnownNormals::Trust(turned(|i| i < 100)));
        assert!(
            (90..=110).contains(&right) && starts.iter().all(|start| *start == Start::Normals),
            "{right} {starts:?}"
        );
        let missing =
            LadderOptions { normals: KnownNormals::Hint(vec![]), ..LadderOptions::new(spacing, 1.0 / spacing) };
        let result = climb(&points, &[1.0; 200], &knots(0.6, 12), &missing);
        assert!(matches!(result, Err(GefmError::Normals { found: 0, needed: 200 })));
    }
}
