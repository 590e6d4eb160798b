//! Random points of a torus around z, with large radius 1.

use std::f64::consts::TAU;

use zeroset_tests::Random;

/// Even by area: more of them on the outer side.
pub fn torus(small: f64, count: usize, random: &mut Random) -> Vec<[f64; 3]> {
    std::iter::repeat_with(|| [TAU * random.uniform(), TAU * random.uniform(), random.uniform()])
        .filter(|[_, v, chance]| chance * (1.0 + small) < 1.0 + small * v.cos())
        .map(|[u, v, _]| [(1.0 + small * v.cos()) * u.cos(), (1.0 + small * v.cos()) * u.sin(), small * v.sin()])
        .take(count)
        .collect()
}
