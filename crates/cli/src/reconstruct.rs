//! `zeroset reconstruct`.

use std::path::{Path, PathBuf};

use zeroset::{ReconstructError, Reconstruction, extract_curve, extract_surface};
use zeroset_io::{OutputKind, Points};

use crate::advice;
use crate::arguments::{Distance, Reconstruct, Topology};
use crate::carried::Carried;
use crate::failure::Failure;
use crate::interrupt;
use crate::picture::{Levels, PREVIEW, surface_views, three_views, write_surface};
use crate::points;
use crate::progress::Say;
use crate::report::{Pictures, write_reports};
use crate::spline_file::to_file;
use crate::zero_set::{describe_curve, describe_surface, write_curves, write_mesh};

pub fn run(arguments: &Reconstruct, say: &Say) -> Result<(), Failure> {
    let kinds = check_outputs(arguments)?;
    if let Some(time) = arguments.time {
        interrupt::limit(say, time);
    }
    // Reading, topology, distance, sign, initial shape, extraction, writing, and mostly refinement.
    say.begin(7 + u64::from(!arguments.no_refine));
    let points = say.stage("reading", || points::read(&arguments.points, arguments.format))?;
    for (path, kind) in &kinds {
        let (problem, tip) = match (points.dimension(), kind) {
            (zeroset_io::Dimension::Two, OutputKind::Mesh) => (
                "a mesh, but the points have two columns",
                "for a curve write .svg, .json, .csv or .dxf; for a surface every row needs x, y and z",
            ),
            (zeroset_io::Dimension::Three, OutputKind::Curve) => (
                "a curve, but the points have three columns",
                "for a surface write .ply, .obj, .stl or .glb; points in the plane have two columns",
            ),
            _ => continue,
        };
        return Err(Failure::usage(format!("{} would be {problem}", path.display())).with_tip(tip));
    }
    let options = options(arguments);
    say.line(format_args!("{}: {} points", arguments.points.display(), points.len()));
    if let Some(note) = advice::mesh_note(&arguments.points, arguments.format, points.len()) {
        say.line(note);
    }
    match points {
        Points::Two(set) => {
            let mut result = reconstruct(arguments, &set.points, &options, say)?;
            let failed = |error| refused(arguments, error);
            let (curves, topology) = say.stage("extraction", || extract_curve(&mut result).map_err(failed))?;
            let levels = || {
                let (origin, spline) = result.in_data_units().map_err(Failure::internal)?;
                Levels::of(&spline, &origin, &set.points, 0.0)
            };
            let pictures = || Ok(Pictures::Plane { svg: levels()?.svg(PREVIEW)? });
            let report = || write_reports(arguments, &set.points, &result.report, pictures);
            trusted(arguments, &result, report)?;
            say.line(describe_curve(&topology));
            let write = |path: &Path, kind| match kind {
                OutputKind::Curve => write_curves(path, &curves, &set.points),
                OutputKind::Picture => levels()?.write(path, PREVIEW),
                _ => write_function(path, kind, &result),
            };
            finish(arguments, &kinds, &result, write, report, say)
        }
        Points::Three(set) => {
            let mut result = reconstruct(arguments, &set.points, &options, say)?;
            let failed = |error| refused(arguments, error);
            let (mesh, topology) = say.stage("extraction", || extract_surface(&mut result).map_err(failed))?;
            let pictures = || {
                let views = surface_views(&mesh, &set.points, arguments.up.into())?;
                Ok(Pictures::Space { views, mesh: &mesh, points: &set.points })
            };
            let report = || write_reports(arguments, &set.points, &result.report, pictures);
            trusted(arguments, &result, report)?;
            say.line(describe_surface(&mesh, &topology));
            let carried = Carried::new(&set, &mesh.vertices);
            let write = |path: &Path, kind| match kind {
                OutputKind::Mesh => write_mesh(path, &mesh, &carried),
                OutputKind::Picture => {
                    write_surface(path, &mesh, &set.points, &three_views(arguments.up.into()), PREVIEW)
                }
                _ => write_function(path, kind, &result),
            };
            finish(arguments, &kinds, &result, write, report, say)
        }
    }
}

fn reconstruct<const D: usize>(
    arguments: &Reconstruct,
    points: &[[f64; D]],
    options: &zeroset::Options,
    say: &Say,
) -> Result<Reconstruction<D>, Failure>
where
    [f64; D]: zeroset::Point<D>,
{
    say.watched(|watch| zeroset::reconstruct_watched(points, options, watch)).map_err(|error| refused(arguments, error))
}

/// Everything about the outputs that can be refused before the work begins: extensions and folders.
fn check_outputs(arguments: &Reconstruct) -> Result<Vec<(PathBuf, OutputKind)>, Failure> {
    let mut kinds = Vec::new();
    for path in &arguments.output {
        let kind = OutputKind::of(path).map_err(|error| advice::no_output(&arguments.points, path, error))?;
        kinds.push((path.clone(), kind));
    }
    if let Some(path) = &arguments.oriented {
        zeroset_io::extension_among(path, zeroset_io::ORIENTED_EXTENSIONS).map_err(Failure::usage)?;
    }
    for path in &arguments.report {
        zeroset_io::extension_among(path, zeroset_io::REPORT_EXTENSIONS).map_err(Failure::usage)?;
    }
    let paths = arguments.output.iter().chain(&arguments.oriented).chain(&arguments.report);
    for path in paths {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(Failure::output(format!(
                "{}: the folder {} does not exist: make it first",
                path.display(),
                folder.display()
            )));
        }
        if path.is_dir() {
            return Err(Failure::output(format!("{} is a folder: give a file name", path.display())));
        }
        if advice::same_file(path, &arguments.points) {
            let problem = format!("{} would be written over the points themselves", path.display());
            return Err(Failure::usage(problem).with_tip("give the output another name"));
        }
        zeroset_io::check_writable(path)
            .map_err(|error| Failure::writing(error).with_tip("choose a folder that you may write to"))?;
    }
    Ok(kinds)
}

fn options(arguments: &Reconstruct) -> zeroset::Options {
    use zeroset::eikonal_sweep::Method;
    zeroset::Options {
        resolution: arguments.resolution,
        degree: arguments.degree,
        topology: match arguments.topology {
            Topology::Continuation => zeroset::Topology::Continuation,
            Topology::Paper => zeroset::Topology::Paper,
        },
        smoothing: arguments.smooth,
        distance: match arguments.distance {
            Distance::ClosestPoint => Method::ClosestPoint,
            Distance::Godunov => Method::Godunov,
            Distance::Exact => Method::Exact,
        },
        open: arguments.open,
        refine: !arguments.no_refine,
        memory: arguments.memory,
    }
}

fn refused(arguments: &Reconstruct, error: ReconstructError) -> Failure {
    match error {
        error if error.is_option() => Failure::usage(error),
        error if error.is_input() => Failure::input(format!("{}: {error}", arguments.points.display())),
        error if error.is_doubt() => Failure::doubt(format!("{}: {error}", arguments.points.display())),
        error => Failure::internal(format!("{}: {error}", arguments.points.display())),
    }
}

/// The spline itself, or its values on the final lattice, in the data's unit.
fn write_function<const D: usize>(path: &Path, kind: OutputKind, result: &Reconstruction<D>) -> Result<(), Failure> {
    let (origin, spline) = result.in_data_units().map_err(Failure::internal)?;
    if kind == OutputKind::Spline {
        return zeroset_io::write_spline(path, &to_file(origin, &spline)?).map_err(Failure::writing);
    }
    let nodes = result.domain.nodes(result.halvings);
    let values = result.spline.sample(&nodes, [0; D]) / result.frame.scale;
    let first = result.frame.to_data(&result.domain.lower);
    let spacing = [result.domain.spacing(result.halvings) / result.frame.scale; D];
    let field = zeroset_io::Field { values: values.view(), origin: &first, spacing: &spacing };
    zeroset_io::write_field(path, &field).map_err(Failure::writing)
}

/// Ends the run where there is no trust in the result, unless that was accepted. The report is written all the same.
fn trusted<const D: usize>(
    arguments: &Reconstruct,
    result: &Reconstruction<D>,
    report: impl FnOnce() -> Result<(), Failure>,
) -> Result<(), Failure> {
    match &result.report.doubt {
        Some(doubt) if !arguments.accept_doubt => {
            report()?;
            let file = arguments.points.display();
            Err(Failure::doubt(format!("{file}: {doubt}; --accept-doubt writes the result as it is")))
        }
        _ => Ok(()),
    }
}

/// Writes everything, and says so.
fn finish<const D: usize>(
    arguments: &Reconstruct,
    kinds: &[(PathBuf, OutputKind)],
    result: &Reconstruction<D>,
    write: impl Fn(&Path, OutputKind) -> Result<(), Failure>,
    report: impl FnOnce() -> Result<(), Failure>,
    say: &Say,
) -> Result<(), Failure> {
    say.stage("writing", || {
        kinds.iter().try_for_each(|(path, kind)| write(path, *kind))?;
        if let Some(path) = &arguments.oriented {
            let oriented = result.oriented();
            let positions: Vec<_> = oriented.iter().map(|p| p.position).collect();
            let normals: Vec<_> = oriented.iter().map(|p| p.normal).collect();
            let confidence: Vec<_> = oriented.iter().map(|p| p.confidence).collect();
            let outlier: Vec<_> = oriented.iter().map(|p| p.outlier).collect();
            zeroset_io::write_oriented(path, &positions, &normals, &confidence, &outlier).map_err(Failure::writing)?;
        }
        report()
    })?;
    for warning in result.report.warnings.iter().chain(&result.report.doubt) {
        say.line(format_args!("warning: {warning}"));
    }
    let seconds: f64 = result.report.stages.iter().map(|stage| stage.seconds).sum();
    say.line(format_args!("done in {seconds:.1} s"));
    for path in kinds.iter().map(|(path, _)| path).chain(&arguments.oriented).chain(&arguments.report) {
        say.line(format_args!("wrote {}", path.display()));
    }
    Ok(())
}
