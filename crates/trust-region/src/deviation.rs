//! The standard deviation of normal distances.

/// Median of `|X|` for a normal variable with standard deviation 1.
const NORMAL_MEDIAN: f64 = 0.674_49;

/// The standard deviation of normal `distances` by the median of their sizes: those of outliers, infinite ones and NaN count as far off, and
/// change little. Zero if there are none.
pub fn normal_deviation(mut distances: Vec<f64>) -> f64 {
    distances.iter_mut().for_each(|distance| *distance = distance.abs());
    let middle = distances.len() / 2;
    if distances.is_empty() { 0.0 } else { *distances.select_nth_unstable_by(middle, f64::total_cmp).1 / NORMAL_MEDIAN }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_do_not_count() {
        let mut state = 4u64;
        let mut uniform = move || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        // Sums of twelve even numbers are about normal.
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let distances: Vec<f64> = (0..20_000).map(|_| 0.3 * normal()).chain([f64::NAN, 1e9]).collect();
        let found = normal_deviation(distances);
        // The median of 20 000 scatters by 0.8 %.
        assert!((found / 0.3 - 1.0).abs() < 0.03, "{found}");
        assert_eq!(normal_deviation(vec![]), 0.0);
    }
}
