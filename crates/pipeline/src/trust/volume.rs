//! Whether the points fill a volume (an area in the plane) instead of lying on a surface (a curve).

use crate::points::roundness::MedianRoundness;
use crate::trust::shape_name;

/// Points of the small neighbourhood.
const FEW: usize = 12;
/// Of the largest: a share of all, at most so many. What is only noisy looks flat in one that is wide against the noise,
const MANY: usize = 1600;
const SHARE: usize = 8;
/// and narrow against the shape: half as large ones are asked too, down to so many points.
const LEAST: usize = 50;
/// With fewer points than this, in the plane and in space, nobody can tell: a large neighbourhood is the whole shape.
const ENOUGH: [usize; 2] = [100, 300];

/// Median roundness of small and of all larger neighbourhoods above which the points fill a volume, in the plane and in space. Of random
/// points in a square they are 0.88 and more than 0.85, on closed curves with noise of a spacing or a little more 0.65 and 0.88. In a
/// ball, a cube or a thick shell, 300 to 20 000 points, they are 0.66 and more than 0.73. Where 10 000 points on surfaces have noise of 1 %
/// of the size, a spacing or so, the least of the larger ones is 0.21 to 0.59 (0.46 to 0.81 among 1/8 or 400), with 2 % 0.35 to 0.75.
const ROUND: [[f64; 2]; 2] = [[0.78, 0.7], [0.6, 0.7]];

/// In the plane even so many neighbours are round where points fill an area: their median roundness is above this. Of random points in a square
/// it is 0.62 to 0.72, of those in rows more; on a closed curve with noise of a spacing 0.51, and at most 0.12 on the turns of a spiral and the
/// strokes of letters that lie so close that twelve neighbours are on several of them.
const NEAREST: usize = 4;
const ROUND_NEAREST: f64 = 0.4;

/// Whether half of the points have neighbours on all sides, near and far.
fn fill_volume<const D: usize>(points: &[[f64; D]]) -> bool {
    let space = usize::from(D == 3);
    if points.len() < ENOUGH[space] {
        return false;
    }
    let roundness = MedianRoundness::of(points);
    // Nearly all surfaces are told by few neighbours, which takes much less time than many.
    roundness.among(FEW) > ROUND[space][0]
        && (D == 3 || roundness.among(NEAREST) > ROUND_NEAREST)
        && sizes(points.len()).into_iter().rev().all(|size| roundness.among(size) > ROUND[space][1])
}

/// The warning, or the doubt, where the points fill a volume: whoever says how much to smooth may know that it is noise that fills it.
pub fn verdict<const D: usize>(points: &[[f64; D]], smoothed: bool) -> (Option<String>, Option<String>) {
    if !fill_volume(points) {
        return (None, None);
    }
    let (shape, body) = (shape_name(D), if D == 2 { "an area" } else { "a volume" });
    let found = format!("the points fill {body} rather than lie on a {shape}");
    if smoothed {
        (Some(format!("{found}: unless that is noise, far wider than they are apart, the result means nothing")), None)
    } else {
        let doubt = format!(
            "no trustworthy {shape} was found: {found}; remove the points inside, or try --smooth with a length above the noise"
        );
        (None, Some(doubt))
    }
}

/// Of the larger neighbourhoods, the largest first.
fn sizes(points: usize) -> Vec<usize> {
    let largest = (points / SHARE).clamp(FEW, MANY);
    std::iter::successors(Some(largest), |size| Some(size / 2).filter(|half| *half >= LEAST)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roundness_of<const D: usize>(points: &[[f64; D]]) -> Vec<f64> {
        let roundness = MedianRoundness::of(points);
        std::iter::once(FEW).chain(sizes(points.len())).map(|size| roundness.among(size)).collect()
    }

    /// Numbers between 0 and 1 without order: the last bits of a multiplication (Knuth's multiplier), folded twice.
    fn any(i: u32, axis: u32) -> f64 {
        let fold = |x: u32| (x ^ (x >> 15)).wrapping_mul(2_654_435_761);
        f64::from(fold(fold(fold(3 * i + axis + 1)))) / 4_294_967_296.0
    }

    fn torus(count: u32, noise: f64) -> Vec<[f64; 3]> {
        tube(count, 0.4, noise)
    }

    fn tube(count: u32, radius: f64, noise: f64) -> Vec<[f64; 3]> {
        (0..count)
            .map(|i| {
                let (u, v) = (std::f64::consts::TAU * any(i, 0), std::f64::consts::TAU * any(i, 1));
                // Even, so that its standard deviation is that of the name.
                let r = radius + noise * 12_f64.sqrt() * (any(i, 2) - 0.5);
                [(1.0 + r * v.cos()) * u.cos(), (1.0 + r * v.cos()) * u.sin(), r * v.sin()]
            })
            .collect()
    }

    #[test]
    fn a_ball_does_and_a_noisy_torus_does_not() {
        for count in [400, 1200, 5000] {
            let box_: Vec<[f64; 3]> = (0..count).map(|i| [0, 1, 2].map(|axis| any(i, axis))).collect();
            let ball: Vec<[f64; 3]> =
                box_.iter().copied().filter(|p| p.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>() < 0.25).collect();
            assert!(fill_volume(&box_), "{:?}", roundness_of(&box_));
            assert!(fill_volume(&ball) || ball.len() < 300, "{:?}", roundness_of(&ball));
            let square: Vec<[f64; 2]> = (0..count).map(|i| [any(i, 0), any(i, 1)]).collect();
            assert!(fill_volume(&square), "{:?}", roundness_of(&square));
            // Who gives a smoothing length is warned.
            assert!(matches!(verdict(&square, false), (None, Some(doubt)) if doubt.contains("fill an area")));
            assert!(matches!(verdict(&square, true), (Some(warning), None) if warning.contains("fill an area")));
            // The area is 4π² · 0.4.
            let spacing = (15.8 / f64::from(count)).sqrt();
            for noise in [0.0, 0.3 * spacing] {
                let torus = torus(count, noise);
                assert!(!fill_volume(&torus), "{count} {noise}: {:?}", roundness_of(&torus));
            }
        }
        // Noise as large as the spacing.
        let noisy = torus(5000, (15.8_f64 / 5000.0).sqrt());
        assert!(!fill_volume(&noisy), "{:?}", roundness_of(&noisy));
    }

    #[test]
    fn a_noisy_tube_does_not() {
        // Noise of a quarter of the radius, or 1.3 spacings: 312 neighbours go all round, half of them do not, twice as many are long.
        let tube = tube(5000, 0.2, 0.05);
        let found = roundness_of(&tube);
        assert!(!fill_volume(&tube) && found[0] > ROUND[1][0] && found[2] > ROUND[1][1], "{found:?}");
    }

    #[test]
    fn a_thick_curve_does_not() {
        let curve: Vec<[f64; 2]> = (0..300)
            .map(|i| (0.0209 * f64::from(i), 1.0 + 0.03 * (any(i, 0) - 0.5)))
            .map(|(t, r)| [r * t.cos(), r * t.sin()])
            .collect();
        assert!(!fill_volume(&curve), "{:?}", roundness_of(&curve));
        assert_eq!(verdict(&curve, false), (None, None));
    }

    #[test]
    fn turns_of_a_spiral_do_not() {
        // Nine turns, twice as far apart as their points: the twelve nearest are on several.
        let place = |i: u32| (2.0 * f64::from(i) + any(i, 0)).sqrt() * 1.7;
        let spiral: Vec<[f64; 2]> = (100..1100).map(place).map(|t| [t * t.cos(), t * t.sin()]).collect();
        let found = roundness_of(&spiral);
        assert!(found.iter().all(|r| *r > ROUND[0][0]), "{found:?}");
        assert!(!fill_volume(&spiral), "{found:?}");
    }
}
