//! `zeroset eval`.

use std::fmt::Display;

use zeroset::bspline::{Derivatives, HierarchicalSpline};
use zeroset::{SignedDistance, isosurface};
use zeroset_io::{EvaluationTable, Points, SplineFile};

use crate::advice;
use crate::arguments::Eval;
use crate::failure::Failure;
use crate::lattice::{self, FINE_ENOUGH};
use crate::points;
use crate::progress::Say;
use crate::spline_file::to_spline;

pub fn run(arguments: &Eval, say: &Say) -> Result<(), Failure> {
    zeroset_io::extension_among(&arguments.output, zeroset_io::TABLE_EXTENSIONS).map_err(Failure::usage)?;
    advice::check_spline(&arguments.spline, Some(("eval", &arguments.points)))?;
    let file = zeroset_io::read_spline(&arguments.spline).map_err(Failure::reading)?;
    let points = points::read(&arguments.points, arguments.format)?;
    let outside = match (file.dimension(), points) {
        (2, Points::Two(set)) => table(arguments, &file, &set.points)?,
        (3, Points::Three(set)) => table(arguments, &file, &set.points)?,
        (dimension, points) => {
            let columns = if matches!(points, Points::Two(_)) { 2 } else { 3 };
            return Err(Failure::input(format!(
                "{} has {columns} columns, but {} is a function of {dimension} variables",
                arguments.points.display(),
                arguments.spline.display()
            )));
        }
    };
    if outside > 0 {
        say.line(format_args!(
            "warning: {outside} of the points lie outside the function's box, where it has no value (NaN)"
        ));
    }
    say.line(format_args!("wrote {}", arguments.output.display()));
    Ok(())
}

fn table<const D: usize>(arguments: &Eval, file: &SplineFile, points: &[[f64; D]]) -> Result<usize, Failure>
where
    [f64; D]: ZeroSet<D>,
{
    let (origin, spline) = to_spline::<D>(&arguments.spline, file)?;
    // Relative to the origin before anything is rounded.
    let relative: Vec<[f64; D]> = points.iter().map(|p| std::array::from_fn(|axis| p[axis] - origin[axis])).collect();
    let evaluation = spline.evaluate(&relative, Derivatives::Hessian);
    let distances = if arguments.distance { distances(arguments, &spline, &relative)? } else { vec![] };
    let table = EvaluationTable {
        points,
        distances: &distances,
        values: &evaluation.values,
        gradients: &evaluation.gradients,
        hessians: &evaluation.hessians,
    };
    zeroset_io::write_table(&arguments.output, &table).map_err(Failure::writing)?;
    Ok(evaluation.outside)
}

/// The distances from the zero set, extracted on the function's own cells.
fn distances<const D: usize>(
    arguments: &Eval,
    f: &HierarchicalSpline<D>,
    places: &[[f64; D]],
) -> Result<Vec<f64>, Failure>
where
    [f64; D]: ZeroSet<D>,
{
    let halvings = lattice::halvings(f, FINE_ENOUGH);
    lattice::check_search(f, halvings)?;
    lattice::check_memory(f, halvings, arguments.memory)?;
    let refused = |problem: &dyn Display| Failure::input(format_args!("{}: {problem}", arguments.spline.display()));
    let vertices = ZeroSet::vertices(f, halvings).map_err(|error| refused(&error))?;
    let distance = SignedDistance::new(f, vertices).ok_or_else(|| refused(&"the function has no zero set"))?;
    Ok(distance.at_all(places))
}

/// Points of a dimension in which zero sets can be extracted.
trait ZeroSet<const D: usize>: Sized {
    fn vertices(f: &HierarchicalSpline<D>, halvings: u32) -> Result<Vec<Self>, isosurface::Error>;
}

impl ZeroSet<2> for [f64; 2] {
    fn vertices(f: &HierarchicalSpline<2>, halvings: u32) -> Result<Vec<Self>, isosurface::Error> {
        Ok(isosurface::curve_of(f, halvings, &Default::default())?.0.loops.concat())
    }
}

impl ZeroSet<3> for [f64; 3] {
    fn vertices(f: &HierarchicalSpline<3>, halvings: u32) -> Result<Vec<Self>, isosurface::Error> {
        Ok(isosurface::surface_of(f, halvings, &Default::default())?.0.vertices)
    }
}
