use rayon::prelude::*;

use crate::direct_sum::{direct_sum, sphere};
use crate::tree::Tree;
use crate::winding_error::{WindingError, check};

/// The winding number of the points of a [`Tree`] with one set of normals.
#[derive(Debug, Clone)]
pub struct Winding<'a, const D: usize> {
    pub(crate) tree: &'a Tree<D>,
    pub(crate) area_vectors: Vec<[f64; D]>,
}

impl<const D: usize> Winding<'_, D> {
    /// W at one place.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond 1e60.
    pub fn at(&self, x: &[f64; D]) -> Result<f64, WindingError> {
        Ok(self.evaluate(std::slice::from_ref(x))?[0])
    }

    /// W at each of `queries` (`M × D`), in their order; parallel.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond 1e60; more than 2³² − 1 queries.
    pub fn evaluate(&self, queries: &[[f64; D]]) -> Result<Vec<f64>, WindingError> {
        self.evaluate_direct(queries)
    }

    /// The same by the sum over all points, exact up to rounding: N M terms. What [`Winding::evaluate`] is tested against.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond 1e60.
    pub fn evaluate_direct(&self, queries: &[[f64; D]]) -> Result<Vec<f64>, WindingError> {
        check("query", queries)?;
        let regular = self.tree.options.regularisation * self.tree.options.regularisation;
        let at = |x| direct_sum(&self.tree.points, &self.area_vectors, regular, x) / sphere::<D>();
        Ok(queries.par_iter().map(at).collect())
    }
}
