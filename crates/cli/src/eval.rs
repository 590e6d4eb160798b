//! `zeroset eval`.

use std::fmt::Display;

use zeroset::bspline::{Derivatives, HierarchicalSpline};
use zeroset::{SignedDistance, isosurface};
use zeroset_io::{EvaluationTable, Points, SplineFile};

use crate::advice;
use crate::arguments::Eval;
use crate::axis_by_axis::axis_by_axis;
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
        (2, Points::Two(set)) => table(arguments, &file, &set.points, |f, halvings| {
            Ok(isosurface::curve_of(f, halvings, &Default::default())?.0.loops.concat())
        })?,
        (3, Points::Three(set)) => table(arguments, &file, &set.points, |f, halvings| {
            Ok(isosurface::graded_surface_of(f, halvings..=halvings, &Default::default())?.0.vertices)
        })?,
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

/// Writes the table; `vertices` gives those of the zero set after so many halvings. Tells how many points lie outside the box.
fn table<const D: usize>(
    arguments: &Eval,
    file: &SplineFile,
    points: &[[f64; D]],
    vertices: impl FnOnce(&HierarchicalSpline<D>, u32) -> Result<Vec<[f64; D]>, isosurface::Error>,
) -> Result<usize, Failure> {
    let (origin, spline) = to_spline::<D>(&arguments.spline, file)?;
    // Relative to the origin before anything is rounded.
    let relative: Vec<[f64; D]> = points.iter().map(|p| axis_by_axis(*p, origin, |x, origin| x - origin)).collect();
    let evaluation = spline.evaluate(&relative, Derivatives::Hessian);
    let mut distances = vec![];
    if arguments.distance {
        let refused = |problem: &dyn Display| Failure::input(format_args!("{}: {problem}", arguments.spline.display()));
        let halvings = lattice::search(&spline, FINE_ENOUGH, arguments.memory)?;
        let vertices = vertices(&spline, halvings).map_err(|error| refused(&error))?;
        let distance = SignedDistance::new(&spline, vertices);
        distances = distance.ok_or_else(|| refused(&"the function has no zero set"))?.at_all(&relative);
    }
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
