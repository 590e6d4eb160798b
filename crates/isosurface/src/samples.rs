//! Samples on a lattice, with one more layer of outside around them.

use ndarray::ArrayD;
use rayon::prelude::*;

use crate::error::Error;
use crate::function::ImplicitFunction;

/// Values on all combinations of coordinates: entry `(i, j[, k])` belongs to `(axes[0][i], axes[1][j][, axes[2][k]])`.
#[derive(Debug, Clone, PartialEq)]
pub struct LatticeSamples<const D: usize> {
    axes: [Vec<f64>; D],
    values: Vec<f64>,
    /// Nodes per axis, the outer layer included.
    padded: [usize; D],
    /// The value that stands for outside: positive, and as large as any sample.
    outside: f64,
}

impl<const D: usize> LatticeSamples<D> {
    /// Joins coordinates and values.
    ///
    /// # Errors
    /// Shapes that do not fit, fewer than two coordinates on an axis, coordinates that do not increase or are too far apart,
    /// or values that are not finite.
    pub fn new(axes: [Vec<f64>; D], values: ArrayD<f64>) -> Result<Self, Error> {
        let lengths = axes.each_ref().map(Vec::len);
        if values.shape() != lengths || lengths.iter().any(|&n| n < 2) {
            return Err(Error::Shape { values: values.shape().to_vec(), axes: lengths.to_vec() });
        }
        for (axis, positions) in axes.iter().enumerate() {
            let fault = |i: usize| !positions[i].is_finite() || (i > 0 && positions[i] <= positions[i - 1]);
            if let Some(index) = (0..positions.len()).find(|&i| fault(i)) {
                return Err(Error::Axis { axis, index });
            }
            let length = positions[positions.len() - 1] - positions[0];
            if !(2.0 * length).is_finite() {
                return Err(Error::Extent { axis });
            }
        }
        if let Some((index, _)) = values.indexed_iter().find(|(_, v)| !v.is_finite()) {
            return Err(Error::NotFinite(ndarray::Dimension::slice(&index).to_vec()));
        }
        let values: Vec<f64> = values.iter().copied().collect();
        let outside = values.iter().map(|v| v.abs()).fold(f64::MIN_POSITIVE, f64::max);
        Ok(Self { axes, values, padded: lengths.map(|n| n + 2), outside })
    }

    /// Samples a function.
    ///
    /// # Errors
    /// As [`LatticeSamples::new`].
    pub fn of(axes: [Vec<f64>; D], function: &impl ImplicitFunction<D>) -> Result<Self, Error> {
        let shape = axes.each_ref().map(Vec::len);
        let count: usize = shape.iter().product();
        let values: Vec<f64> = (0..count)
            .into_par_iter()
            .map(|mut flat| {
                let mut x = [0.0; D];
                for axis in (0..D).rev() {
                    x[axis] = axes[axis][flat % shape[axis]];
                    flat /= shape[axis];
                }
                function.value(&x)
            })
            .collect();
        // One value was made per node.
        let values = ArrayD::from_shape_vec(shape.to_vec(), values).expect("one value per node");
        Self::new(axes, values)
    }

    /// Nodes per axis, the outer layer included.
    pub(crate) fn shape(&self) -> [usize; D] {
        self.padded
    }

    /// The value at a node of the padded lattice.
    pub(crate) fn value(&self, node: &[usize; D]) -> f64 {
        if self.is_outer(node) {
            return self.outside;
        }
        let flat = (0..D).fold(0, |flat, axis| flat * (self.padded[axis] - 2) + node[axis] - 1);
        self.values[flat]
    }

    /// Whether a node belongs to the layer around the lattice.
    pub(crate) fn is_outer(&self, node: &[usize; D]) -> bool {
        (0..D).any(|axis| node[axis] == 0 || node[axis] + 1 == self.padded[axis])
    }

    /// The position of a node; the outer layer lies a thousandth of a cell outside, so that caps are nearly flush.
    pub(crate) fn position(&self, node: &[usize; D]) -> [f64; D] {
        std::array::from_fn(|axis| {
            let coordinates = &self.axes[axis];
            let last = coordinates.len() - 1;
            match node[axis] {
                0 => coordinates[0] - 2e-3 * (coordinates[1] - coordinates[0]),
                i if i > last + 1 => coordinates[last] + 2e-3 * (coordinates[last] - coordinates[last - 1]),
                i => coordinates[i - 1],
            }
        })
    }
}
