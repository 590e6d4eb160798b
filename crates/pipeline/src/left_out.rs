//! Points that are left out, and what is left of the others.

use crate::spacing::Spacing;

/// Isolated points are looked for so often at most, each time among those that are left,
const ROUNDS: usize = 4;
/// as long as a larger share than this is found: the tips of sparse parts would be worn away.
const MANY_ISOLATED: f64 = 0.005;
/// If a larger share of the points would be left out, they are the shape.
pub const MOST: f64 = 0.25;

/// Marks more members: `found` says which of those that were not marked before.
pub fn mark(marks: &mut [bool], found: &[bool]) {
    marks.iter_mut().filter(|mark| !**mark).zip(found).for_each(|(mark, found)| *mark = *found);
}

/// Those of the points that are not `off`, with their spacing, where `spacing` is that of all.
pub fn without<const D: usize>(points: &[[f64; D]], off: &[bool], spacing: Spacing) -> (Vec<[f64; D]>, Spacing) {
    let kept = kept(points, off);
    let spacing = if kept.len() < points.len() { Spacing::of(&kept) } else { spacing };
    (kept, spacing)
}

/// Those of the points that are not `off`.
pub fn kept<const D: usize>(points: &[[f64; D]], off: &[bool]) -> Vec<[f64; D]> {
    points.iter().zip(off).filter(|(_, off)| !**off).map(|(point, _)| *point).collect()
}

/// Which points lie on no surface with others (none, if these are so many that they must be the shape), the other points, and
/// their spacing.
pub fn isolated<const D: usize>(points: &[[f64; D]], spacing: Spacing) -> (Vec<bool>, Vec<[f64; D]>, Spacing) {
    let mut isolated = vec![false; points.len()];
    let (mut rest, mut rest_spacing) = (points.to_vec(), spacing.clone());
    let keeps_apart = spacing.far_ones_keep_apart(points);
    // Among many strays some look like a surface together, until the others are gone.
    for _ in 0..ROUNDS {
        let found = rest_spacing.isolated(&rest, keeps_apart);
        if !found.contains(&true) {
            break;
        }
        mark(&mut isolated, &found);
        let count = isolated.iter().filter(|isolated| **isolated).count();
        if count as f64 > MOST * points.len() as f64 {
            return (vec![false; points.len()], points.to_vec(), spacing);
        }
        let few = (found.iter().filter(|found| **found).count() as f64) < MANY_ISOLATED * points.len() as f64;
        (rest, rest_spacing) = without(&rest, &found, rest_spacing);
        if few {
            break;
        }
    }
    (isolated, rest, rest_spacing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strays_are_isolated_whatever_their_number() {
        let golden = |i: usize, step: f64| (i as f64 * step).fract();
        let sphere = (0..4000).map(|i| {
            let (z, angle) =
                (2.0 * (i as f64 + 0.5) / 4000.0 - 1.0, std::f64::consts::TAU * golden(i, 0.618_033_988_749_895));
            let ring = (1.0 - z * z).sqrt();
            [ring * angle.cos(), ring * angle.sin(), z]
        });
        for strays in [40, 160, 800] {
            // Quasi-random in a box half as large again (Roberts' sequence), but four spacings and more off the surface.
            let stray = |i| [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|step| 3.0 * golden(i, step) - 1.5);
            let spacing = (4.0 * std::f64::consts::PI / 4000.0).sqrt();
            let is_off = |p: &[f64; 3]| (p.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() > 4.0 * spacing;
            let points: Vec<[f64; 3]> = sphere.clone().chain((0..).map(stray).filter(is_off).take(strays)).collect();
            let (found, rest, _) = isolated(&points, Spacing::of(&points));
            assert!(
                !found[..4000].contains(&true) && rest.len() <= 4000 + strays / 50,
                "{strays}: {} left",
                rest.len() - 4000
            );
        }
    }
}
