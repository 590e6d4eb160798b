//! `zeroset info`.

use zeroset::Frame;
use zeroset::bspline::Spline;
use zeroset_io::{PointSet, Points};

use crate::arguments::Info;
use crate::eval::to_spline;
use crate::failure::Failure;
use crate::points;

pub fn run(arguments: &Info) -> Result<(), Failure> {
    let is_spline = arguments.format.is_none()
        && zeroset_io::extension_among(&arguments.file, zeroset_io::SPLINE_EXTENSIONS).is_ok();
    if is_spline {
        let file = zeroset_io::read_spline(&arguments.file).map_err(Failure::reading)?;
        match file.dimension() {
            2 => describe_spline(to_spline::<2>(&arguments.file, &file)?),
            _ => describe_spline(to_spline::<3>(&arguments.file, &file)?),
        }
    } else {
        match points::read(&arguments.file, arguments.format)? {
            Points::Two(set) => describe_points(&set),
            Points::Three(set) => describe_points(&set),
        }
    }
    Ok(())
}

fn describe_spline<const D: usize>((origin, spline): ([f64; D], Spline<D>)) {
    let (lower, upper) = spline.domain();
    let degrees: Vec<String> = spline.knots().iter().map(|knots| knots.degree().to_string()).collect();
    println!("B-spline function of {D} variables, degree {}", degrees.join(", "));
    println!("control coefficients: {}", join(spline.shape().map(|n| n as f64)));
    for axis in 0..D {
        let name = ["x", "y", "z"][axis];
        println!("{name}: {} to {}", lower[axis] + origin[axis], upper[axis] + origin[axis]);
    }
    let bounds = spline.cell_bounds();
    let crossed = bounds.lower.iter().zip(&bounds.upper).filter(|(l, u)| **l < 0.0 && **u >= 0.0).count();
    println!("cells: {}, of which {crossed} may contain the zero set", bounds.lower.len());
}

fn describe_points<const D: usize>(set: &PointSet<D>) {
    println!(
        "{} points, {D} coordinates{}",
        set.points.len(),
        if set.normals.is_some() { ", with normals" } else { "" }
    );
    match Frame::of(&set.points) {
        Ok((frame, distinct)) => {
            println!("centre of the bounding box: {}", join(frame.origin));
            println!("sides: {}", join(frame.sides.map(|side| side / frame.scale)));
            println!("different points: {}", distinct.len());
            println!("typical distance between neighbours: {}", zeroset::Spacing::of(&distinct).typical / frame.scale);
        }
        Err(problem) => println!("cannot be reconstructed: {problem}"),
    }
}

fn join<const D: usize>(numbers: [f64; D]) -> String {
    numbers.map(|number| number.to_string()).join(" × ")
}
