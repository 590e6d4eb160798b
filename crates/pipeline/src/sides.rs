//! The topology stage: f̂, whose sign tells inside from outside, and the points that turn out to lie beside its surface.
//!
//! Strays pull at f̂ like other points. Those that the others do not foretell are taken out and f̂ is found again, from its own normals, as in
//! iteratively reweighted least squares with weights of one and zero, until there are none.

use zeroset_bspline::{Derivatives, Spline};
use zeroset_gefm::{self as gefm, KnownNormals};
use zeroset_watch::CancelToken;

use crate::error::ReconstructError;
use crate::lattice::domain::Domain;
use crate::memory::MemoryReport;
use crate::options::{Normals, Options, Topology};
use crate::points::frame::Frame;
use crate::points::heavy_tails::Noise;
use crate::points::known_normals::Known;
use crate::points::left_out::{self, mark, without};
use crate::points::spacing::{NOISY, Spacing, to_mean_one};
use crate::points::thinning::{Choice, ENOUGH, Few, MORE, thinned};
use crate::report::StageFigures;
use crate::sides::leave_one_out::LeaveOneOut;
use crate::sides::normals::normals;

pub(crate) mod averaging;
pub(crate) mod facing_sheets;
pub(crate) mod leave_one_out;
pub(crate) mod normals;

/// The finest lattice of the topology stage, in halvings of the coarsest.
pub const FINEST_RUNG: u32 = 2;
/// f̂ is found so often at most.
const ROUNDS: usize = 3;
/// No larger share of the points than this, left out, would change it.
const A_FEW: f64 = 0.0005;

/// Where f̂ sees no more noise than so many spacings, the points are a layer, and as many as there are.
pub const SHALLOW: f64 = 0.5;
/// Where it sees more, and its score without what such noise adds is above this, its sides are doubtful: points many times deeper than they
/// are apart look like a body. Of fewer, farther apart, the noise is shallower:
const DOUBTFUL: f64 = 0.25;
/// one of so many each time,
const ONE_OF: usize = 3;
/// but not fewer than these.
const FEWEST: usize = 600;
/// Points farther from the zero set of f̂ than so many spacings of those that it was fitted to, and than so many standard deviations of the
/// noise, lie where these do not tell what the others would;
const ASTRAY: f64 = 0.4;
const ASTRAY_NOISE: f64 = 6.0;
/// if more than this share do, more are heard.
const MANY_ASTRAY: f64 = 0.001;

/// Fairness of third order is tried for no more points than these, in space.
pub const SPARSE: usize = 3000;

/// In the plane, where noise may be many spacings, finer lattices are left to fewer points if the score is above this: walls that are too thin
/// for the lattice never got there.
const HOPELESS: f64 = 0.8;

/// Finer lattices may lower the score by so much.
const WORTH_CLIMBING: f64 = 1.5;

/// Of a smoothing length above this, the longest side of the points' box in the frame, nothing more is left.
const WHOLE: f64 = 1.0;

/// Where noise has heavy tails points are weighted again so often, and f̂ is found again.
const REWEIGHTED: usize = 2;

/// Below this share of its mean the gradient of f̂ has no direction. (Beside strays it is weak, but tells the normal.)
const FLAT: f64 = 0.05;

/// What the stage leaves; frame units.
pub struct Sides<const D: usize> {
    pub f_hat: Spline<D>,
    /// By what winding numbers are divided.
    pub calibration: f64,
    /// The smoothing length of f̂ in spacings.
    pub ratio: f64,
    /// Standard deviation of the points' distances from their surface.
    pub noise: f64,
    /// The noise that f̂ sees, in spacings of the points that it was fitted to.
    pub depth: f64,
    /// The referee's score of f̂, without what such noise adds.
    pub score: f64,
    /// Whether f̂ has unit normals of least energy that were found from two starts: then it knows more than winding numbers do.
    pub agreed: bool,
    /// Whether its points are means of others, with deep noise.
    pub of_means: bool,
    /// Which of the points are strays.
    pub strays: Vec<bool>,
    /// The others,
    pub points: Vec<[f64; D]>,
    /// and how far apart they are.
    pub spacing: Spacing,
    /// Those of them that f̂ was fitted to, and how far apart these are, if not all.
    pub few: Option<Few<D>>,
}

impl<const D: usize> Sides<D> {
    /// The points that f̂ was fitted to, and how far apart they are.
    pub fn few(&self) -> (&[[f64; D]], &Spacing) {
        self.few.as_ref().map_or((&self.points, &self.spacing), |(few, spacing)| (few, spacing))
    }
}

/// One f̂.
struct Fit<const D: usize> {
    f_hat: Spline<D>,
    calibration: f64,
    ratio: f64,
    /// The noise that it sees, in spacings of the points that it was fitted to.
    depth: f64,
    /// The referee's, without what such noise adds.
    score: f64,
    figures: StageFigures,
}

/// What the search depends on besides the points.
pub struct SideSearch<'a, const D: usize> {
    pub domain: &'a Domain<D>,
    /// From the coarsest lattice to that of the initial shape.
    pub halvings: u32,
    pub options: &'a Options,
    pub frame: &'a Frame<D>,
    /// Normals that come with the points.
    pub known: Option<Known<'a, D>>,
    /// Whether the points are means of others with deep noise: they may be few, but are not sparse.
    pub are_means: bool,
    /// What may be used: neither third order nor more points are worth more than that.
    pub memory: &'a MemoryReport,
    /// A score that is to be beaten (infinite if there is none): what does not do so at once is not looked at further.
    pub to_beat: f64,
    /// Ends the search early.
    pub cancel: &'a CancelToken,
}

impl<const D: usize> SideSearch<'_, D> {
    /// Finds f̂ for points, of which so many `known` strays have been left out before.
    pub fn run(
        &self,
        mut points: Vec<[f64; D]>,
        mut spacing: Spacing,
        known: usize,
    ) -> Result<(Sides<D>, StageFigures), ReconstructError> {
        let all = points.len();
        let mut strays = vec![false; all];
        let (mut before, mut round, mut choice) = (None, 1, Choice::Even(ENOUGH));
        loop {
            let (mut fit, mut few) = self.fit(&points, &spacing, before.as_ref(), &mut choice)?;
            let mut chosen = choice;
            if let Some(found) = self.with_more(&points, &spacing, &fit, (&few, choice))? {
                ((fit, few), chosen) = (found, Choice::Even(MORE));
            }
            let Fit { f_hat, calibration, ratio, depth, score, figures } = fit;
            let agreed = matches!(&figures, StageFigures::Ladder(report) if report.has_agreed());
            let noise = gefm::noise_deviation(&f_hat, &points);
            let left_out = known + all - points.len();
            let found = LeaveOneOut::new(&points, &spacing).strays(&normals(&f_hat, &points, FLAT), noise, left_out);
            let (count, enough) = (found.iter().filter(|stray| **stray).count() as f64, points.len() as f64);
            // So many are a part of the shape that f̂ has not got.
            let too_many = count > left_out::MOST * enough;
            if !too_many {
                mark(&mut strays, &found);
                (points, spacing) = without(&points, &found, spacing);
            }
            if score >= self.to_beat || too_many || round == ROUNDS || count <= A_FEW * enough {
                let few = if count > 0.0 && !too_many { thinned(&points, &spacing, chosen) } else { few };
                return Ok((
                    Sides {
                        f_hat,
                        calibration,
                        ratio,
                        noise,
                        depth,
                        score,
                        agreed,
                        of_means: self.are_means,
                        strays,
                        points,
                        spacing,
                        few,
                    },
                    figures,
                ));
            }
            (before, round) = (Some(f_hat), round + 1);
        }
    }

    /// f̂ for those of the points that are chosen so, and these; where noise is too deep for them others are chosen. `before` is an earlier f̂.
    fn fit(
        &self,
        points: &[[f64; D]],
        spacing: &Spacing,
        before: Option<&Spline<D>>,
        choice: &mut Choice,
    ) -> Result<(Fit<D>, Option<Few<D>>), ReconstructError> {
        let of_all = |few: &Option<Few<D>>| few.as_ref().map_or(points.len(), |(few, _)| few.len());
        let mut few = thinned(points, spacing, *choice);
        let mut found = self.fit_to(points, spacing, &few, before)?;
        // Of an open surface the score says nothing, and what f̂ calls noise may be that it is open.
        while found.depth > SHALLOW && !self.options.open {
            let even = few.is_some() && matches!(choice, Choice::Even(_));
            let fewer = if even { ENOUGH } else { of_all(&few) / ONE_OF };
            if !even && (found.score <= DOUBTFUL || fewer < FEWEST) {
                break;
            }
            let next = thinned(points, spacing, Choice::Random(fewer));
            let other = match self.fit_to(points, spacing, &next, before) {
                Err(error) if !error.is_cancelled() => break,
                other => other?,
            };
            if !even && other.score >= found.score {
                break;
            }
            (found, few, *choice) = (other, next, Choice::Random(fewer));
        }
        Ok((found, few))
    }

    /// f̂ fitted to more of the points than these few, if many of the others lie off it and fewer do then: on the finest lattice, and from its
    /// own normals, whose sides are right but for narrow parts. What is narrow is told by points that are near each other, but coarse
    /// lattices want them far apart, for their smoothing length is not to be far below a cell.
    fn with_more(
        &self,
        points: &[[f64; D]],
        spacing: &Spacing,
        known: &Fit<D>,
        (few, choice): (&Option<Few<D>>, Choice),
    ) -> Result<Option<(Fit<D>, Option<Few<D>>)>, ReconstructError> {
        let worth = known.depth <= SHALLOW && known.score <= DOUBTFUL && matches!(choice, Choice::Even(_));
        let (Some((of_few, apart)), StageFigures::Ladder(climbed), true) = (few, &known.figures, worth) else {
            return Ok(None);
        };
        let limit = apart.typical * ASTRAY.max(ASTRAY_NOISE * known.depth);
        let astray = |f: &Spline<D>| {
            let distances = f.evaluate(points, Derivatives::Gradient).sampson_distances();
            distances.iter().filter(|distance| distance.abs() > limit).count()
        };
        let astray_before = astray(&known.f_hat);
        if astray_before as f64 <= MANY_ASTRAY * points.len() as f64 {
            return Ok(None);
        }
        let more = thinned(points, spacing, Choice::Even(MORE));
        let (heard, apart) = more.as_ref().map_or((points, spacing), |(more, apart)| (more, apart));
        // Of points in lines those between the others are never heard.
        if heard.len() <= of_few.len() || !self.memory.has_room_to_hear(heard.len()) {
            return Ok(None);
        }
        let finest = self.finest();
        let settings = gefm::LadderOptions {
            first: finest,
            last: finest,
            content: f64::INFINITY,
            normals: self.normals(heard, Some(&known.f_hat)),
            cancel: self.cancel.clone(),
            ..self.ladder_options(apart)
        };
        let bottom = self.domain.bottom(self.options.degree)?;
        let depth = gefm::noise_deviation(&known.f_hat, heard) / apart.typical;
        let areas = self.reweighted(heard, apart, &known.f_hat, depth);
        let areas = areas.as_ref().unwrap_or(&apart.areas);
        let Some((f_hat, _, report)) = unless_cancelled(gefm::climb(heard, areas, &bottom, &settings))? else {
            return Ok(None);
        };
        let Some(chosen) = report.choice() else { return Ok(None) };
        if chosen.judgement.score > DOUBTFUL || astray(&f_hat) >= astray_before {
            return Ok(None);
        }
        let (calibration, ratio) = (chosen.judgement.calibration, chosen.ratio);
        let figures = StageFigures::Ladder(climbed.clone().followed_by(report));
        Ok(Some((Fit { f_hat, calibration, ratio, depth: known.depth, score: known.score, figures }, more)))
    }

    /// The last rung, in halvings of the V-cycle's coarsest lattice.
    fn finest(&self) -> u32 {
        1 + self.halvings.min(FINEST_RUNG)
    }

    /// The defaults for points so far apart, and for the smoothing length that is wanted.
    fn ladder_options(&self, spacing: &Spacing) -> gefm::LadderOptions<D> {
        let options = gefm::LadderOptions::new(spacing.typical, spacing.density);
        match self.options.smoothing {
            Some(length) => options.up_to((length * self.frame.scale).min(WHOLE)),
            None => options,
        }
    }

    /// One f̂ for the few, if there are any, or else for all points; `before` is an earlier one.
    fn fit_to(
        &self,
        points: &[[f64; D]],
        spacing: &Spacing,
        few: &Option<Few<D>>,
        before: Option<&Spline<D>>,
    ) -> Result<Fit<D>, ReconstructError> {
        let detail = spacing.typical;
        let (points, spacing) = few.as_ref().map_or((points, spacing), |(few, spacing)| (few, spacing));
        let Self { domain, options, cancel, .. } = *self;
        match options.topology {
            Topology::Continuation => {
                let fewer_follow = D == 2 && !options.open && points.len() > ONE_OF * FEWEST;
                let third_order = D == 3
                    && !options.open
                    && options.degree >= 3
                    && points.len() <= SPARSE
                    && !self.are_means
                    && self.memory.has_room_to_factor::<D>(gefm::MOST_FACTORED, options.degree);
                let settings = gefm::LadderOptions {
                    last: self.finest(),
                    normals: self.normals(points, before),
                    cancel: cancel.clone(),
                    detail,
                    hopeless: if fewer_follow { HOPELESS } else { WORTH_CLIMBING * self.to_beat },
                    open: options.open,
                    third_order: third_order.then(|| gefm::ThirdOrderOptions::new(domain.spacing(self.halvings))),
                    ..self.ladder_options(spacing)
                };
                let (f_hat, depth, report) = self.weighted_climb(points, spacing, &settings, before)?;
                let of_choice = |choice: &gefm::Candidate| {
                    (choice.judgement.calibration, choice.ratio, choice.judgement.beyond_noise(depth))
                };
                let (calibration, ratio, score) = report.choice().map_or((1.0, 0.4, 0.0), of_choice);
                Ok(Fit { f_hat, calibration, ratio, depth, score, figures: StageFigures::Ladder(report) })
            }
            Topology::Paper => {
                // Below the spacing, so that close walls stay apart, but not below what the lattice can resolve.
                let smoothing_length = (0.4 * spacing.typical).max(0.1 * domain.spacing);
                let mut settings =
                    gefm::Options { smoothing_length, density: spacing.density, ..gefm::Options::paper() };
                settings.continuation.cancel = cancel.clone();
                let knots = domain.knots(options.degree, 0)?;
                let (f_hat, report) = gefm::fit(points, &spacing.areas, &knots, &settings)?;
                let figures = StageFigures::Topology(report);
                // Its points are what they are.
                Ok(Fit { f_hat, calibration: 1.0, ratio: 0.4, depth: 0.0, score: 0.0, figures })
            }
        }
    }

    /// The ladder's f̂, the noise that it sees in spacings, and its report; where that noise has heavy tails f̂ is found again from scratch with
    /// less weight for those points. `before` is an earlier f̂, which tells what they weigh at once.
    fn weighted_climb(
        &self,
        points: &[[f64; D]],
        spacing: &Spacing,
        settings: &gefm::LadderOptions<D>,
        before: Option<&Spline<D>>,
    ) -> Result<(Spline<D>, f64, gefm::LadderReport), ReconstructError> {
        let bottom = self.domain.bottom(self.options.degree)?;
        let depth_of = |f: &Spline<D>| gefm::noise_deviation(f, points) / spacing.typical;
        let score = |report: &gefm::LadderReport| report.choice().map(|choice| choice.judgement.score);
        let areas = before.and_then(|f| self.reweighted(points, spacing, f, depth_of(f)));
        let (mut f_hat, _, mut report) =
            gefm::climb(points, areas.as_ref().unwrap_or(&spacing.areas), &bottom, settings)?;
        let mut depth = depth_of(&f_hat);
        for _ in 0..if before.is_none() { REWEIGHTED } else { 0 } {
            let Some(areas) = self.reweighted(points, spacing, &f_hat, depth) else { break };
            let Some((f, _, other)) = unless_cancelled(gefm::climb(points, &areas, &bottom, settings))? else { break };
            if score(&other) >= score(&report) {
                break;
            }
            (depth, f_hat, report) = (depth_of(&f), f, report.followed_by(other));
        }
        Ok((f_hat, depth, report))
    }

    /// What points weigh around this f̂ where some are much noisier than the rest, of mean 1: they pull f̂ off, and make sheets and handles of their
    /// own. `--robust` may leave them more, but no less: it is for a function that follows the points.
    /// `depth` is the noise that it sees, in spacings.
    fn reweighted(&self, points: &[[f64; D]], spacing: &Spacing, f_hat: &Spline<D>, depth: f64) -> Option<Vec<f64>> {
        if self.options.open || depth <= NOISY {
            return None;
        }
        let noise = Noise::around(&f_hat.evaluate(points, Derivatives::Gradient), points);
        let areas = spacing.smoothed_areas(points);
        let least = self.options.loss_length.map_or(0.0, |length| length * self.frame.scale);
        let weights = noise.weights(noise.loss_length(&areas)?.max(least));
        let mut areas: Vec<f64> = areas.iter().zip(weights).map(|(area, weight)| area * weight).collect();
        to_mean_one(&mut areas);
        Some(areas)
    }

    /// What is known of the normals: what came with the points if it is to be trusted, otherwise what an earlier f̂ makes of them.
    fn normals(&self, points: &[[f64; D]], before: Option<&Spline<D>>) -> KnownNormals<D> {
        let given = || self.known.map(|known| known.of(points, self.frame));
        let earlier = || before.map(|f| f.evaluate(points, Derivatives::Gradient).gradients);
        match self.options.normals {
            Normals::Ignore => earlier().map(KnownNormals::Hint),
            Normals::Hint => earlier().or_else(given).map(KnownNormals::Hint),
            Normals::Trust => given().map(KnownNormals::Trust).or_else(|| earlier().map(KnownNormals::Hint)),
        }
        .unwrap_or_default()
    }
}

/// What was found, or nothing if it failed for another reason than being cancelled.
fn unless_cancelled<T>(found: Result<T, gefm::GefmError>) -> Result<Option<T>, ReconstructError> {
    match found {
        Err(cancelled @ gefm::GefmError::Cancelled(_)) => Err(cancelled.into()),
        found => Ok(found.ok()),
    }
}
