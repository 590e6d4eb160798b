//! `zeroset mesh`.

use std::fmt::Display;

use zeroset::bspline::HierarchicalSpline;
use zeroset::isosurface::{self, Report};
use zeroset_io::{CURVE_EXTENSIONS, MESH_EXTENSIONS, OutputKind, SplineFile};

use crate::advice;
use crate::arguments::Mesh;
use crate::carried::Carried;
use crate::failure::Failure;
use crate::lattice::{self, FINE_ENOUGH};
use crate::progress::Say;
use crate::spline_file::{self, to_spline};
use crate::zero_set::{describe_curve, describe_surface, write_curves, write_mesh};

pub fn run(arguments: &Mesh, say: &Say) -> Result<(), Failure> {
    for path in &arguments.output {
        if !matches!(OutputKind::of(path).map_err(Failure::usage)?, OutputKind::Mesh | OutputKind::Curve) {
            return Err(Failure::usage(format!("{} is no mesh and no curve", path.display())));
        }
    }
    advice::check_spline(&arguments.spline, None)?;
    if let Some(cells) = arguments.resolution.filter(|cells| !(2..=4096).contains(cells)) {
        return Err(Failure::usage(format!("--resolution {cells}: it must be between 2 and 4096")));
    }
    if !arguments.iso.is_finite() {
        return Err(Failure::usage(format!("--iso {}: a finite number is needed", arguments.iso)));
    }
    let file = zeroset_io::read_spline(&arguments.spline).map_err(Failure::reading)?;
    spline_file::note(&arguments.spline, &file).iter().for_each(|note| say.line(note));
    let extensions = if file.dimension() == 2 { CURVE_EXTENSIONS } else { MESH_EXTENSIONS };
    for path in &arguments.output {
        zeroset_io::extension_among(path, extensions).map_err(Failure::usage)?;
    }
    let found = if file.dimension() == 2 {
        let (origin, f, halvings) = function::<2>(arguments, &file)?;
        let found = isosurface::curve_of(&f, halvings, &Default::default());
        let (mut curves, found) = found.map_err(|error| refused(arguments, error))?;
        curves.loops.iter_mut().flatten().for_each(|vertex| shift(vertex, &origin));
        say.line(describe_curve(&curves.topology()));
        for path in &arguments.output {
            write_curves(path, &curves, &[])?;
        }
        found
    } else {
        let (origin, f, halvings) = function::<3>(arguments, &file)?;
        let found = isosurface::graded_surface_of(&f, halvings..=halvings, &Default::default());
        let (mut mesh, found) = found.map_err(|error| refused(arguments, error))?;
        mesh.vertices.iter_mut().for_each(|vertex| shift(vertex, &origin));
        say.line(describe_surface(&mesh, &mesh.topology()));
        for path in &arguments.output {
            write_mesh(path, &mesh, &Carried::default())?;
        }
        found
    };
    warn(&found, say);
    for path in &arguments.output {
        say.line(format_args!("wrote {}", path.display()));
    }
    Ok(())
}

/// The origin, `f − iso`, and how often the root's cells are halved.
fn function<const D: usize>(
    arguments: &Mesh,
    file: &SplineFile,
) -> Result<([f64; D], HierarchicalSpline<D>, u32), Failure> {
    let (origin, spline) = to_spline::<D>(&arguments.spline, file)?;
    let f = spline.plus_constant(-arguments.iso).map_err(|error| refused(arguments, error))?;
    let halvings = lattice::search(&f, arguments.resolution.unwrap_or(FINE_ENOUGH), arguments.memory)?;
    Ok((origin, f, halvings))
}

fn refused(arguments: &Mesh, error: impl Display) -> Failure {
    Failure::input(format!("{}, f = {}: {error}", arguments.spline.display(), arguments.iso))
}

fn shift<const D: usize>(vertex: &mut [f64; D], origin: &[f64; D]) {
    vertex.iter_mut().zip(origin).for_each(|(x, o)| *x += o);
}

fn warn(found: &Report, say: &Say) {
    if found.capped > 0 {
        let vertices = found.capped;
        say.line(format_args!("warning: it leaves the function's box and was closed there ({vertices} vertices)"));
    }
}
