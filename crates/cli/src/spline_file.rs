//! Spline files and the functions in them.

use std::path::Path;
use std::sync::Arc;

use ndarray::{Array2, ArrayView1};
use zeroset::bspline::{HierarchicalSpline, IndexSet, KnotVector, Level, Spline};
use zeroset_io::{SplineFile, SplineLevel};

use crate::failure::Failure;

/// The function of a file, and the origin that its knots are relative to.
pub fn to_spline<const D: usize>(path: &Path, file: &SplineFile) -> Result<([f64; D], HierarchicalSpline<D>), Failure> {
    let refuse = |problem: String| Failure::input(format!("{}: {problem}", path.display()));
    let wrong = || refuse(format!("not a function of {D} variables"));
    let origin: [f64; D] = file.origin.clone().try_into().map_err(|_| wrong())?;
    let mut knots = Vec::with_capacity(D);
    for (axis, axis_knots) in file.knots.iter().enumerate() {
        let vector = KnotVector::new(file.degree, axis_knots.clone());
        knots.push(vector.map_err(|error| refuse(format!("knots of axis {axis}: {error}")))?);
    }
    let knots: [KnotVector; D] = knots.try_into().map_err(|_| wrong())?;
    let root = Spline::new(knots, file.coefficients.clone()).map_err(|error| refuse(error.to_string()))?;
    let mut spline = HierarchicalSpline::new(root).map_err(|error| refuse(error.to_string()))?;
    for level in &file.levels {
        let extent = spline.next_extent().map_err(|error| refuse(error.to_string()))?;
        let rows = level.index.rows().into_iter();
        // The reader has refused indices that are negative or not below the extent, those that come twice, and rows that do not
        // have one per axis.
        let index = |row: ArrayView1<'_, i32>| std::array::from_fn(|axis| row.get(axis).map_or(0, |i| *i as u32));
        let indices: Vec<[u32; D]> = rows.map(index).collect();
        let active = IndexSet::new(extent, &indices);
        // A file's rows may have any order.
        let mut corrections = vec![0.0; active.len()];
        for (index, coefficient) in indices.iter().zip(&level.coefficients) {
            if let Some(place) = active.rank(*index).and_then(|rank| corrections.get_mut(rank)) {
                *place = *coefficient;
            }
        }
        let pushed = spline.push_level(Arc::new(active)).and_then(|()| spline.correct_finest(corrections));
        pushed.map_err(|error| refuse(error.to_string()))?;
    }
    Ok((origin, spline))
}

/// What is written for a function whose knots are relative to an origin.
pub fn to_file<const D: usize>(origin: [f64; D], spline: &HierarchicalSpline<D>) -> Result<SplineFile, Failure> {
    let root = spline.root();
    let knots = root.knots().iter().map(|knots| knots.knots().to_vec()).collect();
    let file = SplineFile::new(origin.to_vec(), knots, root.knots()[0].degree(), root.coefficients().clone());
    // Below a level without functions there is none with functions.
    let levels = spline.levels().iter().take_while(|level| !level.active().is_empty()).map(stored).collect();
    file.and_then(|file| file.with_levels(levels)).map_err(Failure::internal)
}

/// What is to be known where the zero set of a file's function is extracted as a whole.
pub fn note(path: &Path, file: &SplineFile) -> Option<String> {
    let path = path.display();
    file.open.then(|| {
        format!(
            "note: {path} was made with --open, but holds the function only: its zero set is closed here; reconstruct writes the \
             open one"
        )
    })
}

fn stored<const D: usize>(level: &Level<D>) -> SplineLevel {
    let mut index = Array2::zeros((level.active().len(), D));
    for (mut row, function) in index.rows_mut().into_iter().zip(level.active().iter()) {
        // Extents are below 2^31.
        row.iter_mut().zip(function).for_each(|(entry, k)| *entry = k as i32);
    }
    SplineLevel { index, coefficients: level.corrections().to_vec() }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use zeroset::bspline::{CellBand, Derivatives};

    use super::*;

    /// A function with two levels around one point and one around another.
    fn spline<const D: usize>(numbers: &[f64], at: [f64; D]) -> HierarchicalSpline<D> {
        let knots = std::array::from_fn(|axis| KnotVector::uniform(3, -0.3, 0.1, 6 + axis).unwrap());
        let mut numbers = numbers.iter().copied().cycle();
        let mut some = |n: usize| numbers.by_ref().take(n).collect::<Vec<f64>>();
        let root = Spline::from_flat(knots.clone(), some(knots.iter().map(KnotVector::basis_count).product())).unwrap();
        let band = CellBand::new(&knots, &[at, at.map(|c| 0.1 - c)], &[2, 1], [3, 3]).unwrap();
        HierarchicalSpline::with_levels(root, band.active().iter().map(|set| (Arc::clone(set), some(set.len()))))
            .unwrap()
    }

    fn comes_back<const D: usize>(spline: &HierarchicalSpline<D>) -> Result<(), TestCaseError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.npz");
        let origin = [0.1; D];
        let file = to_file(origin, spline).unwrap();
        prop_assert_eq!(file.levels.len(), spline.levels().len());
        zeroset_io::write_spline(&path, &file).unwrap();
        let (found, back) = to_spline::<D>(&path, &zeroset_io::read_spline(&path).unwrap()).unwrap();
        prop_assert_eq!(found, origin);
        // −0 and 0 are equal, so the bits of what is stored are compared too.
        prop_assert_eq!(&back, spline);
        let bits = |level: &Level<D>| level.corrections().iter().map(|c| c.to_bits()).collect::<Vec<_>>();
        prop_assert!(back.levels().iter().map(bits).eq(spline.levels().iter().map(bits)));
        let mut shuffled = file;
        for level in &mut shuffled.levels {
            level.index.invert_axis(ndarray::Axis(0));
            level.coefficients.reverse();
        }
        let (_, back) = to_spline::<D>(&path, &shuffled).unwrap();
        prop_assert_eq!(&back, spline);
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn functions_with_levels_come_back_bit_for_bit(
            numbers in proptest::collection::vec(-1e9..1e9f64, 97),
            at in proptest::array::uniform3(-0.2..0.2f64),
        ) {
            comes_back(&spline::<2>(&numbers, [at[0], at[1]]))?;
            comes_back(&spline::<3>(&numbers, at))?;
        }
    }

    #[test]
    fn dense_functions_of_any_degree_are_evaluated() {
        let knots = [KnotVector::clamped(2, &[0.0, 0.3, 1.0]).unwrap(), KnotVector::uniform(2, 0.0, 0.5, 2).unwrap()];
        let root = Spline::from_flat(knots, (0..16).map(|i| f64::from(i * i % 11)).collect()).unwrap();
        let file = to_file([0.0; 2], &HierarchicalSpline::new(root.clone()).unwrap()).unwrap();
        let (_, back) = to_spline::<2>(Path::new("f.npz"), &file).unwrap();
        let points = [[0.1, 0.9], [1.0, 1.0], [0.0, 0.0], [0.3, 1.1]];
        let (found, needed) =
            (back.evaluate(&points, Derivatives::Hessian), root.evaluate(&points, Derivatives::Hessian));
        assert_eq!((found.outside, needed.outside), (1, 1));
        assert_eq!((&found.values[..3], &found.hessians[..3]), (&needed.values[..3], &needed.hessians[..3]));
        assert!(found.values[3].is_nan());
        assert_eq!(back.value(&points[0]), root.value(&points[0]));
        assert_eq!(back.sample(&[vec![0.2], vec![0.4]], [1, 0]), root.sample(&[vec![0.2], vec![0.4]], [1, 0]));
        assert_eq!(back.bounds(&[0.0; 2], &[0.2; 2]), root.bounds(&[0.0; 2], &[0.2; 2]));
        assert_eq!(back.leaf_cells(|_| true).len(), 4);
    }

    #[test]
    fn levels_that_make_no_function_are_refused_with_the_reason() {
        let sound = to_file([0.0; 2], &spline::<2>(&[1.0, 2.0], [0.0; 2])).unwrap();
        let refused = |change: &dyn Fn(&mut SplineFile)| {
            let mut file = sound.clone();
            change(&mut file);
            to_spline::<2>(Path::new("f.npz"), &file).unwrap_err().to_string()
        };
        assert!(refused(&|file| file.knots[1][2] += 0.01).contains("f.npz: the knots along axis 1 are not uniform"));
        // The first function sticks out of the box; the one at the box's corner is far from level 1.
        assert!(refused(&|file| file.levels[0].index.row_mut(0).fill(0)).contains("level 1: the supports"));
        assert!(refused(&|file| file.levels[1].index.row_mut(0).fill(3)).contains("level 2: the supports"));
    }
}
