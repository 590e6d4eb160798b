//! `zeroset render`.

use zeroset::isosurface;
use zeroset_io::{PICTURE_EXTENSIONS, Points, SplineFile};
use zeroset_render::{Up, View};

use crate::advice;
use crate::arguments::Render;
use crate::axis_by_axis::axis_by_axis;
use crate::failure::Failure;
use crate::lattice;
use crate::picture::{Levels, write_surface};
use crate::points;
use crate::progress::Say;
use crate::spline_file::{self, to_spline};

/// Chords over cells larger than this part of the box would show.
const FINE_ENOUGH: usize = 192;

pub fn run(arguments: &Render, say: &Say) -> Result<(), Failure> {
    for path in &arguments.output {
        zeroset_io::extension_among(path, PICTURE_EXTENSIONS).map_err(Failure::usage)?;
    }
    advice::check_spline(&arguments.spline, None)?;
    if !arguments.iso.is_finite() {
        return Err(Failure::usage(format!("--iso {}: a finite number is needed", arguments.iso)));
    }
    let file = zeroset_io::read_spline(&arguments.spline).map_err(Failure::reading)?;
    spline_file::note(&arguments.spline, &file).iter().for_each(|note| say.line(note));
    let points = arguments.points.as_ref().map(|path| points::read(path, arguments.format)).transpose()?;
    match (file.dimension(), points) {
        (2, None) => plane(arguments, &file, &[])?,
        (2, Some(Points::Two(set))) => plane(arguments, &file, &set.points)?,
        (3, None) => space(arguments, &file, &[])?,
        (3, Some(Points::Three(set))) => space(arguments, &file, &set.points)?,
        (dimension, _) => {
            let spline = arguments.spline.display();
            return Err(Failure::input(format!(
                "{spline} is a function of {dimension} variables, but the points have another number of columns"
            )));
        }
    }
    for path in &arguments.output {
        say.line(format_args!("wrote {}", path.display()));
    }
    Ok(())
}

fn plane(arguments: &Render, file: &SplineFile, points: &[[f64; 2]]) -> Result<(), Failure> {
    if arguments.view.is_some() {
        return Err(Failure::usage("--view: a function of two variables has only one"));
    }
    let (origin, spline) = to_spline::<2>(&arguments.spline, file)?;
    let levels = Levels::of(&spline, &origin, points, arguments.iso)?;
    arguments.output.iter().try_for_each(|path| levels.write(path, arguments.size))
}

fn space(arguments: &Render, file: &SplineFile, points: &[[f64; 3]]) -> Result<(), Failure> {
    for path in &arguments.output {
        zeroset_io::extension_among(path, &["png"]).map_err(Failure::usage)?;
    }
    let (origin, spline) = to_spline::<3>(&arguments.spline, file)?;
    let refused = |error: &dyn std::fmt::Display| {
        Failure::input(format!("{}, f = {}: {error}", arguments.spline.display(), arguments.iso))
    };
    let f = spline.plus_constant(-arguments.iso).map_err(|error| refused(&error))?;
    let halvings = lattice::halvings(&f, FINE_ENOUGH);
    lattice::check_search(&f, halvings)?;
    let found = isosurface::graded_surface_of(&f, halvings..=halvings, &Default::default());
    let (mesh, _) = found.map_err(|error| refused(&error))?;
    // The mesh stays relative to the origin, for the sake of its last digits.
    let points: Vec<[f64; 3]> = points.iter().map(|p| axis_by_axis(*p, origin, |x, origin| x - origin)).collect();
    let up = Up::from(arguments.up);
    let view = arguments.view.map_or(View::oblique(up), |direction| View { direction, up });
    arguments.output.iter().try_for_each(|path| write_surface(path, &mesh, &points, &[view], arguments.size))
}
