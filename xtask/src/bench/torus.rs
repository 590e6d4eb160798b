//! The benched surface: a torus with bumps, smooth everywhere.

use crate::sample::Random;

/// Radii of the ring and of the tube. With the bumps the longest side is about 1.
const RING: f64 = 0.33;
const TUBE: f64 = 0.15;
/// The bumps' height, in the tube's radius, and how many there are around ring and tube.
const HEIGHT: f64 = 0.12;
const AROUND: [f64; 2] = [7.0, 3.0];
/// No area element is larger: `r (R + r)` of the largest r, and what the bumps' slopes add (seen in samples, with a margin).
const LARGEST: f64 = 0.13;

/// A point of the torus with its area element.
fn at(u: f64, v: f64) -> ([f64; 3], f64) {
    let ((su, cu), (sv, cv)) = (u.sin_cos(), v.sin_cos());
    let ((sa, ca), (sb, cb)) = ((AROUND[0] * u).sin_cos(), (AROUND[1] * v).sin_cos());
    let r = TUBE * (1.0 + HEIGHT * sa * cb);
    let (ru, rv) = (TUBE * HEIGHT * AROUND[0] * ca * cb, -TUBE * HEIGHT * AROUND[1] * sa * sb);
    let ring = RING + r * cv;
    // Derivatives along (cos u, sin u), its normal in the plane, and z: of u, and of v.
    let (along_u, along_v) = ([ru * cv, ring, ru * sv], [rv * cv - r * sv, 0.0, rv * sv + r * cv]);
    let cross: [f64; 3] = std::array::from_fn(|k| {
        along_u[(k + 1) % 3] * along_v[(k + 2) % 3] - along_u[(k + 2) % 3] * along_v[(k + 1) % 3]
    });
    ([ring * cu, ring * su, r * sv], cross.iter().map(|x| x * x).sum::<f64>().sqrt())
}

/// Random points, uniform by area.
pub fn points(count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    let mut points = Vec::with_capacity(count);
    while points.len() < count {
        let turn = |share: f64| std::f64::consts::TAU * share;
        let (point, element) = at(turn(random.uniform()), turn(random.uniform()));
        if random.uniform() * LARGEST < element {
            points.push(point);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_elements_are_right_and_bounded() {
        let step = 1e-6;
        for i in 0..40_000 {
            let (u, v) = (f64::from(i / 200) * 0.031_42, f64::from(i % 200) * 0.031_42);
            let (_, element) = at(u, v);
            assert!(element < LARGEST, "{element}");
            let slope =
                |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| (a[k] - b[k]) / (2.0 * step)) };
            let [a, b] = [slope(at(u + step, v).0, at(u - step, v).0), slope(at(u, v + step).0, at(u, v - step).0)];
            let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let area = (dot(a, a) * dot(b, b) - dot(a, b).powi(2)).sqrt();
            // Central differences: step² times third derivatives, and rounding over the step.
            assert!((area - element).abs() < 1e-8, "{area} {element}");
        }
    }
}
