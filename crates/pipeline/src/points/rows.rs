//! Points in arrays.

use ndarray::ArrayView2;

use crate::error::InputError;

/// The rows of an array (`N × D`, one point or normal each, in any memory layout), as all functions here take them. The way back
/// is ndarray's own: `Array2::from(points)`.
///
/// # Errors
/// [`InputError::Columns`].
///
/// ```
/// use ndarray::{Array2, array};
///
/// let array = array![[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]];
/// let points: Vec<[f64; 3]> = zeroset::rows(array.view())?;
/// assert_eq!(points[1], [3.0, 4.0, 5.0]);
/// assert_eq!(Array2::from(points), array);
/// assert!(zeroset::rows::<2>(array.view()).is_err());
/// # Ok::<(), zeroset::InputError>(())
/// ```
pub fn rows<const D: usize>(array: ArrayView2<f64>) -> Result<Vec<[f64; D]>, InputError> {
    if array.ncols() != D {
        return Err(InputError::Columns { found: array.ncols(), needed: D });
    }
    Ok(array.rows().into_iter().map(|row| std::array::from_fn(|axis| row[axis])).collect())
}
