//! One shape drawn, reconstructed and judged.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use zeroset::bspline::Derivatives;
use zeroset::{Options, Reconstruction, reconstruct};
use zeroset_tests::{Ended, Random, within};

use super::dimension::{Dimension, Topology};
use super::sampling::{Samples, Sampling};
use super::solid::{dot, norm};
use super::truth::Truth;
use super::verdict::{Said, faults};

/// So many shapes of a seed are looked at for one whose truth is sure.
const DRAWS: usize = 100;
/// Thinner parts than so many spacings nobody can see in the points: another shape is drawn.
const THINNEST: f64 = 1.0;
/// Bytes that a run may use, whatever is free: the same run on every machine.
const MEMORY: u64 = 4 << 30;

/// What a seed decides before any shape is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draw {
    pub seed: u64,
    /// Place in the list of families.
    family: usize,
    pub sampling: Sampling,
}

impl Draw {
    pub fn of<const D: usize>(seed: u64) -> Self
    where
        [f64; D]: Dimension<D>,
    {
        // Neighbouring seeds have nothing in common.
        let mut random = Random(Random(seed).bits());
        let family = random.below(<[f64; D]>::FAMILIES.len());
        Self { seed, family, sampling: Sampling::random(&mut random) }
    }

    pub fn family<const D: usize>(&self) -> &'static str
    where
        [f64; D]: Dimension<D>,
    {
        <[f64; D]>::FAMILIES[self.family].0
    }

    /// The first shape of the seed whose truth is sure, with points on it.
    pub fn shape<const D: usize>(&self) -> Option<(Truth<D>, Samples<D>)>
    where
        [f64; D]: Dimension<D>,
    {
        // The state behind the draw of family and sampling is not needed: any other will do.
        let mut seeds = Random(!self.seed);
        (0..DRAWS).find_map(|_| {
            let mut random = Random(seeds.bits());
            let solid = <[f64; D]>::FAMILIES[self.family].1(&mut random).turned(&mut random);
            let [fewest, most] = <[f64; D]>::POINTS;
            let count = random.log_between(fewest, most) as usize;
            let truth = Truth::of(solid, <[f64; D]>::CELLS)?;
            let samples = Samples::draw(&truth, self.sampling, count, &mut random)?;
            let share = samples.spacing.powi(D as i32 - 1);
            let seen = <[f64; D]>::extents(&truth.boundary).iter().all(|extent| *extent >= <[f64; D]>::PART * share);
            (seen && samples.thin >= THINNEST).then_some((truth, samples))
        })
    }
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    pub seed: u64,
    pub family: &'static str,
    pub sampling: Sampling,
    pub detail: String,
    /// Strays among them.
    pub points: usize,
    /// How far these are apart, in the shape's unit.
    pub spacing: f64,
    /// The thinnest part, in spacings.
    pub thin: f64,
    pub truth: Topology,
    pub found: Option<Topology>,
    /// Share of points on the right side.
    pub side: Option<f64>,
    /// Mean distance of the result from the truth and back, to first order, in percent of the diagonal.
    pub distance: Option<f64>,
    /// What is wrong with the result; none if it is right.
    pub faults: Vec<String>,
    pub said: Said,
    /// The doubt, or the first warning.
    pub message: String,
    /// Of the reconstruction and the extraction.
    pub seconds: f64,
}

impl Trial {
    /// Whether there is nothing to look at.
    pub fn right_and_quiet(&self) -> bool {
        self.faults.is_empty() && self.said == Said::Quiet
    }

    /// Draws, reconstructs and judges with so many threads; what is not both right and quiet is written into `folder`.
    ///
    /// # Errors
    /// A panic, more time than `limit`, no shape, or files that cannot be written.
    pub fn run<const D: usize>(draw: Draw, threads: usize, limit: Duration, folder: Option<PathBuf>) -> Result<Self>
    where
        [f64; D]: Dimension<D>,
    {
        let work = move || {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().context("no threads to be had")?;
            pool.install(|| {
                let (truth, samples) = draw.shape::<D>().with_context(|| format!("no shape in {DRAWS} draws"))?;
                judged(draw, &truth, &samples, folder.as_deref())
            })
        };
        match within(limit, work) {
            Ok(trial) => trial,
            Err(Ended::Panicked(text)) => Err(anyhow::anyhow!("panic: {text}")),
            Err(Ended::Hung) => Err(anyhow::anyhow!("not done in {} s", limit.as_secs())),
        }
    }
}

fn judged<const D: usize>(draw: Draw, truth: &Truth<D>, samples: &Samples<D>, folder: Option<&Path>) -> Result<Trial>
where
    [f64; D]: Dimension<D>,
{
    let mut trial = Trial {
        seed: draw.seed,
        family: draw.family::<D>(),
        sampling: draw.sampling,
        detail: samples.detail.clone(),
        points: samples.points.len(),
        spacing: samples.spacing,
        thin: samples.thin,
        truth: truth.topology,
        found: None,
        side: None,
        distance: None,
        faults: Vec::new(),
        said: Said::Doubt,
        message: String::new(),
        seconds: 0.0,
    };
    let start = Instant::now();
    let options = Options { memory: Some(MEMORY), ..Options::default() };
    let made = reconstruct(&samples.points, &options).and_then(|mut result| {
        let boundary = <[f64; D]>::extract(&mut result)?;
        Ok((result, boundary))
    });
    trial.seconds = start.elapsed().as_secs_f64();
    let (result, boundary) = match made {
        Ok((result, boundary)) => (Some(result), Some(boundary)),
        Err(error) => {
            trial.faults.push("no result".into());
            trial.message = error.to_string();
            (None, None)
        }
    };
    if let (Some(result), Some(boundary)) = (&result, &boundary) {
        let oriented = result.oriented(&samples.points);
        let right =
            oriented.iter().zip(&samples.normals).filter(|(point, normal)| dot(&point.normal, normal) > 0.0).count();
        let side = right as f64 / samples.normals.len().max(1) as f64;
        let found = <[f64; D]>::topology(boundary);
        trial.faults = faults(draw.sampling, side, found, truth.topology);
        (trial.side, trial.found) = (Some(side), Some(found));
        trial.distance =
            Some(100.0 * distance(truth, samples, result, &<[f64; D]>::vertices(boundary)) / truth.diagonal());
        let report = &result.report;
        trial.said = match (&report.doubt, report.warnings.is_empty()) {
            (Some(_), _) => Said::Doubt,
            (None, false) => Said::Warned,
            (None, true) => Said::Quiet,
        };
        trial.message = report.doubt.as_ref().or(report.warnings.first()).cloned().unwrap_or_default();
    }
    if let Some(folder) = folder.filter(|_| !trial.right_and_quiet()) {
        let extension = <[f64; D]>::EXTENSION;
        let name = |what: &str| folder.join(format!("{:06}-{}-{}-{what}", draw.seed, trial.family, trial.sampling));
        <[f64; D]>::write(&name(&format!("truth.{extension}")), &truth.boundary, &samples.points)?;
        if let (Some(result), Some(boundary)) = (&result, &boundary) {
            <[f64; D]>::write(&name(&format!("result.{extension}")), boundary, &samples.points)?;
            let oriented = result.oriented(&samples.points);
            let normals: Vec<[f64; D]> = oriented.iter().map(|point| point.normal).collect();
            let confidence: Vec<f64> = oriented.iter().map(|point| point.confidence).collect();
            let outliers: Vec<bool> = oriented.iter().map(|point| point.outlier).collect();
            zeroset_io::write_oriented(name("points.ply"), &samples.points, &normals, &confidence, &outliers)?;
        }
    }
    Ok(trial)
}

/// Half the sum of two means: of |f| / ‖∇f‖ of the truth at the vertices of the result, and of the result where the points were
/// taken from.
fn distance<const D: usize>(
    truth: &Truth<D>,
    samples: &Samples<D>,
    result: &Reconstruction<D>,
    vertices: &[[f64; D]],
) -> f64
where
    [f64; D]: Dimension<D>,
{
    let mean = |distances: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = distances.filter(|d| d.is_finite()).fold((0.0, 0), |(sum, count), d| (sum + d, count + 1));
        sum / f64::from(count.max(1))
    };
    let off = |value: f64, gradient: &[f64; D]| value.abs() / norm(gradient);
    let there = mean(&mut vertices.iter().map(|x| off(truth.solid.value(x), &truth.solid.gradient(x))));
    let places: Vec<[f64; D]> = samples.feet.iter().map(|x| result.frame.to_frame(x)).collect();
    let at = result.spline.evaluate(&places, Derivatives::Gradient);
    let back = mean(&mut at.values.iter().zip(&at.gradients).map(|(value, gradient)| off(*value, gradient)));
    0.5 * (there + back / result.frame.scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_has_one_shape_and_seeds_differ() {
        let points = |seed: u64| Draw::of::<2>(seed).shape::<2>().map(|(_, samples)| samples.points);
        assert!(points(1).is_some());
        assert_eq!(points(1), points(1));
        assert_ne!(points(1), points(2));
    }

    #[test]
    fn every_family_has_a_shape_soon() {
        for family in 0..<[f64; 2]>::FAMILIES.len() {
            let draw = Draw { seed: 7, family, sampling: Sampling::Clean };
            assert!(draw.shape::<2>().is_some(), "{}", draw.family::<2>());
        }
        let drawn: Vec<Draw> = (0..200).map(Draw::of::<3>).collect();
        for family in 0..<[f64; 3]>::FAMILIES.len() {
            assert!(drawn.iter().any(|draw| draw.family == family));
        }
    }
}
