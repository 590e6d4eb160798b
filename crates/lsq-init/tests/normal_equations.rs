//! The fit of equation (15) against its dense normal equations, and against what follows from them.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs::File;
use std::path::Path;

use ndarray::{Array0, Array1, ArrayD, Ix0, Ix1, IxDyn};
use ndarray_npy::NpzReader;
use proptest::prelude::*;
use zeroset_bspline::{Collocation, DerivativeEnergy, KnotVector, Spline};
use zeroset_lsq_init::{Fairness, Options, fit};

/// All nodes of a lattice in C order.
fn nodes<const D: usize>(axes: &[Vec<f64>; D]) -> Vec<[f64; D]> {
    let count: usize = axes.iter().map(Vec::len).product();
    (0..count)
        .map(|mut flat| {
            let mut point = [0.0; D];
            for axis in (0..D).rev() {
                point[axis] = axes[axis][flat % axes[axis].len()];
                flat /= axes[axis].len();
            }
            point
        })
        .collect()
}

/// Solves `A x = b` by elimination with row pivoting.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        b[k] = (b[k] - (k + 1..n).map(|j| a[k][j] * b[j]).sum::<f64>()) / a[k][k];
    }
    b
}

/// The coefficients by dense normal equations, assembled point by point and entry by entry.
fn dense_fit<const D: usize>(
    phi: &ArrayD<f64>,
    axes: &[Vec<f64>; D],
    knots: &[KnotVector; D],
    weight: f64,
) -> Vec<f64> {
    let energy = DerivativeEnergy::thin_plate(knots).unwrap();
    let shape = energy.shape();
    let count: usize = shape.iter().product();
    let multi_index = |mut flat: usize| -> [usize; D] {
        let mut index = [0; D];
        for axis in (0..D).rev() {
            index[axis] = flat % shape[axis];
            flat /= shape[axis];
        }
        index
    };
    let mut a: Vec<Vec<f64>> = (0..count)
        .map(|i| (0..count).map(|j| weight * energy.entry(multi_index(i), multi_index(j))).collect())
        .collect();
    let mut b = vec![0.0; count];
    for (point, value) in nodes(axes).iter().zip(phi.iter()) {
        let collocation = Collocation::new(knots, &[*point]).unwrap();
        let mut q = vec![0.0; count];
        collocation.add_values_transposed(&[1.0], &mut q);
        let support: Vec<usize> = (0..count).filter(|&i| q[i] != 0.0).collect();
        for &i in &support {
            b[i] += q[i] * value;
            for &j in &support {
                a[i][j] += q[i] * q[j];
            }
        }
    }
    solve(a, b)
}

fn assert_agrees<const D: usize>(axes: [Vec<f64>; D], knots: [KnotVector; D], weight: f64) {
    let shape: Vec<usize> = axes.iter().map(Vec::len).collect();
    let phi = ArrayD::from_shape_fn(shape, |i| {
        let flat = (0..D).fold(0, |flat, axis| 31 * flat + i[axis]);
        ((flat * 37 + 11) % 101) as f64 / 50.0 - 1.0
    });
    let options = Options { fairness: Fairness::Weight(weight), tolerance: 1e-12, most_iterations: 5000 };
    let (f, _) = fit(phi.view(), &axes, &knots, &options).unwrap();
    let dense = dense_fit(&phi, &axes, &knots, weight);
    let size = dense.iter().fold(0.0, |size: f64, c| size.max(c.abs()));
    for (f, dense) in f.as_flat().iter().zip(&dense) {
        // A residual of 1e-12 times the condition of the normal equations, up to about 1e6 here.
        assert!((f - dense).abs() < 1e-6 * size, "{f} against {dense} at weight {weight}");
    }
}

fn even(end: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| end * i as f64 / (count - 1) as f64).collect()
}

/// Uniform, clamped with uneven cells, and of another degree with a double knot.
fn uniform() -> KnotVector {
    KnotVector::uniform(3, 0.0, 0.5, 4).unwrap()
}
fn clamped() -> KnotVector {
    KnotVector::clamped(3, &[0.0, 0.1, 0.5, 1.5]).unwrap()
}
fn double_knot() -> KnotVector {
    KnotVector::new(4, vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.3, 1.0, 1.0, 1.0, 1.0, 1.0]).unwrap()
}

#[test]
fn curves_agree_with_dense_normal_equations() {
    for weight in [1e-6, 1e-2, 1.0] {
        // More nodes than coefficients, as many nodes as corners of cells, and fewer, unevenly spaced.
        assert_agrees([even(2.0, 13), even(1.5, 11)], [uniform(), clamped()], weight);
        assert_agrees([even(2.0, 5), even(1.0, 3)], [uniform(), double_knot()], weight);
        assert_agrees([vec![0.1, 0.15, 1.9], vec![0.0, 0.7, 0.8, 1.5]], [uniform(), clamped()], weight);
    }
    // The widest bands that there are, on the last axis and on the first.
    let quintic = || KnotVector::uniform(5, 0.0, 0.25, 4).unwrap();
    assert_agrees([even(1.5, 7), even(1.0, 9)], [clamped(), quintic()], 1e-2);
    assert_agrees([even(1.0, 9), even(1.5, 7)], [quintic(), clamped()], 1e-2);
    // Without fairness, where the nodes suffice.
    assert_agrees([even(2.0, 13), even(1.5, 22)], [uniform(), clamped()], 0.0);
}

#[test]
fn surfaces_agree_with_dense_normal_equations() {
    for weight in [1e-6, 1e-2, 1.0] {
        assert_agrees([even(2.0, 9), even(1.5, 4), even(1.0, 7)], [uniform(), clamped(), double_knot()], weight);
        assert_agrees([even(1.0, 8), vec![0.2, 0.3, 1.4], even(2.0, 5)], [double_knot(), clamped(), uniform()], weight);
    }
}

#[test]
fn agrees_with_the_golden_fit() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/golden/least_squares.npz");
    let mut npz = NpzReader::new(File::open(path).unwrap()).unwrap();
    let mut list = |name: &str| -> Vec<f64> {
        let array: Array1<f64> = npz.by_name::<ndarray::OwnedRepr<f64>, Ix1>(name).unwrap();
        array.to_vec()
    };
    let axes = [list("x"), list("y")];
    let knots = [KnotVector::new(3, list("knots_x")).unwrap(), KnotVector::new(3, list("knots_y")).unwrap()];
    let weight: Array0<f64> = npz.by_name::<ndarray::OwnedRepr<f64>, Ix0>("weight").unwrap();
    let phi: ArrayD<f64> = npz.by_name::<ndarray::OwnedRepr<f64>, IxDyn>("values").unwrap();
    let golden: ArrayD<f64> = npz.by_name::<ndarray::OwnedRepr<f64>, IxDyn>("coefficients").unwrap();
    let options = Options { fairness: Fairness::Weight(weight[()]), tolerance: 1e-13, ..Options::default() };
    let (f, _) = fit(phi.view(), &axes, &knots, &options).unwrap();
    let size = golden.iter().fold(0.0, |size: f64, c| size.max(c.abs()));
    for (f, golden) in f.coefficients().iter().zip(&golden) {
        // Residual 1e-13 times the condition of the normal equations, about 1e4.
        assert!((f - golden).abs() < 1e-9 * size);
    }
}

#[test]
fn a_large_weight_leaves_the_least_squares_plane() {
    let axes = [even(2.0, 9), even(1.5, 7)];
    let phi = ArrayD::from_shape_fn(vec![9, 7], |i| {
        let (x, y) = (axes[0][i[0]], axes[1][i[1]]);
        (x - 0.8).hypot(y - 0.6) - 0.5
    });
    // The plane in the basis 1, x, y by its own normal equations.
    let (mut a, mut b) = (vec![vec![0.0; 3]; 3], vec![0.0; 3]);
    for (&[x, y], value) in nodes(&axes).iter().zip(&phi) {
        let q = [1.0, x, y];
        for i in 0..3 {
            b[i] += q[i] * value;
            (0..3).for_each(|j| a[i][j] += q[i] * q[j]);
        }
    }
    let plane = solve(a, b);
    let options = Options { fairness: Fairness::Weight(1e8), tolerance: 1e-14, ..Options::default() };
    let (f, report) = fit(phi.view(), &axes, &[uniform(), clamped()], &options).unwrap();
    for &[x, y] in &nodes(&axes) {
        // The bend that is left is of the size of φ over w; rounding of w H, 1e-16 · 1e8 · 1e3 (cells of 0.1), weighs more.
        assert!((f.value(&[x, y]) - (plane[0] + plane[1] * x + plane[2] * y)).abs() < 1e-5);
    }
    assert!(report.energy < 1e-6, "{}", report.energy);
}

#[test]
fn a_smoothing_length_is_the_weight_over_the_cell() {
    let axes = [even(2.0, 9), even(1.5, 7)];
    let phi = ArrayD::from_shape_fn(vec![9, 7], |i| (i[0] as f64 - 4.0).hypot(i[1] as f64 - 3.0) - 2.0);
    let run = |fairness| {
        fit(phi.view(), &axes, &[uniform(), clamped()], &Options { fairness, ..Options::default() }).unwrap()
    };
    let (by_length, report) = run(Fairness::Length(0.3));
    // Rounding of the spacing 0.25 = 2 / 8 = 1.5 / 6.
    assert!((report.weight - 0.3f64.powi(4) / 0.0625).abs() < 1e-15);
    assert_eq!(run(Fairness::Weight(report.weight)).0, by_length);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn the_gradient_vanishes_and_the_report_adds_up(
        values in proptest::collection::vec(-1.0..1.0f64, 9 * 6 * 5),
        steps in proptest::collection::vec(0.05..1.0f64, 9),
        exponent in -8.0..1.0f64,
    ) {
        let knots = [uniform(), clamped(), double_knot()];
        // Uneven along the first axis; fewer nodes than coefficients along the last.
        let total: f64 = steps.iter().sum();
        let mut reached = 0.0;
        let first = steps.iter().map(|step| { reached += step; 2.0 * (reached / total).min(1.0) }).collect();
        let axes = [first, even(1.5, 6), even(1.0, 5)];
        let weight = 10f64.powf(exponent);
        let phi = ArrayD::from_shape_vec(vec![9, 6, 5], values).unwrap();
        let options = Options { fairness: Fairness::Weight(weight), tolerance: 1e-10, most_iterations: 5000 };
        let (f, report) = fit(phi.view(), &axes, &knots, &options).unwrap();

        let collocation = Collocation::new(&knots, &nodes(&axes)).unwrap();
        let energy = DerivativeEnergy::thin_plate(&knots).unwrap();
        let misfit: Vec<f64> = collocation.values(f.as_flat()).iter().zip(&phi).map(|(f, phi)| f - phi).collect();
        let mut gradient: Vec<f64> = energy.apply(f.as_flat()).iter().map(|h| weight * h).collect();
        collocation.add_values_transposed(&misfit, &mut gradient);
        let mut right = vec![0.0; gradient.len()];
        collocation.add_values_transposed(phi.as_slice().unwrap(), &mut right);
        let norm = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        // The tolerance, and as much again for rounding of w H (1e-16 · 10 · 1e4 for the double knot at 0.3).
        prop_assert!(norm(&gradient) <= 2e-10 * norm(&right), "{:e}", norm(&gradient) / norm(&right));

        // Sums of 270 squares, and forms of 300 coefficients whose bending cancels by up to 1e4.
        prop_assert!((report.rms - norm(&misfit) / 270f64.sqrt()).abs() < 1e-12);
        let eng = energy.energy(f.as_flat());
        prop_assert!((report.energy - eng).abs() <= 1e-10 * eng);
        let spline: &Spline<3> = &f;
        prop_assert_eq!(spline.shape(), energy.shape());
    }
}
