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
    /// Places off the surface.
    pub places: Vec<Place<D>>,
}

/// A place off the surface, and what is known of f there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place<const D: usize> {
    /// Where it is.
    pub at: [f64; D],
    /// The bound, in lengths: `f ≥ b` where b is positive, `f ≤ b` where it is negative.
    pub bound: f64,
    /// What it weighs, in points of mean area; positive.
    pub weight: f64,
}

impl<const D: usize> Sides<D> {
    pub(crate) fn check(&self, points: usize) -> Result<(), Error> {
        if !self.normals.is_empty() && self.normals.len() != points {
            return Err(Error::Normals { normals: self.normals.len(), points });
        }
        if let Some(index) = self.normals.iter().position(|n| n.iter().any(|x| !x.is_finite())) {
            return Err(Error::NormalNotFinite { index });
        }
        let is_bad = |place: &Place<D>| {
            let known = place.bound.is_finite() && place.weight.is_finite() && place.weight > 0.0;
            !known || place.at.iter().any(|x| !x.is_finite())
        };
        match self.places.iter().position(is_bad) {
            Some(index) => Err(Error::Place { index }),
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
    /// Square roots of the weights, in the same order.
    roots: Vec<f64>,
}

impl<const D: usize> Bounded<D> {
    pub(crate) fn new(level: &Level<D>, sides: &Sides<D>) -> Self {
        let at: Vec<[f64; D]> = sides.places.iter().map(|place| place.at).collect();
        let collocation = BandCollocation::new(level, &at);
        let places = || collocation.indices().iter().map(|i| &sides.places[*i as usize]);
        let (bounds, roots) = places().map(|place| (place.bound, place.weight.sqrt())).unzip();
        Self { collocation, bounds, roots }
    }

    /// `√ω (f − b)` for a place of weight ω where f does not reach its bound, otherwise zero.
    pub(crate) fn lacks(&self, total: &BlockField<D>) -> Vec<f64> {
        let found = self.collocation.values_and_gradients(total);
        let known = self.bounds.iter().zip(&self.roots);
        let lack = |f: f64, b: f64, root: f64| if (f - b) * b < 0.0 { root * (f - b) } else { 0.0 };
        found.iter().zip(known).map(|((f, _), (b, root))| lack(*f, *b, *root)).collect()
    }

    /// The rows of the places that lack something, and what each lacks.
    pub(crate) fn rows(&self, lacks: &[f64]) -> Option<(BandRows<'static, D>, Vec<f64>)> {
        let of_lacking = |values: &[f64]| {
            let lacking = values.iter().zip(lacks).filter(|(_, lack)| **lack != 0.0);
            lacking.map(|(value, _)| *value).collect::<Vec<f64>>()
        };
        let residuals = of_lacking(lacks);
        if residuals.is_empty() {
            return None;
        }
        let collocation = Cow::Owned(self.collocation.subset(|i| lacks[i] != 0.0));
        let (alpha, beta) = (of_lacking(&self.roots), vec![[0.0; D]; residuals.len()]);
        Some((BandRows { collocation, alpha, beta }, residuals))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused() {
        let of = |normals: usize, places: &[(f64, f64)]| Sides {
            normals: vec![[1.0, 0.0]; normals],
            places: places
                .iter()
                .map(|(bound, weight)| Place { at: [0.5, 0.5], bound: *bound, weight: *weight })
                .collect(),
        };
        assert_eq!(of(0, &[]).check(3), Ok(()));
        assert_eq!(of(3, &[(0.1, 1.0), (-0.1, 4.0)]).check(3), Ok(()));
        assert_eq!(of(2, &[]).check(3), Err(Error::Normals { normals: 2, points: 3 }));
        for bad in [(f64::NAN, 1.0), (0.1, f64::INFINITY), (0.1, 0.0), (0.1, -1.0)] {
            assert_eq!(of(0, &[(0.1, 1.0), bad]).check(3), Err(Error::Place { index: 1 }));
        }
    }
}
