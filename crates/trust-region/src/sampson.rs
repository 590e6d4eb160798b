//! The Sampson distance (equation 4), its error sum (equation 5) and its Jacobian.

use zeroset_bspline::{Collocation, Derivatives, Implicit, KnotVector, Spline};

use crate::error::Error;
use crate::rows::{Rows, dot};

/// Sampson distances `f(Pᵢ)/‖∇f(Pᵢ)‖` with the sign of `f`, equation (4), in the unit of the points.
///
/// NaN outside the box of the spline; infinite (or NaN on the zero set) where the gradient vanishes.
pub fn sampson_distances<const D: usize>(f: &impl Implicit<D>, points: &[[f64; D]]) -> Vec<f64> {
    f.evaluate(points, Derivatives::Gradient).sampson_distances()
}

/// Gradients that change a function by less than this share across its box are rounding.
const NO_GRADIENT: f64 = 1e-11;

/// Whether gradients of a given length are not f's own: the derivative of a constant is not zero but the rounding of its
/// coefficients.
pub(crate) fn is_rounding<const D: usize>(f: &Spline<D>, gradient: f64) -> bool {
    let largest = f.as_flat().iter().fold(0.0, |largest: f64, c| largest.max(c.abs()));
    let (lower, upper) = f.domain();
    let side = (0..D).map(|axis| upper[axis] - lower[axis]).fold(0.0, f64::max);
    gradient * side <= NO_GRADIENT * largest
}

/// The points of the Sampson error with their weights.
#[derive(Debug)]
pub(crate) struct SampsonError<const D: usize> {
    pub(crate) points: Vec<[f64; D]>,
    pub(crate) collocation: Collocation<D>,
    /// Square roots of the area weights, whose mean is one.
    roots: Vec<f64>,
    /// Gradients shorter than this share of their root mean square count as if they had just this length.
    gradient_floor: f64,
}

/// Values, gradients and Sampson distances at one function.
#[derive(Debug, Clone)]
pub(crate) struct SampsonState<const D: usize> {
    /// `√aᵢ rᵢ`.
    pub(crate) residuals: Vec<f64>,
    gradients: Vec<[f64; D]>,
    values: Vec<f64>,
    /// `‖∇f(Pᵢ)‖`, or the floor; 0 marks the floor in `floored`.
    norms: Vec<f64>,
    floored: Vec<bool>,
    /// `mean ‖∇f(Pᵢ)‖²`.
    pub(crate) mean_square_gradient: f64,
    /// Equation (5): `Σ aᵢ rᵢ²`.
    pub(crate) error: f64,
}

impl<const D: usize> SampsonError<D> {
    /// # Errors
    /// If a point lies outside the box of the knots or is not finite.
    pub(crate) fn new(
        knots: &[KnotVector; D],
        points: Vec<[f64; D]>,
        areas: &[f64],
        gradient_floor: f64,
    ) -> Result<Self, Error> {
        let collocation = Collocation::new(knots, &points)?;
        Ok(Self { points, collocation, roots: areas.iter().map(|a| a.sqrt()).collect(), gradient_floor })
    }

    /// `Σ aᵢ`.
    pub(crate) fn total_area(&self) -> f64 {
        dot(&self.roots, &self.roots)
    }

    /// # Errors
    /// If all gradients vanish, or numbers overflow.
    pub(crate) fn at(&self, f: &[f64]) -> Result<SampsonState<D>, Error> {
        let (values, gradients) = (self.collocation.values(f), self.collocation.gradients(f));
        let squares: Vec<f64> = gradients.iter().map(|g| dot(g, g)).collect();
        let mean_square_gradient = squares.iter().sum::<f64>() / squares.len() as f64;
        if !(mean_square_gradient.is_finite() && mean_square_gradient > 0.0) {
            return Err(Error::NoGradient);
        }
        let floor = self.gradient_floor * mean_square_gradient.sqrt();
        let floored: Vec<bool> = squares.iter().map(|s| s.sqrt() < floor).collect();
        let norms: Vec<f64> = squares.iter().map(|s| s.sqrt().max(floor)).collect();
        let residuals: Vec<f64> = values.iter().zip(&norms).zip(&self.roots).map(|((v, n), a)| a * v / n).collect();
        let error = dot(&residuals, &residuals);
        if !error.is_finite() {
            return Err(Error::NoGradient);
        }
        Ok(SampsonState { residuals, gradients, values, norms, floored, mean_square_gradient, error })
    }

    /// The Jacobian of the residuals, `√aᵢ (qᵢ/‖∇f‖ − f (Bᵢ f)/‖∇f‖³)`, where `Bᵢ f = uᵢ fₓ + vᵢ f_y [+ wᵢ f_z]`.
    ///
    /// Where the floor holds, the divisor is a constant and only the first term is left.
    pub(crate) fn jacobian(&self, state: &SampsonState<D>) -> Rows<'_, D> {
        let count = state.values.len();
        let alpha = (0..count).map(|i| self.roots[i] / state.norms[i]).collect();
        let beta = (0..count)
            .map(|i| {
                let factor = if state.floored[i] { 0.0 } else { -state.residuals[i] / state.norms[i].powi(2) };
                state.gradients[i].map(|g| factor * g)
            })
            .collect();
        Rows::new(&self.collocation, alpha, beta)
    }

    /// `B f / N`, half the derivative of `mean ‖∇f(Pᵢ)‖²`: equation (8).
    pub(crate) fn mean_gradient_normal(&self, state: &SampsonState<D>) -> Vec<f64> {
        let count = state.values.len();
        let rows = Rows::new(&self.collocation, vec![0.0; count], state.gradients.clone());
        let mut normal = vec![0.0; self.collocation.coefficient_count()];
        rows.add_transposed(&vec![1.0 / count as f64; count], &mut normal);
        normal
    }
}

impl<const D: usize> SampsonState<D> {
    /// Number of points whose gradient is below the floor.
    pub(crate) fn floored(&self) -> usize {
        self.floored.iter().filter(|&&floored| floored).count()
    }

    /// Mean of `‖∇f(Pᵢ)‖`.
    pub(crate) fn mean_gradient(&self) -> f64 {
        self.gradients.iter().map(|g| dot(g, g).sqrt()).sum::<f64>() / self.gradients.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn knots() -> [KnotVector; 2] {
        [KnotVector::uniform(3, 0.0, 0.25, 4).unwrap(), KnotVector::clamped(2, &[0.0, 0.3, 0.5, 1.0]).unwrap()]
    }

    fn error(points: &[[f64; 2]], floor: f64) -> SampsonError<2> {
        let areas: Vec<f64> = (0..points.len()).map(|i| 0.5 + (i % 3) as f64 * 0.5).collect();
        SampsonError::new(&knots(), points.to_vec(), &areas, floor).unwrap()
    }

    proptest! {
        #[test]
        fn the_jacobian_is_the_derivative(
            points in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0f64], 1..20),
            noise in proptest::collection::vec(-0.05..0.05f64, 35),
            g in proptest::collection::vec(-1.0..1.0f64, 35),
        ) {
            // A slope of about 1 along x (7 coefficients over 1.5) with bumps, so that no gradient is near zero.
            let f: Vec<f64> = noise.iter().enumerate().map(|(i, e)| (i / 5) as f64 * 0.25 - 0.7 + 0.5 * e).collect();
            let error = error(&points, 1e-6);
            let state = error.at(&f).unwrap();
            let applied = error.jacobian(&state).apply(&g);
            let step = 1e-5;
            let moved = |t: f64| -> Vec<f64> { f.iter().zip(&g).map(|(f, g)| f + t * g).collect() };
            let (after, before) = (error.at(&moved(step)).unwrap(), error.at(&moved(-step)).unwrap());
            for i in 0..points.len() {
                let difference = (after.residuals[i] - before.residuals[i]) / (2.0 * step);
                // Step² times third derivatives: up to (‖∇g‖/‖∇f‖)³ ~ 10³ here; rounding 1e-16 / step.
                prop_assert!((difference - applied[i]).abs() < 1e-6 * (1.0 + applied[i].abs()), "{difference} {}", applied[i]);
            }
        }

        #[test]
        fn scaling_f_changes_nothing_and_j_f_is_zero(
            points in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0f64], 1..20),
            f in proptest::collection::vec(-1.0..1.0f64, 35),
            scale in 0.01..100.0f64,
        ) {
            let error = error(&points, 1e-3);
            let state = error.at(&f).unwrap();
            let scaled = error.at(&f.iter().map(|c| scale * c).collect::<Vec<_>>()).unwrap();
            // Rounding only; floored residuals keep their ratio as well, the floor being relative.
            prop_assert!((state.error - scaled.error).abs() <= 1e-10 * state.error);
            let jf = error.jacobian(&state).apply(&f);
            for (i, value) in jf.iter().enumerate() {
                if !state.floored[i] {
                    prop_assert!(value.abs() <= 1e-12 * (1.0 + state.residuals[i].abs()) * (1.0 + 1.0 / state.norms[i]));
                }
            }
        }
    }

    #[test]
    fn vanishing_gradients_are_floored_and_counted() {
        // f = x² − ¼ from its blossom: the gradient vanishes on x = 0 … the left edge of the box.
        let t = knots()[0].knots().to_vec();
        let f: Vec<f64> = (0..35)
            .map(|i| i / 5)
            .map(|r| (t[r + 1] * t[r + 2] + t[r + 2] * t[r + 3] + t[r + 1] * t[r + 3]) / 3.0 - 0.25)
            .collect();
        let error = error(&[[0.0, 0.5], [0.5, 0.5], [1.0, 0.5]], 0.01);
        let state = error.at(&f).unwrap();
        assert_eq!(state.floored(), 1);
        // Mean square gradient (0 + 1 + 4)/3; the first point counts −¼ over a hundredth of its root, weight ½.
        let floor = 0.01 * (5.0f64 / 3.0).sqrt();
        assert!((state.residuals[0] + 0.5f64.sqrt() * 0.25 / floor).abs() < 1e-9);
        assert!(state.residuals[1].abs() < 1e-14);
    }
}
