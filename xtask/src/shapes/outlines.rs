//! Random solids of the plane, a family of them per function, all of size about 1.

use std::f64::consts::TAU;

use zeroset_tests::Random;

use super::families::{Family, fins, nested};
use super::solid::{Solid, distance};

/// Every family.
pub const OUTLINES: [Family<2>; 9] = [
    ("star", star),
    ("polygon", polygon),
    ("letters", letters),
    ("gear", gear),
    ("holes", holes),
    ("islands", islands),
    ("snake", snake),
    ("fork", fins),
    ("rings", nested),
];

/// Strokes of letters, in a box of width 1 and height 1.4.
const LETTERS: [&[[f64; 4]]; 8] = [
    // A, E, F, H, K, N, T, and the sign for a number.
    &[[0.0, 0.0, 0.5, 1.4], [0.5, 1.4, 1.0, 0.0], [0.2, 0.5, 0.8, 0.5]],
    &[[0.0, 0.0, 0.0, 1.4], [0.0, 0.0, 1.0, 0.0], [0.0, 0.7, 0.8, 0.7], [0.0, 1.4, 1.0, 1.4]],
    &[[0.0, 0.0, 0.0, 1.4], [0.0, 0.7, 0.8, 0.7], [0.0, 1.4, 1.0, 1.4]],
    &[[0.0, 0.0, 0.0, 1.4], [1.0, 0.0, 1.0, 1.4], [0.0, 0.7, 1.0, 0.7]],
    &[[0.0, 0.0, 0.0, 1.4], [0.0, 0.6, 1.0, 1.4], [0.3, 0.8, 1.0, 0.0]],
    &[[0.0, 0.0, 0.0, 1.4], [0.0, 1.4, 1.0, 0.0], [1.0, 0.0, 1.0, 1.4]],
    &[[0.5, 0.0, 0.5, 1.4], [0.0, 1.4, 1.0, 1.4]],
    &[[0.3, 0.0, 0.3, 1.4], [0.7, 0.0, 0.7, 1.4], [0.0, 0.45, 1.0, 0.45], [0.0, 0.95, 1.0, 0.95]],
];

/// A circle with waves of several lengths.
fn star(random: &mut Random) -> Solid<2> {
    let waves: Vec<[f64; 3]> = (0..1 + random.below(4))
        .map(|_| {
            let count = 2 + random.below(11);
            [count as f64, random.between(0.1, 0.6) / (count as f64).sqrt(), random.between(0.0, TAU)]
        })
        .collect();
    let radius = |angle: f64| {
        let sum: f64 = waves.iter().map(|[count, height, phase]| height * (count * angle + phase).cos()).sum();
        (0.8 * sum).exp()
    };
    let corner = |k: u32| {
        let angle = TAU * f64::from(k) / 720.0;
        [radius(angle) * angle.cos(), radius(angle) * angle.sin()]
    };
    Solid::polygon((0..720).map(corner).collect())
}

/// Corners around a centre, rounded or sharp.
fn polygon(random: &mut Random) -> Solid<2> {
    let (count, turn) = (3 + random.below(7), random.uniform());
    let corners = (0..count).map(|k| {
        let angle = TAU * (k as f64 + random.between(-0.35, 0.35) + turn) / count as f64;
        let radius = random.between(0.4, 1.0);
        [radius * angle.cos(), radius * angle.sin()]
    });
    let polygon = Solid::polygon(corners.collect());
    if random.one_in(3) { polygon } else { polygon.grown(random.log_between(0.02, 0.2)) }
}

/// A word of up to three letters.
fn letters(random: &mut Random) -> Solid<2> {
    let (half, flat) = (random.log_between(0.04, 0.14), random.one_in(2));
    let mut strokes = Vec::new();
    let apart = 1.0 + 2.0 * half + random.log_between(0.05, 0.4);
    for place in 0..1 + random.below(3) {
        let by = apart * place as f64;
        for [x0, y0, x1, y1] in LETTERS[random.below(LETTERS.len())] {
            let (a, b) = ([x0 + by, *y0], [x1 + by, *y1]);
            strokes.push(if flat { Solid::bar(a, b, half) } else { Solid::tube(&[a, b], half) });
        }
    }
    Solid::union(strokes)
}

/// A wheel with teeth, with a bore or without.
pub fn gear(random: &mut Random) -> Solid<2> {
    let (teeth, root) = (6 + random.below(15), random.between(0.65, 0.85));
    // Shares of a tooth's part of the wheel: at the root, and at the tip.
    let (foot, tip) = (random.between(0.5, 0.7), random.between(0.25, 0.45));
    let mut corners = Vec::new();
    for tooth in 0..teeth {
        for (radius, share) in [(root, -foot), (1.0, -tip), (1.0, tip), (root, foot)] {
            let angle = TAU * (tooth as f64 + 0.5 * share) / teeth as f64;
            corners.push([radius * angle.cos(), radius * angle.sin()]);
        }
    }
    let wheel = Solid::polygon(corners);
    if random.one_in(4) { wheel } else { wheel.without(Solid::ball([0.0; 2], root - random.log_between(0.08, 0.5))) }
}

/// A disc with holes.
fn holes(random: &mut Random) -> Solid<2> {
    let count = 1 + random.below(8);
    drilled([1.0; 2], count, random.log_between(0.03, 0.2), random).and(Solid::ball([0.0; 2], 1.0))
}

/// A rectangle, by half its sides, with up to so many holes; at least `web` is left between them, and at the rim.
pub fn drilled(half: [f64; 2], count: usize, web: f64, random: &mut Random) -> Solid<2> {
    let mut holes: Vec<([f64; 2], f64)> = Vec::new();
    // Where there is no room for all there are fewer.
    for _ in 0..20 * count {
        let (centre, radius) = (half.map(|half| random.between(-half, half)), random.log_between(0.06, 0.35));
        let clear = (0..2).all(|axis| centre[axis].abs() + radius + web < half[axis]);
        let apart = |(other, far): &([f64; 2], f64)| distance(other, &centre) > far + radius + web;
        if holes.len() < count && clear && holes.iter().all(apart) {
            holes.push((centre, radius));
        }
    }
    let holes = holes.into_iter().map(|(centre, radius)| Solid::ball(centre, radius)).collect();
    Solid::cuboid(half).without(Solid::union(holes))
}

/// Discs, rings and polygons in rows, a gap apart.
fn islands(random: &mut Random) -> Solid<2> {
    let (gap, columns, rows) = (random.log_between(0.03, 0.3), 1 + random.below(3), 2 + random.below(2));
    let mut parts = Vec::new();
    for column in 0..columns {
        for row in 0..rows {
            let part = match random.below(3) {
                0 => Solid::ball([0.0; 2], 0.5),
                1 => {
                    let thickness = random.between(0.1, 0.3);
                    Solid::ball([0.0; 2], 0.5 - 0.5 * thickness).shell(thickness)
                }
                _ => Solid::cuboid([0.5 - 0.1, random.between(0.1, 0.4)]).grown(0.1),
            };
            let pitch = 1.0 + gap;
            parts.push(part.moved([pitch * column as f64, pitch * row as f64]));
        }
    }
    Solid::union(parts)
}

/// A long thin band: wound up, or to and fro.
fn snake(random: &mut Random) -> Solid<2> {
    let (half, gap) = (random.log_between(0.03, 0.1), random.log_between(0.05, 0.3));
    let pitch = 2.0 * half + gap;
    if random.one_in(2) {
        let turns = random.between(1.5, 3.5);
        let at = |step: u32| {
            let turn = turns * f64::from(step) / 200.0;
            let radius = 0.15 + pitch * turn;
            [radius * (TAU * turn).cos(), radius * (TAU * turn).sin()]
        };
        return Solid::tube(&(0..=200).map(at).collect::<Vec<_>>(), half);
    }
    let (runs, length) = (3 + random.below(5), random.between(0.6, 1.4));
    let mut line = Vec::new();
    for run in 0..runs {
        let ends = if run % 2 == 0 { [0.0, length] } else { [length, 0.0] };
        line.extend(ends.map(|x| [x, pitch * run as f64]));
    }
    Solid::tube(&line, half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::families::FAMILIES;

    fn lipschitz<const D: usize>(families: &[Family<D>]) {
        for (name, family) in families {
            for seed in 0..8 {
                let mut random = Random(seed);
                let solid = family(&mut random);
                for _ in 0..200 {
                    let a = std::array::from_fn(|_| random.between(-1.5, 1.5));
                    let b = a.map(|c| c + random.between(-0.2, 0.2));
                    let slope = (solid.value(&a) - solid.value(&b)).abs() / distance(&a, &b);
                    assert!(slope < 1.0 + 1e-9, "{name}, seed {seed}: {slope} between {a:?} and {b:?}");
                }
            }
        }
    }

    #[test]
    fn no_shape_is_nearer_than_it_says() {
        lipschitz(&FAMILIES);
        lipschitz(&OUTLINES);
    }
}
