//! The cells that bounds leave over are enough, few, and have the right values at their corners.

use crate::common::scattered;
use proptest::prelude::*;
use std::sync::Arc;
use zeroset_bspline::{BandError, CellBand, CrossedCells, HierarchicalSpline, IndexSet, KnotVector, Spline};

/// Cells of side ¼ with two finer levels around a few points.
fn hierarchy<const D: usize>(seed: u64, shift: f64) -> HierarchicalSpline<D> {
    let cells = [9, 6, 7];
    let knots: [KnotVector; D] = std::array::from_fn(|a| KnotVector::uniform(3, -0.5, 0.25, cells[a]).unwrap());
    let count = knots.iter().map(KnotVector::basis_count).product();
    let coefficients = scattered(count, seed).into_iter().map(|c| c + shift).collect();
    let points: Vec<[f64; D]> = scattered(4 * D, seed + 1)
        .chunks_exact(D)
        .map(|u| std::array::from_fn(|a| -0.5 + 0.125 * cells[a] as f64 * (u[a] + 1.0)))
        .collect();
    let band = CellBand::new(&knots, &points, &[2, 1, 2, 0], [3, 3]).unwrap();
    let mut spline = HierarchicalSpline::new(Spline::from_flat(knots, coefficients).unwrap()).unwrap();
    for active in band.active() {
        spline.push_level(Arc::clone(active)).unwrap();
        spline.correct_finest(scattered(active.len(), seed + 2)).unwrap();
    }
    spline
}

/// All indices below an extent.
fn indices<const D: usize>(extent: [u32; D]) -> impl Iterator<Item = [u32; D]> {
    (0..extent.iter().product()).map(move |mut rest: u32| {
        let mut index = [0; D];
        for axis in (0..D).rev() {
            index[axis] = rest % extent[axis];
            rest /= extent[axis];
        }
        index
    })
}

fn value_at<const D: usize>(found: &CrossedCells<D>, node: [u32; D]) -> Option<f64> {
    let mut value = [0.0];
    found.values.set().contains(node).then(|| {
        found.values.gather(node.map(i64::from), 1, &mut value);
        value[0]
    })
}

fn check<const D: usize>(f: &HierarchicalSpline<D>, halvings: u32) -> Result<(), TestCaseError> {
    let found = f.crossed_cells(halvings).unwrap();
    let extent = found.cells.extent();
    prop_assert_eq!(found.axes.each_ref().map(|nodes| nodes.len() as u32 - 1), extent);
    prop_assert_eq!(&**found.values.set(), &found.cells.dilated(0..=1, extent.map(|n| n + 1)));
    let position = |node: [u32; D]| std::array::from_fn(|a| found.axes[a][node[a] as usize]);
    for node in found.values.set().iter() {
        let value = value_at(&found, node).unwrap();
        // Convex combinations of coefficients up to 4, in another order.
        prop_assert!((value - f.value(&position(node))).abs() < 1e-14);
    }
    for cell in indices(extent).filter(|cell| !found.cells.contains(*cell)) {
        let at = |t: f64, other: f64| {
            let (low, high) = (position(cell), position(cell.map(|k| k + 1)));
            std::array::from_fn(|a| low[a] + (high[a] - low[a]) * if a == 0 { t } else { other })
        };
        let inside = f.value(&at(0.5, 0.5)) < 0.0;
        for x in [at(0.0, 0.0), at(0.1, 0.9), at(0.9, 0.1), at(0.7, 0.6)] {
            prop_assert_eq!(f.value(&x) < 0.0, inside, "a cell left out has one sign");
        }
        let at_face = (0..D).any(|a| cell[a] == 0 || cell[a] + 1 == extent[a]);
        prop_assert!(!(at_face && inside), "at a face only the outside is left out");
        // Nodes that it shares with cells that were kept have its sign, by the values that go with those.
        for corner in 0..1u32 << D {
            let node = std::array::from_fn(|a| cell[a] + (corner >> a & 1));
            prop_assert!(value_at(&found, node).is_none_or(|value| (value < 0.0) == inside));
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn cells_left_out_have_one_sign(seed in 0u64..1000, shift in -0.5..0.5f64, halvings in 0u32..4) {
        check(&hierarchy::<2>(seed, shift), halvings)?;
        check(&hierarchy::<3>(seed, shift), halvings.min(2))?;
    }

    #[test]
    fn dense_splines_may_be_any(seed in 0u64..1000, degree in 1usize..=5, halvings in 0u32..3) {
        let steps = scattered(40, seed);
        let mut t = vec![0.0];
        for step in steps.iter().take(12 + degree) {
            // Knots repeat, but not so often that f would jump.
            let repeats = t.iter().rev().take_while(|k| **k == t[t.len() - 1]).count();
            t.push(t[t.len() - 1] + if *step < 0.0 && repeats < degree { 0.0 } else { step.abs() + 0.1 });
        }
        let knots = [KnotVector::new(degree, t).unwrap(), KnotVector::uniform(degree, -1.0, 0.5, 6).unwrap()];
        let coefficients = scattered(knots.iter().map(KnotVector::basis_count).product(), seed + 1);
        check(&HierarchicalSpline::new(Spline::from_flat(knots, coefficients).unwrap()).unwrap(), halvings)?;
    }
}

/// The same with f > 0 at the box's faces.
fn walled<const D: usize>(seed: u64, shift: f64) -> HierarchicalSpline<D> {
    let f = hierarchy::<D>(seed, shift);
    let shape = f.root().shape().to_vec();
    let is_wall = |mut flat: usize| {
        shape.iter().rev().any(|n| {
            let k = flat % n;
            flat /= n;
            k < 3 || k + 3 >= *n
        })
    };
    let root = f.root().as_flat().iter().enumerate().map(|(flat, c)| if is_wall(flat) { 20.0 } else { *c }).collect();
    let root = Spline::from_flat(f.root().knots().clone(), root).unwrap();
    let levels = f.levels().iter().map(|level| (Arc::clone(level.active()), level.corrections().to_vec()));
    HierarchicalSpline::with_levels(root, levels.collect::<Vec<_>>()).unwrap()
}

/// Cells of several sizes, of which some are divided further.
fn check_graded<const D: usize>(f: &HierarchicalSpline<D>, halvings: u32, more: bool) -> Result<usize, TestCaseError> {
    let mut grading = f.grading(0..=halvings);
    if more && let Some(sizes) = f.graded_cells(&grading).unwrap() {
        let largest: Vec<[u32; D]> = sizes[sizes.len() - 1].cells.iter().take(1).collect();
        grading.divide(grading.finest() + 1 - sizes.len(), &largest);
    }
    let Some(sizes) = f.graded_cells(&grading).unwrap() else { return Ok(0) };
    let whole = f.crossed_cells(halvings).unwrap();
    for (i, size) in sizes.iter().enumerate() {
        for node in size.values.set().iter() {
            let value = value_at(size, node).unwrap();
            let x = std::array::from_fn(|a| size.axes[a][node[a] as usize]);
            // As above, of coefficients up to 20.
            prop_assert!((value - f.value(&x)).abs() < 1e-13);
            // The smallest come first.
            let finer = i.checked_sub(1).and_then(|finer| value_at(&sizes[finer], node.map(|k| 2 * k)));
            prop_assert!(finer.is_none_or(|finer| finer == value), "one value for all sizes");
        }
        // From one place before the cells to one after, on lattices of half the spacing or less.
        for cell in size.cells.iter() {
            for (j, smaller) in sizes[..i].iter().enumerate() {
                let side = 1u32 << (i - j);
                let around = |place: [u32; D]| std::array::from_fn(|a| (cell[a] * side + place[a]).wrapping_sub(1));
                for place in indices([side + 2; D]) {
                    let touches = (0..D).any(|a| place[a] == 0 || place[a] == side + 1);
                    let is_there = smaller.cells.contains(around(place));
                    prop_assert!(!is_there || (touches && j + 1 == i), "sizes {} and {} at {:?}", i, j, cell);
                }
            }
        }
    }
    // No cell that the zero set passes through is left out.
    for cell in whole.cells.iter() {
        let corner = |c: u32| value_at(&whole, std::array::from_fn(|a| cell[a] + (c >> a & 1))).unwrap();
        let inside = corner(0) < 0.0;
        if (1..1 << D).any(|c| (corner(c) < 0.0) != inside) {
            prop_assert!(sizes.iter().enumerate().any(|(i, size)| size.cells.contains(cell.map(|k| k >> i))));
        }
    }
    Ok(sizes[1..].iter().map(|size| size.cells.len()).sum())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn cells_of_several_sizes_fit_together(seed in 0u64..1000, shift in -0.5..0.5f64, more in 0u32..2, divided: bool) {
        // Of two levels there are two sizes, or three where the finest's cells are halved.
        check_graded(&walled::<2>(seed, shift), 2 + more, divided)?;
        check_graded(&walled::<3>(seed, shift), 2 + more, divided)?;
    }
}

#[test]
fn larger_cells_are_found_where_the_function_has_them() {
    let counts = [3, 4, 5].map(|seed| check_graded(&walled::<3>(seed, 0.0), 2, false).unwrap());
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
    // None larger than asked for.
    let f = walled::<3>(3, 0.0);
    assert_eq!(f.graded_cells(&f.grading(2..=2)).unwrap(), Some(vec![f.crossed_cells(2).unwrap()]));
    // Where f < 0 at the box's faces there is a cap, which is as thick everywhere.
    assert_eq!(hierarchy::<3>(3, 0.0).graded_cells(&hierarchy::<3>(3, 0.0).grading(0..=2)).unwrap(), None);
}

#[test]
fn where_f_jumps_no_cell_is_left_out() {
    let jump = KnotVector::new(1, vec![0.0, 1.0, 2.0, 2.0, 3.0, 4.0]).unwrap();
    let smooth = KnotVector::uniform(1, 0.0, 1.0, 2).unwrap();
    let coefficients = [[-1.0; 6], [1.0; 6]].concat();
    let spline = HierarchicalSpline::new(Spline::from_flat([jump, smooth], coefficients).unwrap()).unwrap();
    assert_eq!(spline.crossed_cells(1).unwrap().cells.len(), 4 * 4);
}

#[test]
fn cells_that_cannot_be_told_apart_or_counted_are_refused() {
    let far = KnotVector::uniform(3, 1e15, 1.0, 4).unwrap();
    let spline = Spline::from_flat([far.clone(), far], vec![1.0; 49]).unwrap();
    let error = HierarchicalSpline::new(spline).unwrap().crossed_cells(9).unwrap_err();
    // Neighbours at 1e15 are an eighth apart.
    assert_eq!(error, BandError::TooFine(4));
    let knots = KnotVector::uniform(3, 0.0, 1.0, 4).unwrap();
    let spline = Spline::from_flat([knots.clone(), knots.clone(), knots], vec![1.0; 343]).unwrap();
    let error = HierarchicalSpline::new(spline).unwrap().crossed_cells(u32::MAX).unwrap_err();
    assert_eq!(error, BandError::TooFine((IndexSet::<3>::MAX_EXTENT / 4).ilog2() as usize));
}
