//! Equation (15).

use ndarray::ArrayViewD;
use serde::Serialize;
use zeroset_bspline::{AxisCollocation, DerivativeEnergy, KnotVector, Spline};

use crate::axis_factors::AxisFactors;
use crate::conjugate_gradients::{conjugate_gradients, dot};
use crate::error::Error;
use crate::lattice_data::{Banded, right_side, squared_misfit};
use crate::normal_operator::NormalOperator;
use crate::preconditioner::Preconditioner;

/// How strongly the thin-plate energy counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fairness {
    /// The length ℓ below which detail is smoothed away, in the unit of the nodes: `w = ℓ⁴ / h^D` for nodes h apart. At
    /// least 0; the nodes must be evenly spaced.
    Length(f64),
    /// The weight w itself; at least 0.
    Weight(f64),
}

/// Settings of [`fit`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// How strongly the thin-plate energy counts.
    pub fairness: Fairness,
    /// Relative residual of the normal equations at which the iteration ends; in (0, 1).
    pub tolerance: f64,
    /// Most iterations.
    pub most_iterations: usize,
}

impl Default for Options {
    /// The tolerance leaves errors of a few millionths of the size of φ, far below what smoothing does to it.
    fn default() -> Self {
        Self { fairness: Fairness::Length(0.01), tolerance: 1e-6, most_iterations: 200 }
    }
}

/// What [`fit`] did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Report {
    /// The weight w.
    pub weight: f64,
    /// Iterations of conjugate gradients.
    pub iterations: usize,
    /// Relative residual of the normal equations, as conjugate gradients carry it.
    pub residual: f64,
    /// Root mean square of `f − φ` over the nodes.
    pub rms: f64,
    /// `Eng(f)`, equation (3).
    pub energy: f64,
}

/// Fits a spline on `knots` to `values` φ on the lattice of all combinations of the coordinates in `axes` (axis order x,
/// y\[, z\]; entry `(i, j[, k])` belongs to `(axes[0][i], axes[1][j][, axes[2][k]])`): equation (15).
///
/// The 1D eigenproblems of the preconditioner are dense: time and memory grow with the cube and the square of the number
/// of coefficients along an axis, which is nothing up to several hundred.
///
/// # Errors
/// Shapes that do not fit, coordinates that do not increase or leave the knots' domain, values that are not finite,
/// options out of range, nodes that do not determine the spline, or an iteration that does not converge.
pub fn fit<const D: usize>(
    values: ArrayViewD<'_, f64>,
    axes: &[Vec<f64>; D],
    knots: &[KnotVector; D],
    options: &Options,
) -> Result<(Spline<D>, Report), Error> {
    const { assert!(D == 2 || D == 3, "curves and surfaces only") };
    check_axes(&values, axes, knots)?;
    if !(options.tolerance > 0.0 && options.tolerance < 1.0) {
        return Err(Error::Tolerance(options.tolerance));
    }
    let weight = weight(axes, options.fairness)?;
    let values = values.as_standard_layout();
    let phi = values.as_slice().unwrap_or_default();
    check_values(phi, values.shape())?;

    let thin_plate = DerivativeEnergy::thin_plate(knots)?;
    let collocations: [AxisCollocation; D] =
        std::array::from_fn(|axis| AxisCollocation::new(&knots[axis], &axes[axis], 0));
    let determined = |axis: usize| match weight > 0.0 {
        // What has no energy is linear: two nodes tell.
        true => axes[axis].len() >= 2,
        false => meets_schoenberg_whitney(&collocations[axis], knots[axis].basis_count()),
    };
    if let Some(axis) = (0..D).find(|&axis| !determined(axis)) {
        return Err(Error::Undetermined { axis });
    }

    // A plane is a space whose middle axis has one node and one function, so that its lines are lines all the same.
    let axis_of = |place: usize| if D == 3 { Some(place) } else { [Some(0), None, Some(1)][place] };
    let factors: [AxisFactors; 3] = std::array::from_fn(|place| match axis_of(place) {
        Some(axis) => AxisFactors::new(&collocations[axis], &thin_plate, axis),
        None => AxisFactors::unit(),
    });
    let sampling: [Banded; 3] = std::array::from_fn(|place| match axis_of(place) {
        Some(axis) => Banded::collocation(&collocations[axis], knots[axis].basis_count()),
        None => Banded::unit(),
    });

    let right = right_side(&sampling.each_ref().map(Banded::transposed), phi);
    let preconditioner = Preconditioner::new(&factors, weight).ok_or(Error::Singular)?;
    let mut operator = NormalOperator::new(&factors, weight);
    let solution = conjugate_gradients(
        |x, out| operator.apply(x, out),
        |r, out| preconditioner.apply(r, out),
        &right,
        options.tolerance,
        options.most_iterations,
    );
    let (iterations, residual) = (solution.iterations, solution.residual);
    if residual.is_nan() || residual > options.tolerance {
        return Err(Error::NotConverged { iterations, residual });
    }

    let mut product = vec![0.0; right.len()];
    operator.apply_energy(&solution.x, &mut product);
    let energy = dot(&product, &solution.x);
    let rms = (squared_misfit(&sampling, &solution.x, phi) / phi.len() as f64).sqrt();
    let report = Report { weight, iterations, residual, rms, energy };
    Ok((Spline::from_flat(knots.clone(), solution.x)?, report))
}

fn check_axes<const D: usize>(
    values: &ArrayViewD<'_, f64>,
    axes: &[Vec<f64>; D],
    knots: &[KnotVector; D],
) -> Result<(), Error> {
    let lengths: Vec<usize> = axes.iter().map(Vec::len).collect();
    if values.shape() != lengths || lengths.contains(&0) {
        return Err(Error::Shape { values: values.shape().to_vec(), axes: lengths });
    }
    for (axis, positions) in axes.iter().enumerate() {
        let fault =
            |index: usize| !positions[index].is_finite() || (index > 0 && positions[index] <= positions[index - 1]);
        if let Some(index) = (0..positions.len()).find(|&index| fault(index)) {
            return Err(Error::Axis { axis, index });
        }
        if let Some(index) = positions.iter().position(|&x| knots[axis].span(x).is_none()) {
            return Err(Error::Outside { axis, index });
        }
    }
    Ok(())
}

fn check_values(phi: &[f64], shape: &[usize]) -> Result<(), Error> {
    match phi.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(mut flat) => {
            let mut index = vec![0; shape.len()];
            for (index, &size) in index.iter_mut().zip(shape).rev() {
                (*index, flat) = (flat % size, flat / size);
            }
            Err(Error::NotFinite(index))
        }
    }
}

/// Whether the nodes determine all coefficients: each basis function needs a node of its own on which it does not vanish,
/// in ascending order (Schoenberg and Whitney 1953).
fn meets_schoenberg_whitney(collocation: &AxisCollocation, functions: usize) -> bool {
    let mut nodes = 0..collocation.rows();
    (0..functions).all(|function| {
        nodes.any(|node| {
            let (first, values) = collocation.row(node);
            function >= first && values.get(function - first).is_some_and(|value| *value > 0.0)
        })
    })
}

fn weight<const D: usize>(axes: &[Vec<f64>; D], fairness: Fairness) -> Result<f64, Error> {
    let (given, weight) = match fairness {
        Fairness::Weight(weight) => (weight, weight),
        Fairness::Length(length) => {
            let mut product = 1.0;
            for positions in axes {
                let steps = positions.len() - 1;
                if steps == 0 {
                    return Err(Error::Uneven);
                }
                let h = (positions[steps] - positions[0]) / steps as f64;
                // Coordinates made by adding or multiplying steps round differently.
                if positions.windows(2).any(|pair| (pair[1] - pair[0] - h).abs() > 1e-6 * h) {
                    return Err(Error::Uneven);
                }
                product *= h;
            }
            (length, length.powi(4) / product)
        }
    };
    if given >= 0.0 && weight.is_finite() { Ok(weight) } else { Err(Error::Fairness(given)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::ArrayD;
    use proptest::prelude::*;

    fn knots() -> [KnotVector; 3] {
        [
            KnotVector::uniform(3, 0.0, 0.5, 4).unwrap(),
            KnotVector::clamped(3, &[0.0, 0.5, 1.5]).unwrap(),
            KnotVector::clamped(2, &[0.0, 0.4, 0.5, 1.0]).unwrap(),
        ]
    }

    fn even(end: f64, count: usize) -> Vec<f64> {
        (0..count).map(|i| end * i as f64 / (count - 1) as f64).collect()
    }

    #[test]
    fn a_spline_is_recovered_from_its_own_samples() {
        let coefficients: Vec<f64> = (0..7 * 5 * 5).map(|i| ((i * 31 + 7) % 23) as f64 - 11.0).collect();
        let spline = Spline::from_flat(knots(), coefficients).unwrap();
        let axes = [even(2.0, 15), even(1.5, 9), even(1.0, 12)];
        let phi = spline.sample(&axes, [0; 3]);
        let options = Options { fairness: Fairness::Weight(0.0), tolerance: 1e-13, ..Options::default() };
        let (fitted, report) = fit(phi.view(), &axes, &knots(), &options).unwrap();
        // The data term alone is diagonalised exactly, up to the share of mass that keeps it definite.
        assert!(report.iterations <= 12, "{}", report.iterations);
        for (a, b) in fitted.as_flat().iter().zip(spline.as_flat()) {
            // Residual 1e-13 times the condition number of the collocation, about 1e4.
            assert!((a - b).abs() < 1e-7);
        }
    }

    #[test]
    fn a_solution_that_has_not_converged_is_none() {
        let axes = [even(2.0, 9), even(1.5, 6), even(1.0, 5)];
        let phi = ArrayD::from_shape_fn(vec![9, 6, 5], |i| ((i[0] * 31 + i[1] * 17 + i[2] * 7) % 23) as f64 - 11.0);
        let options = Options { fairness: Fairness::Weight(0.1), most_iterations: 2, ..Options::default() };
        let refused = fit(phi.view(), &axes, &knots(), &options).unwrap_err();
        let Error::NotConverged { iterations: 2, residual } = refused else { panic!("{refused:?}") };
        assert!(residual > options.tolerance && residual < 1.0, "{residual}");
        // It is enough, if that is enough.
        let content = Options { tolerance: 1.01 * residual, ..options };
        assert_eq!(fit(phi.view(), &axes, &knots(), &content).unwrap().1.residual, residual);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn no_step_from_the_solution_lowers_the_objective(
            values in proptest::collection::vec(-1.0..1.0f64, 9 * 6 * 5),
            step in proptest::collection::vec(-1.0..1.0f64, 7 * 5 * 5),
            exponent in -6.0..1.0f64,
        ) {
            // Fewer nodes than coefficients along the last axis: the energy fills in.
            let axes = [even(2.0, 9), even(1.5, 6), even(1.0, 5)];
            let phi = ArrayD::from_shape_vec(vec![9, 6, 5], values).unwrap();
            let weight = 10f64.powf(exponent);
            let options = Options { fairness: Fairness::Weight(weight), tolerance: 1e-10, ..Options::default() };
            let (f, report) = fit(phi.view(), &axes, &knots(), &options).unwrap();
            let energy = DerivativeEnergy::thin_plate(&knots()).unwrap();
            let objective = |f: &Spline<3>| {
                let misfit = f.sample(&axes, [0; 3]) - &phi;
                misfit.iter().map(|r| r * r).sum::<f64>() + weight * energy.energy(f.as_flat())
            };
            let best = objective(&f);
            prop_assert!((best - (270.0 * report.rms.powi(2) + weight * report.energy)).abs() < 1e-9 * best);
            for scale in [1e-3, -1e-3, 1.0] {
                let moved = f.as_flat().iter().zip(&step).map(|(f, s)| f + scale * s).collect();
                let other = objective(&Spline::from_flat(knots(), moved).unwrap());
                // The slope vanishes to the residual's 1e-10 of the data's size.
                prop_assert!(other >= best - 1e-9);
            }
        }
    }

    #[test]
    fn a_large_weight_leaves_the_least_squares_plane() {
        let axes = [even(2.0, 9), even(1.5, 7)];
        let phi = ArrayD::from_shape_fn(vec![9, 7], |i| 1.0 + axes[0][i[0]] - 2.0 * axes[1][i[1]]);
        let knots = [knots()[0].clone(), knots()[1].clone()];
        let options = Options { fairness: Fairness::Weight(1e6), tolerance: 1e-10, ..Options::default() };
        let (f, _) = fit(phi.view(), &axes, &knots, &options).unwrap();
        // Planes have no energy, so the data are met; tolerance of the residual times a condition of 1e6.
        assert!((f.value(&[0.7, 1.1]) - (1.0 + 0.7 - 2.2)).abs() < 1e-4);
    }

    #[test]
    fn cells_as_large_as_the_nodes_need_few_iterations() {
        let knots: [KnotVector; 2] = std::array::from_fn(|_| KnotVector::uniform(3, 0.0, 0.05, 40).unwrap());
        let axes = [even(2.0, 41), even(2.0, 41)];
        let phi =
            ArrayD::from_shape_fn(vec![41, 41], |i| ((i[0] as f64 - 20.0).hypot(i[1] as f64 - 20.0) - 12.0) * 0.05);
        let options = Options { fairness: Fairness::Length(0.025), tolerance: 1e-10, ..Options::default() };
        let (_, report) = fit(phi.view(), &axes, &knots, &options).unwrap();
        assert!(report.iterations <= 40, "{}", report.iterations);
    }

    #[test]
    fn the_bytes_do_not_depend_on_threads() {
        let axes = [even(2.0, 30), even(1.5, 30), even(1.0, 30)];
        let phi = ArrayD::from_shape_fn(vec![30, 30, 30], |i| ((i[0] * 7 + i[1] * 3 + i[2]) % 11) as f64);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| fit(phi.view(), &axes, &knots(), &Options::default()).unwrap())
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn zeros_are_fitted_without_an_iteration() {
        let axes = [even(2.0, 9), even(1.5, 6), even(1.0, 5)];
        let options = Options { fairness: Fairness::Weight(0.1), most_iterations: 0, ..Options::default() };
        let (f, report) = fit(ArrayD::zeros(vec![9, 6, 5]).view(), &axes, &knots(), &options).unwrap();
        assert!(f.as_flat().iter().all(|c| *c == 0.0));
        assert_eq!((report.iterations, report.residual), (0, 0.0));
    }

    #[test]
    fn bad_input_is_refused() {
        let knots = [knots()[0].clone(), knots()[1].clone()];
        let axes = [even(2.0, 9), even(1.5, 7)];
        let phi = ArrayD::zeros(vec![9, 7]);
        let run = |phi: &ArrayD<f64>, axes: &[Vec<f64>; 2], fairness| {
            fit(phi.view(), axes, &knots, &Options { fairness, ..Options::default() }).unwrap_err()
        };
        let fair = Fairness::Weight(1.0);
        assert_eq!(run(&ArrayD::zeros(vec![9, 6]), &axes, fair), Error::Shape { values: vec![9, 6], axes: vec![9, 7] });
        let mut bad = phi.clone();
        bad[[3, 2].as_slice()] = f64::NAN;
        assert_eq!(run(&bad, &axes, fair), Error::NotFinite(vec![3, 2]));
        assert_eq!(run(&phi, &[even(2.1, 9), even(1.5, 7)], fair), Error::Outside { axis: 0, index: 8 });
        let mut uneven = axes.clone();
        uneven[1][3] += 0.01;
        assert_eq!(run(&phi, &uneven, Fairness::Length(0.1)), Error::Uneven);
        uneven[1][3] = 0.0;
        assert_eq!(run(&phi, &uneven, fair), Error::Axis { axis: 1, index: 3 });
        assert_eq!(run(&phi, &axes, Fairness::Weight(-1.0)), Error::Fairness(-1.0));
        assert_eq!(run(&ArrayD::zeros(vec![1, 7]), &[vec![0.5], even(1.5, 7)], Fairness::Length(0.1)), Error::Uneven);
        for tolerance in [0.0, 1.0, f64::NAN] {
            let options = Options { tolerance, ..Options::default() };
            assert!(matches!(fit(phi.view(), &axes, &knots, &options), Err(Error::Tolerance(_))), "{tolerance}");
        }
        let few = [even(2.0, 3), even(1.5, 7)];
        assert_eq!(run(&ArrayD::zeros(vec![3, 7]), &few, Fairness::Weight(0.0)), Error::Undetermined { axis: 0 });
    }
}
