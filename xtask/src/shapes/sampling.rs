//! Random points on the boundary of a solid, as scans have them.

use std::fmt;

use zeroset_tests::Random;

use super::dimension::Dimension;
use super::solid::{Solid, ahead, distance, dot, norm};
use super::truth::{Truth, extent};

/// A point is on f = 0 when |f| is no more than this; solids are of size about 1.
const ON: f64 = 1e-9;
/// Newton steps towards f = 0 at most; a place from which they do not arrive gives no point.
const STEPS: usize = 30;
/// Thinness is looked for up to so many spacings away,
const FARTHEST: f64 = 10.0;
/// in steps of at least so many,
const SHORTEST: f64 = 0.02;
/// from so many on,
const START: f64 = 0.05;
/// at this many of the points at most.
const WALKS: usize = 3000;
/// The thinnest part is where this share of what was found is thinner.
const THINNEST: f64 = 0.01;

/// What is done to the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Random by area, on the boundary.
    Clean,
    /// Moved along the normals.
    Noise,
    /// Denser on one side.
    Uneven,
    /// Strays around them.
    Outliers,
    /// Some taken away around a place.
    Missing,
}

impl Sampling {
    /// Every one.
    pub const ALL: [Self; 5] = [Self::Clean, Self::Noise, Self::Uneven, Self::Outliers, Self::Missing];

    /// Four in ten are clean.
    pub fn random(random: &mut Random) -> Self {
        Self::ALL[random.below(20).saturating_sub(5) / 3]
    }

    /// As `--only` and the table have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Noise => "noise",
            Self::Uneven => "uneven",
            Self::Outliers => "outliers",
            Self::Missing => "missing",
        }
    }
}

impl fmt::Display for Sampling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Points with what is known of them.
pub struct Samples<const D: usize> {
    /// Those of the shape, and then the strays.
    pub points: Vec<[f64; D]>,
    /// Where those of the shape were before noise.
    pub feet: Vec<[f64; D]>,
    /// The outward unit normals there.
    pub normals: Vec<[f64; D]>,
    /// How far apart they are: the root of the area by their number, or the length by it.
    pub spacing: f64,
    /// How far it is from a point through the solid, or through what is around it, to the boundary, where it is thinnest; in
    /// spacings there.
    pub thin: f64,
    /// How noisy, how uneven and so on, in words.
    pub detail: String,
}

impl<const D: usize> Samples<D>
where
    [f64; D]: Dimension<D>,
{
    /// Draws so many points, strays not counted; `None` where the boundary has none to give.
    pub fn draw(truth: &Truth<D>, sampling: Sampling, count: usize, random: &mut Random) -> Option<Self> {
        let simplices = <[f64; D]>::simplices(&truth.boundary);
        let mut sum = 0.0;
        let sums: Vec<f64> = simplices
            .iter()
            .map(|simplex| {
                sum += extent(simplex);
                sum
            })
            .collect();
        let anywhere = |random: &mut Random| {
            let place = random.uniform() * sum;
            let simplex = &simplices[sums.partition_point(|sum| *sum <= place).min(sums.len().checked_sub(1)?)];
            foot(&truth.solid, &somewhere(simplex, random))
        };

        // By how much fewer points there are at the sparse end, and which way that is.
        let factor = if sampling == Sampling::Uneven { random.log_between(4.0, 60.0) } else { 1.0 };
        let axis = super::solid::direction::<D>(random);
        let height = |x: &[f64; D]| dot(x, &axis);
        let ends = simplices
            .iter()
            .flatten()
            .map(height)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        let chance = |x: &[f64; D]| factor.powf(-((height(x) - ends[0]) / (ends[1] - ends[0])).clamp(0.0, 1.0));

        let (mut feet, mut normals, mut tries) = (Vec::with_capacity(count), Vec::with_capacity(count), 0);
        while feet.len() < count {
            tries += 1;
            if tries > 100 * count {
                return None;
            }
            let Some((x, normal)) = anywhere(random) else { continue };
            if random.uniform() < chance(&x) {
                feet.push(x);
                normals.push(normal);
            }
        }
        let exponent = 1.0 / (D - 1) as f64;
        let spacing = (sum / count as f64).powf(exponent);
        // The density at a point, by the mean one: its chance, by the mean chance.
        let mean = count as f64 / f64::from(tries as u32);
        let local = |x: &[f64; D]| if factor > 1.0 { spacing * (mean / chance(x)).powf(exponent) } else { spacing };
        let thin = thinness(&truth.solid, &feet, &normals, local);

        let mut samples = Self { points: feet.clone(), feet, normals, spacing, thin, detail: String::new() };
        match sampling {
            Sampling::Clean => {}
            Sampling::Uneven => samples.detail = format!("1:{factor:.0}"),
            Sampling::Noise => {
                let noise = random.log_between(0.05, 0.5);
                for (point, normal) in samples.points.iter_mut().zip(&samples.normals) {
                    *point = ahead(point, noise * spacing * random.gaussian(), normal);
                }
                samples.detail = format!("{noise:.2} s");
            }
            Sampling::Outliers => {
                let share = random.between(0.01, 0.03);
                for _ in 0..(share * count as f64).ceil() as usize {
                    samples.points.push(truth.bounds.map(|[low, high]| {
                        let room = 0.15 * (high - low);
                        random.between(low - room, high + room)
                    }));
                }
                samples.detail = format!("{:.1} %", 100.0 * share);
            }
            Sampling::Missing => {
                let share = random.between(0.02, 0.06);
                let index = random.below(count);
                let middle = samples.feet[index];
                let mut far: Vec<f64> = samples.feet.iter().map(|x| distance(x, &middle)).collect();
                far.sort_by(f64::total_cmp);
                let radius = far[((share * count as f64) as usize).min(count - 1)];
                // A ball wider than the wall takes both sides of it, and nobody can tell what was there.
                let [inward, outward] =
                    [-1.0, 1.0].map(|side| across(&truth.solid, &middle, &samples.normals[index], side, spacing));
                let walls = radius / (inward.min(outward) * spacing);
                let kept: Vec<usize> = (0..count).filter(|&i| distance(&samples.feet[i], &middle) >= radius).collect();
                samples.feet = kept.iter().map(|&i| samples.feet[i]).collect();
                samples.normals = kept.iter().map(|&i| samples.normals[i]).collect();
                samples.points = samples.feet.clone();
                samples.detail = format!("{:.1} % to {walls:.1} walls", 100.0 * share);
            }
        }
        Some(samples)
    }
}

/// A place in a simplex, any as likely as any other: shares of exponential numbers.
fn somewhere<const D: usize>(simplex: &[[f64; D]; D], random: &mut Random) -> [f64; D] {
    let weights: [f64; D] = std::array::from_fn(|_| -(1.0 - random.uniform()).ln());
    let sum = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    std::array::from_fn(|axis| (0..D).map(|corner| weights[corner] / sum * simplex[corner][axis]).sum())
}

/// A place on f = 0 by Newton's method, with the unit normal.
fn foot<const D: usize>(solid: &Solid<D>, from: &[f64; D]) -> Option<([f64; D], [f64; D])> {
    let mut x = *from;
    for _ in 0..STEPS {
        let (value, gradient) = (solid.value(&x), solid.gradient(&x));
        let length = norm(&gradient);
        if length.is_nan() || length < 1e-3 {
            return None;
        }
        if value.abs() <= ON {
            return Some((x, gradient.map(|g| g / length)));
        }
        x = ahead(&x, -value / (length * length), &gradient);
    }
    None
}

/// In local spacings.
fn thinness<const D: usize>(
    solid: &Solid<D>,
    feet: &[[f64; D]],
    normals: &[[f64; D]],
    local: impl Fn(&[f64; D]) -> f64,
) -> f64 {
    let mut found = Vec::new();
    for i in (0..feet.len()).step_by(feet.len().div_ceil(WALKS).max(1)) {
        let spacing = local(&feet[i]);
        for side in [-1.0, 1.0] {
            found.push(across(solid, &feet[i], &normals[i], side, spacing));
        }
    }
    found.sort_by(f64::total_cmp);
    found.get((THINNEST * found.len() as f64) as usize).copied().unwrap_or(FARTHEST)
}

/// How far it is from a place on f = 0 to the next, inward (`side` −1) or outward (1), in spacings.
fn across<const D: usize>(solid: &Solid<D>, foot: &[f64; D], normal: &[f64; D], side: f64, spacing: f64) -> f64 {
    let mut at = START * spacing;
    while at < FARTHEST * spacing {
        let room = side * solid.value(&ahead(foot, side * at, normal));
        if room <= 0.0 {
            break;
        }
        at += room.max(SHORTEST * spacing);
    }
    (at / spacing).min(FARTHEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shell of a third, turned.
    fn shell() -> Truth<3> {
        Truth::of(Solid::ball([0.0; 3], 1.0).shell(1.0 / 3.0).turned(&mut Random(1)), 40).unwrap()
    }

    #[test]
    fn points_lie_on_the_boundary_with_its_normals() {
        let truth = shell();
        let samples = Samples::draw(&truth, Sampling::Clean, 2000, &mut Random(2)).unwrap();
        let mut outer = 0.0;
        for (x, normal) in samples.points.iter().zip(&samples.normals) {
            assert!(truth.solid.value(x).abs() < 2.0 * ON);
            let out = norm(x) > 1.0;
            outer += f64::from(u8::from(out));
            let along = dot(x, normal) / norm(x);
            assert!((along - if out { 1.0 } else { -1.0 }).abs() < 1e-6);
        }
        // By area: (7/6)² to (5/6)². Four standard deviations of 0.011.
        assert!((outer / 2000.0 - 49.0 / 74.0).abs() < 0.045);
        // The wall is a third, the hollow is wider than ten spacings of 0.11.
        let wall = 1.0 / 3.0 / samples.spacing;
        assert!((samples.thin / wall - 1.0).abs() < 0.05, "{} of {wall}", samples.thin);
    }

    #[test]
    fn every_sampling_does_its_own() {
        let truth = shell();
        let draw = |sampling| Samples::draw(&truth, sampling, 2000, &mut Random(3)).unwrap();
        let off = |samples: &Samples<3>| {
            let squares = samples.points.iter().zip(&samples.feet).map(|(x, foot)| distance(x, foot).powi(2));
            (squares.sum::<f64>() / samples.feet.len() as f64).sqrt() / samples.spacing
        };
        let noisy = draw(Sampling::Noise);
        assert!((0.045..0.55).contains(&off(&noisy)), "{}", off(&noisy));
        assert_eq!(off(&draw(Sampling::Clean)), 0.0);
        let strays = draw(Sampling::Outliers);
        assert!((20..=60).contains(&(strays.points.len() - strays.feet.len())));
        assert!((40..=121).contains(&(2000 - draw(Sampling::Missing).points.len())));
        // Where it is sparse the wall has fewer spacings.
        assert!(draw(Sampling::Uneven).thin < draw(Sampling::Clean).thin);
    }

    #[test]
    fn four_in_ten_are_clean() {
        let mut random = Random(1);
        let drawn: Vec<Sampling> = (0..20_000).map(|_| Sampling::random(&mut random)).collect();
        for (sampling, share) in Sampling::ALL.into_iter().zip([0.4, 0.15, 0.15, 0.15, 0.15]) {
            let count = drawn.iter().filter(|other| **other == sampling).count();
            // Six standard deviations.
            assert!((count as f64 / 20_000.0 - share).abs() < 0.02, "{sampling}: {count}");
        }
    }
}
