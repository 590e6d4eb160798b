//! What is known of the sides of the surface, beside the points.
//!
//! Sampson distances are small wherever a function stays near zero. Where a wall or a gap is thinner than the points are dense, a smooth
//! one would rather do so than fall and rise again, and pierces the one or bridges the other. Where the side is known f is held
//! to it, by its slope along normals and its values off the surface: one-sidedly, so that it costs nothing where f is right.

use std::borrow::Cow;

use zeroset_bspline::{BlockField, Level};
use zeroset_multigrid::{BandCollocation, BandRows};

use crate::error::Error;

/// What is known of the sides; nothing by default.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sides<const D: usize> {
    /// One outward unit normal per point, or zero where it is not known; empty if none is. They need not be exact: a function that
    /// rises along them by at least half its usual slope is left alone.
    pub normals: Vec<[f64; D]>,
    /// Places off the surface, each of the weight of a point of mean area.
    pub places: Vec<[f64; D]>,
    /// One bound for each place, in lengths: `f ≥ b` where b is positive, `f ≤ b` where it is negative.
    pub bounds: Vec<f64>,
}

impl<const D: usize> Sides<D> {
    pub(crate) fn check(&self, points: usize) -> Result<(), Error> {
        if !self.normals.is_empty() && self.normals.len() != points {
            return Err(Error::Normals { normals: self.normals.len(), points });
        }
        if let Some(index) = self.normals.iter().position(|n| n.iter().any(|x| !x.is_finite())) {
            return Err(Error::NormalNotFinite { index });
        }
        if self.bounds.len() != self.places.len() {
            return Err(Error::Bounds { bounds: self.bounds.len(), places: self.places.len() });
        }
        let mut places = self.places.iter().zip(&self.bounds);
        match places.position(|(x, b)| !b.is_finite() || x.iter().any(|x| !x.is_finite())) {
            Some(index) => Err(Error::PlaceNotFinite { index }),
            None => Ok(()),
        }
    }
}

/// Those of the places that lie in a level's cells.
#[derive(Debug)]
pub(crate) struct Bounded<const D: usize> {
    collocation: BandCollocation<D>,
    /// In the order of the collocation.
    bounds: Vec<f64>,
}

impl<const D: usize> Bounded<D> {
    pub(crate) fn new(level: &Level<D>, sides: &Sides<D>) -> Self {
        let collocation = BandCollocation::new(level, &sides.places);
        let bounds = collocation.indices().iter().map(|i| sides.bounds[*i as usize]).collect();
        Self { collocation, bounds }
    }

    /// `f − b` where f does not reach its bound, otherwise zero.
    pub(crate) fn lacks(&self, total: &BlockField<D>) -> Vec<f64> {
        let found = self.collocation.values_and_gradients(total);
        let lack = |b: f64, lack: f64| if lack * b < 0.0 { lack } else { 0.0 };
        found.iter().zip(&self.bounds).map(|((f, _), b)| lack(*b, f - b)).collect()
    }

    /// The rows of the places that lack something, and what each lacks.
    pub(crate) fn rows(&self, lacks: &[f64]) -> Option<(BandRows<'static, D>, Vec<f64>)> {
        let residuals: Vec<f64> = lacks.iter().copied().filter(|lack| *lack != 0.0).collect();
        if residuals.is_empty() {
            return None;
        }
        let collocation = Cow::Owned(self.collocation.subset(|i| lacks[i] != 0.0));
        let (alpha, beta) = (vec![1.0; residuals.len()], vec![[0.0; D]; residuals.len()]);
        Some((BandRows { collocation, alpha, beta }, residuals))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused() {
        let of = |normals: usize, places: usize, bounds: Vec<f64>| Sides {
            normals: vec![[1.0, 0.0]; normals],
            places: vec![[0.5, 0.5]; places],
            bounds,
        };
        assert_eq!(of(0, 0, vec![]).check(3), Ok(()));
        assert_eq!(of(3, 2, vec![0.1, -0.1]).check(3), Ok(()));
        assert_eq!(of(2, 0, vec![]).check(3), Err(Error::Normals { normals: 2, points: 3 }));
        assert_eq!(of(0, 2, vec![0.1]).check(3), Err(Error::Bounds { bounds: 1, places: 2 }));
        assert_eq!(of(0, 2, vec![0.1, f64::NAN]).check(3), Err(Error::PlaceNotFinite { index: 1 }));
    }
}
