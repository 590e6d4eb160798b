//! What `reconstruct` is to work on: the points of its files, or a part of them.

use std::path::Path;

use zeroset_io::{PointSet, Points};

use crate::advice;
use crate::arguments::{Plane, Reconstruct};
use crate::axis_by_axis::{axis_by_axis, bounding_box};
use crate::failure::Failure;
use crate::points::read;

/// The points of all files, in the plane and the box that were asked for.
pub fn points(arguments: &Reconstruct) -> Result<Points, Failure> {
    if arguments.points.iter().filter(|path| path.as_path() == Path::new("-")).count() > 1 {
        return Err(Failure::usage("standard input can be read once only: give - once"));
    }
    let mut sets = Vec::with_capacity(arguments.points.len());
    for (index, path) in arguments.points.iter().enumerate() {
        let set = read(path, arguments.format);
        sets.push(if index > 0 { set.map_err(|failure| advice::another_input(path, failure)) } else { set }?);
    }
    let mut named = arguments.points.iter().zip(&sets);
    if let Some((first, one)) = named.next()
        && let Some((other, _)) = named.find(|(_, set)| set.dimension() != one.dimension())
    {
        let (first, other) = (first.display(), other.display());
        return Err(Failure::input(format_args!(
            "{first} and {other} cannot be one cloud: one has two columns, the other three"
        ))
        .with_tip("reconstruct them one by one, or give all the same number of coordinates"));
    }
    let points = Points::joined(sets).ok_or_else(|| Failure::usage("no points were given"))?;
    let points = match arguments.plane {
        Some(plane) => points.in_plane(plane.into()),
        None => points,
    };
    match points {
        Points::Two(set) => within(arguments, set).map(Points::Two),
        Points::Three(set) => within(arguments, set).map(Points::Three),
    }
}

/// The files' names.
pub fn names(arguments: &Reconstruct) -> String {
    let names: Vec<String> = arguments.points.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

/// The points of the box, if one was asked for.
fn within<const D: usize>(arguments: &Reconstruct, set: PointSet<D>) -> Result<PointSet<D>, Failure> {
    let corners = &arguments.corners;
    if corners.is_empty() {
        return Ok(set);
    }
    let (Some(lower), Some(upper), true) =
        (corners.first_chunk::<D>(), corners.last_chunk::<D>(), corners.len() == 2 * D)
    else {
        let order = if D == 2 { "X0,Y0,X1,Y1" } else { "X0,Y0,Z0,X1,Y1,Z1" };
        return Err(Failure::usage(format_args!(
            "--box has {} numbers: points with {D} coordinates need {}, {order}",
            corners.len(),
            2 * D
        )));
    };
    let mut sides = ["x", "y", "z"].into_iter().zip(lower.iter().zip(upper));
    if let Some((name, (low, high))) = sides.find(|(_, (low, high))| low.is_nan() || high.is_nan() || low > high) {
        return Err(Failure::usage(format_args!("--box is empty: it goes from {name} = {low} to {high}"))
            .with_tip("first the corner with the smaller coordinates, then the other"));
    }
    let [low, high] = bounding_box(&set.points);
    let extents = axis_by_axis(low, high, |low, high| format!("{low} to {high}"));
    let part = set.within(lower, upper);
    if part.points.is_empty() {
        return Err(Failure::input(format_args!("{}: no point lies in --box", names(arguments)))
            .with_tip(format_args!("the points reach over {}", extents.join(", "))));
    }
    Ok(part)
}

impl From<Plane> for zeroset_io::Plane {
    fn from(plane: Plane) -> Self {
        match plane {
            Plane::Xy => Self::Xy,
            Plane::Xz => Self::Xz,
            Plane::Yz => Self::Yz,
        }
    }
}
