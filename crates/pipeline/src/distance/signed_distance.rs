//! Distances from a zero set.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;
use zeroset_bspline::HierarchicalSpline;

/// Steps from the nearest vertex to the nearest place.
const STEPS: usize = 24;
/// A step that leads away is halved. No shorter share of a step is tried: only beyond so many radii of curvature one would be needed.
const SHORTEST: f64 = 1.0 / 1024.0;

/// The signed distance from the curve or surface `f = 0`, negative inside: near it f itself is close to that, farther away it need
/// not be, and beyond its box f is not defined.
///
/// ```
/// use zeroset::{Options, SignedDistance, extract_curve, reconstruct};
/// let points: Vec<[f64; 2]> = (0..200)
///     .map(|i| (f64::from(i) / 200.0 * std::f64::consts::TAU).sin_cos())
///     .map(|(s, c)| [3.0 * c, 3.0 * s])
///     .collect();
/// let mut circle = reconstruct(&points, &Options::default())?;
/// let (curves, _) = extract_curve(&mut circle)?;
/// let (origin, f) = circle.in_data_units()?;
/// let vertices = curves.loops.concat().iter().map(|v| [v[0] - origin[0], v[1] - origin[1]]).collect();
/// let distance = SignedDistance::new(&f, vertices).ok_or("no curve")?;
/// assert!((distance.at(&[10.0 - origin[0], -origin[1]]) - 7.0).abs() < 1e-3);
/// assert!((distance.at(&[1.0 - origin[0], -origin[1]]) + 2.0).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SignedDistance<'a, const D: usize> {
    f: &'a HierarchicalSpline<D>,
    vertices: Vec<[f64; D]>,
    tree: ImmutableKdTree<f64, D>,
}

impl<'a, const D: usize> SignedDistance<'a, D> {
    /// The distance from `f = 0`, of which `vertices` are places, as close to each other as its cells: those that
    /// [`isosurface`](crate::isosurface) gives. `None` if there are none, or one is not finite.
    pub fn new(f: &'a HierarchicalSpline<D>, vertices: Vec<[f64; D]>) -> Option<Self> {
        if vertices.is_empty() || vertices.iter().flatten().any(|x| !x.is_finite()) {
            return None;
        }
        let tree = ImmutableKdTree::new_from_slice(&vertices).ok()?;
        Some(Self { f, vertices, tree })
    }

    /// The distance of one place, in the coordinates of f; outside the box f counts as positive.
    pub fn at(&self, x: &[f64; D]) -> f64 {
        let nearest = self.tree.query(x).nearest_n::<SquaredEuclidean<f64>>(NonZero::<usize>::MIN).execute();
        let mut foot = nearest.iter().map(|n| self.vertices[n.item as usize]).next().unwrap_or(self.vertices[0]);
        let mut share = 1.0;
        for _ in 0..STEPS {
            // Along the tangent plane towards below x, then back to f = 0. Where the surface bends away the whole way is too far.
            let (_, g) = self.f.value_and_gradient(&foot);
            let to_x = minus(x, &foot);
            let off = dot(&to_x, &g) / dot(&g, &g);
            let aside: [f64; D] = std::array::from_fn(|k| to_x[k] - off * g[k]);
            let next = loop {
                let beside = std::array::from_fn(|k| foot[k] + share * aside[k]);
                let (value, g) = self.f.value_and_gradient(&beside);
                let next: [f64; D] = std::array::from_fn(|k| beside[k] - value / dot(&g, &g) * g[k]);
                let closer = minus(x, &next);
                if dot(&closer, &closer) < dot(&to_x, &to_x) {
                    break Some(next);
                }
                share *= 0.5;
                if share < SHORTEST {
                    break None;
                }
            };
            let Some(next) = next else { break };
            foot = next;
        }
        let away = minus(x, &foot);
        let inside = self.f.value(x) < 0.0;
        dot(&away, &away).sqrt() * if inside { -1.0 } else { 1.0 }
    }

    /// The distances of many places.
    pub fn at_all(&self, places: &[[f64; D]]) -> Vec<f64> {
        places.par_iter().map(|x| self.at(x)).collect()
    }
}

fn minus<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| a[k] * b[k]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::Domain;
    use crate::lattice::domain::tests::spline;

    #[test]
    fn of_a_ball_it_is_the_radius_less_its_own() {
        // |x|² − r²: no distance, with the surface of a ball, and a spline exactly.
        let domain = Domain::<3>::around(&[1.0, 1.0, 1.0], 8);
        let h = domain.spacing(1);
        // The coefficients of x² are its values at the middles of the supports, less h²/3.
        let square = |x: f64| x * x - h * h / 3.0;
        let f =
            HierarchicalSpline::new(spline(&domain, 1, |[x, y, z]| square(x) + square(y) + square(z) - 0.16)).unwrap();
        let (mesh, _) = zeroset_isosurface::surface_of(&f, 0, &Default::default()).unwrap();
        let distance = SignedDistance::new(&f, mesh.vertices).unwrap();
        let places = [[0.1, 0.2, -0.1], [0.4, 0.3, 0.2], [3.0, -1.0, 2.0], [0.0, 0.4, 0.0]];
        for (x, found) in places.iter().zip(distance.at_all(&places)) {
            let expected = dot(x, x).sqrt() - 0.4;
            assert!((found - expected).abs() < 1e-7, "{x:?}: {found} {expected}");
        }
        // All places of the surface are as near.
        assert!((distance.at(&[0.0; 3]) + 0.4).abs() < 1e-9);
        assert!(SignedDistance::new(&f, vec![]).is_none() && SignedDistance::new(&f, vec![[f64::NAN; 3]]).is_none());
    }
}
