//! Does a sphere touch the surface, and where? `cargo run --release -p zeroset --example collision`.
//!
//! B-splines come with bounds: over a box f lies between the smallest and the largest of its coefficients there. Most queries end
//! with that alone, and what it says is proven.

use std::error::Error;

use zeroset::bspline::HierarchicalSpline;
use zeroset::{Options, reconstruct};
use zeroset_io::{Points, read_points};

enum Contact {
    /// All of the sphere is outside, or all of it inside.
    Free { inside: bool },
    /// The place of the surface that the search found, and its outward normal.
    Touches { at: [f64; 3], normal: [f64; 3] },
}

/// Of a sphere with its centre in the function's coordinates.
fn query(f: &HierarchicalSpline<3>, centre: [f64; 3], radius: f64) -> Contact {
    let (lower, upper) = (centre.map(|c| c - radius), centre.map(|c| c + radius));
    match f.bounds(&lower, &upper) {
        // Beyond the function's box all is outside.
        None => return Contact::Free { inside: false },
        Some((least, _)) if least > 0.0 => return Contact::Free { inside: false },
        Some((_, most)) if most < 0.0 => return Contact::Free { inside: true },
        _ => {}
    }
    // Near the surface: go to it from the centre, down the gradient, one Newton step after another.
    let mut at = centre;
    for _ in 0..12 {
        let (value, gradient) = f.value_and_gradient(&at);
        let square: f64 = gradient.iter().map(|g| g * g).sum();
        at = std::array::from_fn(|k| at[k] - value / square * gradient[k]);
    }
    let (_, gradient) = f.value_and_gradient(&at);
    let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    let away = (0..3).map(|k| (at[k] - centre[k]).powi(2)).sum::<f64>().sqrt();
    // Not a number, where the way led out of the box, is no touch.
    if away <= radius {
        Contact::Touches { at, normal: gradient.map(|g| g / norm) }
    } else {
        Contact::Free { inside: f.value(&centre) < 0.0 }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/points/double_torus.ply");
    let Points::Three(set) = read_points(fixture)? else { return Err("points in space are needed".into()) };
    let (origin, f) = reconstruct(&set.points, &Options::default())?.in_data_units()?;

    // A ball flies over the two rings and sinks.
    for step in 0..=6 {
        let centre = [0.8 - 0.1 * f64::from(step), 0.5, 0.6 - 0.1 * f64::from(step)];
        let relative = std::array::from_fn(|k| centre[k] - origin[k]);
        print!("ball of radius 0.1 at {centre:.2?}: ");
        match query(&f, relative, 0.1) {
            Contact::Free { inside: false } => println!("free"),
            Contact::Free { inside: true } => println!("inside"),
            Contact::Touches { at, normal } => {
                let at: [f64; 3] = std::array::from_fn(|k| at[k] + origin[k]);
                println!("touches at {at:.3?}, push along {normal:.3?}");
            }
        }
    }
    Ok(())
}
