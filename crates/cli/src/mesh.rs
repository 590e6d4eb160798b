//! `zeroset mesh`.

use zeroset::bspline::HierarchicalSpline;
use zeroset::isosurface::{self, ImplicitFunction, LatticeSamples, Report};
use zeroset_io::{CURVE_EXTENSIONS, MESH_EXTENSIONS, OutputKind};

use crate::Say;
use crate::arguments::Mesh;
use crate::failure::Failure;
use crate::lattice;
use crate::spline_file::to_spline;
use crate::zero_set::{describe_curve, describe_surface, write_curves, write_mesh};

/// Chords over cells larger than this part of the box would show.
const FINE_ENOUGH: usize = 96;

/// `f − iso`.
struct Shifted<'a, const D: usize> {
    spline: &'a HierarchicalSpline<D>,
    iso: f64,
}

impl<const D: usize> ImplicitFunction<D> for Shifted<'_, D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.spline.value(x) - self.iso
    }

    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
        let (value, gradient) = self.spline.value_and_gradient(x);
        (value - self.iso, gradient)
    }
}

pub fn run(arguments: &Mesh, say: Say) -> Result<(), Failure> {
    for path in &arguments.output {
        if !matches!(OutputKind::of(path).map_err(Failure::usage)?, OutputKind::Mesh | OutputKind::Curve) {
            return Err(Failure::usage(format!("{} is no mesh and no curve", path.display())));
        }
    }
    zeroset_io::extension_among(&arguments.spline, zeroset_io::SPLINE_EXTENSIONS).map_err(Failure::usage)?;
    if let Some(cells) = arguments.resolution.filter(|cells| !(2..=4096).contains(cells)) {
        return Err(Failure::usage(format!("--resolution {cells}: it must be between 2 and 4096")));
    }
    if !arguments.iso.is_finite() {
        return Err(Failure::usage(format!("--iso {}: a finite number is needed", arguments.iso)));
    }
    let file = zeroset_io::read_spline(&arguments.spline).map_err(Failure::reading)?;
    let extensions = if file.dimension() == 2 { CURVE_EXTENSIONS } else { MESH_EXTENSIONS };
    for path in &arguments.output {
        zeroset_io::extension_among(path, extensions).map_err(Failure::usage)?;
    }
    let refuse = |error: isosurface::Error| {
        Failure::input(format!("{}, f = {}: {error}", arguments.spline.display(), arguments.iso))
    };
    let found = if file.dimension() == 2 {
        let (origin, spline) = to_spline::<2>(&arguments.spline, &file)?;
        let f = Shifted { spline: &spline, iso: arguments.iso };
        let (mut curves, found) =
            isosurface::curve(&samples(arguments, &f)?, Some(&f), &Default::default()).map_err(refuse)?;
        curves.loops.iter_mut().flatten().for_each(|vertex| shift(vertex, &origin));
        say.line(describe_curve(&curves.topology()));
        for path in &arguments.output {
            write_curves(path, &curves, &[])?;
        }
        found
    } else {
        let (origin, spline) = to_spline::<3>(&arguments.spline, &file)?;
        let f = Shifted { spline: &spline, iso: arguments.iso };
        let (mut mesh, found) =
            isosurface::surface(&samples(arguments, &f)?, Some(&f), &Default::default()).map_err(refuse)?;
        mesh.vertices.iter_mut().for_each(|vertex| shift(vertex, &origin));
        say.line(describe_surface(&mesh, &mesh.topology()));
        for path in &arguments.output {
            write_mesh(path, &mesh)?;
        }
        found
    };
    warn(&found, say);
    for path in &arguments.output {
        say.line(format_args!("wrote {}", path.display()));
    }
    Ok(())
}

/// The function on a lattice that fills its box.
fn samples<const D: usize>(arguments: &Mesh, f: &Shifted<'_, D>) -> Result<LatticeSamples<D>, Failure> {
    let cells = arguments.resolution.unwrap_or_else(|| lattice::own_cells(f.spline).max(FINE_ENOUGH));
    let spacing = lattice::longest_side(f.spline) / cells as f64;
    let mut axes = lattice::nodes(f.spline, spacing)?;
    let (_, upper) = f.spline.domain();
    for (axis, end) in axes.iter_mut().zip(upper) {
        match axis.last_mut() {
            // A smaller cell fills the rest.
            Some(last) if end - *last > 1e-3 * spacing => axis.push(end),
            Some(last) => *last = end,
            None => {}
        }
    }
    let values = f.spline.sample(&axes, [0; D]) - f.iso;
    LatticeSamples::new(axes, values).map_err(Failure::internal)
}

fn shift<const D: usize>(vertex: &mut [f64; D], origin: &[f64; D]) {
    vertex.iter_mut().zip(origin).for_each(|(x, o)| *x += o);
}

fn warn(found: &Report, say: Say) {
    if found.capped > 0 {
        let vertices = found.capped;
        say.line(format_args!("warning: it leaves the function's box and was closed there ({vertices} vertices)"));
    }
}
