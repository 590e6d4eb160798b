//! `zeroset field`.

use zeroset_io::SplineFile;

use crate::advice;
use crate::arguments::Field;
use crate::axis_by_axis::axis_by_axis;
use crate::failure::Failure;
use crate::lattice;
use crate::progress::Say;
use crate::spline_file::to_spline;

pub fn run(arguments: &Field, say: &Say) -> Result<(), Failure> {
    for path in &arguments.output {
        zeroset_io::extension_among(path, zeroset_io::FIELD_EXTENSIONS).map_err(Failure::usage)?;
    }
    advice::check_spline(&arguments.spline, None)?;
    if arguments.cells == Some(0) {
        return Err(Failure::usage("--cells 0: at least one cell is needed"));
    }
    if let Some(spacing) = arguments.spacing.filter(|spacing| !(spacing.is_finite() && *spacing > 0.0)) {
        return Err(Failure::usage(format!("--spacing {spacing}: a positive length is needed")));
    }
    let file = zeroset_io::read_spline(&arguments.spline).map_err(Failure::reading)?;
    match file.dimension() {
        2 => write::<2>(arguments, &file)?,
        _ => write::<3>(arguments, &file)?,
    }
    for path in &arguments.output {
        say.line(format_args!("wrote {}", path.display()));
    }
    Ok(())
}

fn write<const D: usize>(arguments: &Field, file: &SplineFile) -> Result<(), Failure> {
    let (origin, spline) = to_spline::<D>(&arguments.spline, file)?;
    let spacing = arguments.spacing.unwrap_or_else(|| {
        let cells = arguments.cells.unwrap_or_else(|| lattice::own_cells(&spline));
        lattice::longest_side(&spline) / cells as f64
    });
    let values = spline.sample(&lattice::nodes(&spline, spacing)?, [0; D]);
    let (lower, _) = spline.domain();
    let first = axis_by_axis(lower, origin, |lower, origin| lower + origin);
    let field = zeroset_io::Field { values: values.view(), origin: &first, spacing: &[spacing; D], confidence: None };
    arguments.output.iter().try_for_each(|path| zeroset_io::write_field(path, &field).map_err(Failure::writing))
}
