//! Points that have a speck of surface to themselves.
//!
//! A point beside the surface that is fitted as if it were on it makes the function vanish around it: a speck outside, a bubble
//! inside, smaller than the distance between points. A surface that a point belongs to goes on beyond it.

use std::collections::BTreeMap;

use zeroset_bspline::{Derivatives, Implicit};

use crate::lattice::domain::multi_index;

/// The surface is looked for at so many times the room around a point, in the directions of the outer cells of a cube of so many along
/// each side: farther away thin walls are seen at smaller angles.
const AROUND: [(f64, usize); 2] = [(0.35, 3), (0.7, 5)];
/// And the piece that ends before that at these shares of it,
const NEARER: [f64; 2] = [0.3, 0.65];
/// if the function at the point is below this share of the shortest of those lengths: then its zero set is near the point.
const AT_POINT: f64 = 0.5;

/// A point on a piece of f = 0 of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Stray<const D: usize> {
    /// Among the points.
    pub index: usize,
    /// Where f has the wrong sign around it, and the point itself.
    pub places: Vec<[f64; D]>,
    /// What f is to be there, if there is nothing: about the distance from the point to where that is seen, with the sign there.
    pub value: f64,
}

/// Those of the points, with so much `room` around each of them, that lie on a piece of f = 0 that ends within it; f is about the
/// distance. In frame units.
pub fn strays<const D: usize>(f: &impl Implicit<D>, points: &[[f64; D]], room: &[f64]) -> Vec<Stray<D>> {
    let at = f.evaluate(points, Derivatives::Gradient);
    let mut found = BTreeMap::new();
    for (radius, cells) in AROUND {
        let across = |i: usize| {
            let gradient = at.gradients[i];
            let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            let step = if length > 0.0 { radius * room[i] / length } else { 0.0 };
            [-1.0, 1.0].map(|side| std::array::from_fn(|axis| points[i][axis] + side * step * gradient[axis]))
        };
        let probes: Vec<[f64; D]> = (0..points.len()).flat_map(across).collect();
        let values = f.evaluate(&probes, Derivatives::Value).values;
        // Across nearly all points the function changes sign; around the others all directions are tried.
        let ends = |i: &usize| {
            at.values[*i].abs() < AT_POINT * AROUND[0].0 * room[*i]
                && (values[2 * i] < 0.0) == (values[2 * i + 1] < 0.0)
        };
        for i in (0..points.len()).filter(ends) {
            let inside = |places: &[[f64; D]]| -> Vec<bool> {
                f.evaluate(places, Derivatives::Value).values.into_iter().map(|value| value < 0.0).collect()
            };
            let around = |share: f64| sphere(&points[i], share * radius * room[i], cells);
            let beyond = inside(&around(1.0));
            if beyond.iter().any(|inside| *inside != beyond[0]) {
                continue;
            }
            let nearer = NEARER.map(around).concat();
            let other = inside(&nearer).into_iter().zip(nearer).filter(|(inside, _)| *inside != beyond[0]);
            let mut places: Vec<[f64; D]> = other.map(|(_, place)| place).collect();
            if !places.is_empty() {
                places.push(points[i]);
                let value = AROUND[0].0 * room[i] * if beyond[0] { -1.0 } else { 1.0 };
                found.entry(i).or_insert(Stray { index: i, places, value });
            }
        }
    }
    found.into_values().collect()
}

/// Points around another one at the given distance: through the outer cells of a cube of so many, an odd number, along each side.
fn sphere<const D: usize>(centre: &[f64; D], radius: f64, cells: usize) -> Vec<[f64; D]> {
    let half = (cells / 2) as f64;
    let directions = (0..cells.pow(D as u32)).map(|i| multi_index(i, &[cells; D]).map(|i| i as f64 - half));
    directions
        .filter(|direction| direction.iter().any(|x| x.abs() == half))
        .map(|direction| {
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            std::array::from_fn(|axis| centre[axis] + radius / length * direction[axis])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::Domain;
    use crate::lattice::domain::tests::spline;

    fn indices<const D: usize>(f: &impl Implicit<D>, points: &[[f64; D]], room: f64) -> Vec<usize> {
        strays(f, points, &vec![room; points.len()]).iter().map(|stray| stray.index).collect()
    }

    #[test]
    fn specks_and_bubbles_are_found_and_walls_are_not() {
        let domain = Domain::around(&[1.0, 1.0, 1.0], 8);
        let away = |x: [f64; 3], c: [f64; 3]| (x[0] - c[0]).hypot(x[1] - c[1]).hypot(x[2] - c[2]);
        let (speck, bubble) = ([0.4, 0.0, 0.3], [0.0, -0.2, 0.0]);
        // A plate with a speck above it and a bubble in it.
        let f = spline(&domain, 3, |x| {
            let plate = x[2].abs() - 0.16;
            plate.min(away(x, speck) - 0.04).max(0.04 - away(x, bubble))
        });
        let beside = |c: [f64; 3]| [c[0], c[1], c[2] + 0.04];
        let points = [[0.2, 0.1, 0.16], [-0.3, 0.2, -0.16], beside(speck), beside(bubble), [0.0, 0.3, 0.5]];
        let found = strays(&f, &points, &[0.3; 5]);
        assert_eq!(found.iter().map(|stray| stray.index).collect::<Vec<_>>(), [2, 3]);
        assert!(found[0].value > 0.0 && found[1].value < 0.0, "outside, and in the plate");
        for stray in found {
            let values = f.evaluate(&stray.places, Derivatives::Value).values;
            let (at_point, around) = values.split_last().unwrap();
            assert!(at_point.abs() < 0.02 && around.iter().all(|value| value * stray.value < 0.0), "{values:?}");
        }
        // A larger speck, with its point at one end.
        let f = spline(&domain, 3, |x| (x[2] + 0.3).min(away(x, [0.0, 0.0, 0.2]) - 0.08));
        assert_eq!(indices(&f, &[[0.0, 0.0, 0.28], [0.1, 0.0, -0.3]], 0.3), [0]);
        // Both sides of a wall thinner than the radius.
        let wall = spline(&domain, 3, |x| x[2].abs() - 0.05);
        assert_eq!(indices(&wall, &[[0.2, 0.1, 0.05], [0.1, 0.1, -0.05]], 0.3), [0; 0]);
    }

    #[test]
    fn of_curves_too() {
        let domain = Domain::around(&[1.0, 1.0], 12);
        let f = spline(&domain, 2, |x| x[1].abs().min((x[1] - 0.3).hypot(x[0]) - 0.03));
        assert_eq!(indices(&f, &[[0.0, 0.32], [0.0, 0.27]], 0.2), [0, 1]);
    }
}
