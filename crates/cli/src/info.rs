//! `zeroset info`.

use std::io::{self, Write};
use std::sync::atomic::{AtomicUsize, Ordering};

use zeroset::Frame;
use zeroset::bspline::HierarchicalSpline;
use zeroset_io::{PointSet, Points};

use crate::arguments::Info;
use crate::axis_by_axis::axis_by_axis;
use crate::failure::Failure;
use crate::points;
use crate::spline_file::{self, to_spline};

pub fn run(arguments: &Info) -> Result<(), Failure> {
    let is_spline = arguments.format.is_none()
        && zeroset_io::extension_among(&arguments.file, zeroset_io::SPLINE_EXTENSIONS).is_ok();
    let out = &mut io::stdout().lock();
    let told = if is_spline {
        let file = zeroset_io::read_spline(&arguments.file).map_err(Failure::reading)?;
        let told = match file.dimension() {
            2 => describe_spline(out, to_spline::<2>(&arguments.file, &file)?),
            _ => describe_spline(out, to_spline::<3>(&arguments.file, &file)?),
        };
        told.and_then(|()| {
            spline_file::note(&arguments.file, &file).iter().try_for_each(|note| writeln!(out, "{note}"))
        })
    } else {
        match points::read(&arguments.file, arguments.format)? {
            Points::Two(set) => describe_points(out, &set),
            Points::Three(set) => describe_points(out, &set),
        }
    };
    match told.and_then(|()| out.flush()) {
        // Whoever reads has read enough, as `head` has.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        told => told.map_err(|error| Failure::output(format!("standard output: {error}"))),
    }
}

fn describe_spline<const D: usize>(
    out: &mut impl Write,
    (origin, spline): ([f64; D], HierarchicalSpline<D>),
) -> io::Result<()> {
    let (root, levels) = (spline.root(), spline.levels());
    let (lower, upper) = spline.domain();
    let degrees: Vec<String> = root.knots().iter().map(|knots| knots.degree().to_string()).collect();
    writeln!(out, "B-spline function of {D} variables, degree {}", degrees.join(", "))?;
    let placed = |corner| axis_by_axis(corner, origin, |x: f64, origin| x + origin);
    for (name, (lower, upper)) in ["x", "y", "z"].iter().zip(placed(lower).iter().zip(placed(upper))) {
        writeln!(out, "{name}: {lower} to {upper}")?;
    }
    writeln!(out, "control coefficients: {}", join(root.shape()))?;
    if !levels.is_empty() {
        let sides = axis_by_axis(upper, lower, |upper, lower| upper - lower);
        let sides = axis_by_axis(sides, root.shape(), |side, functions| side / (functions - 3) as f64);
        writeln!(out, "levels: {} on top of the dense one, whose cells have sides {}", levels.len(), join(sides))?;
    }
    for (k, level) in (1..).zip(levels) {
        writeln!(
            out,
            "level {k}: {} active functions, cells of sides {}",
            level.active().len(),
            join(level.cell_sides())
        )?;
    }
    if !levels.is_empty() {
        let active: usize = levels.iter().map(|level| level.active().len()).sum();
        writeln!(out, "coefficients of all levels: {}", root.as_flat().len() + active)?;
    }
    let cells = AtomicUsize::new(0);
    let crossed = spline.leaf_cells(|leaf| {
        cells.fetch_add(1, Ordering::Relaxed);
        leaf.lower < 0.0 && leaf.upper >= 0.0
    });
    writeln!(out, "cells: {}, of which {} may contain the zero set", cells.into_inner(), crossed.len())
}

fn describe_points<const D: usize>(out: &mut impl Write, set: &PointSet<D>) -> io::Result<()> {
    let normals = if set.normals.is_some() { ", with normals" } else { "" };
    writeln!(out, "{} points, {D} coordinates{normals}", set.points.len())?;
    match Frame::of(&set.points) {
        Ok((frame, distinct)) => {
            let spacing = zeroset::Spacing::of(&distinct);
            writeln!(out, "centre of the bounding box: {}", join(frame.origin))?;
            writeln!(out, "sides: {}", join(frame.sides.map(|side| side / frame.scale)))?;
            writeln!(out, "different points: {}", distinct.len())?;
            writeln!(out, "typical distance between neighbours: {}", spacing.typical / frame.scale)?;
            match spacing.lines {
                Some(_) => {
                    writeln!(out, "in lines: {} points are about as far apart, the others between", spacing.count())
                }
                None => Ok(()),
            }
        }
        Err(problem) => writeln!(out, "cannot be reconstructed: {problem}"),
    }
}

fn join<T: ToString, const D: usize>(numbers: [T; D]) -> String {
    numbers.map(|number| number.to_string()).join(" × ")
}
