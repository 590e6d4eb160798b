//! The anchor: springs between the control coefficients and those of the initial shape.
//!
//! Away from the points only fairness shapes f, and fairness knows nothing of inside and outside: f̂ there curls up, walls
//! that no point holds apart meet. The initial shape is a signed distance, with the right sign. `Σ κ_k (c_k − c̄_k)²`,
//! weighted as the energy is, keeps f at it where the caller says so; on a B-spline lattice this is equivalent to the same
//! integral over `(f − f̄)²` (the basis is stable), and costs nothing.

/// Stiffness κ of every coefficient, and where it is pulled to.
#[derive(Debug, Clone, Default)]
pub(crate) struct Anchor {
    stiffness: Vec<f64>,
    target: Vec<f64>,
}

impl Anchor {
    /// No springs if `stiffness` is empty.
    pub(crate) fn new(stiffness: &[f64], target: &[f64]) -> Self {
        if stiffness.is_empty() {
            return Self::default();
        }
        Self { stiffness: stiffness.to_vec(), target: target.to_vec() }
    }

    pub(crate) fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// `Σ κ_k (c_k − c̄_k)²`.
    pub(crate) fn energy(&self, f: &[f64]) -> f64 {
        self.pulls(f).map(|(difference, stiffness)| stiffness * difference * difference).sum()
    }

    /// Adds half its gradient times a factor.
    pub(crate) fn add_gradient(&self, f: &[f64], factor: f64, out: &mut [f64]) {
        for (out, (difference, stiffness)) in out.iter_mut().zip(self.pulls(f)) {
            *out += factor * stiffness * difference;
        }
    }

    /// Adds half its second derivative applied to `g`, times a factor.
    pub(crate) fn add_applied(&self, g: &[f64], factor: f64, out: &mut [f64]) {
        for ((out, g), stiffness) in out.iter_mut().zip(g).zip(&self.stiffness) {
            *out += factor * stiffness * g;
        }
    }

    fn pulls<'a>(&'a self, f: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
        f.iter().zip(&self.target).zip(&self.stiffness).map(|((c, target), stiffness)| (c - target, *stiffness))
    }
}
