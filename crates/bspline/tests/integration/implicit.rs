//! What every implicit function must satisfy, and what holds for hierarchies of levels alone.

use crate::common::scattered;
use proptest::prelude::*;
use std::sync::Arc;
use zeroset_bspline::{
    BandError, CellBand, Derivatives, HierarchicalSpline, HierarchyError, Implicit, IndexSet, KnotVector, Spline,
};

/// Cells of side ¼ in the plane and in space.
fn root<const D: usize>(seed: u64) -> Spline<D> {
    let cells = [9, 6, 7];
    let knots = std::array::from_fn(|axis| KnotVector::uniform(3, -0.5, 0.25, cells[axis]).unwrap());
    let count = knots.iter().map(KnotVector::basis_count).product();
    Spline::from_flat(knots, scattered(count, seed)).unwrap()
}

/// Where the finer levels are: on a short arc, and finest at its begin.
fn data<const D: usize>() -> (Vec<[f64; D]>, Vec<u8>) {
    let at = |i: u8| std::array::from_fn(|axis| 0.45 + 0.5 * (0.1 * f64::from(i) + 0.4 * axis as f64).sin());
    ((0..10).map(at).collect(), (0..10).map(|i| if i < 3 { 3 } else { 2 }).collect())
}

fn hierarchy<const D: usize>(seed: u64, size: f64) -> HierarchicalSpline<D> {
    let root = root(seed);
    let (points, levels) = data();
    let band = CellBand::new(root.knots(), &points, &levels, [3, 3]).unwrap();
    let mut spline = HierarchicalSpline::new(root).unwrap();
    for (level, active) in band.active().iter().enumerate() {
        spline.push_level(Arc::clone(active)).unwrap();
        let corrections = scattered(active.len(), seed + 1 + level as u64);
        spline.correct_finest(corrections.iter().map(|c| size * c).collect()).unwrap();
    }
    assert_eq!(spline.levels().len(), 3);
    spline
}

/// Points in the box, most of them near the data.
fn probes<const D: usize>(domain: ([f64; D], [f64; D]), seed: u64) -> Vec<[f64; D]> {
    let (points, _) = data::<D>();
    let numbers = scattered(200 * D, seed);
    numbers
        .chunks_exact(D)
        .enumerate()
        .map(|(i, u)| {
            std::array::from_fn(|a| {
                let (start, end) = (domain.0[a], domain.1[a]);
                let anywhere = start + (end - start) * 0.5 * (u[a] + 1.0);
                if i % 4 == 0 { anywhere } else { (points[i % 10][a] + 0.2 * u[a]).clamp(start, end) }
            })
        })
        .collect()
}

/// The laws of [`Implicit`]. `cell` is the side of the finest cells.
fn conforms<const D: usize, F: Implicit<D>>(f: &F, cell: f64) {
    let (start, end) = f.domain();
    let points = probes::<D>((start, end), 5);
    let at = f.evaluate(&points, Derivatives::Hessian);
    let (values, slopes) = (f.evaluate(&points, Derivatives::Value), f.evaluate(&points, Derivatives::Gradient));
    assert_eq!(at.outside, 0);
    assert_eq!((&values.values, &slopes.values, &slopes.gradients), (&at.values, &at.values, &at.gradients));
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| f.evaluate(&points, Derivatives::Hessian)), at, "the same for any number of threads");

    let step = 1e-5 * cell;
    for (i, x) in points.iter().enumerate() {
        let jet = f.jet(x);
        assert_eq!((f.value(x), f.value_and_gradient(x)), (jet.value, (jet.value, jet.gradient)));
        assert_eq!((at.values[i], at.gradients[i], at.hessians[i]), (jet.value, jet.gradient, jet.hessian));
        for a in 0..D {
            let (mut before, mut after) = (*x, *x);
            before[a] = (x[a] - step).max(start[a]);
            after[a] = (x[a] + step).min(end[a]);
            let length = after[a] - before[a];
            let (p, q) = (f.value_and_gradient(&before), f.value_and_gradient(&after));
            // At a face of the box the difference is one-sided: an error of first order. Coefficients are up to 4, so that
            // second derivatives reach 4 · 4/cell², third ones 4 · 8/cell³; rounding is 1e-15 / step. A function that jumped
            // by 1e-8 across a face between cells would show.
            assert!(((q.0 - p.0) / length - jet.gradient[a]).abs() < 16.0 * step / cell.powi(2) + 4e-15 / step);
            for b in 0..D {
                let slope = (q.1[b] - p.1[b]) / length;
                assert!((slope - jet.hessian[a][b]).abs() < 60.0 * step / cell.powi(3) + 4e-15 / (step * cell));
            }
        }
        let (low, high) = (std::array::from_fn(|a| x[a] - 0.3 * cell), std::array::from_fn(|a| x[a] + cell));
        let (lower, upper) = f.bounds(&low, &high).unwrap();
        for y in [*x, low, high] {
            let value = f.value(&y);
            // Rounding of convex combinations of coefficients up to 4.
            assert!(value.is_nan() || (lower - 1e-14..=upper + 1e-14).contains(&value));
        }
    }
    let (lower, upper) = f.bounds(&start, &end).unwrap();
    assert!(at.values.iter().all(|v| (lower..=upper).contains(v)));
    assert_eq!(f.bounds(&end.map(|e| e + 1.0), &end.map(|e| e + 2.0)), None);

    let outside = [end.map(|e| e + 1e-9), start.map(|s| s - 1.0), [f64::NAN; D]];
    let nowhere = f.evaluate(&outside, Derivatives::Hessian);
    assert_eq!(nowhere.outside, 3);
    assert!((0..3).all(|i| nowhere.values[i].is_nan() && nowhere.gradients[i][0].is_nan()));
    assert!(nowhere.hessians.iter().all(|h| h[D - 1][0].is_nan()));
    assert!(f.contains(&start) && f.contains(&end) && !outside.iter().any(|x| f.contains(x)));
    assert!(f.value(&start).is_finite() && f.value(&end).is_finite());

    let axes: [Vec<f64>; D] =
        std::array::from_fn(|a| (0..12).map(|i| start[a] + (end[a] - start[a]) * f64::from(i) / 10.0).collect());
    let sizes: [f64; 3] = [1.0, 4.0 / cell, 16.0 / (cell * cell)];
    for order in [[0; D], std::array::from_fn(|a| usize::from(a == D - 1)), std::array::from_fn(|a| usize::from(a < 2))]
    {
        let sampled = f.sample(&axes, order);
        for (index, value) in sampled.indexed_iter() {
            let jet = f.jet(&std::array::from_fn(|a| axes[a][index[a]]));
            let exact = match order.iter().sum() {
                0 => jet.value,
                1 => jet.gradient[D - 1],
                _ => jet.hessian[0][1],
            };
            let size = 4.0 * sizes[order.iter().sum::<usize>()];
            // The same products in another order.
            assert!(value.is_nan() && exact.is_nan() || (value - exact).abs() < 1e-13 * size);
        }
    }

    let shift = std::array::from_fn(|a| 3.0 - a as f64);
    let (doubled, mapped) = (f.scaled(2.0).unwrap(), f.mapped(0.7, shift).unwrap());
    for x in &points {
        let jet = f.jet(x);
        assert_eq!(doubled.value(x), 2.0 * jet.value, "powers of two scale exactly");
        let there = mapped.jet(&std::array::from_fn(|a| 0.7 * x[a] + shift[a]));
        // Coordinates rounded at 3, where values change by 8 / cell.
        assert!(there.value.is_nan() || (there.value - 0.7 * jet.value).abs() < 4e-14 / cell);
        for a in 0..D {
            assert!(there.value.is_nan() || (there.gradient[a] - jet.gradient[a]).abs() < 4e-14 / cell.powi(2));
        }
    }
    assert!(f.scaled(f64::INFINITY).is_err() && f.mapped(-1.0, shift).is_err());
}

#[test]
fn dense_splines_conform() {
    conforms(&root::<2>(1), 0.25);
    conforms(&root::<3>(2), 0.25);
}

#[test]
fn hierarchical_splines_conform() {
    conforms(&HierarchicalSpline::new(root::<2>(3)).unwrap(), 0.25);
    let knots = KnotVector::clamped(4, &[-0.5, 0.0, 0.3, 1.1, 1.5, 2.0]).unwrap();
    let clamped = Spline::from_flat([knots.clone(), knots], scattered(81, 6)).unwrap();
    conforms(&HierarchicalSpline::new(clamped).unwrap(), 0.1);
    conforms(&hierarchy::<2>(4, 0.5), 0.25 / 8.0);
    conforms(&hierarchy::<3>(5, 0.5), 0.25 / 8.0);
}

/// The function as it is defined: the sum of its terms, each a dense spline.
fn sum_of_terms<const D: usize>(spline: &HierarchicalSpline<D>) -> Vec<Spline<D>> {
    let mut terms = vec![spline.root().clone()];
    for level in spline.levels() {
        let shape = level.knots().each_ref().map(KnotVector::basis_count);
        let mut coefficients = vec![0.0; shape.iter().product()];
        for (k, c) in level.active().iter().zip(level.corrections()) {
            coefficients[(0..D).fold(0, |flat, axis| flat * shape[axis] + k[axis] as usize)] = *c;
        }
        terms.push(Spline::from_flat(level.knots().clone(), coefficients).unwrap());
    }
    terms
}

fn check_sum<const D: usize>(seed: u64) {
    let spline = hierarchy::<D>(seed, 1.0);
    let terms = sum_of_terms(&spline);
    for x in probes::<D>(spline.domain(), seed + 7) {
        let (jet, parts) = (spline.jet(&x), terms.iter().map(|t| t.jet(&x)).collect::<Vec<_>>());
        // Convex combinations of numbers up to 4; derivatives divide by the finest cell.
        assert!((jet.value - parts.iter().map(|p| p.value).sum::<f64>()).abs() < 1e-14);
        for a in 0..D {
            assert!((jet.gradient[a] - parts.iter().map(|p| p.gradient[a]).sum::<f64>()).abs() < 2e-12);
            for b in 0..D {
                assert!((jet.hessian[a][b] - parts.iter().map(|p| p.hessian[a][b]).sum::<f64>()).abs() < 2e-10);
            }
        }
    }
}

#[test]
fn local_coefficients_give_the_sum_over_all_levels() {
    for seed in 10..13 {
        check_sum::<2>(seed);
        check_sum::<3>(seed);
    }
}

#[test]
fn levels_without_corrections_change_nothing() {
    let plain = root::<3>(20);
    let spline = hierarchy::<3>(20, 0.0);
    for x in probes::<3>(spline.domain(), 21) {
        // Convex combinations of numbers below 1, and their differences over the finest cell.
        assert!((spline.value(&x) - plain.value(&x)).abs() < 2e-15);
        let (a, b) = (spline.jet(&x), plain.jet(&x));
        assert!((0..3).all(|i| (a.gradient[i] - b.gradient[i]).abs() < 1e-13));
        assert!((0..9).all(|i| (a.hessian[i / 3][i % 3] - b.hessian[i / 3][i % 3]).abs() < 2e-11));
    }
}

#[test]
fn twice_continuously_differentiable_across_the_faces_of_levels() {
    let spline = hierarchy::<3>(30, 1.0);
    let mut faces = 0;
    for level in spline.levels() {
        let side = level.cell_side();
        for cell in level.cells().iter() {
            for axis in 0..3 {
                let mut next = cell;
                next[axis] += 1;
                if level.cells().contains(next) || next[axis] >= level.cells().extent()[axis] {
                    continue;
                }
                faces += 1;
                // A point on the outer face of Ω, and its neighbours at the last bit on either side.
                let mut x: [f64; 3] = std::array::from_fn(|a| -0.5 + side * (f64::from(cell[a]) + 0.3));
                x[axis] = -0.5 + side * f64::from(next[axis]);
                let (mut before, mut after) = (x, x);
                before[axis] -= 1e-13;
                after[axis] += 1e-13;
                let (p, q) = (spline.jet(&before), spline.jet(&after));
                // Third derivatives are below 4 · 8 / side³ ≈ 1e6, times the distance of 2e-13; rounding as elsewhere.
                assert!((p.value - q.value).abs() < 1e-10);
                assert!((0..3).all(|a| (p.gradient[a] - q.gradient[a]).abs() < 1e-9));
                assert!((0..9).all(|a| (p.hessian[a / 3][a % 3] - q.hessian[a / 3][a % 3]).abs() < 1e-6));
            }
        }
    }
    assert!(faces > 100, "{faces}");
}

#[test]
fn levels_that_do_not_fit_are_refused() {
    let knots = KnotVector::uniform(2, 0.0, 1.0, 6).unwrap();
    let flat = Spline::from_flat([knots.clone(), knots], vec![1.0; 64]).unwrap();
    let mut quadratic = HierarchicalSpline::new(flat).unwrap();
    assert_eq!(
        quadratic.push_level(Arc::new(IndexSet::new([14, 14], &[]))).unwrap_err(),
        HierarchyError::Band(BandError::Degree { axis: 0, degree: 2 })
    );
    let leaves = quadratic.leaf_cells(|_| true);
    assert!(leaves.len() == 36 && leaves.iter().all(|leaf| (leaf.level, leaf.lower, leaf.upper) == (0, 1.0, 1.0)));
    assert_eq!(leaves[7].index, [1, 1]);
    let mut spline = HierarchicalSpline::new(root::<2>(40)).unwrap();
    let functions = |n: u32, indices: &[[u32; 2]]| Arc::new(IndexSet::new([n + 3, n / 3 * 2 + 3], indices));
    assert_eq!(
        spline.push_level(functions(9, &[])).unwrap_err(),
        HierarchyError::Extent { level: 1, found: vec![12, 9], needed: vec![21, 15] }
    );
    let at_the_face = functions(18, &[[2, 8], [8, 8]]);
    assert_eq!(spline.push_level(at_the_face).unwrap_err(), HierarchyError::NotNested { level: 1, count: 1 });
    spline.push_level(functions(18, &[[8, 8]])).unwrap();
    // The support of function 8 is the cells 5 to 8, which are 10 to 17 of the next level.
    let beyond = functions(36, &[[17, 17], [18, 17]]);
    assert_eq!(spline.push_level(beyond).unwrap_err(), HierarchyError::NotNested { level: 2, count: 4 });
    assert_eq!(
        spline.correct_finest(vec![0.0; 2]).unwrap_err(),
        HierarchyError::Corrections { level: 1, found: 2, needed: 1 }
    );
    assert_eq!(spline.correct_finest(vec![f64::NAN]).unwrap_err(), HierarchyError::NotFinite { level: 1, index: 0 });
    spline.push_level(functions(36, &[[13, 14]])).unwrap();
    spline.pop_level();
    assert_eq!(spline.levels().len(), 1);
}

#[test]
fn coefficients_of_the_finest_level_are_replaced() {
    let mut corrected = hierarchy::<3>(41, 0.1);
    let mut again = corrected.clone();
    let count = corrected.levels()[2].active().len();
    corrected.correct_finest(scattered(count, 42)).unwrap();
    again.correct_finest(vec![0.0; count]).unwrap();
    again.correct_finest(scattered(count, 42)).unwrap();
    let mut without = again.clone();
    without.correct_finest(vec![0.0; count]).unwrap();
    let mut popped = again.clone();
    popped.pop_level();
    let mut changed = 0;
    for x in probes(corrected.domain(), 43) {
        assert_eq!(corrected.value(&x), again.value(&x));
        // Of nothing but rounding: one lattice's functions are sums of the next one's.
        assert!((without.value(&x) - popped.value(&x)).abs() < 1e-13);
        changed += usize::from((again.value(&x) - popped.value(&x)).abs() > 1e-3);
    }
    // The finest level is small, but some of the points see it.
    assert!(changed > 5, "{changed}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn leaf_cells_fill_the_box_and_hold_their_values(seed in 0u64..1000) {
        let spline = hierarchy::<2>(seed, 1.0);
        let leaves = spline.leaf_cells(|_| true);
        let area: f64 = leaves.iter().map(|leaf| (0.25 / f64::from(1 << leaf.level)).powi(2)).sum();
        prop_assert!((area - 54.0 / 16.0).abs() < 1e-12, "disjoint, so that the areas add up to the box");
        prop_assert!((0..=3).all(|level| leaves.iter().any(|leaf| leaf.level == level)));
        for leaf in &leaves {
            let side = 0.25 / f64::from(1 << leaf.level);
            for corner in [[0.0, 0.0], [0.4, 0.7], [1.0, 0.2]] {
                let x = std::array::from_fn(|a| -0.5 + side * (f64::from(leaf.index[a]) + corner[a]));
                let value = spline.value(&x);
                prop_assert!(value >= leaf.lower - 1e-14 && value <= leaf.upper + 1e-14);
            }
        }
        let crossing = spline.leaf_cells(|leaf| leaf.lower <= 0.0 && leaf.upper >= 0.0);
        let expected: Vec<_> = leaves.into_iter().filter(|leaf| leaf.lower <= 0.0 && leaf.upper >= 0.0).collect();
        prop_assert_eq!(crossing, expected);
    }
}

fn grows_by<const D: usize>(f: &HierarchicalSpline<D>, constant: f64, seed: u64) -> Result<(), TestCaseError> {
    let g = f.plus_constant(constant).unwrap();
    for x in probes(f.domain(), seed) {
        let ((before, gradient), (after, same)) = (f.value_and_gradient(&x), g.value_and_gradient(&x));
        // Rounding of numbers of size 1 and of the constant's, through sums of 4^D products and three levels.
        let tolerance = 1e-13 * (1.0 + constant.abs());
        prop_assert!((after - before - constant).abs() < tolerance, "{before} becomes {after} at {x:?}");
        // Differences of coefficients over cells of at least 1/32.
        prop_assert!((0..D).all(|a| (same[a] - gradient[a]).abs() < 1e3 * tolerance), "{gradient:?} becomes {same:?}");
    }
    let corrections = |f: &HierarchicalSpline<D>| -> Vec<Vec<f64>> {
        f.levels().iter().map(|level| level.corrections().to_vec()).collect()
    };
    prop_assert_eq!(corrections(&g), corrections(f));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_constant_is_added_everywhere(seed in 0u64..1000, constant in -100.0..100.0f64) {
        grows_by(&hierarchy::<2>(seed, 1.0), constant, seed)?;
        grows_by(&hierarchy::<3>(seed, 1.0), constant, seed)?;
    }
}

#[test]
fn a_constant_is_added_on_any_knots_and_must_be_finite() {
    let knots = [KnotVector::clamped(2, &[0.0, 0.3, 1.0]).unwrap(), KnotVector::uniform(2, 0.0, 0.5, 2).unwrap()];
    let f = Spline::from_flat(knots, scattered(16, 7)).unwrap();
    let g = f.plus_constant(0.25).unwrap();
    for x in [[0.0, 0.0], [0.3, 0.5], [0.7, 0.1], [1.0, 1.0]] {
        // Rounding of a sum of nine products.
        assert!((g.value(&x) - f.value(&x) - 0.25).abs() < 1e-15 * 9.0, "{x:?}");
    }
    assert_eq!(f.plus_constant(0.0).unwrap(), f);
    for constant in [f64::NAN, f64::INFINITY] {
        assert!(f.plus_constant(constant).is_err());
        assert!(hierarchy::<2>(1, 1.0).plus_constant(constant).is_err());
    }
}
