//! A random cloud with random options.

use zeroset::eikonal_sweep::Method;
use zeroset::{Normals, Options, Topology};

use crate::random::Random;
use crate::shapes::{Shape2, Shape3};

/// Points of either dimension.
#[derive(Debug, Clone, PartialEq)]
pub enum Cloud {
    /// In the plane.
    Two(Vec<[f64; 2]>),
    /// In space.
    Three(Vec<[f64; 3]>),
}

/// A small reconstruction, of a size that takes about 0.3 s at most.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What it is, in words.
    pub name: String,
    /// The points.
    pub cloud: Cloud,
    /// How they are reconstructed.
    pub options: Options,
}

impl Case {
    /// The case of a seed.
    pub fn of_seed(seed: u64) -> Self {
        let mut random = Random(seed);
        // Neighbouring seeds have nothing in common.
        random = Random(random.bits());
        if random.one_in(2) { Self::in_space(&mut random) } else { Self::in_the_plane(&mut random) }
    }

    fn in_the_plane(random: &mut Random) -> Self {
        let shape = Shape2::ALL[random.below(Shape2::ALL.len())];
        let resolution = if random.one_in(2) { None } else { Some(8 + random.below(56)) };
        let mut options = options(resolution, random);
        if options.degree != 3 {
            // One dense lattice, as fine as the densest part needs, takes minutes.
            options.resolution = options.resolution.or(Some(48));
        }
        // By itself a lattice has as many cells along a side as there are points, and where there is no curve all of them are tried.
        let most = if options.resolution.is_none() { 120 } else { 300 };
        let count = 4 + count_below(most, random);
        let points = (0..count).map(|_| shape.point(random)).collect();
        let (points, what) = mistreated(points, farthest(&options), random);
        Self { name: format!("{shape:?}: {count} points{what}"), cloud: Cloud::Two(points), options }
    }

    fn in_space(random: &mut Random) -> Self {
        let shape = Shape3::ALL[random.below(Shape3::ALL.len())];
        // By itself, or from 12 cells on, a run takes longer.
        let resolution = if random.one_in(20) { None } else { Some(8 + random.below(4)) };
        let mut options = options(resolution, random);
        if options.degree > 3 {
            // Each point meets 125 coefficients, or 216, in place of 64, and the matrices, factored for every smoothing length that
            // is tried, are nearly full.
            options.resolution = Some(8);
            options.smoothing = options.smoothing.or(Some(0.05));
            options.margin = None;
            options.refine &= options.degree < 5;
        } else if options.degree != 3 {
            options.resolution = options.resolution.or(Some(10));
        }
        if options.topology == Topology::Paper {
            // Its matrix is factored time and again: half a minute where a margin makes the lattice larger.
            options.margin = None;
            options.resolution = Some(8);
            options.degree = options.degree.min(3);
        }
        let most = match options.resolution {
            None => 12,
            Some(_) if options.degree > 3 => 40,
            Some(_) => 150,
        };
        let count = 5 + count_below(most, random);
        let points = (0..count).map(|_| shape.point(random)).collect();
        let (points, what) = mistreated(points, farthest(&options), random);
        Self { name: format!("{shape:?}: {count} points{what}"), cloud: Cloud::Three(points), options }
    }
}

/// Now and then a very small one.
fn count_below(most: usize, random: &mut Random) -> usize {
    let most = if random.one_in(8) { 12 } else { most };
    random.below(most)
}

/// How far off outliers may be. Without a resolution every smoothing length down to the spacing near the origin is tried, and with
/// high degrees each takes long.
fn farthest(options: &Options) -> f64 {
    if options.resolution.is_none() || options.degree > 3 { 1e2 } else { 1e6 }
}

/// Does to points what scanners and programs do to them; says what.
fn mistreated<const D: usize>(
    mut points: Vec<[f64; D]>,
    farthest: f64,
    random: &mut Random,
) -> (Vec<[f64; D]>, String) {
    let mut what = String::new();
    let mut said = |text: String| what += &format!(", {text}");
    if random.one_in(3) {
        let noise = 10f64.powf(-4.0 + 3.0 * random.uniform());
        points.iter_mut().flatten().for_each(|x| *x += noise * random.gaussian());
        said(format!("noise {noise:.1e}"));
    }
    if random.one_in(4) {
        // A hole: nothing beyond a plane.
        let most = 0.9 * random.uniform();
        points.retain(|p| p[0] < most);
        said(format!("x < {most:.2}"));
    }
    if random.one_in(6) {
        let by = 10f64.powf(-6.0 * random.uniform());
        points.iter_mut().for_each(|p| p[D - 1] *= by);
        said(format!("flattened to {by:.1e}"));
    }
    if random.one_in(4) {
        let (count, far) = (1 + random.below(8), farthest.powf(random.uniform() * random.uniform()));
        points.extend((0..count).map(|_| std::array::from_fn::<_, D, _>(|_| far * (2.0 * random.uniform() - 1.0))));
        said(format!("{count} outliers within {far:.1e}"));
    }
    if random.one_in(4) && !points.is_empty() {
        let (times, jitter) = (1 + random.below(4), if random.one_in(2) { 0.0 } else { 1e-9 });
        for i in 0..times * points.len().min(200) {
            points.push(points[i].map(|x| x + jitter * random.gaussian()));
        }
        said(format!("up to {times} times repeated with jitter {jitter:.0e}"));
    }
    if random.one_in(10) {
        let steps = 4.0 + 60.0 * random.uniform();
        points.iter_mut().flatten().for_each(|x| *x = (steps * *x).round());
        said(format!("whole numbers up to {steps:.0}"));
    }
    if random.one_in(4) {
        let (scale, shift) = (10f64.powf(24.0 * random.uniform() - 12.0), 10f64.powf(8.0 * random.uniform()));
        points.iter_mut().flatten().for_each(|x| *x = scale * (*x + shift));
        said(format!("moved by {shift:.1e} and scaled by {scale:.1e}"));
    }
    if random.one_in(100) && !points.is_empty() {
        let index = random.below(points.len());
        points[index][D - 1] = [f64::NAN, f64::INFINITY, 1e308, 1e-308][random.below(4)];
        said(format!("{:e} in point {index}", points[index][D - 1]));
    }
    (points, what)
}

fn options(resolution: Option<usize>, random: &mut Random) -> Options {
    Options {
        resolution,
        degree: if random.one_in(4) { 2 + random.below(4) } else { 3 },
        topology: if random.one_in(8) { Topology::Paper } else { Topology::Continuation },
        smoothing: random.one_in(8).then(|| 10f64.powf(-3.0 + 3.0 * random.uniform())),
        distance: [Method::ClosestPoint, Method::Godunov, Method::Exact][random.below(3)],
        open: random.one_in(5),
        refine: !random.one_in(5),
        // Not what is free at the moment: the same run on every machine.
        memory: Some(if random.one_in(20) { 1 << (20 + random.below(8)) } else { 4 << 30 }),
        // Unless they are ignored, each point's normal leads from the origin to it.
        normals: if random.one_in(6) { [Normals::Hint, Normals::Trust][random.below(2)] } else { Normals::Ignore },
        margin: random.one_in(8).then(|| 0.6 * random.uniform()),
        loss_length: random.one_in(16).then(|| 10f64.powf(-3.0 + 3.0 * random.uniform())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_has_one_case_and_seeds_differ() {
        let (one, two) = (Case::of_seed(5), Case::of_seed(6));
        assert_eq!(one, Case::of_seed(5));
        assert_ne!(one, two);
    }

    #[test]
    fn every_kind_occurs() {
        let names: String = (0..2000).map(|seed| Case::of_seed(seed).name + "\n").collect();
        let shapes = Shape2::ALL.map(|s| format!("{s:?}:")).into_iter().chain(Shape3::ALL.map(|s| format!("{s:?}:")));
        let acts = ["noise", "x <", "flattened", "outliers", "repeated", "whole", "moved", " in point"];
        for part in shapes.chain(acts.map(String::from)) {
            assert!(names.contains(&part), "{part}");
        }
    }
}
