//! Places where points may lie: shapes that have an answer, and shapes that have none.

use std::f64::consts::{PI, TAU};

use crate::random::Random;

/// Sets of points in the plane, of size about 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape2 {
    /// A circle of radius 1.
    Circle,
    /// A five-pointed star without corners.
    Star,
    /// The rim of a square.
    Square,
    /// Two circles with the same centre.
    Annulus,
    /// Two circles beside each other.
    TwoCircles,
    /// Two circles that cross.
    CrossingCircles,
    /// A curve that crosses itself (Gerono's lemniscate).
    Eight,
    /// A circle with a chord in it.
    CircleWithChord,
    /// Two thirds of a circle.
    Arc,
    /// Two turns of a spiral.
    Spiral,
    /// A segment that no axis is parallel to.
    Segment,
    /// A full disc.
    Disc,
    /// A dense cluster in sparse noise.
    Cluster,
    /// The nodes of a square lattice.
    Lattice,
}

/// Sets of points in space, of size about 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape3 {
    /// A sphere of radius 1.
    Sphere,
    /// A torus with radii 1 and 0.4.
    Torus,
    /// The faces of a cube.
    Cube,
    /// Two spheres beside each other.
    TwoSpheres,
    /// Two spheres with the same centre.
    Shell,
    /// Two spheres that cross.
    CrossingSpheres,
    /// A sphere with a disc across its inside.
    SphereWithSheet,
    /// A Möbius band.
    Moebius,
    /// A Klein bottle (the figure-eight immersion).
    Klein,
    /// Half a sphere.
    Bowl,
    /// A plane sheet that no axis is parallel to.
    Sheet,
    /// Three turns of a helix: a curve.
    Helix,
    /// A segment that no axis is parallel to.
    Segment,
    /// A full ball.
    Ball,
    /// A dense cluster in sparse noise.
    Cluster,
    /// The nodes of a cubic lattice.
    Lattice,
}

impl Shape2 {
    /// Every one.
    pub const ALL: [Self; 14] = [
        Self::Circle,
        Self::Star,
        Self::Square,
        Self::Annulus,
        Self::TwoCircles,
        Self::CrossingCircles,
        Self::Eight,
        Self::CircleWithChord,
        Self::Arc,
        Self::Spiral,
        Self::Segment,
        Self::Disc,
        Self::Cluster,
        Self::Lattice,
    ];

    /// A point on it.
    pub fn point(self, random: &mut Random) -> [f64; 2] {
        let (u, v) = (random.uniform(), random.uniform());
        let at = |r: f64, turns: f64| [r * (TAU * turns).cos(), r * (TAU * turns).sin()];
        let beside = |[x, y]: [f64; 2], by: f64| [x + if v < 0.5 { -by } else { by }, y];
        match self {
            Self::Circle => at(1.0, u),
            Self::Star => at(1.0 + 0.3 * (5.0 * TAU * u).cos(), u),
            Self::Square => {
                let (side, along) = ((4.0 * u).floor(), 2.0 * (4.0 * u).fract() - 1.0);
                let far = if side % 2.0 == 0.0 { 1.0 } else { -1.0 };
                if side < 2.0 { [along, far] } else { [far, along] }
            }
            // By length.
            Self::Annulus => at(if v < 2.0 / 3.0 { 1.0 } else { 0.5 }, u),
            Self::TwoCircles => beside(at(0.5, u), 0.9),
            Self::CrossingCircles => beside(at(0.8, u), 0.5),
            Self::Eight => [(TAU * u).cos(), (TAU * u).cos() * (TAU * u).sin()],
            Self::CircleWithChord => {
                if v < PI / (PI + 1.0) {
                    at(1.0, u)
                } else {
                    [2.0 * u - 1.0, 0.0]
                }
            }
            Self::Arc => at(1.0, u / 1.5),
            Self::Spiral => at(0.2 + 0.8 * u.sqrt(), 2.0 * u.sqrt()),
            Self::Segment => [2.0 * u - 1.0, 0.7 * u + 0.1],
            Self::Disc => at(v.sqrt(), u),
            Self::Cluster if v < 0.8 => [random.gaussian(), random.gaussian()].map(|x| 0.05 * x),
            Self::Cluster => [2.0 * u - 1.0, 2.0 * random.uniform() - 1.0],
            Self::Lattice => [u, v].map(|x| (10.0 * x).floor() / 10.0),
        }
    }
}

impl Shape3 {
    /// Every one.
    pub const ALL: [Self; 16] = [
        Self::Sphere,
        Self::Torus,
        Self::Cube,
        Self::TwoSpheres,
        Self::Shell,
        Self::CrossingSpheres,
        Self::SphereWithSheet,
        Self::Moebius,
        Self::Klein,
        Self::Bowl,
        Self::Sheet,
        Self::Helix,
        Self::Segment,
        Self::Ball,
        Self::Cluster,
        Self::Lattice,
    ];

    /// A point on it.
    pub fn point(self, random: &mut Random) -> [f64; 3] {
        let (u, v, w) = (random.uniform(), random.uniform(), random.uniform());
        let (cos, sin) = ((TAU * u).cos(), (TAU * u).sin());
        // By area (Archimedes).
        let sphere = |r: f64| {
            let (z, ring) = (2.0 * v - 1.0, 2.0 * (v * (1.0 - v)).sqrt());
            [r * ring * cos, r * ring * sin, r * z]
        };
        let beside = |[x, y, z]: [f64; 3], by: f64| [x + if w < 0.5 { -by } else { by }, y, z];
        match self {
            Self::Sphere => sphere(1.0),
            Self::Torus => {
                let r = 1.0 + 0.4 * (TAU * v).cos();
                [r * cos, r * sin, 0.4 * (TAU * v).sin()]
            }
            Self::Cube => {
                let (face, a, b) = ((6.0 * w).floor(), 2.0 * u - 1.0, 2.0 * v - 1.0);
                let far = if face % 2.0 == 0.0 { 1.0 } else { -1.0 };
                if face < 2.0 {
                    [far, a, b]
                } else if face < 4.0 {
                    [a, far, b]
                } else {
                    [a, b, far]
                }
            }
            Self::TwoSpheres => beside(sphere(0.5), 0.9),
            Self::Shell => sphere(if w < 0.8 { 1.0 } else { 0.5 }),
            Self::CrossingSpheres => beside(sphere(0.8), 0.5),
            Self::SphereWithSheet if w < 0.8 => sphere(1.0),
            Self::SphereWithSheet => [v.sqrt() * cos, v.sqrt() * sin, 0.0],
            Self::Moebius => {
                let (across, half) = (v - 0.5, 0.5 * TAU * u);
                let r = 1.0 + across * half.cos();
                [r * cos, r * sin, across * half.sin()]
            }
            Self::Klein => {
                let (half, around) = (0.5 * TAU * u, TAU * v);
                let r = 1.0 + 0.5 * (half.cos() * around.sin() - half.sin() * (2.0 * around).sin());
                [r * cos, r * sin, 0.5 * (half.sin() * around.sin() + half.cos() * (2.0 * around).sin())]
            }
            Self::Bowl => {
                let [x, y, z] = sphere(1.0);
                [x, y, -z.abs()]
            }
            Self::Sheet => [2.0 * u - 1.0, 2.0 * v - 1.0, 0.3 * u - 0.7 * v],
            Self::Helix => [(3.0 * TAU * u).cos(), (3.0 * TAU * u).sin(), 2.0 * u - 1.0],
            Self::Segment => [2.0 * u - 1.0, 0.7 * u, 0.3 - u],
            Self::Ball => sphere(w.cbrt()),
            Self::Cluster if w < 0.8 => [random.gaussian(), random.gaussian(), random.gaussian()].map(|x| 0.05 * x),
            Self::Cluster => [u, v, random.uniform()].map(|x| 2.0 * x - 1.0),
            Self::Lattice => [u, v, w].map(|x| (6.0 * x).floor() / 6.0),
        }
    }
}
