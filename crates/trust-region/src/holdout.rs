//! Which points are held out, to judge and not to fit.

/// So many points are held out at least, however small the share: fewer say nothing.
const LEAST: f64 = 48.0;

/// But never more than this share: where that is too few to judge by, none are held out.
const MOST: f64 = 0.2;

/// For every point whether it is held out: a hash of its coordinates falls below `fraction`. The choice does not depend
/// on the order of the points, nor on that and the directions of the axes, and equal points share their fate; so do those that lie in the same
/// cube with sides of this length, if it is not zero.
pub(crate) fn held_out<const D: usize>(points: &[[f64; D]], fraction: f64, side: f64, seed: u64) -> Vec<bool> {
    let least = LEAST / points.len() as f64;
    if fraction <= 0.0 || least > MOST {
        return vec![false; points.len()];
    }
    let fraction = fraction.max(least);
    let cube = |x: f64| if side > 0.0 { (x.abs() / side).floor() + 1.0 } else { x };
    let places: Vec<[f64; D]> = points.iter().map(|point| point.map(cube)).collect();
    let held: Vec<bool> = lots(&places, seed).map(|lot| lot < fraction).collect();
    // Many equal points can leave nothing on one of the sides.
    if held.iter().all(|&h| h) || held.iter().all(|&h| !h) { vec![false; points.len()] } else { held }
}

/// A number in [0, 1) for every point that chance might have drawn, but its position has, whatever the order of the points and whatever the
/// directions and the order of the axes; equal points have equal numbers. Another `seed` draws others.
pub fn lots<const D: usize>(points: &[[f64; D]], seed: u64) -> impl Iterator<Item = f64> + '_ {
    points.iter().map(move |point| unit_interval(hash(point, seed)))
}

/// Bits of a coordinate's mantissa that do not count: what other units and another origin leave is rounding.
const ROUNDING: u32 = 32;

/// The same for points that mirroring or exchanging axes turns into each other, so that a shape in another position has the same
/// points held out.
fn hash<const D: usize>(point: &[f64; D], seed: u64) -> u64 {
    let sum = point.iter().fold(0u64, |sum, x| sum.wrapping_add(mixed(x.abs().to_bits() >> ROUNDING)));
    mixed(sum ^ mixed(seed))
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mixed(bits: u64) -> u64 {
    let z = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn unit_interval(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spiral(count: usize) -> Vec<[f64; 2]> {
        (0..count).map(|i| i as f64 * 0.01).map(|t| [t * t.cos(), t * t.sin()]).collect()
    }

    #[test]
    fn the_share_is_met_and_the_order_does_not_matter() {
        let points = spiral(10_000);
        let held = held_out(&points, 0.05, 0.0, 0);
        let count = held.iter().filter(|&&h| h).count();
        // Binomial: 500 ± 22 per standard deviation.
        assert!((400..600).contains(&count), "{count}");
        let reversed: Vec<[f64; 2]> = points.iter().rev().copied().collect();
        let mut back = held_out(&reversed, 0.05, 0.0, 0);
        back.reverse();
        assert_eq!(held, back);
        assert_ne!(held, held_out(&points, 0.05, 0.0, 1), "the seed changes the choice");
        let turned: Vec<[f64; 2]> = points.iter().map(|p| [-p[1], p[0]]).collect();
        assert_eq!(held, held_out(&turned, 0.05, 0.0, 0));
    }

    #[test]
    fn what_shares_a_cube_shares_its_fate() {
        let points = spiral(10_000);
        let held = held_out(&points, 0.1, 2.0, 0);
        let cube = |i: usize| points[i].map(|x| (x / 2.0).floor());
        let mut fates = std::collections::BTreeMap::new();
        for i in 0..points.len() {
            assert_eq!(*fates.entry(cube(i).map(|x| x as i64)).or_insert(held[i]), held[i], "{:?}", points[i]);
        }
        // Some ten thousand cubes in a square of side 200, four of which share theirs, since directions of axes do not count: 0.1 ± 0.006.
        let share = fates.values().filter(|held| **held).count() as f64 / fates.len() as f64;
        assert!((0.07..0.13).contains(&share), "{share} of {}", fates.len());
        let turned: Vec<[f64; 2]> = points.iter().map(|p| [-p[1], p[0]]).collect();
        assert_eq!(held, held_out(&turned, 0.1, 2.0, 0));
    }

    #[test]
    fn lots_are_even_and_equal_points_share_theirs() {
        let points = spiral(10_000);
        let drawn: Vec<f64> = lots(&points, 3).collect();
        let below = |x: f64| drawn.iter().filter(|lot| **lot < x).count() as f64 / 1e4;
        // Binomial: at most 0.005 per standard deviation.
        assert!([0.1, 0.5, 0.9].iter().all(|x| (below(*x) - x).abs() < 0.02));
        assert_eq!(lots(&[points[7]; 2], 3).collect::<Vec<_>>(), [drawn[7]; 2]);
    }

    #[test]
    fn too_few_to_judge_means_none() {
        assert!(held_out(&spiral(200), 0.05, 0.0, 0).iter().all(|h| !h));
        assert!(held_out(&spiral(1000), 0.0, 0.0, 0).iter().all(|h| !h));
        assert!(held_out(&[[1.0, 2.0]; 1000], 0.05, 0.0, 0).iter().all(|h| !h), "equal points cannot be divided");
        // 48 of 500 wanted, five standard deviations of 6.6.
        let few = held_out(&spiral(500), 0.05, 0.0, 0).iter().filter(|&&h| h).count();
        assert!((15..=81).contains(&few), "{few}");
    }
}
