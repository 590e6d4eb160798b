//! `zeroset eval`.

use std::path::Path;

use zeroset::bspline::{Derivatives, KnotVector, Spline};
use zeroset_io::{EvaluationTable, Points, SplineFile};

use crate::Say;
use crate::arguments::Eval;
use crate::failure::Failure;
use crate::points;

pub fn run(arguments: &Eval, say: Say) -> Result<(), Failure> {
    zeroset_io::extension_among(&arguments.output, zeroset_io::TABLE_EXTENSIONS).map_err(Failure::usage)?;
    zeroset_io::extension_among(&arguments.spline, zeroset_io::SPLINE_EXTENSIONS).map_err(Failure::usage)?;
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
        say.line(format_args!("warning: {outside} points lie outside the function's box, where it has no value (NaN)"));
    }
    say.line(format_args!("wrote {}", arguments.output.display()));
    Ok(())
}

fn table<const D: usize>(arguments: &Eval, file: &SplineFile, points: &[[f64; D]]) -> Result<usize, Failure> {
    let (origin, spline) = to_spline::<D>(&arguments.spline, file)?;
    // Relative to the origin before anything is rounded.
    let relative: Vec<[f64; D]> = points.iter().map(|p| std::array::from_fn(|axis| p[axis] - origin[axis])).collect();
    let evaluation = spline.evaluate(&relative, Derivatives::Hessian);
    let table = EvaluationTable {
        points,
        values: &evaluation.values,
        gradients: &evaluation.gradients,
        hessians: &evaluation.hessians,
    };
    zeroset_io::write_table(&arguments.output, &table).map_err(Failure::writing)?;
    Ok(evaluation.outside)
}

/// The spline of a file, and the origin that its knots are relative to.
pub fn to_spline<const D: usize>(path: &Path, file: &SplineFile) -> Result<([f64; D], Spline<D>), Failure> {
    let refuse = |problem: String| Failure::input(format!("{}: {problem}", path.display()));
    let wrong = || refuse(format!("not a function of {D} variables"));
    let origin: [f64; D] = file.origin.clone().try_into().map_err(|_| wrong())?;
    let mut knots = Vec::with_capacity(D);
    for (axis, axis_knots) in file.knots.iter().enumerate() {
        let vector = KnotVector::new(file.degree, axis_knots.clone());
        knots.push(vector.map_err(|error| refuse(format!("knots of axis {axis}: {error}")))?);
    }
    let knots: [KnotVector; D] = knots.try_into().map_err(|_| wrong())?;
    let spline = Spline::new(knots, file.coefficients.clone()).map_err(|error| refuse(error.to_string()))?;
    Ok((origin, spline))
}
