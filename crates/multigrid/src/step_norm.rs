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
