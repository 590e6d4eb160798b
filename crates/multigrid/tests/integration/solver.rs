//! Laws of the V-cycle and of the solver around it.

use proptest::prelude::*;
use zeroset_bspline::{Collocation, DerivativeEnergy, KnotVector};
use zeroset_multigrid::{FactorError, Multigrid, MultigridError, NormalEquations, SolveOptions};

/// Points of a bumpy circle or sphere of diameter about 0.8, scattered by the golden ratio.
fn bumpy<const D: usize>(count: usize) -> Vec<[f64; D]> {
    (0..count)
        .map(|i| {
            let turn = std::f64::consts::TAU * ((i as f64 * 0.618_033_988_749_895).fract());
            let height = if D == 3 { 2.0 * (i as f64 + 0.5) / count as f64 - 1.0 } else { 0.0 };
            let radius = 0.4 * (1.0 + 0.15 * (5.0 * turn).cos() * (1.0 - height * height));
            let level = (1.0 - height * height).sqrt();
            let unit = [level * turn.cos(), level * turn.sin(), height];
            std::array::from_fn(|a| radius * unit[a])
        })
        .collect()
}

/// Knots around the unit box with a margin of 1.5 cells.
fn knots<const D: usize>(cells: usize) -> [KnotVector; D] {
    let spacing = 1.0 / cells as f64;
    std::array::from_fn(|_| {
        KnotVector::uniform(3, -0.5 - 1.5 * spacing, spacing, cells + 3).expect("a positive spacing")
    })
}

/// ρ ℓ³ for ℓ = 0.5 s, where ρ = s^−(D−1) and `count` points lie on a circle or sphere of diameter 0.8.
fn energy_weight<const D: usize>(count: usize) -> f64 {
    let measure = std::f64::consts::PI * if D == 3 { 0.64 } else { 0.8 };
    let s = (measure / count as f64).powf(1.0 / (D as f64 - 1.0));
    s.powi(1 - D as i32) * (0.5 * s).powi(3)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn noise(size: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    (0..size)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}

fn multigrid<const D: usize>(cells: usize, halvings: u32, count: usize) -> Multigrid<D> {
    let weights: Vec<f64> = (0..count).map(|i| 0.5 + (i % 7) as f64 / 6.0).collect();
    Multigrid::new(&knots(cells), halvings, &bumpy(count), &weights, energy_weight::<D>(count)).expect("a solver")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_cycle_is_symmetric_and_positive(seed in any::<u64>()) {
        let check = |size: usize, cycle: &dyn Fn(&[f64], &mut [f64])| {
            let (r, q) = (noise(size, seed), noise(size, seed ^ 0xABCD));
            let (mut br, mut bq) = (vec![0.0; size], vec![0.0; size]);
            cycle(&r, &mut br);
            cycle(&q, &mut bq);
            let (rr, qq) = (dot(&r, &br), dot(&q, &bq));
            prop_assert!(rr > 0.0 && qq > 0.0);
            // Rounding of a bottom solve whose condition is about 1e6, relative to ‖r‖ ‖q‖ in the norm of the cycle.
            prop_assert!((dot(&q, &br) - dot(&r, &bq)).abs() < 1e-9 * (rr * qq).sqrt());
            Ok(())
        };
        let plane = multigrid::<2>(8, 3, 300);
        check(plane.size(), &|r, z| plane.precondition(r, z))?;
        let space = multigrid::<3>(4, 1, 600);
        check(space.size(), &|r, z| space.precondition(r, z))?;
    }
}

/// Solves for random right sides and compares with a direct solution.
fn agrees_with_cholesky<const D: usize>(cells: usize, halvings: u32, count: usize) {
    let solver = multigrid::<D>(cells, halvings, count);
    // By way of another weight: nothing of it may stay.
    let solver = solver.reweighted(7.0).unwrap().reweighted(energy_weight::<D>(count)).unwrap();
    let weights: Vec<f64> = (0..count).map(|i| 0.5 + (i % 7) as f64 / 6.0).collect();
    let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(solver.knots()).unwrap());
    let collocation = Collocation::new(solver.knots(), &bumpy(count)).unwrap();
    let matrix = equations.weighted(&collocation, &weights, energy_weight::<D>(count)).unwrap();
    let right = noise(solver.size(), 1);
    let exact = equations.factor(&matrix).unwrap().solve(&right);

    let options = SolveOptions { tolerance: 1e-9, ..SolveOptions::default() };
    let mut x = vec![0.0; solver.size()];
    let report = solver.solve(&right, &mut x, &options);
    assert!(report.converged && report.iterations <= 45, "{report:?}");
    assert_eq!(report.residuals.len(), report.iterations + 1);
    let error: Vec<f64> = x.iter().zip(&exact).map(|(a, b)| a - b).collect();
    let energy = |v: &[f64]| dot(v, &matrix.apply(v)).sqrt();
    // B is within a factor of ten of A⁻¹.
    assert!(energy(&error) < 1e-8 * energy(&exact));

    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut again = vec![0.0; solver.size()];
    assert_eq!(alone.install(|| solver.solve(&right, &mut again, &options)), report);
    assert_eq!(x, again, "the same bytes for any number of threads");
}

#[test]
fn solutions_agree_with_cholesky() {
    agrees_with_cholesky::<2>(8, 3, 400);
    agrees_with_cholesky::<3>(6, 1, 1500);
    agrees_with_cholesky::<3>(8, 0, 1500);
}

#[test]
fn iterations_hardly_depend_on_the_lattice() {
    let iterations = |halvings| {
        let solver = multigrid::<2>(8, halvings, 200);
        let mut right = vec![0.0; solver.size()];
        let collocation = Collocation::new(solver.knots(), &bumpy(200)).unwrap();
        collocation.add_gradients_transposed(&bumpy(200), &mut right);
        let options = SolveOptions { tolerance: 1e-6, ..SolveOptions::default() };
        let report = solver.solve(&right, &mut vec![0.0; solver.size()], &options);
        assert!(report.converged);
        report.iterations
    };
    let counts = [2, 3, 4, 5].map(iterations);
    assert!(counts.iter().all(|n| *n <= 30), "{counts:?}");
}

/// Iterations to 1e-6 where of the points on one side one in `sparse` is left, with the weight of all of them.
fn iterations_of_uneven<const D: usize>(cells: usize, halvings: u32, count: usize, sparse: usize) -> usize {
    let is_left = |(i, p): &(usize, [f64; D])| p[0] < 0.1 || i % sparse == 0;
    let points: Vec<[f64; D]> = bumpy(count).into_iter().enumerate().filter(is_left).map(|(_, p)| p).collect();
    let weights: Vec<f64> = points.iter().map(|p| if p[0] < 0.1 { 1.0 } else { sparse as f64 }).collect();
    let solver = Multigrid::new(&knots(cells), halvings, &points, &weights, energy_weight::<D>(count)).unwrap();
    let mut right = vec![0.0; solver.size()];
    let collocation = Collocation::new(solver.knots(), &points).unwrap();
    collocation.add_gradients_transposed(&points, &mut right);
    let options = SolveOptions { tolerance: 1e-6, ..SolveOptions::default() };
    let report = solver.solve(&right, &mut vec![0.0; solver.size()], &options);
    assert!(report.converged, "{report:?}");
    report.iterations
}

#[test]
fn points_that_stand_for_many_hardly_cost_iterations() {
    // Without what the smoother knows of them: 44, 33, 26, 22; and 99, 68.
    let plane = [2, 3, 4, 5].map(|halvings| iterations_of_uneven::<2>(16, halvings, 900, 1000));
    assert!(plane.iter().all(|n| *n <= 20), "{plane:?}");
    let space = [2, 3].map(|halvings| iterations_of_uneven::<3>(6, halvings, 30_000, 1000));
    assert!(space.iter().all(|n| *n <= 24), "{space:?}");
}

#[test]
fn a_start_is_honoured() {
    let solver = multigrid::<2>(8, 2, 400);
    let right = noise(solver.size(), 2);
    let mut x = vec![0.0; solver.size()];
    let cold = solver.solve(&right, &mut x, &SolveOptions { tolerance: 1e-6, ..SolveOptions::default() });

    let mut warm = x.clone();
    let report = solver.solve(&right, &mut warm, &SolveOptions { tolerance: 1e-5, ..SolveOptions::default() });
    assert_eq!(report.iterations, 0, "{report:?}");
    assert_eq!(warm, x);
    // The same V-cycle of the same right side.
    assert_eq!(report.right_norm, cold.right_norm);

    // The wrong multiple is put right without an iteration, and a known norm is taken as it is.
    let mut scaled: Vec<f64> = x.iter().map(|x| -3.0 * x).collect();
    let known = SolveOptions {
        tolerance: 1e-5,
        scale_start: true,
        right_norm: Some(cold.right_norm),
        ..SolveOptions::default()
    };
    let report = solver.solve(&right, &mut scaled, &known);
    assert!(report.iterations == 0 && report.converged, "{report:?}");
    let without = SolveOptions { scale_start: false, ..known };
    let report = solver.solve(&right, &mut x.iter().map(|x| -3.0 * x).collect::<Vec<_>>(), &without);
    // B is within a factor of a few of A⁻¹, and the start is four times as wrong as zero.
    assert!(report.residuals[0] > 3.9 && report.converged, "{report:?}");
}

#[test]
fn zero_has_the_solution_zero() {
    let solver = multigrid::<2>(8, 1, 100);
    let mut x = noise(solver.size(), 3);
    let report = solver.solve(&vec![0.0; solver.size()], &mut x, &SolveOptions::default());
    assert!(report.iterations <= 100 && report.right_norm == 0.0);
    let mut x = vec![0.0; solver.size()];
    let report = solver.solve(&vec![0.0; solver.size()], &mut x, &SolveOptions::default());
    assert!(report.converged && report.iterations == 0 && x.iter().all(|x| *x == 0.0));
}

#[test]
fn numbers_that_are_none_do_not_converge() {
    let solver = multigrid::<2>(8, 1, 100);
    let mut right = vec![0.0; solver.size()];
    right[17] = f64::NAN;
    assert!(!solver.solve(&right, &mut vec![0.0; solver.size()], &SolveOptions::default()).converged);
}

#[test]
fn points_on_a_line_are_refused() {
    let points: Vec<[f64; 2]> = (0..30).map(|i| [0.25, i as f64 / 64.0]).collect();
    let error = Multigrid::new(&knots::<2>(8), 1, &points, &[0.0; 30], 1e-3).unwrap_err();
    assert_eq!(error, MultigridError::Factor(FactorError::NotPositiveDefinite));
}

#[test]
fn threads_change_no_byte() {
    // Large enough for every loop to be shared out.
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let solver = multigrid::<3>(8, 2, 6000);
            let right = noise(solver.size(), 4);
            let (mut z, mut y) = (vec![0.0; solver.size()], vec![0.0; solver.size()]);
            solver.precondition(&right, &mut z);
            solver.apply(&z, &mut y);
            let mut x = vec![0.0; solver.size()];
            let report = solver.solve(&right, &mut x, &SolveOptions { tolerance: 0.1, ..SolveOptions::default() });
            (z, y, x, report)
        })
    };
    assert!(run(1) == run(3));
}
