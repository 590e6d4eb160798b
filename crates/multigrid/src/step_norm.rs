//! How long the iterates of conjugate gradients are.

/// The length of an iterate x in the norm of P, whose inverse preconditions the conjugate gradients, by recurrence from their
/// coefficients (Steihaug 1983): P itself is never applied. From zero on iterates only grow in this norm.
#[derive(Debug, Clone, Copy)]
pub struct StepNorm {
    /// xᵀPx, xᵀPp and pᵀPp with the direction p.
    xx: f64,
    xp: f64,
    pp: f64,
}

impl StepNorm {
    /// At zero; `square` is `rᵀP⁻¹r` with the residual r there.
    pub fn new(square: f64) -> Self {
        Self { xx: 0.0, xp: 0.0, pp: square }
    }

    /// `√(xᵀPx)`.
    pub fn length(&self) -> f64 {
        self.xx.max(0.0).sqrt()
    }

    /// Whether x would reach the boundary of a ball on the way `alpha` along the direction.
    pub fn reaches(&self, alpha: f64, radius: f64) -> bool {
        self.after(alpha) >= radius.powi(2)
    }

    fn after(&self, alpha: f64) -> f64 {
        self.xx + 2.0 * alpha * self.xp + alpha * alpha * self.pp
    }

    /// Takes x to the boundary of a ball, which ends the iteration. Gives how far that is along the direction: the positive root τ of
    /// `xᵀPx + 2τ xᵀPp + τ² pᵀPp = radius²`, without cancellation.
    pub fn cut(&mut self, radius: f64) -> f64 {
        let gap = (radius * radius - self.xx).max(0.0);
        let root = (self.xp * self.xp + self.pp * gap).sqrt();
        self.xx = radius.powi(2);
        if self.xp > 0.0 { gap / (self.xp + root) } else { (root - self.xp) / self.pp }
    }

    /// Takes x `alpha` along the direction.
    pub fn advance(&mut self, alpha: f64) {
        self.xx = self.after(alpha);
        self.xp += alpha * self.pp;
    }

    /// The next direction is the preconditioned residual and `beta` times this one; `square` is `rᵀP⁻¹r` with that residual.
    pub fn turn(&mut self, beta: f64, square: f64) {
        self.xp *= beta;
        self.pp = square + beta * beta * self.pp;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 8;

    fn dot(a: &[f64; SIZE], b: &[f64; SIZE]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn lengths_are_those_of_the_iterates() {
        // (A + I) x = b, A the second difference, with a diagonal preconditioner P that is not A's.
        let applied = |x: &[f64; SIZE]| -> [f64; SIZE] {
            let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
            std::array::from_fn(|i| 3.0 * at(i) - at(i.wrapping_sub(1)) - at(i + 1))
        };
        let p: [f64; SIZE] = std::array::from_fn(|i| 1.0 + 0.5 * i as f64);
        let length = |x: &[f64; SIZE]| x.iter().zip(p).map(|(x, p)| p * x * x).sum::<f64>().sqrt();
        let mut residual: [f64; SIZE] = std::array::from_fn(|i| (1.0 + i as f64).sin());
        let solved = |r: &[f64; SIZE]| -> [f64; SIZE] { std::array::from_fn(|i| r[i] / p[i]) };
        let (mut x, mut direction) = ([0.0; SIZE], solved(&residual));
        let mut square = dot(&residual, &direction);
        let mut norm = StepNorm::new(square);
        for _ in 0..SIZE - 2 {
            let image = applied(&direction);
            let alpha = square / dot(&direction, &image);
            let next: [f64; SIZE] = std::array::from_fn(|i| x[i] + alpha * direction[i]);
            // Between here and there lies the boundary, and the way to it is shorter.
            let radius = 0.5 * (length(&x) + length(&next));
            assert!(norm.reaches(alpha, radius) && !norm.reaches(alpha, 1.01 * length(&next)));
            let mut stopped = norm;
            let tau = stopped.cut(radius);
            let at_boundary: [f64; SIZE] = std::array::from_fn(|i| x[i] + tau * direction[i]);
            // Rounding of numbers of size one, over a few iterations.
            assert!((length(&at_boundary) - radius).abs() < 1e-12 && (stopped.length() - radius).abs() < 1e-12);
            norm.advance(alpha);
            x = next;
            assert!((norm.length() - length(&x)).abs() < 1e-12, "{} {}", norm.length(), length(&x));
            residual = std::array::from_fn(|i| residual[i] - alpha * image[i]);
            let z = solved(&residual);
            let beta = dot(&residual, &z) / square;
            square = dot(&residual, &z);
            norm.turn(beta, square);
            direction = std::array::from_fn(|i| z[i] + beta * direction[i]);
        }
    }
}
