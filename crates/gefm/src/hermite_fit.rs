//! A fit to points and their normals, as smooth as third derivatives allow.

use std::iter::repeat_n;

use zeroset_bspline::{Collocation, DerivativeEnergy, KnotVector, Spline};
use zeroset_multigrid::NormalEquations;

use crate::error::GefmError;
use crate::gradient_form::area_vectors;

/// Settings of [`hermite_fit`]. Lengths are in frame units.
#[derive(Debug, Clone, PartialEq)]
pub struct HermiteOptions {
    /// Density ρ of the points: per unit length in 2D, per unit area in 3D. Positive.
    pub density: f64,
    /// Smoothing length ℓ; the weight of the energy is `w = ρ ℓ⁵`. Positive.
    pub smoothing_length: f64,
    /// A gradient that differs from the normal by 1 counts as much as a value of this. Positive.
    pub normal_length: f64,
    /// How often the normals are taken from the fit, and it is made again.
    pub rounds: usize,
}

/// Minimises `Σ aᵢ (f(Pᵢ)² + m² ‖∇f(Pᵢ) − nᵢ‖²) + w ∫‖∇³f‖²` with m the normal length.
///
/// Second derivatives as fairness, where nothing else is known, flatten a surface between its points; third derivatives follow its
/// curvature across holes. The energy and the interpolation of points with unit normals that are sought along with f are those
/// of Huang, Carr and Ju (2019); here f lives on a lattice, the data are approximated, and the normals begin as `normals` (of any length, one
/// per point) and are taken from f after each solution, which never raises the sum. `areas` holds one weight per point with mean 1.
///
/// The lattice's matrix is factored: it should have no more than some ten thousand coefficients.
///
/// # Errors
/// If there are no points, numbers do not fit, lengths are not positive, the degree is below 3, a point lies outside the knots' domain,
/// or the matrix cannot be factored.
pub fn hermite_fit<const D: usize>(
    points: &[[f64; D]],
    normals: &[[f64; D]],
    areas: &[f64],
    knots: &[KnotVector; D],
    options: &HermiteOptions,
) -> Result<Spline<D>, GefmError> {
    let count = points.len();
    if count == 0 {
        return Err(GefmError::NoPoints);
    }
    if areas.len() != count {
        return Err(GefmError::Areas { found: areas.len(), needed: count });
    }
    if normals.len() != count {
        return Err(GefmError::Normals { found: normals.len(), needed: count });
    }
    let HermiteOptions { density, smoothing_length: length, normal_length, rounds } = *options;
    let energy_weight = density * length.powi(5);
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if !(positive(energy_weight) && positive(length) && positive(normal_length * normal_length)) {
        return Err(GefmError::Smoothing { length, density });
    }
    let equations = NormalEquations::new(&DerivativeEnergy::new(knots, 3)?);
    // One row for the value at a point, and one for each component of the gradient there.
    let repeated: Vec<[f64; D]> = points.iter().flat_map(|point| repeat_n(*point, D + 1)).collect();
    let value = |row: usize| if row == D { 1.0 } else { 0.0 };
    let values: Vec<f64> = areas.iter().flat_map(|a| (0..=D).map(move |row| a.sqrt() * value(row))).collect();
    let unit = |row: usize| std::array::from_fn(|axis| if axis == row { normal_length } else { 0.0 });
    let gradients: Vec<[f64; D]> =
        areas.iter().flat_map(|a| (0..=D).map(move |row| unit(row).map(|x: f64| a.sqrt() * x))).collect();
    let matrix = equations.rows(&Collocation::new(knots, &repeated)?, &values, Some(&gradients), energy_weight)?;
    let factor = equations.factor(&matrix)?;

    let collocation = Collocation::new(knots, points)?;
    let weights: Vec<f64> = areas.iter().map(|a| a * normal_length * normal_length).collect();
    let fitted = |normals: &[[f64; D]]| {
        let mut right = vec![0.0; collocation.coefficient_count()];
        collocation.add_gradients_transposed(&area_vectors(normals, &weights), &mut right);
        factor.solve(&right)
    };
    let mut f = fitted(normals);
    for _ in 0..rounds {
        f = fitted(&collocation.gradients(&f));
    }
    Ok(Spline::from_flat(knots.clone(), f)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::f64::consts::TAU;

    fn knots() -> [KnotVector; 2] {
        let knots = KnotVector::uniform(3, -0.75, 0.125, 12).unwrap();
        [knots.clone(), knots]
    }

    /// Three quarters of a circle of radius 0.5.
    fn arc(count: usize) -> Vec<[f64; 2]> {
        let angle = |i: usize| 0.75 * TAU * i as f64 / (count - 1) as f64;
        (0..count).map(|i| [0.5 * angle(i).cos(), 0.5 * angle(i).sin()]).collect()
    }

    fn options() -> HermiteOptions {
        HermiteOptions { density: 25.0, smoothing_length: 0.02, normal_length: 0.02, rounds: 5 }
    }

    #[test]
    fn a_quarter_of_a_circle_is_found_again() {
        let points = arc(60);
        // Off by up to half a radian: the rounds turn them right.
        let turned = |(i, p): (usize, &[f64; 2])| {
            let (s, c) = (0.5 * (i as f64).sin()).sin_cos();
            [c * p[0] - s * p[1], s * p[0] + c * p[1]]
        };
        let normals: Vec<[f64; 2]> = points.iter().enumerate().map(turned).collect();
        let f = hermite_fit(&points, &normals, &[1.0; 60], &knots(), &options()).unwrap();
        for step in 0..20 {
            let (s, c) = (-0.25 * TAU * f64::from(step) / 19.0).sin_cos();
            let (value, gradient) = f.value_and_gradient(&[0.5 * c, 0.5 * s]);
            // A circle is no zero of a function without third derivatives; second ones alone cut the corner by 0.07.
            assert!((value / gradient[0].hypot(gradient[1])).abs() < 0.02, "{value} at step {step}");
            assert!(gradient[0] * c + gradient[1] * s > 0.5);
        }
    }

    #[test]
    fn quadratic_functions_cost_nothing() {
        // 2 y² − ⅛ has unit gradients on the sides of a strip, and no third derivatives: it is the fit, however stiff.
        let points: Vec<[f64; 2]> =
            (0..22).map(|i| [0.1 * f64::from(i / 2) - 0.5, if i % 2 == 0 { -0.25 } else { 0.25 }]).collect();
        let stiff = HermiteOptions { smoothing_length: 0.5, ..options() };
        let f =
            hermite_fit(&points, &points.iter().map(|p| [0.0, p[1]]).collect::<Vec<_>>(), &[1.0; 22], &knots(), &stiff);
        let f = f.unwrap();
        for [x, y] in [[0.3, 0.6], [-0.7, 0.2], [0.0, -0.5]] {
            // A condition number of about 1e6.
            assert!((f.value(&[x, y]) - (2.0 * y * y - 0.125)).abs() < 1e-8, "{x}, {y}");
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let points = arc(20);
        let fit = |normals: &[[f64; 2]], areas: &[f64], options: &HermiteOptions| {
            hermite_fit(&points, normals, areas, &knots(), options).unwrap_err()
        };
        let few = fit(&points[1..], &[1.0; 20], &options());
        assert_eq!(few, GefmError::Normals { found: 19, needed: 20 });
        assert_eq!(fit(&points, &[1.0; 21], &options()), GefmError::Areas { found: 21, needed: 20 });
        let without = HermiteOptions { normal_length: 0.0, ..options() };
        assert!(matches!(fit(&points, &[1.0; 20], &without), GefmError::Smoothing { .. }));
        assert_eq!(hermite_fit::<2>(&[], &[], &[], &knots(), &options()).unwrap_err(), GefmError::NoPoints);
    }
}
