//! Points so far away that a frame around all would leave nothing of the shape.

/// Points are far off behind a gap of at least so many times the distance up to it.
const GAP: f64 = 4.0;
/// At least so many points are needed for a few of them to be the exception.
const ENOUGH: usize = 20;
/// Far points with so many others beside them are a part of the shape.
const COMPANY: usize = 6;
/// More points than this are no exception. Also bounds the cost, which is quadratic.
const MOST: usize = 1000;

/// Which points are far off: one in ten at most, at four times the distance (from the middle of the others) of any nearer point,
/// and with few others within the size of the shape. `None` if there are none. The points must be finite.
pub fn far_off<const D: usize>(points: &[[f64; D]]) -> Option<Vec<bool>> {
    let n = points.len();
    if n < ENOUGH {
        return None;
    }
    // The box of most points: a twentieth may stick out on each side. Halves, for coordinates up to the largest f64.
    let mut centre = [0.0; D];
    let mut half = 0.0_f64;
    for axis in 0..D {
        let mut along: Vec<f64> = points.iter().map(|p| 0.5 * p[axis]).collect();
        let (_, low, rest) = along.select_nth_unstable_by(n / 20, f64::total_cmp);
        let low = *low;
        let (_, high, _) = rest.select_nth_unstable_by(n - 1 - 2 * (n / 20), f64::total_cmp);
        centre[axis] = low + *high;
        half = half.max(*high - low);
    }
    if half == 0.0 {
        return None;
    }
    let apart = |a: &[f64; D], b: &[f64; D]| (0..D).map(|k| (0.5 * a[k] - 0.5 * b[k]).abs()).fold(0.0, f64::max);
    let distances: Vec<f64> = points.iter().map(|p| apart(p, &centre)).collect();
    let mut sorted = distances.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let before = (n - 1 - n / 10..n - 1).find(|&i| sorted[i] >= 0.5 * half && sorted[i + 1] / GAP > sorted[i])?;
    let far = |distance: f64| distance > sorted[before];
    let mut outside: Vec<[f64; D]> =
        points.iter().zip(&distances).filter(|(_, d)| far(**d)).map(|(point, _)| *point).collect();
    // Repetitions are no company.
    outside.sort_unstable_by(|a, b| {
        a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    });
    outside.dedup();
    if outside.len() > MOST {
        return None;
    }
    let alone = |p: &[f64; D]| outside.iter().filter(|q| apart(p, q) < 2.0 * half).count() <= COMPANY;
    let off: Vec<bool> = points.iter().zip(&distances).map(|(p, d)| far(*d) && alone(p)).collect();
    off.contains(&true).then_some(off)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle() -> Vec<[f64; 2]> {
        (0..100).map(|i| (0.0628 * f64::from(i)).sin_cos()).map(|(s, c)| [c, s]).collect()
    }

    #[test]
    fn strays_are_far_off_and_parts_are_not() {
        assert_eq!(far_off(&circle()), None);
        for far in [5.0, 1e9, 1e300, -1.7e308] {
            let mut points = circle();
            points.extend([[far, 0.5 * far], [far, 0.5 * far], [0.0, far]]);
            let off = far_off(&points).unwrap();
            assert!(!off[..100].contains(&true) && off[100..] == [true; 3], "{far}");
        }
        let mut parts = circle();
        parts.extend((0..10).map(|i| (0.6 * f64::from(i)).sin_cos()).map(|(s, c)| [20.0 + 0.3 * c, 0.3 * s]));
        assert_eq!(far_off(&parts), None, "ten points beside each other");
        parts.truncate(102);
        assert_eq!(far_off(&parts).unwrap().iter().filter(|off| **off).count(), 2);
        assert_eq!(far_off(&[[1.0, 2.0]; 50]), None);
        let mut tips = circle();
        tips.extend([[3.5, 0.0], [0.0, 3.5]]);
        assert_eq!(far_off(&tips), None, "less than four times as far as the next");
    }
}
