//! Random solids of space, a family of them per function, all of size about 1.

use std::f64::consts::TAU;

use zeroset_tests::Random;

use super::outlines::{drilled, gear};
use super::solid::{Solid, ahead, direction};

/// A name, and a shape from random numbers.
pub type Family<const D: usize> = (&'static str, fn(&mut Random) -> Solid<D>);

/// Every family.
pub const FAMILIES: [Family<3>; 13] = [
    ("blobs", blobs),
    ("limbs", limbs),
    ("chain", chain),
    ("pierced", pierced),
    ("gyroid", gyroid),
    ("truss", truss),
    ("plate", plate),
    ("bracket", bracket),
    ("gear", |random| gear(random).extruded(random.log_between(0.04, 0.25))),
    ("spring", spring),
    ("fins", fins),
    ("vase", vase),
    ("nested", nested),
];

/// Balls grown together.
fn blobs(random: &mut Random) -> Solid<3> {
    let mut balls = vec![([0.0; 3], random.between(0.2, 0.5))];
    for _ in 0..2 + random.below(6) {
        let (centre, radius) = balls[random.below(balls.len())];
        let next = random.between(0.15, 0.5);
        balls.push((ahead(&centre, (radius + next) * random.between(0.75, 1.05), &direction(random)), next));
    }
    let width = random.between(0.05, 0.3);
    Solid::smooth_union(balls.into_iter().map(|(centre, radius)| Solid::ball(centre, radius)).collect(), width)
}

/// A tree of rods.
fn limbs(random: &mut Random) -> Solid<3> {
    let mut joints = vec![([0.0; 3], random.log_between(0.06, 0.2))];
    let mut parts = Vec::new();
    for _ in 0..4 + random.below(7) {
        let (start, radius) = joints[random.below(joints.len())];
        let next = radius * random.between(0.6, 1.0);
        let end = ahead(&start, random.between(0.4, 0.9), &direction(random));
        parts.push(Solid::tube(&[start, end], next));
        joints.push((end, next));
    }
    Solid::smooth_union(parts, random.between(0.02, 0.15))
}

/// Linked rings.
fn chain(random: &mut Random) -> Solid<3> {
    let radius = random.log_between(0.06, 0.15);
    // Each ring passes through the hole of the one before it and clear of the one before that.
    let room = 0.25 * (0.5 - 3.0 * radius);
    let apart = random.between(0.5 + radius + room.min(0.02), 1.0 - 2.0 * radius - room.min(0.02));
    let rings = (0..2 + random.below(3)).map(|link| {
        let axes = if link % 2 == 0 { [0, 1, 2] } else { [0, 2, 1] };
        Solid::torus(0.5, radius).with_axes(axes).moved([apart * link as f64, 0.0, 0.0])
    });
    Solid::union(rings.collect())
}

/// A hollow ball with holes, or an ellipsoid.
fn pierced(random: &mut Random) -> Solid<3> {
    let thickness = random.log_between(0.05, 0.4);
    let mut shell = Solid::ball([0.0; 3], 1.0 - 0.5 * thickness).shell(thickness);
    for _ in 0..1 + random.below(6) {
        let towards = direction(random).map(|c| 2.0 * c);
        shell = shell.without(Solid::tube(&[[0.0; 3], towards], random.between(0.12, 0.4)));
    }
    if random.one_in(2) {
        shell = shell.stretched([random.between(0.6, 1.0), random.between(0.6, 1.0), 1.0]);
    }
    shell
}

/// A ball filled with a gyroid's wall, or with what is on one side of it.
fn gyroid(random: &mut Random) -> Solid<3> {
    let waves = random.between(2.5, 5.5);
    let by = std::array::from_fn(|_| random.between(-1.0, 1.0));
    let (filling, seam) = match random.one_in(2) {
        true => (Solid::gyroid_side(waves, random.between(-0.5, 0.5)), 0.5),
        false => (Solid::gyroid_side(waves, 0.0).shell(random.between(0.5, 1.0) / waves), 1.0),
    };
    // Scraps that the ball cuts off are rounded away.
    Solid::ball([0.0; 3], 1.0).smoothly_and(filling.moved(by), seam / waves)
}

/// A cage of bars: a prism, with or without bars across.
fn truss(random: &mut Random) -> Solid<3> {
    let (sides, radius) = (3 + random.below(4), random.log_between(0.04, 0.14));
    let (height, across) = (random.between(0.5, 0.9), random.below(3));
    let corner = |k: usize, up: f64| {
        let (sin, cos) = (TAU * (k % sides) as f64 / sides as f64).sin_cos();
        [cos, sin, up * height]
    };
    let mut rods = Vec::new();
    for k in 0..sides {
        let mut rod = |a, b| rods.push((a, b, radius));
        rod(corner(k, 1.0), corner(k + 1, 1.0));
        rod(corner(k, -1.0), corner(k + 1, -1.0));
        rod(corner(k, -1.0), corner(k, 1.0));
        match across {
            0 => {}
            1 => rod(corner(k, -1.0), corner(k + 1, 1.0)),
            _ => rod(corner(k, -1.0), [0.0; 3]),
        }
    }
    Solid::rods(rods)
}

/// A plate with holes.
fn plate(random: &mut Random) -> Solid<3> {
    let holes = 1 + random.below(9);
    let half = [1.0, random.between(0.5, 1.0)];
    let sheet = drilled(half, holes, random.log_between(0.04, 0.2), random);
    sheet.extruded(random.log_between(0.025, 0.2))
}

/// Two plates at right angles, drilled, with a boss.
fn bracket(random: &mut Random) -> Solid<3> {
    let (half, wide) = (random.log_between(0.04, 0.15), random.between(0.4, 0.7));
    let web = random.between(0.05, 0.15);
    let plate = |random: &mut Random| {
        let holes = random.below(4);
        drilled([0.9, wide], holes, web, random).extruded(half)
    };
    let base = plate(random);
    let upright = plate(random).with_axes([2, 1, 0]).moved([half - 0.9, 0.0, 0.9 - half]);
    let mut bracket = Solid::union(vec![base, upright]);
    if random.one_in(2) {
        let outer = random.between(0.18, 0.3);
        let bore = outer - random.between(0.08, 0.12);
        let at = [random.between(0.0, 0.5), 0.0, 0.0];
        let [boss, bore] = [(outer, 0.4), (bore, 1.0)]
            .map(|(radius, half)| Solid::<2>::ball([0.0; 2], radius).extruded(half).moved(at));
        bracket = Solid::union(vec![bracket, boss]).without(bore);
    }
    bracket
}

/// A wire wound around an axis.
fn spring(random: &mut Random) -> Solid<3> {
    let (turns, wire) = (random.between(2.0, 5.0), random.log_between(0.05, 0.14));
    let pitch = 2.0 * wire + random.log_between(0.06, 0.4);
    let steps = (32.0 * turns) as usize;
    let line: Vec<[f64; 3]> = (0..=steps)
        .map(|step| {
            let turn = turns * (step as f64 / steps as f64 - 0.5);
            let (sin, cos) = (TAU * turn).sin_cos();
            [0.6 * cos, 0.6 * sin, pitch * turn]
        })
        .collect();
    Solid::tube(&line, wire)
}

/// Fins on a base. In the plane: a comb.
pub fn fins<const D: usize>(random: &mut Random) -> Solid<D> {
    let (count, half) = (2 + random.below(6), random.log_between(0.025, 0.12));
    let pitch = 2.0 * half + random.log_between(0.05, 0.3);
    let (height, base, depth) = (random.between(0.3, 0.8), random.between(0.04, 0.12), random.between(0.3, 0.7));
    let block = |across: f64, up: f64| std::array::from_fn(|axis| [across, up, depth][axis]);
    let at = |across: f64, up: f64| std::array::from_fn(|axis| [across, up, 0.0][axis]);
    let end = 0.5 * pitch * (count - 1) as f64;
    let mut parts = vec![Solid::cuboid(block(end + half, base))];
    for fin in 0..count {
        parts.push(Solid::cuboid(block(half, height)).moved(at(pitch * fin as f64 - end, height - base)));
    }
    Solid::union(parts)
}

/// A vessel that is open at its top, with a handle or without.
fn vase(random: &mut Random) -> Solid<3> {
    let (wall, height) = (random.log_between(0.02, 0.12), random.between(0.8, 1.6));
    let mut line = vec![[0.0, 0.0], [random.between(0.3, 0.5), 0.0]];
    line.extend([0.35, 0.7, 1.0].map(|up| [random.between(0.4, 0.8), up * height]));
    let (low, high) = (line[2], line[3]);
    let cup = Solid::tube(&line, wall).revolved();
    if !random.one_in(3) {
        return cup;
    }
    let (out, thick) = (random.between(0.25, 0.45), wall.max(0.04));
    let handle: Vec<[f64; 3]> = (0..=16)
        .map(|step| {
            let share = f64::from(step) / 16.0;
            let bulge = out * (0.5 * TAU * share).sin();
            [low[0] + share * (high[0] - low[0]) + bulge, 0.0, low[1] + share * (high[1] - low[1])]
        })
        .collect();
    Solid::union(vec![cup, Solid::tube(&handle, thick)])
}

/// Shells within each other, the innermost hollow or not. In the plane: rings.
pub fn nested<const D: usize>(random: &mut Random) -> Solid<D> {
    let around = if random.one_in(2) {
        Solid::ball([0.0; D], 1.0)
    } else {
        let round = random.between(0.05, 0.4);
        let mut half: [f64; D] = std::array::from_fn(|_| random.between(0.6, 1.0) - round);
        half[0] = 1.0 - round;
        Solid::cuboid(half).grown(round)
    };
    let (mut depth, mut shells) = (0.0, Vec::new());
    for _ in 0..1 + random.below(2) {
        let thickness = random.log_between(0.04, 0.25);
        shells.push(around.clone().grown(-depth - 0.5 * thickness).shell(thickness));
        depth += thickness + random.log_between(0.06, 0.25);
    }
    if shells.len() > 1 && random.one_in(3) {
        shells.push(around.grown(-depth));
    }
    Solid::union(shells)
}
