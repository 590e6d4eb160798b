//! Unit normals with which the smoothest function is as smooth as it can be (Huang, Carr and Ju 2019), for points so few that dense matrices do.
//!
//! Of all functions with values near zero and given gradients at the points one has the least energy; that of the unit normals is least where
//! all sides are right. Lengths of gradients, which the eigenvector leaves free, are what lets it be flat where points are few.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::lu::partial_pivoting::solve::{solve_in_place, solve_in_place_scratch};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, ColMut, Mat, MatMut, Par};
use zeroset_bspline::{Collocation, KnotVector, Spline};
use zeroset_watch::CancelToken;

use crate::descent::{Descent, descend};
use crate::error::GefmError;
use crate::fit::normalise;
use crate::ladder_report::UnitNormals;
use crate::lanczos::{dot, smallest_eigenpair};
use crate::lattice_nodes::lattice_nodes;
use crate::quasi_interpolation::quasi_interpolant;

/// Two normals agree where they are no farther apart than 25 degrees.
const ALONG: f64 = 0.906_307_787;
/// `Δ³ ‖x‖³ = −96 π δ` in space: what `∫‖∇³f‖²` is over the form of the kernel.
const KERNEL: f64 = 96.0 * std::f64::consts::PI;
/// Relative residual of the eigenvector, and the most steps towards it; only its directions are used.
const EIGENVECTOR: (f64, usize) = (1e-3, 60);

/// Unit normals of least energy at points with positive areas, from known ones and from the eigenvector, which is sought from directions (the
/// `starts`, of any length but zero), and the function of the lower ones on `knots`, which are uniform, of degree 3, and about the points. Also how many
/// evaluations of the energy these took. None if rounding leaves no energy.
///
/// # Errors
/// If a point lies outside the knots' domain, no gradient is left, or it was cancelled.
pub(crate) fn unit_normals<const D: usize>(
    (points, areas): (&[[f64; D]], &[f64]),
    weight: f64,
    (known, directions): (&[[f64; D]], &[[f64; D]]),
    knots: &[KnotVector; D],
    cancel: &CancelToken,
) -> Result<Option<(Spline<D>, usize, UnitNormals)>, GefmError> {
    cancel.check()?;
    let Some(energy) = NormalEnergy::new(points, areas, weight) else { return Ok(None) };
    let Some(found) = energy.least_from_two_starts(known, directions, cancel)? else { return Ok(None) };
    let lower = found.lower();
    let coefficients = energy.coefficients(&lower.vectors, knots);
    let f = normalise(&Collocation::new(knots, points)?, points, areas, knots, coefficients)?;
    let report = UnitNormals {
        from_leader: found.known.energy,
        from_eigenvector: found.spectral.energy,
        agreement: found.agreement(),
        closed: is_closed(&f),
    };
    Ok(Some((f, lower.evaluations, report)))
}

/// The energy of the smoothest function as a form of the gradients `gᵢ` at the points: of all f with `∇f(Pᵢ) = gᵢ` the least
/// `Σ aᵢ f(Pᵢ)² + w ∫‖∇³f‖²`, but for a factor.
///
/// `f(x) = Σ αᵢ φ(x − Pᵢ) − Σ βᵢ·∇φ(x − Pᵢ) + γ·(1, x)` with `φ = ‖x‖³`. What belongs to the values, α and γ, is eliminated first; the
/// matrix of β that is left is positive definite, and its inverse the form.
struct NormalEnergy<const D: usize> {
    points: Vec<[f64; D]>,
    /// `−(α, γ)` of unit β.
    response: Mat<f64>,
    /// The Cholesky factor of the matrix of β.
    factor: Mat<f64>,
}

/// From two starts.
#[derive(Debug, Clone, PartialEq)]
struct TwoStarts<const D: usize> {
    /// From normals found before.
    known: Descent<D>,
    /// From the eigenvector.
    spectral: Descent<D>,
}

impl<const D: usize> TwoStarts<D> {
    /// The one that came lower.
    fn lower(&self) -> &Descent<D> {
        if self.spectral.energy < self.known.energy { &self.spectral } else { &self.known }
    }

    /// The share of the points at which both have about the same normal, up to a common sign.
    fn agreement(&self) -> f64 {
        let cosines: Vec<f64> = self.known.vectors.iter().zip(&self.spectral.vectors).map(|(a, b)| dot(a, b)).collect();
        let along = |sign: f64| cosines.iter().filter(|cosine| sign * **cosine > ALONG).count();
        along(1.0).max(along(-1.0)) as f64 / cosines.len() as f64
    }
}

impl<const D: usize> NormalEnergy<D> {
    /// Of points with positive areas; `weight` is w. None if rounding has left no positive definite matrix.
    fn new(points: &[[f64; D]], areas: &[f64], weight: f64) -> Option<Self> {
        let (count, parts) = (points.len(), D * points.len());
        let values = count + 1 + D;
        let at = |i: usize, j: usize| -> [f64; D] { std::array::from_fn(|axis| points[i][axis] - points[j][axis]) };
        // Entries of the polynomials at a point, and of their derivatives along an axis.
        let polynomial = |i: usize, k: usize| if k == 0 { 1.0 } else { points[i][k - 1] };
        let derivative = |axis: usize, k: usize| if k == axis + 1 { 1.0 } else { 0.0 };
        let mut saddle = Mat::from_fn(values, values, |i, j| match (i < count, j < count) {
            (true, true) if i == j => KERNEL * weight / areas[i],
            (true, true) => kernel(&at(i, j)),
            (true, false) => polynomial(i, j - count),
            (false, true) => polynomial(j, i - count),
            (false, false) => 0.0,
        });
        let coupling = Mat::from_fn(values, parts, |i, column| match (i.checked_sub(count), column % D) {
            (None, axis) => -slope(&at(i, column / D))[axis],
            (Some(k), axis) => derivative(axis, k),
        });
        let mut response = coupling.clone();
        let (mut forward, mut backward) = (vec![0usize; values], vec![0usize; values]);
        let scratch = lu_in_place_scratch::<usize, f64>(values, values, Par::Seq, Default::default())
            .or(solve_in_place_scratch::<usize, f64>(values, parts, Par::Seq));
        let mut memory = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut memory);
        let (_, order) = lu_in_place(saddle.as_mut(), &mut forward, &mut backward, Par::Seq, stack, Default::default());
        solve_in_place(saddle.as_ref(), saddle.as_ref(), order, response.as_mut(), Par::Seq, stack);

        let mut factor =
            Mat::from_fn(parts, parts, |row, column| -curvature(&at(row / D, column / D), row % D, column % D));
        matmul(
            factor.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            coupling.transpose(),
            BlockStructure::Rectangular,
            response.as_ref(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(parts, Par::Seq, Default::default()));
        let stack = MemStack::new(&mut memory);
        cholesky_in_place(factor.as_mut(), Default::default(), Par::Seq, stack, Default::default()).ok()?;
        Some(Self { points: points.to_vec(), response, factor })
    }

    /// The least from normals that are known (of any length but zero), and from the eigenvector, which is sought from `directions`. None if one of
    /// them does not exist.
    ///
    /// # Errors
    /// If it was cancelled.
    fn least_from_two_starts(
        &self,
        known: &[[f64; D]],
        directions: &[[f64; D]],
        cancel: &CancelToken,
    ) -> Result<Option<TwoStarts<D>>, GefmError> {
        let (tolerance, steps) = EIGENVECTOR;
        let start = directions.as_flattened().to_vec();
        let pair = smallest_eigenpair(|g| self.inverse(g), <[f64]>::to_vec, start, tolerance, steps);
        let Some((vector, _)) = pair else { return Ok(None) };
        let spectral = self.least(vector.as_chunks::<D>().0, cancel)?;
        let known = self.least(known, cancel)?;
        Ok(known.zip(spectral).map(|(known, spectral)| TwoStarts { known, spectral }))
    }

    fn least(&self, start: &[[f64; D]], cancel: &CancelToken) -> Result<Option<Descent<D>>, GefmError> {
        Ok(descend(|normals| self.of(normals), start, cancel)?)
    }

    /// The form of gradients, and its gradient.
    fn of(&self, gradients: &[f64]) -> (f64, Vec<f64>) {
        let (energy, mut slope) = self.solved(gradients);
        slope.iter_mut().for_each(|v| *v *= 2.0);
        (energy, slope)
    }

    /// The form of gradients, and the β that gives them.
    fn solved(&self, gradients: &[f64]) -> (f64, Vec<f64>) {
        let mut beta = gradients.to_vec();
        solve_lower_triangular_in_place(self.factor.as_ref(), column(&mut beta), Par::Seq);
        let energy = dot(&beta, &beta);
        solve_upper_triangular_in_place(self.factor.transpose(), column(&mut beta), Par::Seq);
        (energy, beta)
    }

    /// The inverse of the form, applied.
    fn inverse(&self, vector: &[f64]) -> Vec<f64> {
        let (mut half, mut whole) = (vector.to_vec(), vector.to_vec());
        let product = |matrix, shape, from: &mut [f64], to: &mut [f64]| {
            let (from, whole) = (column(from), BlockStructure::Rectangular);
            matmul(column(to), whole, Accum::Replace, matrix, shape, from.as_ref(), whole, 1.0, Par::Seq);
        };
        product(self.factor.transpose(), BlockStructure::TriangularUpper, &mut whole, &mut half);
        product(self.factor.as_ref(), BlockStructure::TriangularLower, &mut half, &mut whole);
        whole
    }

    /// The coefficients of cubic B-splines on uniform knots whose sum is the function of least energy with these normals, to fourth order.
    fn coefficients(&self, normals: &[[f64; D]], knots: &[KnotVector; D]) -> Vec<f64> {
        let (_, mut beta) = self.solved(normals.as_flattened());
        let mut alpha = vec![0.0; self.response.nrows()];
        let whole = BlockStructure::Rectangular;
        let (response, to) = (self.response.as_ref(), column(&mut alpha));
        matmul(to, whole, Accum::Replace, response, whole, column(&mut beta).as_ref(), whole, -1.0, Par::Seq);
        let (beta, _) = beta.as_chunks::<D>();
        let (alpha, gamma) = alpha.split_at(self.points.len());
        let f = |x: &[f64; D]| {
            let mut value = gamma[0] + dot(&gamma[1..], x);
            for ((p, alpha), beta) in self.points.iter().zip(alpha).zip(beta) {
                let away: [f64; D] = std::array::from_fn(|axis| x[axis] - p[axis]);
                value += alpha * kernel(&away) - dot(beta, &slope(&away));
            }
            value
        };
        quasi_interpolant(f, knots)
    }
}

/// Whether f is positive at the ends of all knot intervals on the faces of its box.
fn is_closed<const D: usize>(f: &Spline<D>) -> bool {
    let nodes = lattice_nodes(f.knots());
    (0..D).all(|axis| {
        let mut faces = nodes.clone();
        faces[axis] = <[f64; 2]>::from(f.knots()[axis].domain()).to_vec();
        f.sample(&faces, [0; D]).iter().all(|value| *value > 0.0)
    })
}

fn column(vector: &mut [f64]) -> MatMut<'_, f64> {
    ColMut::from_slice_mut(vector).as_mat_mut()
}

/// φ, and its first
fn kernel<const D: usize>(x: &[f64; D]) -> f64 {
    dot(x, x).sqrt().powi(3)
}

/// and second derivatives.
fn slope<const D: usize>(x: &[f64; D]) -> [f64; D] {
    let r = dot(x, x).sqrt();
    x.map(|x| 3.0 * r * x)
}

fn curvature<const D: usize>(x: &[f64; D], a: usize, b: usize) -> f64 {
    let r = dot(x, x).sqrt();
    let round = if a == b { 3.0 * r } else { 0.0 };
    if r > 0.0 { round + 3.0 * x[a] * x[b] / r } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all over a sphere of radius 0.4, with fewer than one in four of its lower half.
    fn sphere() -> Vec<[f64; 3]> {
        let on = |i: i32| {
            let z = (f64::from(i) + 0.5) / 100.0 - 1.0;
            let (s, c) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
            [0.4 * c * (1.0 - z * z).sqrt(), 0.4 * s * (1.0 - z * z).sqrt(), 0.4 * z]
        };
        (0..200).filter(|i| *i >= 100 || i % 4 == 0).map(on).collect()
    }

    fn energy(points: &[[f64; 3]]) -> NormalEnergy<3> {
        NormalEnergy::new(points, &vec![1.0; points.len()], 1e-9).unwrap()
    }

    #[test]
    fn the_form_is_that_of_its_inverse_and_its_gradient_a_difference() {
        let points = sphere();
        let energy = energy(&points);
        let normals: Vec<f64> = (0..375).map(|i| (0.7 * f64::from(i)).sin()).collect();
        let (value, gradient) = energy.of(&normals);
        let back = energy.inverse(&gradient);
        for (back, normal) in back.iter().zip(&normals) {
            // A condition number of some thousands.
            assert!((0.5 * back - normal).abs() < 1e-10);
        }
        // Of a quadratic form a central difference is exact.
        let moved = |step: f64| {
            energy.of(&normals.iter().enumerate().map(|(i, n)| n + step * f64::from(i == 17)).collect::<Vec<_>>()).0
        };
        assert!((moved(0.5) - moved(-0.5) - gradient[17]).abs() < 1e-9 * value);
    }

    #[test]
    fn the_normals_of_a_sphere_are_found_from_both_starts() {
        let points = sphere();
        let energy = energy(&points);
        // A third of them begin inward, and all askew.
        let known: Vec<[f64; 3]> = points
            .iter()
            .enumerate()
            .map(|(i, p)| [p[0] * if i % 3 == 0 { -1.0 } else { 1.0 }, p[1] + 0.1, p[2]])
            .collect();
        let directions: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], p[2] - 0.1]).collect();
        let found = energy.least_from_two_starts(&known, &directions, &CancelToken::new()).unwrap().unwrap();
        assert_eq!(found.agreement(), 1.0);
        let sign = dot(&found.lower().vectors[0], &points[0]).signum();
        for (normal, point) in found.lower().vectors.iter().zip(&points) {
            // A sphere is the zero set of a quadratic function, which the kernel only comes near.
            assert!(sign * dot(normal, point) > 0.4 * 0.99, "{normal:?} at {point:?}");
        }
    }

    #[test]
    fn the_spline_has_the_normals_and_vanishes_at_the_points() {
        let points = sphere();
        let normals: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| x / 0.4)).collect();
        let knots =
            [24, 20, 22].map(|cells| KnotVector::uniform(3, -0.025 * f64::from(cells), 0.05, cells as usize).unwrap());
        let coefficients = energy(&points).coefficients(&normals, &knots);
        let f = Spline::from_flat(knots, coefficients).unwrap();
        for (point, normal) in points.iter().zip(&normals) {
            let (value, gradient) = f.value_and_gradient(point);
            // The kernel's second derivatives have kinks at the points, where the cells of 0.05 do not follow them.
            assert!(value.abs() < 1e-3, "{value}");
            assert!((0..3).all(|axis| (gradient[axis] - normal[axis]).abs() < 0.02), "{gradient:?} {normal:?}");
        }
        assert!(f.value(&[0.0; 3]) < -0.1);
    }

    #[test]
    fn normals_that_differ_do_not_agree() {
        let descent = |vectors: &[[f64; 3]], energy| Descent { vectors: vectors.to_vec(), energy, evaluations: 1 };
        let [up, down, aside] = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
        let agreement =
            |other: &[[f64; 3]]| TwoStarts { known: descent(&[up; 4], 1.0), spectral: descent(other, 2.0) }.agreement();
        assert_eq!((agreement(&[aside, down, down, down]), agreement(&[down, up, up, down])), (0.75, 0.5));
        // By twenty degrees, and by thirty.
        let turned = [20f64, 30.0].map(|angle| [0.0, angle.to_radians().sin(), angle.to_radians().cos()]);
        assert_eq!(agreement(&[turned[0], turned[0], turned[1], up]), 0.75);
    }

    #[test]
    fn closed_surfaces_do_not_reach_the_box() {
        let knots = KnotVector::uniform(3, -0.75, 0.25, 6).unwrap();
        let knots = [knots.clone(), knots.clone(), knots];
        let is_closed = |f: &(dyn Fn(&[f64; 3]) -> f64 + Sync)| {
            is_closed(&Spline::from_flat(knots.clone(), quasi_interpolant(f, &knots)).unwrap())
        };
        assert!(is_closed(&|x| dot(x, x) - 0.49));
        assert!(!is_closed(&|x| dot(x, x) - 0.64), "the corners alone are outside");
        assert!(!is_closed(&|x| x[2]));
    }
}
