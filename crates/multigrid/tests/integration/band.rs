//! The operator of a band level against the assembled matrix of the whole lattice, restricted to the active functions.

use std::borrow::Cow;
use std::sync::Arc;
use zeroset_bspline::{CellBand, Collocation, DerivativeEnergy, HierarchicalSpline, KnotVector, Level, Spline};
use zeroset_multigrid::{
    BandCollocation, BandEnergy, BandOperator, BandRows, Fairness, NormalEquations, StepEnd, Truncation,
    solve_truncated,
};

/// Numbers between −1 and 1 that look random.
fn scattered(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

/// Points on a wave, of which a third wants one level and the others two; the spline has random coefficients on all levels.
fn case<const D: usize>() -> (HierarchicalSpline<D>, Vec<[f64; D]>) {
    let knots: [KnotVector; D] =
        std::array::from_fn(|axis| KnotVector::uniform(3, 0.0, 0.25 + 0.05 * axis as f64, 4).unwrap());
    let count = knots.iter().map(KnotVector::basis_count).product();
    let points: Vec<[f64; D]> = scattered(120 * D, 3)
        .chunks_exact(D)
        .map(|u| {
            let mut point = std::array::from_fn(|a| 0.5 + 0.3 * u[a]);
            point[D - 1] = 0.5 + 0.05 * (3.0 * u[0]).sin();
            point
        })
        .collect();
    let levels: Vec<u8> = points.iter().map(|p| if p[0] < 0.4 { 1 } else { 2 }).collect();
    let band = CellBand::new(&knots, &points, &levels, [3, 3]).unwrap();
    let mut spline = HierarchicalSpline::new(Spline::from_flat(knots, scattered(count, 4)).unwrap()).unwrap();
    for active in band.active() {
        spline.push_level(Arc::clone(active)).unwrap();
        spline.correct_finest(scattered(active.len(), 5)).unwrap();
    }
    (spline, points)
}

/// Members of a set of functions as places in the whole lattice's coefficients.
fn places<const D: usize>(level: &Level<D>) -> Vec<usize> {
    let shape = level.knots().each_ref().map(KnotVector::basis_count);
    let flat = |k: [u32; D]| (0..D).fold(0, |flat, axis| flat * shape[axis] + k[axis] as usize);
    level.active().iter().map(flat).collect()
}

fn embedded<const D: usize>(level: &Level<D>, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; level.knots().iter().map(KnotVector::basis_count).product()];
    places(level).into_iter().zip(x).for_each(|(place, x)| out[place] = *x);
    out
}

fn restricted<const D: usize>(level: &Level<D>, y: &[f64]) -> Vec<f64> {
    places(level).into_iter().map(|place| y[place]).collect()
}

#[track_caller]
fn assert_near(a: &[f64], b: &[f64], tolerance: f64) {
    let size = b.iter().map(|v| v.abs()).fold(0.0, f64::max);
    assert_eq!(a.len(), b.len());
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= tolerance * size, "entry {i}: {a} and {b}, of numbers up to {size}");
    }
}

/// Rows for the points of a level, and the same for all points: others count nothing.
type RowsOf<const D: usize> = (Vec<f64>, Vec<[f64; D]>);

fn rows<const D: usize>(collocation: &BandCollocation<D>, points: usize) -> (RowsOf<D>, RowsOf<D>) {
    let (mut alpha, mut beta) = (vec![0.0; points], vec![[0.0; D]; points]);
    for (i, u) in collocation.indices().iter().zip(scattered(points * (D + 1), 8).chunks_exact(D + 1)) {
        alpha[*i as usize] = u[D];
        beta[*i as usize].copy_from_slice(&u[..D]);
    }
    let sorted = collocation.indices().iter().map(|i| *i as usize);
    ((sorted.clone().map(|i| alpha[i]).collect(), sorted.map(|i| beta[i]).collect()), (alpha, beta))
}

fn check_operator<const D: usize>() {
    let (spline, points) = case::<D>();
    for level in spline.levels() {
        let collocation = BandCollocation::new(level, &points);
        let ((alpha, beta), (dense_alpha, dense_beta)) = rows(&collocation, points.len());
        let dense = Collocation::new(level.knots(), &points).unwrap();
        let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(level.knots()).unwrap());
        let matrix = equations.rows(&dense, &dense_alpha, Some(&dense_beta), 1e-3).unwrap();

        let energy = BandEnergy::new(Arc::clone(level.active()), level.cell_sides(), Fairness::thin_plate(1e-3));
        let part = |third: bool| {
            let is_wanted = |i: usize| i.is_multiple_of(3) == third;
            let wanted: Vec<usize> = (0..alpha.len()).filter(|i| is_wanted(*i)).collect();
            BandRows {
                collocation: Cow::Owned(collocation.subset(is_wanted)),
                alpha: wanted.iter().map(|i| alpha[*i]).collect(),
                beta: wanted.iter().map(|i| beta[*i]).collect(),
            }
        };
        let operator = BandOperator::new(vec![part(true), part(false)], energy);
        let x = scattered(operator.size(), 9);
        let mut y = vec![f64::NAN; x.len()];
        operator.apply(&x, &mut y);
        // Sums of a few hundred products in another order.
        assert_near(&y, &restricted(level, &matrix.apply(&embedded(level, &x))), 1e-12);
        assert_near(operator.diagonal(), &restricted(level, &matrix.diagonal()), 1e-12);

        let weights = scattered(collocation.indices().len(), 10);
        let mut sums = vec![0.0; level.active().block_count() * zeroset_bspline::IndexSet::<D>::BLOCK];
        collocation.add_transposed(&alpha, &beta, &weights, level.active(), &mut sums);
        let (mut exact, mut gradients) = (vec![0.0; matrix.diagonal().len()], vec![[0.0; D]; points.len()]);
        let mut values = vec![0.0; points.len()];
        for (k, i) in collocation.indices().iter().enumerate() {
            values[*i as usize] = weights[k] * alpha[k];
            gradients[*i as usize] = beta[k].map(|b| weights[k] * b);
        }
        dense.add_values_transposed(&values, &mut exact);
        dense.add_gradients_transposed(&gradients, &mut exact);
        let mut transposed = vec![0.0; level.active().len()];
        level.active().members_of_blocks(&sums, &mut transposed);
        assert_near(&transposed, &restricted(level, &exact), 1e-13);

        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let mut again = vec![f64::NAN; x.len()];
        alone.install(|| operator.apply(&x, &mut again));
        assert_eq!(y, again, "the same bytes for any number of threads");
    }
}

#[test]
fn equals_the_restricted_assembled_matrix() {
    check_operator::<2>();
    check_operator::<3>();
}

/// Values and gradients of the total function, at the points of the finest level.
fn check_collocation<const D: usize>() {
    let (spline, points) = case::<D>();
    let level = &spline.levels()[1];
    let collocation = BandCollocation::new(level, &points);
    assert!(collocation.indices().len() > 60);
    for (i, (value, gradient)) in collocation.indices().iter().zip(collocation.values_and_gradients(level.total())) {
        let (exact, slope) = spline.value_and_gradient(&points[*i as usize]);
        // Sums of 64 products of coefficients up to 3; slopes are divided by the cells' sides of a sixteenth.
        assert!((value - exact).abs() < 1e-14);
        assert!((0..D).all(|a| (gradient[a] - slope[a]).abs() < 1e-12));
    }
}

#[test]
fn values_are_those_of_the_spline() {
    check_collocation::<2>();
    check_collocation::<3>();
}

/// On a lattice where all functions with support in the box are active.
fn check_energy<const D: usize>(fairness: Fairness) {
    let knots: [KnotVector; D] = std::array::from_fn(|_| KnotVector::uniform(3, 0.0, 0.5, 4).unwrap());
    let count = knots.iter().map(KnotVector::basis_count).product();
    let root = Spline::from_flat(knots.clone(), scattered(count, 11)).unwrap();
    let lattice = |flat: usize| std::array::from_fn(|a| 0.5 + (flat / 2usize.pow(a as u32) % 2) as f64);
    let points: Vec<[f64; D]> = (0..1 << D).map(lattice).collect();
    let band = CellBand::new(&knots, &points, &vec![1; points.len()], [7, 7]).unwrap();
    let mut spline = HierarchicalSpline::new(root.clone()).unwrap();
    spline.push_level(Arc::clone(&band.active()[0])).unwrap();
    let level = &spline.levels()[0];
    assert_eq!(level.active().len(), 5usize.pow(D as u32), "all but those that stick out");

    let total = |spline: &Spline<D>| -> f64 {
        let energy = |order: usize| match fairness.weights[order] {
            0.0 => 0.0,
            c => c * DerivativeEnergy::new(spline.knots(), order).unwrap().energy(spline.as_flat()),
        };
        (0..4).map(energy).sum()
    };
    let energy = BandEnergy::new(Arc::clone(level.active()), level.cell_sides(), fairness);
    let delta = scattered(level.active().len(), 12);
    let (mut coarse, mut fine) = (vec![0.0; delta.len()], vec![0.0; delta.len()]);
    energy.apply(level.total(), None, &mut coarse);
    let mut own = zeroset_bspline::BlockField::zeros(Arc::clone(level.active()));
    own.scatter(&delta);
    energy.apply(&own, None, &mut fine);
    let change: f64 = delta.iter().zip(coarse.iter().zip(&fine)).map(|(d, (c, f))| d * (2.0 * c + f)).sum();

    let refined = root.halved().unwrap();
    let coefficients = refined.as_flat().iter().zip(embedded(level, &delta)).map(|(f, d)| f + d).collect();
    let sum = total(&Spline::from_flat(refined.knots().clone(), coefficients).unwrap());
    // Sums of thousands of products, of energies that exceed their sum a few times.
    assert!((total(&root) + change - sum).abs() < 1e-10 * sum, "{} and {sum}", total(&root) + change);
}

#[test]
fn the_coarse_function_adds_its_energy() {
    let all = Fairness { weights: [0.1, 0.3, 0.2, 0.1] };
    for fairness in [Fairness::thin_plate(0.7), Fairness::third_order(0.2, 0.4), all] {
        check_energy::<2>(fairness);
        check_energy::<3>(fairness);
    }
}

/// Solves a dense system by elimination.
fn solved(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for pivot in 0..n {
        for row in pivot + 1..n {
            let factor = matrix[row][pivot] / matrix[pivot][pivot];
            for column in pivot..n {
                matrix[row][column] -= factor * matrix[pivot][column];
            }
            right[row] -= factor * right[pivot];
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|column| matrix[row][column] * right[column]).sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    right
}

#[test]
fn solves_to_the_same_coefficients_as_elimination() {
    let (spline, points) = case::<2>();
    let level = &spline.levels()[1];
    let collocation = BandCollocation::new(level, &points);
    let ((alpha, beta), (dense_alpha, dense_beta)) = rows(&collocation, points.len());
    let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(level.knots()).unwrap());
    let dense = Collocation::new(level.knots(), &points).unwrap();
    let assembled = equations.rows(&dense, &dense_alpha, Some(&dense_beta), 1e-3).unwrap();
    let size = level.active().len();
    let column = |k: usize| {
        let unit: Vec<f64> = (0..size).map(|i| f64::from(u8::from(i == k))).collect();
        restricted(level, &assembled.apply(&embedded(level, &unit)))
    };
    let matrix: Vec<Vec<f64>> = (0..size).map(column).collect();
    let right = scattered(size, 20);
    let exact = solved(matrix.clone(), right.clone());

    let energy = BandEnergy::new(Arc::clone(level.active()), level.cell_sides(), Fairness::thin_plate(1e-3));
    let rows = BandRows { collocation: Cow::Borrowed(&collocation), alpha, beta };
    let operator = BandOperator::new(vec![rows], energy);
    let solve = |truncation: &Truncation| solve_truncated(&operator, &right, truncation);
    let free = Truncation { most_steps: 1000, tolerance: 1e-13, radius: f64::INFINITY };
    let step = solve(&free);
    assert_eq!(step.end, StepEnd::Converged);
    assert_near(&step.x, &exact, 1e-8);
    // Vectors are used again; nothing of what they held is left.
    assert_eq!(solve(&free), step);
    // The minimum of ½ xᵀAx − bᵀx is −½ bᵀx.
    let decrease: f64 = 0.5 * exact.iter().zip(&right).map(|(x, b)| x * b).sum::<f64>();
    assert!((step.predicted_decrease - decrease).abs() < 1e-8 * decrease);

    // At the minimum already: no direction leads down, and none is divided by.
    let step = solve_truncated(&operator, &vec![0.0; size], &free);
    assert_eq!((step.steps, step.end, step.norm, step.predicted_decrease), (0, StepEnd::Flat, 0.0, 0.0));
    assert!(step.x.iter().all(|x| *x == 0.0));

    let mut before = 0.0;
    for most_steps in 1..=12 {
        let step = solve(&Truncation { most_steps, ..free });
        assert_eq!((step.steps, step.end), (most_steps, StepEnd::Truncated));
        let ax = |k: usize| matrix[k].iter().zip(&step.x).map(|(a, x)| a * x).sum::<f64>();
        let model: f64 = (0..size).map(|k| step.x[k] * (right[k] - 0.5 * ax(k))).sum();
        assert!((model - step.predicted_decrease).abs() < 1e-9 * decrease && model > before);
        before = model;
        // Half the length: the first iterate outside is cut, and the model falls at least in proportion.
        let cut = solve(&Truncation { most_steps, radius: 0.5 * step.norm, ..free });
        assert_eq!(cut.end, StepEnd::Boundary);
        assert!((cut.norm - 0.5 * step.norm).abs() < 1e-12 * step.norm);
        assert!(cut.predicted_decrease >= 0.5 * model);
    }
}
