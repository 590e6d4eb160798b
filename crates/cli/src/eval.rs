//! `zeroset eval`.

use zeroset::bspline::Derivatives;
use zeroset_io::{EvaluationTable, Points, SplineFile};

use crate::advice;
use crate::arguments::Eval;
use crate::failure::Failure;
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
