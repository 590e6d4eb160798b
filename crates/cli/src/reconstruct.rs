//! `zeroset reconstruct`.

use std::path::{Path, PathBuf};

use zeroset::{ReconstructError, Reconstruction, extract_curve, extract_surface};
use zeroset_io::{OutputKind, PointSet, Points};

use crate::advice;
use crate::arguments::{Distance, Normals, Reconstruct, Topology};
use crate::carried::Carried;
use crate::failure::Failure;
use crate::input;
use crate::interrupt;
use crate::picture::{Levels, PREVIEW, surface_views, three_views, write_surface};
use crate::progress::Say;
use crate::report::{Pictures, write_reports};
use crate::spline_file::to_file;
use crate::zero_set::{describe_curve, describe_surface, write_curves, write_mesh};

pub fn run(arguments: &Reconstruct, say: &Say) -> Result<(), Failure> {
    let kinds = check_outputs(arguments)?;
    let options = options(arguments);
    options.check().map_err(Failure::usage)?;
    if let Some(time) = arguments.time {
        interrupt::limit(say, time);
    }
    // Reading, topology, distance, sign, initial shape, extraction, writing, and mostly refinement.
    say.begin(7 + u64::from(!arguments.no_refine));
    let points = say.stage("reading", || input::points(arguments))?;
    for (path, kind) in &kinds {
        let (problem, tip) = match (points.dimension(), kind) {
            (zeroset_io::Dimension::Two, OutputKind::Mesh) => (
                "a mesh, but the points have two columns",
                "for a curve write .svg, .json, .csv or .dxf; for a surface every row needs x, y and z",
            ),
            (zeroset_io::Dimension::Three, OutputKind::Curve) => (
                "a curve, but the points have three columns",
                "for a surface write .ply, .obj, .stl or .glb; for a curve take two of the columns, as with --plane xy",
            ),
            (zeroset_io::Dimension::Three, OutputKind::Picture)
                if zeroset_io::extension_among(path, &["png"]).is_err() =>
            {
                ("a drawing of a curve, but the points have three columns", "a picture of a surface is a .png")
            }
            _ => continue,
        };
        return Err(Failure::usage(format!("{} would be {problem}", path.display())).with_tip(tip));
    }
    let normals = match (points.has_normals(), arguments.normals) {
        (false, Normals::Trust) => {
            let files = input::names(arguments);
            return Err(Failure::usage(format_args!("--normals trust: the points of {files} have no normals"))
                .with_tip("leave the option out: zeroset finds the sides itself"));
        }
        (false, _) => "",
        (true, Normals::Ignore) => ", whose normals are ignored",
        (true, Normals::Hint) => ", whose normals are a hint (--normals)",
        (true, Normals::Trust) => ", whose normals are trusted",
    };
    say.line(format_args!("{}: {} points{normals}", input::names(arguments), points.len()));
    for path in &arguments.points {
        if let Some(note) = advice::mesh_note(path, arguments.format) {
            say.line(note);
        }
    }
    match points {
        Points::Two(set) => {
            let mut result = reconstruct(arguments, &set, &options, say)?;
            let failed = |error| refused(arguments, error);
            let (curves, topology) = extracted(say, || extract_curve(&mut result).map_err(failed))?;
            let levels = || {
                let (origin, spline) = result.in_data_units().map_err(Failure::internal)?;
                Levels::of(&spline, &origin, &set.points, 0.0)
            };
            let pictures = || Ok(Pictures::Plane { svg: levels()?.svg(PREVIEW)? });
            let report = || write_reports(arguments, &set.points, &result.report, pictures);
            trusted(arguments, &result, report, say)?;
            say.line(describe_curve(&topology));
            let write = |path: &Path, kind| match kind {
                OutputKind::Curve => write_curves(path, &curves, &set.points),
                OutputKind::Picture => levels()?.write(path, PREVIEW),
                _ => write_function(path, kind, &result),
            };
            finish(arguments, &kinds, &set.points, &result, write, report, say)
        }
        Points::Three(set) => {
            let mut result = reconstruct(arguments, &set, &options, say)?;
            let failed = |error| refused(arguments, error);
            let (mesh, topology) = extracted(say, || extract_surface(&mut result).map_err(failed))?;
            let pictures = || {
                let views = surface_views(&mesh, &set.points, arguments.up.into())?;
                Ok(Pictures::Space { views, mesh: &mesh, points: &set.points })
            };
            let report = || write_reports(arguments, &set.points, &result.report, pictures);
            trusted(arguments, &result, report, say)?;
            say.line(describe_surface(&mesh, &topology));
            let carried = Carried::new(&set, &mesh.vertices);
            let write = |path: &Path, kind| match kind {
                OutputKind::Mesh => write_mesh(path, &mesh, &carried),
                OutputKind::Picture => {
                    write_surface(path, &mesh, &set.points, &three_views(arguments.up.into()), PREVIEW)
                }
                _ => write_function(path, kind, &result),
            };
            finish(arguments, &kinds, &set.points, &result, write, report, say)
        }
    }
}

fn reconstruct<const D: usize>(
    arguments: &Reconstruct,
    set: &PointSet<D>,
    options: &zeroset::Options,
    say: &Say,
) -> Result<Reconstruction<D>, Failure>
where
    [f64; D]: zeroset::Point<D>,
{
    say.watched(|watch| match &set.normals {
        Some(normals) => zeroset::reconstruct_with_normals(&set.points, normals, options, watch),
        None => zeroset::reconstruct_watched(&set.points, options, watch),
    })
    .map_err(|error| refused(arguments, error))
}

/// The last stage of the road, told of like those before it.
fn extracted<T>(say: &Say, work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    say.watched(|watch| watch.stage("extraction", work).map_err(Failure::internal)?)
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
        if arguments.points.iter().any(|points| advice::same_file(path, points)) {
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
        normals: match arguments.normals {
            Normals::Ignore => zeroset::Normals::Ignore,
            Normals::Hint => zeroset::Normals::Hint,
            Normals::Trust => zeroset::Normals::Trust,
        },
        smoothing: arguments.smooth,
        loss_length: arguments.robust,
        margin: arguments.margin,
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
        error if error.is_input() => Failure::input(format!("{}: {error}", input::names(arguments))),
        error if error.is_doubt() => Failure::doubt(format!("{}: {error}", input::names(arguments))),
        error => Failure::internal(format!("{}: {error}", input::names(arguments))),
    }
}

/// The spline itself, or its values on the final lattice, in the data's unit.
fn write_function<const D: usize>(path: &Path, kind: OutputKind, result: &Reconstruction<D>) -> Result<(), Failure> {
    let (origin, spline) = result.in_data_units().map_err(Failure::internal)?;
    if kind == OutputKind::Spline {
        let file = to_file(origin, &spline)?.with_open(result.open);
        return zeroset_io::write_spline(path, &file).map_err(Failure::writing);
    }
    let nodes = result.domain.nodes(result.halvings);
    let values = result.spline.sample(&nodes, [0; D]) / result.frame.scale;
    let first = result.frame.to_data(&result.domain.lower);
    let spacing = [result.domain.spacing(result.halvings) / result.frame.scale; D];
    // Open surfaces have no sides to be sure of, and the other formats no room.
    let is_wanted = !result.open && zeroset_io::extension_among(path, &["vti"]).is_ok();
    let confidence = is_wanted.then(|| result.confidence_field()).transpose().map_err(Failure::internal)?;
    let confidence = confidence.as_ref().map(|values| values.view());
    let field = zeroset_io::Field { values: values.view(), origin: &first, spacing: &spacing, confidence };
    zeroset_io::write_field(path, &field).map_err(Failure::writing)
}

/// Ends the run where there is no trust in the result, unless that was accepted. The report is written all the same.
fn trusted<const D: usize>(
    arguments: &Reconstruct,
    result: &Reconstruction<D>,
    report: impl FnOnce() -> Result<(), Failure>,
    say: &Say,
) -> Result<(), Failure> {
    match &result.report.doubt {
        Some(doubt) if !arguments.accept_doubt => {
            warn(result, say);
            report()?;
            let file = input::names(arguments);
            Err(Failure::doubt(format!("{file}: {doubt}; --accept-doubt writes the result as it is")))
        }
        _ => Ok(()),
    }
}

fn warn<const D: usize>(result: &Reconstruction<D>, say: &Say) {
    result.report.warnings.iter().for_each(|warning| say.line(format_args!("warning: {warning}")));
}

/// Writes everything, and says so.
fn finish<const D: usize>(
    arguments: &Reconstruct,
    kinds: &[(PathBuf, OutputKind)],
    points: &[[f64; D]],
    result: &Reconstruction<D>,
    write: impl Fn(&Path, OutputKind) -> Result<(), Failure>,
    report: impl FnOnce() -> Result<(), Failure>,
    say: &Say,
) -> Result<(), Failure> {
    say.stage("writing", || {
        kinds.iter().try_for_each(|(path, kind)| write(path, *kind))?;
        if let Some(path) = &arguments.oriented {
            let oriented = result.oriented(points);
            let positions: Vec<_> = oriented.iter().map(|p| p.position).collect();
            let normals: Vec<_> = oriented.iter().map(|p| p.normal).collect();
            let confidence: Vec<_> = oriented.iter().map(|p| p.confidence).collect();
            let outlier: Vec<_> = oriented.iter().map(|p| p.outlier).collect();
            zeroset_io::write_oriented(path, &positions, &normals, &confidence, &outlier).map_err(Failure::writing)?;
        }
        report()
    })?;
    let input = &result.report.input;
    if let Some(means) = input.averaged {
        say.line(format_args!("the noise is deeper than the points are apart: {means} means of them were fitted"));
    }
    if input.outliers > 0 {
        let (few, all) = (input.outliers, input.points);
        say.line(format_args!(
            "{few} of {all} points lie on no surface with others, and were left out (--oriented names them)"
        ));
    }
    warn(result, say);
    result.report.doubt.iter().for_each(|doubt| say.line(format_args!("warning: {doubt}")));
    let seconds: f64 = result.report.stages.iter().map(|stage| stage.seconds).sum();
    say.line(format_args!("done in {seconds:.1} s"));
    for path in kinds.iter().map(|(path, _)| path).chain(&arguments.oriented).chain(&arguments.report) {
        say.line(format_args!("wrote {}", path.display()));
    }
    Ok(())
}
