//! The road: points → frame → f̂ → distance → φ → initial shape → f*.

use std::time::Instant;

use zeroset_bspline::{Derivatives, HierarchicalSpline, Spline};
use zeroset_lsq_init as lsq_init;
use zeroset_trust_region::normal_deviation;
use zeroset_watch::Watch;

use crate::distance::calibration::{calibrated, distance_figures};
use crate::distance::redistancing::Redistancing;
use crate::error::ReconstructError;
use crate::ground::{Beginning, Ground};
use crate::lattice::cell_widths::Lattices;
use crate::lattice::domain::Domain;
use crate::options::{Options, Topology};
use crate::phi::denoising::denoised;
use crate::phi::{SignStage, Signed, unsigned_distance};
use crate::point::{Point, Reconstruct};
use crate::points::far_off::far_off;
use crate::points::frame::{Frame, finite, not_flat};
use crate::points::heavy_tails::{HeavyTails, Noise};
use crate::points::isolated::isolated;
use crate::points::known_normals::Known;
use crate::points::left_out::{kept, mark, without};
use crate::points::spacing::{NOISY, Spacing};
use crate::refinement::{Outcome, Refinement};
use crate::report::{FrameReport, InputReport, REPORT_VERSION, Report, StageFigures, StageReport};
use crate::topology::simplified::{Simplification, Simplified};
use crate::trust;
use crate::trust::one_sided;
use crate::trust::volume;
use crate::warnings;

/// What a reconstruction leaves: the function, the points that it belongs to, and the report.
#[derive(Debug, Clone)]
pub struct Reconstruction<const D: usize> {
    /// f in the frame: negative inside, and away from the points the distance from its zero set in the median.
    pub spline: HierarchicalSpline<D>,
    /// How the frame and the data are related.
    pub frame: Frame<D>,
    /// The points in the frame, without repetitions and without those that lie many times farther away than the others reach.
    pub points: Vec<[f64; D]>,
    /// Which of them lie on no part of the surface, and were not fitted.
    pub outliers: Vec<bool>,
    /// What was fitted in their place, if their noise is deeper than they are apart: means of them.
    pub means: Option<Vec<[f64; D]>>,
    /// How far apart the fitted ones are.
    pub spacing: Spacing,
    /// Standard deviation of their distances from their surface.
    pub noise: f64,
    /// The box and its lattices.
    pub domain: Domain<D>,
    /// How often the coarse lattice's cells were halved for the final one.
    pub halvings: u32,
    /// f̂, where the points are so noisy that their normals are better taken from it: f* follows detail that their noise
    /// hides, and many points do not lie beside the part of it that they were taken from.
    pub guide: Option<Spline<D>>,
    /// The initial shape, if it was refined.
    pub initial: Option<Spline<D>>,
    /// Whether the zero set is to end where the points do: [`Options::open`].
    pub open: bool,
    /// Everything worth knowing about how it came about.
    pub report: Report,
}

/// The smoothing length from which refinement of an open surface starts is at most so many spacings if its points are not noisy.
const CLEAN_RATIO: f64 = 0.4;

/// Where means were fitted, points farther than so many standard deviations of the noise from the result lie on no part of it.
const BESIDE: f64 = 5.0;

/// Reconstructs a closed curve (`D` = 2) or surface (`D` = 3) from points on it, `N × D` in any unit, as the zero set of
/// a B-spline that is negative inside. With [`Options::open`] the zero set is cut where the points end when it is extracted.
///
/// # Errors
/// Points that have no shape, options out of range, or a stage that could not go on; the message names it.
pub fn reconstruct<const D: usize>(
    points: &[[f64; D]],
    options: &Options,
) -> Result<Reconstruction<D>, ReconstructError>
where
    [f64; D]: Point<D>,
{
    reconstruct_watched(points, options, &Watch::default())
}

/// As [`reconstruct`], for somebody who watches: `watch.progress` is told when a stage begins and ends, by the stage's name in the
/// report, and `watch.cancel` ends the work, within an iteration in the long stages (topology and refinement), otherwise when the
/// stage is done.
///
/// ```
/// use zeroset::{CancelToken, Options, Watch, reconstruct_watched};
/// let cancel = CancelToken::new();
/// cancel.cancel(); // usually from another thread
/// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0], [0.5, 1.0]];
/// let error = reconstruct_watched(&square, &Options::default(), &Watch { cancel, ..Watch::default() }).unwrap_err();
/// assert!(error.is_cancelled());
/// ```
///
/// # Errors
/// As [`reconstruct`], and [`ReconstructError::is_cancelled`] errors.
pub fn reconstruct_watched<const D: usize>(
    points: &[[f64; D]],
    options: &Options,
    watch: &Watch,
) -> Result<Reconstruction<D>, ReconstructError>
where
    [f64; D]: Point<D>,
{
    Reconstruct::reconstruct(points, None, options, watch)
}

/// As [`reconstruct_watched`], for points that have normals, `N × D` of any length, zero where one is not known; what they are
/// used for [`Options::normals`] says.
///
/// # Errors
/// As [`reconstruct_watched`], not one normal per point, or one that is not finite.
pub fn reconstruct_with_normals<const D: usize>(
    points: &[[f64; D]],
    normals: &[[f64; D]],
    options: &Options,
    watch: &Watch,
) -> Result<Reconstruction<D>, ReconstructError>
where
    [f64; D]: Point<D>,
{
    Reconstruct::reconstruct(points, Some(normals), options, watch)
}

/// See [`reconstruct_watched`].
pub(crate) fn road<const D: usize>(
    points: &[[f64; D]],
    normals: Option<&[[f64; D]]>,
    options: &Options,
    watch: &Watch,
) -> Result<Reconstruction<D>, ReconstructError> {
    options.check()?;
    finite(points)?;
    let known = normals.map(|normals| Known::new(points, normals)).transpose()?;
    let far = far_off(points);
    let near = far.as_ref().map(|far| kept(points, far));
    let near = near.as_deref().unwrap_or(points);
    let (frame, distinct) = Frame::of(near)?;
    let spacing = Spacing::of(&distinct);
    let beginning = Beginning {
        points: points.len(),
        distinct: &distinct,
        frame: &frame,
        margin: options.margin_in_frame(frame.scale)?,
        known,
        are_means: false,
        options,
        cancel: &watch.cancel,
    };
    let (mut outliers, heard, spacing) = isolated(&distinct, spacing);
    if heard.len() < distinct.len() {
        // The frame has seen that all of them are not.
        not_flat(&heard)?;
    }
    let ground = beginning.ground(&heard, &spacing)?;
    let mut road = Road { stages: Vec::new(), watch };

    let name = if options.topology == Topology::Paper { "topology" } else { "ladder" };
    let typical = spacing.typical;
    let (ground, sides) = road.stage(name, || beginning.sides(ground, heard, spacing))?;
    let Ground { lattices: Lattices { domain, halvings, .. }, band, memory } = beginning.adapted(ground, &sides)?;
    if !sides.of_means && sides.strays.len() == distinct.len() {
        // All were heard in the end.
        outliers.fill(false);
    }
    // What is left out of means, no point is.
    let mut leave_out = |found: &[bool]| {
        if !sides.of_means {
            mark(&mut outliers, found)
        }
    };
    leave_out(&sides.strays);

    let cell = domain.spacing(halvings);
    let nodes = domain.nodes(halvings);
    // The referee knows closed surfaces only and may take an open one for noisy: its choice of a long smoothing length is then
    // heard only if neighbouring points differ as noisy ones do.
    let misjudged = options.open && sides.noise < NOISY * sides.spacing.typical;
    let smooth = if misjudged { None } else { denoised(&sides.f_hat, &sides.points, sides.spacing.typical) };
    let sites = smooth.as_ref().unwrap_or(&sides.points);
    let noisy = smooth.is_some();
    let distance = road.stage("distance", || unsigned_distance(sites, &domain, halvings, options))?;
    let stage = SignStage { sides: &sides, sites, domain: &domain, halvings, memory: &memory, options };
    let Signed { phi, distance, off, no_room } = road.stage("sign", || stage.run(distance))?;
    let (mut fitted, mut fitted_spacing) = without(&sides.points, &off, sides.spacing.clone());
    leave_out(&off);

    let knots = domain.knots(options.degree, halvings)?;
    let initial = road.stage("initial-shape", || {
        let fairness = lsq_init::Fairness::Length(0.5 * cell);
        let settings = lsq_init::Options { fairness, ..lsq_init::Options::default() };
        let (spline, report) = lsq_init::fit(phi.view(), &nodes, &knots, &settings)?;
        Ok((spline, StageFigures::InitialShape(report)))
    })?;

    let (spline, initial, heavy_tails) = if options.refine {
        let settings = Refinement {
            points: &fitted,
            spacing: &fitted_spacing,
            f_hat: &sides.f_hat,
            noise: sides.noise,
            ratio: if misjudged { sides.ratio.min(CLEAN_RATIO) } else { sides.ratio },
            domain: &domain,
            halvings,
            band: band.as_ref(),
            distance: &distance,
            smoothing: options.smoothing.map(|length| length * frame.scale),
            loss_length: options.loss_length.map(|length| length * frame.scale),
            cancel: &watch.cancel,
        };
        let (spline, stray, heavy_tails) =
            road.stage(if band.is_some() { "refinement" } else { "dense-refinement" }, || {
                let Outcome { function: (spline, figures), stray, heavy_tails } = settings.run(&initial)?;
                Ok(((spline, stray, heavy_tails), figures))
            })?;
        (fitted, fitted_spacing) = without(&fitted, &stray, fitted_spacing);
        leave_out(&stray);
        (spline, Some(initial), heavy_tails)
    } else {
        (HierarchicalSpline::new(initial)?, None, None)
    };

    let mut spline = calibrated(spline, &domain, halvings, &distance, fitted_spacing.typical)?;

    let coarse = domain.knots(options.degree, 0)?;
    let (few, few_spacing) = sides.few();
    let trust = trust::judge(&spline, (&fitted, &fitted_spacing), (few, few_spacing), sides.noise, &coarse, &frame)?;
    // What hangs on little is seen where f hardly leaves zero: afterwards it is as far from it as a distance would be.
    if let Some(band) = &band {
        let settings = Redistancing {
            points: &fitted,
            spacing: &fitted_spacing,
            noise: sides.noise,
            domain: &domain,
            halvings,
            band,
            distance: &distance,
            cancel: &watch.cancel,
        };
        spline = road.stage("redistancing", || settings.run(spline))?;
        // In the plane a curve has no handles.
        if D == 3 && !options.open {
            let settings = Simplification {
                points: &fitted,
                spacing: &fitted_spacing,
                noise: sides.noise,
                domain: &domain,
                halvings,
                band,
                cancel: &watch.cancel,
            };
            let (simple, stray) = road.stage("simplification", || {
                let Simplified { function: (spline, figures), stray } = settings.run(spline)?;
                Ok(((spline, stray), figures))
            })?;
            spline = simple;
            (fitted, fitted_spacing) = without(&fitted, &stray, fitted_spacing);
            leave_out(&stray);
        }
    }
    let mut noise = sides.noise;
    if sides.of_means {
        let distances = spline.evaluate(&distinct, Derivatives::Gradient).sampson_distances();
        noise = normal_deviation(distances.clone());
        let is_beside = |d: &f64| d.is_nan() || d.abs() > BESIDE * noise;
        outliers = distances.iter().map(is_beside).collect();
    }
    let distance = distance_figures(&spline, &domain, halvings, &distance, (few, fitted_spacing.typical));
    let (warning, mut doubt) = trust::verdict::<D>(&trust, options.open, sides.agreed);
    let mut of_volume = None;
    if doubt.is_none() {
        (of_volume, doubt) = volume::verdict(&fitted, options.smoothing.is_some());
    }
    let mut of_sides = None;
    if doubt.is_none() && options.open {
        let gradients = spline.evaluate(&fitted, Derivatives::Gradient).gradients;
        (of_sides, doubt) = one_sided::verdict(&fitted, &gradients, &fitted_spacing.local, &frame);
    }
    let left_out = outliers.iter().filter(|outlier| **outlier).count();
    let far = points.len() - near.len();
    let mut warnings = warnings::of_stages(&road.stages, options.open);
    warnings.extend(warning.into_iter().chain(of_volume).chain(of_sides));
    warnings.extend(memory.warning(cell));
    warnings.extend(no_room.then(warnings::of_flat_holes));
    // Of noise with heavy tails those points are left out that are farthest off.
    let is_noise = || {
        let tails = || Noise::around(&spline.evaluate(&distinct, Derivatives::Gradient), &distinct);
        sides.noise > NOISY * sides.spacing.typical && tails().loss_length(&vec![1.0; distinct.len()]).is_some()
    };
    warnings.extend(warnings::of_left_out::<D>(left_out, distinct.len()).filter(|_| !is_noise()));
    warnings.extend(warnings::of_far_off(far));
    let report = Report {
        version: REPORT_VERSION,
        input: InputReport {
            dimension: D,
            points: points.len(),
            repeated: near.len() - distinct.len(),
            outliers: left_out + far,
            spacing: if sides.of_means { typical } else { sides.spacing.typical } / frame.scale,
            averaged: sides.of_means.then_some(fitted.len()),
            in_lines: sides.spacing.lines.is_some().then(|| sides.spacing.count()),
            noise: noise / frame.scale,
            heavy_tails: heavy_tails.map(|found| HeavyTails { loss_length: found.loss_length / frame.scale, ..found }),
        },
        frame: FrameReport {
            origin: frame.origin.to_vec(),
            scale: frame.scale,
            coarse_cells: domain.cells(0).to_vec(),
            cells: domain.cells(halvings).to_vec(),
            cell: cell / frame.scale,
        },
        memory,
        stages: road.stages,
        trust,
        distance,
        warnings,
        doubt,
    };
    let guide = noisy.then_some(sides.f_hat);
    Ok(Reconstruction {
        spline,
        frame,
        points: distinct,
        outliers,
        means: sides.of_means.then_some(fitted),
        spacing: fitted_spacing,
        noise: sides.noise,
        domain,
        halvings,
        guide,
        initial,
        open: options.open,
        report,
    })
}

impl<const D: usize> Reconstruction<D> {
    /// The points that were fitted, in the frame, or their means.
    pub fn fitted(&self) -> Vec<[f64; D]> {
        self.means.clone().unwrap_or_else(|| kept(&self.points, &self.outliers))
    }

    /// The function in the data's unit of length, on knots relative to the returned origin: `f(x) = spline(x − origin)`.
    ///
    /// # Errors
    /// If the data's unit is so small or large that the knots cannot be told apart in it.
    pub fn in_data_units(&self) -> Result<([f64; D], HierarchicalSpline<D>), ReconstructError> {
        Ok((self.frame.origin, self.spline.mapped(1.0 / self.frame.scale, [0.0; D])?))
    }
}

/// Collects the stages' reports.
struct Road<'a> {
    stages: Vec<StageReport>,
    watch: &'a Watch<'a>,
}

impl Road<'_> {
    /// Runs a stage, which has the name of its figures.
    fn stage<T>(
        &mut self,
        name: &'static str,
        work: impl FnOnce() -> Result<(T, StageFigures), ReconstructError>,
    ) -> Result<T, ReconstructError> {
        let start = Instant::now();
        let (result, figures) = self.watch.stage(name, work)??;
        debug_assert_eq!(name, figures.name());
        self.stages.push(StageReport { seconds: start.elapsed().as_secs_f64(), figures });
        Ok(result)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use zeroset_watch::{CancelToken, Progress};

    use super::*;

    #[test]
    fn every_stage_is_told_of_and_can_be_called_off() {
        let points: Vec<[f64; 2]> = (0..120)
            .map(|i| (f64::from(i) / 120.0 * std::f64::consts::TAU).sin_cos())
            .map(|(s, c)| [3.0 * c, 2.0 * s])
            .collect();
        for options in [Options::default(), Options { degree: 2, topology: Topology::Paper, ..Options::default() }] {
            let (begun, done) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
            let note = |progress| match progress {
                Progress::Started { stage } => begun.borrow_mut().push(stage),
                Progress::Finished { stage, .. } => done.borrow_mut().push(stage),
                _ => {}
            };
            let watch = Watch { progress: Some(&note), ..Watch::default() };
            let result = reconstruct_watched(&points, &options, &watch).unwrap();
            let stages: Vec<&str> = result.report.stages.iter().map(|stage| stage.figures.name()).collect();
            assert_eq!((&*begun.borrow(), &*done.borrow()), (&stages, &stages));
            for called_off in stages {
                let (cancel, done) = (CancelToken::new(), RefCell::new(Vec::new()));
                let note = |progress| match progress {
                    Progress::Started { stage } if stage == called_off => cancel.cancel(),
                    Progress::Finished { stage, .. } => done.borrow_mut().push(stage),
                    _ => {}
                };
                let watch = Watch { cancel: cancel.clone(), progress: Some(&note) };
                let error = reconstruct_watched(&points, &options, &watch).unwrap_err();
                assert!(error.is_cancelled() && !done.borrow().contains(&called_off), "{called_off}: {error}");
            }
        }
    }
}
