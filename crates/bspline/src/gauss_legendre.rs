//! Gauss–Legendre quadrature on [-1, 1].

/// Nodes and weights of the rule with `count` points, exact for polynomials of degree `2 count − 1`.
pub(crate) fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    (0..count)
        .map(|i| {
            // Newton's method on the Legendre polynomial, from Tricomi's starting value: quadratic from there.
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..20 {
                let (mut value, mut before) = (1.0, 0.0);
                for k in 0..count {
                    let k = k as f64;
                    (value, before) = (((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0), value);
                }
                slope = count as f64 * (x * value - before) / (x * x - 1.0);
                let step = value / slope;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_monomials_exactly() {
        for count in 1..=6 {
            let rule = gauss_legendre(count);
            for power in 0..2 * count {
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                // Sums of at most six terms of size one.
                assert!((sum - exact).abs() < 1e-14, "{count} points, x^{power}: {sum}");
            }
        }
    }
}
