use pulp::Arch;
use rayon::prelude::*;

use crate::batch::{BATCH, Batch};
use crate::direct_sum::direct_sum;
use crate::multipole::Source;
use crate::opening::Opening;
use crate::partition::{BLOCK, Partition, bounds};
use crate::tree::Tree;
use crate::winding_error::{WindingError, check};

/// The winding number of the points of a [`Tree`] with one set of normals.
#[derive(Debug, Clone)]
pub struct Winding<'a, const D: usize> {
    pub(crate) tree: &'a Tree<D>,
    /// In the order of the tree.
    pub(crate) sources: Vec<Source<D>>,
    /// Polynomials of the boxes, in preorder.
    pub(crate) fields: Vec<f64>,
    pub(crate) openings: Vec<Opening>,
    /// 1 / area of the unit sphere.
    pub(crate) scale: f64,
}

/// What a batch of queries interacts with: filled anew for each, kept for its memory.
struct Interactions<'a, const D: usize> {
    far: Vec<([f64; D], &'a [f64])>,
    near: Vec<&'a [Source<D>]>,
}

impl<const D: usize> Winding<'_, D> {
    /// W at one place. For many places [`Winding::evaluate`] takes less time for each.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond [`crate::LARGEST`].
    pub fn at(&self, x: &[f64; D]) -> Result<f64, WindingError> {
        check("query", std::slice::from_ref(x))?;
        Ok(self.batch(std::slice::from_ref(x), &mut Interactions { far: vec![], near: vec![] })[0])
    }

    /// W at each of `queries` (`M × D`), in their order; parallel.
    ///
    /// Queries that lie near each other share what is near and what is far: values depend, within the tolerance, on the
    /// other queries, but not on the order of distinct ones.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond [`crate::LARGEST`]; more than 2³² − 1 queries.
    pub fn evaluate(&self, queries: &[[f64; D]]) -> Result<Vec<f64>, WindingError> {
        check("query", queries)?;
        let partition = Partition::new(queries, BATCH);
        let leaves: Vec<_> = partition.leaves().map(|leaf| leaf.run()).collect();
        let empty = || Interactions { far: vec![], near: vec![] };
        let batches: Vec<[f64; BATCH]> = leaves
            .par_iter()
            .map_init(empty, |interactions, run| self.batch(&partition.points[run.clone()], interactions))
            .collect();
        let mut values = vec![0.0; queries.len()];
        for (run, batch) in leaves.into_iter().zip(&batches) {
            for (&place, &value) in partition.order[run].iter().zip(batch) {
                values[place as usize] = value;
            }
        }
        debug_assert!(values.iter().all(|w| w.is_finite()), "squared distances are kept from vanishing");
        Ok(values)
    }

    /// The same by the sum over all points: M N terms, exact up to rounding. What [`Winding::evaluate`] is tested against.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond [`crate::LARGEST`].
    pub fn evaluate_direct(&self, queries: &[[f64; D]]) -> Result<Vec<f64>, WindingError> {
        check("query", queries)?;
        let regular = self.tree.regular();
        Ok(queries.par_iter().map(|x| self.scale * direct_sum(&self.sources, regular, x)).collect())
    }

    /// W at 1 to [`BATCH`] queries.
    fn batch<'s>(&'s self, queries: &[[f64; D]], interactions: &mut Interactions<'s, D>) -> [f64; BATCH] {
        self.interactions(&bounds(queries), interactions);
        let mut by_axis = [[0.0; BATCH]; D];
        for axis in 0..D {
            for (lane, x) in by_axis[axis].iter_mut().enumerate() {
                *x = queries[lane.min(queries.len() - 1)][axis];
            }
        }
        let batch = Batch {
            count: queries.len().next_multiple_of(BLOCK),
            queries: &by_axis,
            regular: self.tree.regular(),
            far: &interactions.far,
            near: &interactions.near,
        };
        Arch::new().dispatch(batch).map(|sum| self.scale * sum)
    }

    /// Walks down the tree to the boxes that are far from a box of queries, and to the leaves that are not.
    fn interactions<'s>(&'s self, [low, high]: &[[f64; D]; 2], interactions: &mut Interactions<'s, D>) {
        interactions.far.clear();
        interactions.near.clear();
        let (parts, regular, length) = (&self.tree.partition.parts, self.tree.regular(), self.tree.tables.coefficients);
        let mut index = 0;
        while index < parts.len() {
            let part = &parts[index];
            let centre = self.tree.balls[index].centre;
            let mut square = regular;
            for k in 0..D {
                let outside = (low[k] - centre[k]).max(centre[k] - high[k]).max(0.0);
                square += outside * outside;
            }
            if self.openings[index].is_far::<D>(square) {
                interactions.far.push((centre, &self.fields[index * length..][..length]));
                index = part.skip as usize;
            } else {
                if part.is_leaf(index) {
                    interactions.near.push(&self.sources[part.run()]);
                }
                index += 1;
            }
        }
    }
}
