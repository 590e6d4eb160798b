//! How what holds far from some places, and not near them, begins.

/// 0 within `reach`, 1 from twice that on, and smooth between them (Hermite's cubic).
pub fn ramp(distance: f64, reach: f64) -> f64 {
    let t = (distance / reach - 1.0).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_at_its_reach_and_is_smooth() {
        assert_eq!([0.0, 1.0, 2.0, 3.0, 4.0, 9.0].map(|d| ramp(d, 2.0)), [0.0, 0.0, 0.0, 0.5, 1.0, 1.0]);
        // A parabola at either end: 3 t² less what t³ takes away, 2e-9.
        for t in [1e-3, 1.0 - 1e-3] {
            let from_end = f64::min(t, 1.0 - t);
            let value = f64::min(ramp(1.0 + t, 1.0), 1.0 - ramp(1.0 + t, 1.0));
            assert!((value - 3.0 * from_end * from_end).abs() < 2.1e-9, "{t}: {value}");
        }
    }
}
