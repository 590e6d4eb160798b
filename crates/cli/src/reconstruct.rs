//! `zeroset reconstruct`.

use std::path::{Path, PathBuf};

use serde::Serialize;
use zeroset::{ReconstructError, Reconstruction, extract_curve, extract_surface};
use zeroset_io::{OutputKind, Points};

use crate::arguments::{Distance, Reconstruct, Topology};
use crate::carried::Carried;
use crate::failure::Failure;
use crate::interrupt;
use crate::picture::{Levels, PREVIEW, three_views, write_surface};
use crate::points;
use crate::progress::Say;
use crate::spline_file::to_file;
use crate::zero_set::{describe_curve, describe_surface, write_curves, write_mesh};

/// The report as it is written: the file, then what the library says.
#[derive(Serialize)]
struct RunReport<'a> {
    zeroset: &'static str,
    file: &'a Path,
    #[serde(flatten)]
    report: &'a zeroset::Report,
}

pub fn run(arguments: &Reconstruct, say: &Say) -> Result<(), Failure> {
    let kinds = check_outputs(arguments)?;
    if let Some(time) = arguments.time {
        interrupt::limit(say, time);
    }
    // Reading, topology, distance, sign, initial shape, extraction, writing, and mostly refinement.
    say.begin(7 + u64::from(!arguments.no_refine));
    let points = say.stage("reading", || points::read(&arguments.points, arguments.format))?;
    for (path, kind) in &kinds {
        let problem = match (points.dimension(), kind) {
            (zeroset_io::Dimension::Two, OutputKind::Mesh) => {
                "a mesh, but the points have two columns: write .svg, .json, .csv or .dxf"
            }
            (zeroset_io::Dimension::Three, OutputKind::Curve) => {
                "a curve, but the points have three columns: write .ply, .obj, .stl or .glb"
            }
            _ => continue,
        };
        return Err(Failure::usage(format!("{} would be {problem}", path.display())));
    }
    let options = options(arguments);
    say.line(format_args!("{}: {} points", arguments.points.display(), points.len()));
    match points {
        Points::Two(set) => {
            let mut result = reconstruct(arguments, &set.points, &options, say)?;
            let failed = |error| refused(arguments, error);
            let (curves, topology) = say.stage("extraction", || extract_curve(&mut result).map_err(failed))?;
            trusted(arguments, &result)?;
            say.line(describe_curve(&topology));
            let write = |path: &Path, kind| match kind {
                OutputKind::Curve => write_curves(path, &curves, &set.points),
                OutputKind::Picture => {
                    let (origin, spline) = result.in_data_units().map_err(Failure::internal)?;
                    Levels::of(&spline, &origin, &set.points, 0.0)?.write(path, PREVIEW)
                }
                _ => write_function(path, kind, &result),
            };
            finish(arguments, &kinds, &result, write, say)
        }
        Points::Three(set) => {
            let mut result = reconstruct(arguments, &set.points, &options, say)?;
            let failed = |error| refused(arguments, error);
            let (mesh, topology) = say.stage("extraction", || extract_surface(&mut result).map_err(failed))?;
            trusted(arguments, &result)?;
            say.line(describe_surface(&mesh, &topology));
            let carried = Carried::new(&set, &mesh.vertices);
            let write = |path: &Path, kind| match kind {
                OutputKind::Mesh => write_mesh(path, &mesh, &carried),
                OutputKind::Picture => {
                    write_surface(path, &mesh, &set.points, &three_views(arguments.up.into()), PREVIEW)
                }
                _ => write_function(path, kind, &result),
            };
            finish(arguments, &kinds, &result, write, say)
        }
    }
}

fn reconstruct<const D: usize>(
    arguments: &Reconstruct,
    points: &[[f64; D]],
    options: &zeroset::Options,
    say: &Say,
) -> Result<Reconstruction<D>, Failure> {
    say.watched(|watch| zeroset::reconstruct_watched(points, options, watch)).map_err(|error| refused(arguments, error))
}

/// Everything about the outputs that can be refused before the work begins: extensions and folders.
fn check_outputs(arguments: &Reconstruct) -> Result<Vec<(PathBuf, OutputKind)>, Failure> {
    let mut kinds = Vec::new();
    for path in &arguments.output {
        kinds.push((path.clone(), OutputKind::of(path).map_err(Failure::usage)?));
    }
    let others =
        [(&arguments.oriented, zeroset_io::ORIENTED_EXTENSIONS), (&arguments.report, zeroset_io::REPORT_EXTENSIONS)];
    for (path, known) in others {
        if let Some(path) = path {
            zeroset_io::extension_among(path, known).map_err(Failure::usage)?;
        }
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
fn trusted<const D: usize>(arguments: &Reconstruct, result: &Reconstruction<D>) -> Result<(), Failure> {
    match &result.report.doubt {
        Some(doubt) if !arguments.accept_doubt => {
            write_report(arguments, result)?;
            let file = arguments.points.display();
            Err(Failure::doubt(format!("{file}: {doubt}; --accept-doubt writes the result as it is")))
        }
        _ => Ok(()),
    }
}

fn write_report<const D: usize>(arguments: &Reconstruct, result: &Reconstruction<D>) -> Result<(), Failure> {
    let Some(path) = &arguments.report else { return Ok(()) };
    let report = RunReport { zeroset: env!("CARGO_PKG_VERSION"), file: &arguments.points, report: &result.report };
    zeroset_io::write_report(path, &report).map_err(Failure::writing)
}

/// Writes everything, and says so.
fn finish<const D: usize>(
    arguments: &Reconstruct,
    kinds: &[(PathBuf, OutputKind)],
    result: &Reconstruction<D>,
    write: impl Fn(&Path, OutputKind) -> Result<(), Failure>,
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
        write_report(arguments, result)
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
