//! The paper's claim: a better initial shape saves iterations of the dynamic reconstruction.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use ndarray::ArrayD;
use zeroset::bspline::Spline;
use zeroset::isosurface::{self, LatticeSamples};
use zeroset::trust_region::{self, StoppingRule};
use zeroset::{Domain, gefm};

use super::cases::{Case, curve, surface};
use super::plot::{Series, panels};

const CURVES: [&str; 4] = ["star.xy", "hook.xy", "annulus_offset.xy", "horse.xy"];
const SURFACES: [&str; 2] = ["double_torus.ply", "teapot.ply"];
const STARTS: [(&str, &str); 3] = [("sphere", "#c0392b"), ("GEFM alone", "#e08e0b"), ("synthesized", "#1f5fa8")];

/// Sampson distance to reach, in spacings of the points, root mean square.
const TARGET: f64 = 0.02;
const MOST_ITERATIONS: usize = 60;

pub fn write(root: &Path, folder: &Path, page: &mut String) -> Result<()> {
    write!(
        page,
        "## The claim: initial shapes that reflect geometry and topology speed up the iteration\n\nThe dynamic reconstruction of \
         section 2.3 from three initial shapes on the same lattice, until the root mean square Sampson distance is {TARGET} of the \
         spacing of the points, at most {MOST_ITERATIONS} iterations: a circle or sphere (centre of the points, mean distance), the \
         function of generalized eigenvector fitting as the paper has it, and the synthesized shape of equations (14) and (15). \
         Seconds are those of the iteration alone, and in brackets with the making of the initial shape. Where the goal is not \
         reached, the error at the end and the rule that stopped the iteration are given. Behind the figures stands what the zero set \
         then is; the error at the points alone does not see it.\n\n\
         | case | sphere: iterations, s | GEFM alone: iterations, s | synthesized: iterations, s |\n|---|---|---|---|\n"
    )?;
    let mut plots = Vec::new();
    for name in CURVES {
        measure(&curve(root, name)?, name, page, &mut plots)?;
    }
    for name in SURFACES {
        measure(&surface(root, name)?, name, page, &mut plots)?;
    }
    let path = folder.join("claim.svg");
    std::fs::write(&path, panels(&plots, "iteration", "Sampson distance / spacing"))
        .with_context(|| format!("{} cannot be written", path.display()))?;
    page.push_str(
        "\nRead: from a sphere the iteration takes many more steps than from the synthesized shape, and often ends with another \
         topology; that part of the claim holds. Against GEFM alone it does not, measured by the Sampson distance at the points: with the \
         small weight w used here the eigenvector fit already passes close to them, often below the goal without a step. What the \
         synthesized shape adds is seen in Figs. 2 and 4: the slope of a distance instead of flat regions, and stray sheets removed.\n",
    );
    page.push_str("\n![Sampson distance over iterations; dashed: the goal](claim.svg)\n");
    Ok(())
}

fn measure<const D: usize>(
    case: &Case<D>,
    name: &str,
    page: &mut String,
    plots: &mut Vec<(String, Vec<Series>, f64)>,
) -> Result<()>
where
    Case<D>: Shape<D>,
{
    let domain = case.domain();
    let halvings = 1;
    let initial = |which: usize| -> Result<Spline<D>> {
        match which {
            0 => sphere(case, &domain, halvings),
            1 => Ok(gefm_alone(case, &domain, gefm::Options::paper())?.halved()?),
            _ => case.synthesized(&gefm_alone(case, &domain, gefm::Options::default())?, &domain, halvings),
        }
    };
    let mut series = Vec::new();
    write!(page, "| {name} |")?;
    for (which, (start, colour)) in STARTS.into_iter().enumerate() {
        let clock = Instant::now();
        let shape = initial(which)?;
        let making = clock.elapsed().as_secs_f64();
        let mut options = trust_region::Options::for_spacing::<D>(case.spacing.typical);
        options.smoothing_length = case.spacing.typical.max(0.5 * domain.spacing(halvings));
        options.target_error = Some(TARGET * case.spacing.typical);
        options.most_iterations = MOST_ITERATIONS;
        options.relative_decrease = 0.0;
        options.holdout = 0.0;
        let clock = Instant::now();
        let (fitted, report) = trust_region::refine(&case.points, Some(&case.spacing.areas), &shape, &options)?;
        let seconds = clock.elapsed().as_secs_f64();
        let rms = |errors: &trust_region::Errors| errors.sampson_rms / case.spacing.typical;
        if report.stopping_rule == StoppingRule::SampsonErrorReached {
            let shape = case.shape(&fitted, &domain, halvings)?;
            write!(page, " {}, {seconds:.2} ({:.2}); {shape} |", report.iterations.len(), seconds + making)?;
        } else {
            write!(
                page,
                " not reached: {:.3} after {} ({:?}), {seconds:.2} ({:.2}) |",
                rms(&report.result),
                report.iterations.len(),
                report.stopping_rule,
                seconds + making
            )?;
        }
        let values = std::iter::once(rms(&report.initial)).chain(report.iterations.iter().map(|i| rms(&i.errors)));
        series.push(Series { name: start, colour, values: values.collect() });
    }
    page.push('\n');
    plots.push((name.to_owned(), series, TARGET));
    Ok(())
}

/// Says what a zero set is.
trait Shape<const D: usize> {
    fn shape(&self, f: &Spline<D>, domain: &Domain<D>, halvings: u32) -> Result<String>;
}

impl Shape<2> for Case<2> {
    fn shape(&self, f: &Spline<2>, domain: &Domain<2>, halvings: u32) -> Result<String> {
        let axes = domain.nodes(halvings + 1);
        let samples = LatticeSamples::new(axes.clone(), f.sample(&axes, [0; 2]))?;
        let topology = isosurface::curve(&samples, Some(f), &isosurface::Options::default())?.0.topology();
        Ok(format!("parts {}, holes {}", topology.parts, topology.holes))
    }
}

impl Shape<3> for Case<3> {
    fn shape(&self, f: &Spline<3>, domain: &Domain<3>, halvings: u32) -> Result<String> {
        let axes = domain.nodes(halvings + 1);
        let samples = LatticeSamples::new(axes.clone(), f.sample(&axes, [0; 3]))?;
        let topology = isosurface::surface(&samples, Some(f), &isosurface::Options::default())?.0.topology();
        Ok(format!("components {}, genus {}", topology.components, topology.genus))
    }
}

fn gefm_alone<const D: usize>(case: &Case<D>, domain: &Domain<D>, settings: gefm::Options) -> Result<Spline<D>> {
    let options = case.gefm_options(domain, settings);
    Ok(gefm::fit(&case.points, &case.spacing.areas, &domain.knots(3, 0)?, &options)?.0)
}

/// A circle or sphere around the mean of the points with their mean distance, as a spline on the lattice.
fn sphere<const D: usize>(case: &Case<D>, domain: &Domain<D>, halvings: u32) -> Result<Spline<D>> {
    let count = case.points.len() as f64;
    let centre: [f64; D] = std::array::from_fn(|axis| case.points.iter().map(|p| p[axis]).sum::<f64>() / count);
    let away = |x: &[f64; D]| (0..D).map(|axis| (x[axis] - centre[axis]).powi(2)).sum::<f64>().sqrt();
    let radius = case.points.iter().map(away).sum::<f64>() / count;
    let nodes = domain.nodes(halvings);
    let shape: Vec<usize> = nodes.iter().map(Vec::len).collect();
    let phi =
        ArrayD::from_shape_fn(shape, |index| away(&std::array::from_fn(|axis| nodes[axis][index[axis]])) - radius);
    case.least_squares(&phi, &nodes, &domain.knots(3, halvings)?, domain.spacing(halvings))
}
