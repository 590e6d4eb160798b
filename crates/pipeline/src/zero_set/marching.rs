//! The cells that the zero set is extracted on.

use rayon::prelude::*;
use std::ops::RangeInclusive;
use zeroset_bspline::{Derivatives, graded_halving};

use crate::reconstruct::Reconstruction;

/// Lattices coarser than this are halved once more for extraction: chords over a cell would show.
const FINE_ENOUGH: usize = 96;
/// A mesh of more vertices is not made by halving the finest level's cells: it would cost more than it shows.
const MANY: f64 = 400_000.0;
/// Nor is one of more than so many by halving them again, for chords that leave the surface.
pub(crate) const MANY_FOR_SAG: f64 = 200_000.0;
/// Cells that a surface or curve of extent A crosses, in `A / h^(D−1)`: the mean over all directions of a plane's normal of
/// the sum of its components is 3/2, of a line's 4/π.
pub(crate) const CUT: f64 = 1.5;
/// Chords that leave the surface by less than this share of the spacing are as good as the surface. (Functions of smooth shapes are
/// exact to a thousandth of it, where chords over half a spacing are off by several.)
const SAG: f64 = 0.002;
/// So are those that leave it by less than this share of the noise.
const SAG_IN_NOISE: f64 = 0.05;

/// From the dense lattice's cells to those that the zero set is extracted on: the largest, over which chords do not show, and the smallest. These
/// are the finest of the spline, halved once more if chords over them would show or the mesh stays small, and again while chords leave the
/// surface by more than the points tell of it.
pub(crate) fn marching_halvings<const D: usize>(reconstruction: &Reconstruction<D>) -> RangeInclusive<u32> {
    let longest = reconstruction.domain.cells(reconstruction.halvings).into_iter().max().unwrap_or(0);
    let levels = reconstruction.spline.levels().len() as u32;
    let cell = |halvings: u32| reconstruction.domain.spacing(reconstruction.halvings + halvings);
    let refined = reconstruction.initial.is_some();
    let extents = if refined { extents(reconstruction) } else { vec![] };
    let vertices = |halvings: u32| -> f64 {
        let of = |level: usize| halving_at(D, level, levels as usize, halvings as usize) as u32;
        let crossed = |(level, extent): (usize, &f64)| CUT * extent / cell(of(level)).powi(D as i32 - 1);
        extents.iter().enumerate().map(crossed).sum()
    };
    let mut halvings = levels + u32::from(longest << levels < FINE_ENOUGH || (refined && vertices(levels + 1) < MANY));
    if refined && vertices(halvings + 1) < MANY_FOR_SAG {
        let curvature = typical_curvature(reconstruction);
        let shown = (SAG * reconstruction.spacing.typical).max(SAG_IN_NOISE * reconstruction.noise);
        while sag(curvature, cell(halvings)) > shown && vertices(halvings + 1) < MANY_FOR_SAG {
            halvings += 1;
        }
    }
    let fewest = (0..halvings).find(|fewest| longest << fewest >= FINE_ENOUGH).unwrap_or(halvings);
    fewest..=halvings
}

/// How often the dense lattice's cells are halved to extract the zero set where the spline has its cells of a level, if they are halved
/// `finest` times for the smallest. In the plane all are as small as these.
pub(crate) fn halving_at(dimension: usize, level: usize, levels: usize, finest: usize) -> usize {
    if dimension == 3 { graded_halving(level, levels, finest) } else { finest }
}

/// The length or area that the points stand for where the spline has its cells of each level, in the frame.
fn extents<const D: usize>(reconstruction: &Reconstruction<D>) -> Vec<f64> {
    let (spline, spacing) = (&reconstruction.spline, &reconstruction.spacing);
    let points = reconstruction.fitted();
    let levels: Vec<usize> = points.par_iter().map(|point| spline.level_at(point).unwrap_or(0)).collect();
    let mut extents = vec![0.0; spline.levels().len() + 1];
    for (level, share) in levels.into_iter().zip(&spacing.areas) {
        extents[level] += share * spacing.extent() / points.len() as f64;
    }
    extents
}

/// How far a chord leaves an arc of this curvature.
fn sag(curvature: f64, chord: f64) -> f64 {
    0.125 * curvature * chord * chord
}

/// The median over the fitted points of the root mean square of the principal curvatures there, in the frame.
fn typical_curvature<const D: usize>(reconstruction: &Reconstruction<D>) -> f64 {
    let at = reconstruction.spline.evaluate(&reconstruction.fitted(), Derivatives::Hessian);
    let of = |(gradient, hessian): (&[f64; D], &[[f64; D]; D])| {
        let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        (norm > 0.0).then(|| norm_on_tangents(&gradient.map(|g| g / norm), hessian) / norm / ((D - 1) as f64).sqrt())
    };
    let mut curvatures: Vec<f64> = at.gradients.par_iter().zip(&at.hessians).filter_map(of).collect();
    let middle = curvatures.len() / 2;
    if curvatures.is_empty() { 0.0 } else { *curvatures.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// The Frobenius norm of `P H P`, `P = 1 − n nᵀ`.
fn norm_on_tangents<const D: usize>(normal: &[f64; D], hessian: &[[f64; D]; D]) -> f64 {
    let dot = |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let across = hessian.map(|row| dot(&row, normal));
    let along = dot(&across, normal);
    let entry = |i: usize, j: usize| {
        hessian[i][j] - across[i] * normal[j] - normal[i] * across[j] + along * normal[i] * normal[j]
    };
    (0..D).flat_map(|i| (0..D).map(move |j| (i, j))).map(|(i, j)| entry(i, j).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Options, reconstruct};

    /// A circle and a sphere of radius 2, by points turned by the golden angle.
    fn round<const D: usize>(n: usize) -> Vec<[f64; D]> {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..n)
            .map(|i| {
                let z = if D == 3 { 1.0 - (2 * i + 1) as f64 / n as f64 } else { 0.0 };
                let (sin, cos) = (golden * i as f64).sin_cos();
                let place = [2.0 * (1.0 - z * z).sqrt() * cos, 2.0 * (1.0 - z * z).sqrt() * sin, 2.0 * z];
                std::array::from_fn(|axis| place[axis])
            })
            .collect()
    }

    #[test]
    fn a_norm_on_tangents_leaves_out_what_goes_across() {
        let h = [[1.0, 2.0, 3.0], [2.0, 5.0, 6.0], [3.0, 6.0, 9.0]];
        let expected = (1.0 + 2.0 * 4.0 + 25.0_f64).sqrt();
        assert!((norm_on_tangents(&[0.0, 0.0, 1.0], &h) - expected).abs() < 1e-14, "rounding");
        // The identity restricted to a plane.
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let n = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
        assert!((norm_on_tangents(&n, &identity) - 2.0_f64.sqrt()).abs() < 1e-14, "rounding");
    }

    #[test]
    fn curvature_of_a_circle_and_of_a_sphere() {
        let circle = reconstruct(&round::<2>(300), &Options::default()).unwrap();
        let radius = 2.0 * circle.frame.scale;
        // Two percent: curvature is a second derivative of a fit.
        assert!((typical_curvature(&circle) * radius - 1.0).abs() < 0.02, "{}", typical_curvature(&circle) * radius);
        let sphere = reconstruct(&round::<3>(1500), &Options::default()).unwrap();
        let radius = 2.0 * sphere.frame.scale;
        assert!((typical_curvature(&sphere) * radius - 1.0).abs() < 0.02, "{}", typical_curvature(&sphere) * radius);
    }

    #[test]
    fn cells_are_halved_until_chords_do_not_show() {
        // So few points that spacings are long against the radius.
        let coarse = reconstruct(&round::<3>(150), &Options { resolution: Some(8), ..Options::default() }).unwrap();
        let halvings = *marching_halvings(&coarse).end();
        let cell = coarse.domain.spacing(coarse.halvings + halvings);
        let spacing = coarse.spacing.typical;
        assert!(sag(typical_curvature(&coarse), cell) <= SAG * spacing, "{halvings}");
        assert!(sag(typical_curvature(&coarse), 2.0 * cell) > SAG * spacing, "and no further: {halvings}");
    }
}
