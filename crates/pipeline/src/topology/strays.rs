//! Points that have a speck of surface to themselves.
//!
//! A point beside the surface that is fitted as if it were on it makes the function vanish around it: a speck outside, a bubble
//! inside, smaller than the distance between points. A surface that a point belongs to goes on beyond it.

use std::collections::BTreeMap;

use rayon::prelude::*;
use zeroset_bspline::{Derivatives, Implicit};

use crate::lattice::domain::{flat_index, multi_index};
use crate::points::spacing::Spacing;

/// The surface is looked for at so many times the room around a point, in the directions of the outer cells of a cube of so many along
/// each side: farther away thin walls are seen at smaller angles.
const AROUND: [(f64, usize); 2] = [(0.35, 3), (0.7, 5)];
/// And the piece that ends before that at these shares of it,
const NEARER: [f64; 2] = [0.3, 0.65];
/// if the function at the point is below this share of the shortest of those lengths: then its zero set is near the point.
const AT_POINT: f64 = 0.5;

/// Around a point that stands alone f is looked at as far as this share of the distance to the nearest other one,
const WITHIN: f64 = 0.95;
/// at the nodes of a lattice with so many to each side, the last of them beyond.
const HALF: usize = 9;

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

/// Those of the points that stand alone, farther from all others than these are apart, and lie on a piece of f = 0 that hangs together with
/// nothing else within that; not those that are `known`. f is about the distance. In frame units.
pub fn strays_alone<const D: usize>(
    f: &impl Implicit<D>,
    points: &[[f64; D]],
    spacing: &Spacing,
    known: &[bool],
) -> Vec<Stray<D>> {
    let Spacing { local, nearest, .. } = spacing;
    // Beside a curve the sixth neighbour, by which the spacing goes, may be hardly farther away than the nearest one.
    let alone = (0..points.len()).into_par_iter().filter(|i| !known[*i] && nearest[*i] > local[*i]);
    alone.filter_map(|i| stray_alone(f, points, i, nearest[i])).collect()
}

/// One of the points, with so much `room` around it, if it lies on such a piece, whatever its form.
fn stray_alone<const D: usize>(f: &impl Implicit<D>, points: &[[f64; D]], index: usize, room: f64) -> Option<Stray<D>> {
    let point = points[index];
    let at = f.evaluate(&[point], Derivatives::Gradient);
    let gradient = at.gradients[0];
    let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    if at.values[0].abs() >= AT_POINT * AROUND[0].0 * room || length == 0.0 {
        return None;
    }
    // Across nearly all points the function changes sign.
    let lengths = [AROUND[0].0, AROUND[1].0, WITHIN].map(|share| share * room / length);
    let along = |step: f64| -> [f64; D] { std::array::from_fn(|axis| point[axis] + step * gradient[axis]) };
    let across = f.evaluate(&lengths.map(|step| [along(-step), along(step)]).concat(), Derivatives::Value).values;
    if across.chunks(2).all(|ends| (ends[0] < 0.0) != (ends[1] < 0.0)) {
        return None;
    }
    let (counts, middle) = ([2 * HALF + 1; D], HALF as f64);
    let step = WITHIN * room / (middle - 1.0);
    let offsets: Vec<[f64; D]> =
        (0..counts.iter().product()).map(|i| multi_index(i, &counts).map(|i| i as f64 - middle)).collect();
    let places: Vec<[f64; D]> =
        offsets.iter().map(|offset| std::array::from_fn(|axis| point[axis] + step * offset[axis])).collect();
    let inside: Vec<bool> = f.evaluate(&places, Derivatives::Value).values.iter().map(|value| *value < 0.0).collect();
    // Nodes with this sign that hang together with those around the point, if all of them are well within.
    let piece = |sign: bool| {
        let mut seen = vec![false; places.len()];
        let mut piece: Vec<usize> = Vec::new();
        let mut next: Vec<usize> = (0..places.len()).filter(|i| offsets[*i].iter().all(|x| x.abs() <= 1.0)).collect();
        while let Some(i) = next.pop() {
            if inside[i] != sign || std::mem::replace(&mut seen[i], true) {
                continue;
            }
            if offsets[i].iter().map(|x| x * x).sum::<f64>().sqrt() > middle - 1.0 {
                return None;
            }
            piece.push(i);
            let at = multi_index(i, &counts);
            let beside = (0..3usize.pow(D as u32)).map(|k| multi_index(k, &[3; D]));
            let moved = |step: [usize; D]| std::array::from_fn(|axis| at[axis] + step[axis] - 1);
            next.extend(beside.map(|step| flat_index(&moved(step), &counts)));
        }
        (!piece.is_empty()).then_some(piece)
    };
    let (of_inside, of_outside) = (piece(true), piece(false));
    let is_speck = of_inside.is_some();
    let piece = match (of_inside, of_outside) {
        (Some(piece), None) | (None, Some(piece)) => piece,
        _ => return None,
    };
    let places = piece.into_iter().map(|i| places[i]).chain([point]).collect();
    Some(Stray { index, places, value: AROUND[0].0 * room * if is_speck { 1.0 } else { -1.0 } })
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

    /// Of any form, up to the distance of the nearest other point, which the surface itself may be nearer than.
    #[test]
    fn a_point_that_stands_alone_may_have_a_large_speck() {
        let domain = Domain::around(&[1.0, 1.0, 1.0], 8);
        let (point, room) = ([0.0, 0.0, 0.12], 0.4);
        // An ellipsoid, seven tenths of the room long, with the point at one end, and a surface at nine tenths of it.
        let speck = |x: [f64; 3]| ((x[0] - 0.14) / 0.14).hypot(x[1] / 0.08).hypot((x[2] - 0.12) / 0.08) - 1.0;
        let f = spline(&domain, 3, |x| (x[2] + 0.24).min(0.1 * speck(x)));
        let found = stray_alone(&f, &[point], 0, room).unwrap();
        assert!(found.value > 0.0 && found.places.contains(&point) && found.places.len() > 20, "{found:?}");
        assert!(found.places.iter().all(|x| x[2] > 0.0), "{found:?}");
        // A cavity of that form.
        let f = spline(&domain, 3, |x| (x[2] - 0.4).max(-0.1 * speck(x)));
        assert!(stray_alone(&f, &[point], 0, room).unwrap().value < 0.0);
        // A rod, a wall, and what hangs together with the surface.
        let rod = spline(&domain, 3, |x| (x[1] + 0.05).hypot(x[2] - 0.12) - 0.05);
        assert_eq!(stray_alone(&rod, &[point], 0, room), None);
        let wall = spline(&domain, 3, |x| (x[2] - 0.09).abs() - 0.03);
        assert_eq!(stray_alone(&wall, &[point], 0, room), None);
        let bump = spline(&domain, 3, |x| (x[2] + 0.24).min(x[0].hypot(x[1] - 0.1) - 0.1));
        assert_eq!(stray_alone(&bump, &[point], 0, room), None);
    }

    #[test]
    fn of_curves_too() {
        let domain = Domain::around(&[1.0, 1.0], 12);
        let f = spline(&domain, 2, |x| x[1].abs().min((x[1] - 0.3).hypot(x[0]) - 0.03));
        assert_eq!(indices(&f, &[[0.0, 0.32], [0.0, 0.27]], 0.2), [0, 1]);
    }
}
