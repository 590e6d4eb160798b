//! Critical points: known ones are found, all found are ones, and few are missed even where a function is as rough as its cells.

use crate::common::scattered;
use std::sync::Arc;
use zeroset_bspline::{CellBand, CriticalPoint, HierarchicalSpline, KnotVector, Spline};

/// `Σ x³ − 3x` over the axes, exactly: critical where every coordinate is 1 (f is least along it) or −1, with values of ∓2 each.
fn cubes<const D: usize>(degree: usize, start: f64, side: f64, cells: usize) -> HierarchicalSpline<D> {
    let knots: [KnotVector; D] = std::array::from_fn(|_| KnotVector::uniform(degree, start, side, cells).unwrap());
    let along: Vec<f64> = (0..knots[0].basis_count())
        .map(|r| {
            let t = &knots[0].knots()[r + 1..=r + degree];
            // The blossoms of x³ and of x.
            let (mut triples, mut count) = (0.0, 0.0);
            for i in 0..degree {
                for j in 0..i {
                    for k in 0..j {
                        triples += t[i] * t[j] * t[k];
                        count += 1.0;
                    }
                }
            }
            triples / count - 3.0 * t.iter().sum::<f64>() / degree as f64
        })
        .collect();
    let n = along.len();
    let coefficient = |flat: usize| (0..D).map(|axis| along[flat / n.pow(axis as u32) % n]).sum();
    let coefficients = (0..n.pow(D as u32)).map(coefficient).collect();
    HierarchicalSpline::new(Spline::from_flat(knots, coefficients).unwrap()).unwrap()
}

fn check_cubes<const D: usize>(f: &HierarchicalSpline<D>) {
    let signs = |corner: usize| -> [f64; D] { std::array::from_fn(|axis| [-1.0, 1.0][corner >> (D - 1 - axis) & 1]) };
    for limit in [1.0, 3.0, 7.0] {
        let found = f.critical_points(limit);
        let expected: Vec<[f64; D]> =
            (0..1 << D).map(signs).filter(|place| (2.0 * place.iter().sum::<f64>()).abs() <= limit).collect();
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for place in expected {
            // Newton's method has ended where its steps are below a billionth of a cell.
            let at = |point: &&CriticalPoint<D>| (0..D).all(|axis| (point.place[axis] - place[axis]).abs() < 1e-8);
            let point = found.iter().find(at).unwrap();
            assert!((point.value + 2.0 * place.iter().sum::<f64>()).abs() < 1e-12, "{point:?}");
            assert_eq!(point.index, place.iter().filter(|x| **x < 0.0).count());
        }
    }
}

#[test]
fn known_ones_are_found_once_with_their_values_and_indices() {
    // Within cells, and where 2^D cells meet.
    for (start, side, cells) in [(-2.1, 0.31, 15), (-2.0, 0.25, 16), (-2.0, 1.0, 4)] {
        check_cubes(&cubes::<2>(3, start, side, cells));
        check_cubes(&cubes::<3>(3, start, side, cells));
        // Other degrees have no levels.
        check_cubes(&cubes::<2>(4, start, side, cells));
        check_cubes(&cubes::<3>(5, start, side, cells));
    }
}

#[test]
fn levels_that_change_nothing_change_no_critical_points() {
    for points in [vec![[1.0, 1.0, 1.0]], vec![[0.9, -1.2, 1.1], [-1.1, -0.9, -1.0]]] {
        let mut f = cubes::<3>(3, -2.0, 0.25, 16);
        let band = CellBand::new(f.root().knots(), &points, &vec![2; points.len()], [3, 3]).unwrap();
        for active in band.active() {
            f.push_level(Arc::clone(active)).unwrap();
        }
        check_cubes(&f);
    }
}

/// Random coefficients on cells of side ¼, with finer levels around a few points.
fn rough<const D: usize>(seed: u64) -> HierarchicalSpline<D> {
    let cells = [7, 5, 6];
    let knots: [KnotVector; D] = std::array::from_fn(|a| KnotVector::uniform(3, -0.5, 0.25, cells[a]).unwrap());
    let count = knots.iter().map(KnotVector::basis_count).product();
    let points: Vec<[f64; D]> = scattered(2 * D, seed + 1)
        .chunks_exact(D)
        .map(|u| std::array::from_fn(|a| -0.5 + 0.125 * cells[a] as f64 * (u[a] + 1.0)))
        .collect();
    let band = CellBand::new(&knots, &points, &[2, 1], [3, 3]).unwrap();
    let mut spline = HierarchicalSpline::new(Spline::from_flat(knots, scattered(count, seed)).unwrap()).unwrap();
    for active in band.active() {
        spline.push_level(Arc::clone(active)).unwrap();
        let corrections = scattered(active.len(), seed + 2);
        spline.correct_finest(corrections.into_iter().map(|c| 0.3 * c).collect()).unwrap();
    }
    spline
}

/// Where descent on ‖∇f‖² from everywhere ends, by Gauss–Newton steps with damping: another way than that of the crate.
fn minima_of_slope<const D: usize>(f: &HierarchicalSpline<D>, starts: usize, seed: u64) -> Vec<[f64; D]> {
    let (lower, upper) = f.domain();
    let mut found: Vec<[f64; D]> = Vec::new();
    for u in scattered(starts * D, seed).chunks_exact(D) {
        let mut x: [f64; D] = std::array::from_fn(|a| lower[a] + 0.5 * (u[a] + 1.0) * (upper[a] - lower[a]));
        let mut damping = 1.0;
        for _ in 0..200 {
            let jet = f.jet(&x);
            // x − (HH + μI)⁻¹ H g, one coordinate after another (Gauss–Seidel), for small symmetric systems.
            let squared = |a: usize, b: usize| (0..D).map(|k| jet.hessian[a][k] * jet.hessian[k][b]).sum::<f64>();
            let descent: [f64; D] =
                std::array::from_fn(|a| -(0..D).map(|k| jet.hessian[a][k] * jet.gradient[k]).sum::<f64>());
            let mut step = [0.0; D];
            for _ in 0..60 {
                for a in 0..D {
                    let rest: f64 = (0..D).filter(|b| *b != a).map(|b| squared(a, b) * step[b]).sum();
                    step[a] = (descent[a] - rest) / (squared(a, a) + damping);
                }
            }
            let next = std::array::from_fn(|a| (x[a] + step[a]).clamp(lower[a], upper[a]));
            let slope = |x: &[f64; D]| f.jet(x).gradient.iter().map(|g| g * g).sum::<f64>();
            if slope(&next) < slope(&x) {
                (x, damping) = (next, 0.3 * damping);
            } else {
                damping *= 4.0;
            }
        }
        let slope = f.jet(&x).gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        let known = found.iter().any(|other| (0..D).all(|a| (other[a] - x[a]).abs() < 1e-5));
        if slope < 1e-10 && !known {
            found.push(x);
        }
    }
    found
}

fn check_rough<const D: usize>(seed: u64, starts: usize) -> (usize, usize) {
    let (f, limit) = (rough::<D>(seed), 0.1);
    let found = f.critical_points(limit);
    for CriticalPoint { place, value, index } in &found {
        let jet = f.jet(place);
        assert!(value.abs() <= limit && (jet.value - value).abs() < 1e-12);
        // Second derivatives reach 4/h² on the finest cells; places are known to a billionth of a cell.
        assert!(jet.gradient.iter().all(|g| g.abs() < 1e-5), "{:?}", jet.gradient);
        assert!(*index <= D);
    }
    let others: Vec<_> = minima_of_slope(&f, starts, seed + 9);
    let others: Vec<_> = others.into_iter().filter(|x| f.value(x).abs() < limit).collect();
    let is_known = |x: &&[f64; D]| found.iter().any(|point| (0..D).all(|a| (point.place[a] - x[a]).abs() < 1e-4));
    (others.iter().filter(is_known).count(), others.len())
}

#[test]
fn few_are_missed_where_a_function_is_as_rough_as_its_cells() {
    let plane: Vec<_> = (0..12).map(|seed| check_rough::<2>(100 * seed, 300)).collect();
    let space: Vec<_> = (0..4).map(|seed| check_rough::<3>(100 * seed + 7, 400)).collect();
    for counts in [plane, space] {
        let (known, all) = counts.iter().fold((0, 0), |sum, (known, all)| (sum.0 + known, sum.1 + all));
        // Two in one sixteenth of a cell, or in space in one sixty-fourth, count for one.
        assert!(all > 40 && known as f64 >= 0.9 * all as f64, "{known} of {all}");
    }
}
