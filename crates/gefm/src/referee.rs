//! The referee: winding numbers judge an orientation without knowing f.
//!
//! With outward normals `nᵢ` and areas `aᵢ`, `W(X) = Σ aᵢ nᵢ·(Pᵢ − X) / (4π ‖Pᵢ − X‖³)` (in 2D over `2π ‖Pᵢ − X‖²`) is 1
//! inside, 0 outside, and ½ at the points. Three things follow, and three are measured:
//!
//! - at the points W is ½. (A patch on the wrong side is seen at its rim and, through its curvature, within; two walls
//!   that face the same way add up to 0 or 1.) Nothing needs to be chosen: neither a step off the surface nor its sign;
//! - away from the points `W > ½` and `f < 0` are the same region;
//! - and that region is not empty where f has an inside.
//!
//! Areas come from the distances between neighbours, which noise enlarges; so W is first divided by the number that makes
//! it 1 on average where f is negative; holes of the data, which keep it small there, must not bring it above ½ at the points.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use serde::Serialize;
use zeroset_bspline::{Derivatives, Implicit, KnotVector};
use zeroset_winding::{Options, Tree};

use crate::error::GefmError;
use crate::gradient_form::area_vectors;
use crate::lattice_nodes::{lattice_nodes, node};

/// Nodes nearer to the points than so many spacings are not looked at: there W is rough.
const CLEAR: f64 = 2.0;
/// Nor nodes farther than so many cells beyond that: there fairness alone has shaped f.
const REACH: f64 = 2.0;
/// Weight of the disagreement between f and W, and of the same relative to the inside, beside the error at the points.
/// (Chosen so that a disagreement counts as much as an error of the same share of the points, or more.)
const DISAGREEMENT: f64 = 2.0;
const RELATIVE: f64 = 0.5;
/// A shape with less than this share of the nodes inside is too thin for them to tell much of its inside.
const THIN: f64 = 0.05;

/// What judges the candidates: the points with their areas, and lattice nodes away from them.
#[derive(Debug)]
pub struct Referee<'a, const D: usize> {
    points: &'a [[f64; D]],
    /// Length (2D) or area (3D) that each point stands for.
    areas: Vec<f64>,
    /// For W away from the points.
    away: Tree<D>,
    /// For W at the points, where the kernel is kept finite below the spacing.
    near: Tree<D>,
    nodes: Vec<[f64; D]>,
    /// The inverse of each node's distance to the points, so that every shell around them counts alike.
    weights: Vec<f64>,
}

/// The referee's opinion of one candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// Mean `|W − ½|` at the points: 0.05 to 0.2 for right orientations, ½ for random ones.
    pub principal: f64,
    /// Share of the nodes where the signs of f and `½ − W` differ.
    pub disagreement: f64,
    /// Share of the nodes with `W > ½`.
    pub inside: f64,
    /// What W was divided by: above 1 if noise has enlarged the areas, below if the points leave gaps.
    pub calibration: f64,
    /// All together, smaller is better.
    pub score: f64,
}

impl Judgement {
    /// The score less what noise of a standard deviation of `noise` = σ spacings adds to it where all sides are right. At a distance d
    /// from a flat sheet `|W − ½|` is `½ |d|/√(d² + s²)` with the kernel that is kept finite below the spacing s. Noisy points are no
    /// sheet but a layer, of normal density across it, in which `|W − ½|` is `|Φ(d/σ) − ½|` without that kernel, which rises as
    /// `½ |d|/√(π/2) σ`: so `π/2 σ²` is added to s². `|d|` is `√(2/π) σ` on average.
    pub fn beyond_noise(&self, noise: f64) -> f64 {
        let (mean, layer) = (std::f64::consts::FRAC_2_PI.sqrt() * noise, std::f64::consts::FRAC_PI_2 * noise * noise);
        self.score - 0.5 * mean / (mean * mean + 1.0 + layer).sqrt()
    }
}

impl<'a, const D: usize> Referee<'a, D> {
    /// A referee for points with area weights of mean 1, in a box given by the knots of its coarsest lattice.
    ///
    /// # Errors
    /// If a point is not finite, or far too large.
    pub fn new(
        points: &'a [[f64; D]],
        areas: &[f64],
        spacing: f64,
        density: f64,
        knots: &[KnotVector; D],
    ) -> Result<Self, GefmError> {
        let away = Tree::new(points, Options::default())?;
        let near = Tree::new(points, Options { regularisation: spacing, ..Options::default() })?;
        let axes = lattice_nodes(knots);
        let (mut nodes, mut weights) = (Vec::new(), Vec::new());
        if let Ok(tree) = ImmutableKdTree::<f64, D>::new_from_slice(points) {
            let count: usize = axes.iter().map(Vec::len).product();
            let near = CLEAR * spacing..CLEAR * spacing + REACH * (axes[0][1] - axes[0][0]);
            for flat in 0..count {
                let x = node(&axes, flat);
                let distance = tree.query(&x).nearest_one::<SquaredEuclidean<f64>>().execute().distance.sqrt();
                if near.contains(&distance) {
                    nodes.push(x);
                    weights.push(1.0 / distance);
                }
            }
        }
        Ok(Self { points, areas: areas.iter().map(|a| a / density).collect(), away, near, nodes, weights })
    }

    /// Length (2D) or area (3D) that each point stands for.
    pub(crate) fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// `W` at every point for these area vectors, not calibrated.
    ///
    /// # Errors
    /// If an area vector is not finite.
    pub(crate) fn winding(&self, area_vectors: &[[f64; D]]) -> Result<Vec<f64>, GefmError> {
        Ok(self.near.with_normals(area_vectors)?.evaluate(self.points)?)
    }

    /// Unit vectors along which the other points push each one away: `Σ aⱼ (Pᵢ − Pⱼ) / ‖Pᵢ − Pⱼ‖³` (in 2D over `‖Pᵢ − Pⱼ‖²`), which is outward on
    /// what is convex. W is linear in the area vectors, and this is its transpose applied to ½ at all points, so the first step of steepest
    /// descent from no normals at all for `Σ (W(Pᵢ) − ½)²` (Lin, Xiao, Shi and Wang 2022).
    ///
    /// # Errors
    /// If an area is not finite.
    pub fn repulsion(&self) -> Result<Vec<[f64; D]>, GefmError> {
        let mut pushes = vec![[0.0; D]; self.points.len()];
        for axis in 0..D {
            let along = |area: &f64| std::array::from_fn(|other| if other == axis { *area } else { 0.0 });
            let pulls = self.winding(&self.areas.iter().map(along).collect::<Vec<_>>())?;
            pushes.iter_mut().zip(pulls).for_each(|(push, pull)| push[axis] = -pull);
        }
        Ok(area_vectors(&pushes, &vec![1.0; pushes.len()]))
    }

    /// Judges f, and gives `W` at every point, calibrated: ½ where all is well.
    ///
    /// # Errors
    /// If gradients of f are not finite.
    pub fn judge(&self, f: &impl Implicit<D>) -> Result<(Judgement, Vec<f64>), GefmError> {
        let gradients = f.evaluate(self.points, Derivatives::Gradient).gradients;
        let vectors = area_vectors(&gradients, &self.areas);
        let away = self.away.with_normals(&vectors)?.evaluate(&self.nodes)?;
        let mut at_points = self.winding(&vectors)?;
        let values = f.evaluate(&self.nodes, Derivatives::Value).values;

        let (mut total, mut negative, mut flux) = (0.0, 0.0, 0.0);
        for ((value, w), weight) in values.iter().zip(&away).zip(&self.weights) {
            total += weight;
            if *value < 0.0 {
                negative += weight;
                flux += weight * w;
            }
        }
        // Noise enlarges the areas, hardly more than threefold; points along curves on the surface hide most of it. Shapes
        // thinner than the lattice have no inside to go by, but if the sides are right W is ½ at the points on average. So it is
        // beside holes of the data, and small in them: they must not make W larger than that where the points are.
        let area: f64 = self.areas.iter().sum();
        let mean = at_points.iter().zip(&self.areas).map(|(w, a)| a * w).sum::<f64>() / area;
        let calibration = if negative > THIN * total {
            let flux = (flux / negative).clamp(0.05, 3.0);
            flux.max((2.0 * mean).min(1.0))
        } else {
            (2.0 * mean).clamp(1.0, 3.0)
        };
        let (mut differing, mut inside) = (0.0, 0.0);
        for ((value, w), weight) in values.iter().zip(&away).zip(&self.weights) {
            let within = *w > 0.5 * calibration;
            differing += if within != (*value < 0.0) { *weight } else { 0.0 };
            inside += if within { *weight } else { 0.0 };
        }
        at_points.iter_mut().for_each(|w| *w /= calibration);
        let (disagreement, inside) = if total > 0.0 { (differing / total, inside / total) } else { (0.0, 0.0) };
        let principal = at_points.iter().zip(&self.areas).map(|(w, a)| a * (w - 0.5).abs()).sum::<f64>() / area;
        let relative = (disagreement / inside.max(THIN)).min(1.0);
        let score = principal + DISAGREEMENT * disagreement + RELATIVE * relative;
        Ok((Judgement { principal, disagreement, inside, calibration, score }, at_points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanczos::dot;
    use zeroset_bspline::Spline;

    /// Points on a circle of radius 0.4, in a box of 16 × 16 cells, and a function that is linear in the radius there.
    fn circle(value: impl Fn(f64, f64) -> f64) -> (Vec<[f64; 2]>, Spline<2>) {
        let points =
            (0..200).map(|i| f64::from(i) * 0.01 * std::f64::consts::PI).map(|t| [0.4 * t.cos(), 0.4 * t.sin()]);
        let knots = KnotVector::uniform(3, -0.6, 1.2 / 16.0, 16).unwrap();
        let at = |i: usize| -0.6 + (i as f64 - 1.0) * 1.2 / 16.0;
        let coefficients = (0..19 * 19).map(|flat| value(at(flat / 19), at(flat % 19))).collect();
        (points.collect(), Spline::from_flat([knots.clone(), knots], coefficients).unwrap())
    }

    fn judged(points: &[[f64; 2]], f: &Spline<2>) -> (Judgement, Vec<f64>) {
        let spacing = 0.8 * std::f64::consts::PI / 200.0;
        let ones = vec![1.0; points.len()];
        Referee::new(points, &ones, spacing, 1.0 / spacing, f.knots()).unwrap().judge(f).unwrap()
    }

    #[test]
    fn a_right_orientation_scores_well() {
        let (points, f) = circle(|x, y| x.hypot(y) - 0.4);
        let (judgement, winding) = judged(&points, &f);
        // The trapezoidal rule on a circle, with W = ½ at its own points; the tree code is good to 1e-3.
        assert!(judgement.score < 0.02 && judgement.disagreement == 0.0, "{judgement:?}");
        assert!(winding.iter().all(|w| (w - 0.5).abs() < 0.02));
        assert!(judgement.inside > 0.2 && (judgement.calibration - 1.0).abs() < 0.05);
    }

    #[test]
    fn repulsion_is_outward_where_the_points_are_convex() {
        let (points, f) = circle(|_, _| 0.0);
        let ones = vec![1.0; points.len()];
        let referee = Referee::new(&points, &ones, 0.01, 100.0, f.knots()).unwrap();
        for (push, p) in referee.repulsion().unwrap().iter().zip(&points) {
            // The tree code is good to 1e-3 of W, which is ½ of such a push.
            assert!(dot(push, p) > 0.4 * 0.99999 && (dot(push, push) - 1.0).abs() < 1e-12, "{push:?} at {p:?}");
        }
    }

    #[test]
    fn what_noise_adds_to_the_score_is_known() {
        // Displaced across the circle by up to twice the spacing, evenly: a standard deviation of 2/√3 spacings.
        let (points, f) = circle(|x, y| x.hypot(y) - 0.4);
        let spacing = 0.8 * std::f64::consts::PI / 200.0;
        let displaced = |(i, p): (usize, &[f64; 2])| {
            let shift = 1.0 + 2.0 * spacing * (2.0 * (i as f64 * 0.618_033_988_749_895).fract() - 1.0) / 0.4;
            p.map(|x| shift * x)
        };
        let points: Vec<[f64; 2]> = points.iter().enumerate().map(displaced).collect();
        let (judgement, _) = judged(&points, &f);
        let left = judgement.beyond_noise(2.0 / 3.0_f64.sqrt());
        // Points are neither a sheet nor, with even noise, a normal layer, and the mean of a ratio is not the ratio of means.
        assert!(judgement.score > 0.2 && left.abs() < 0.05, "{left} of {judgement:?}");
        assert_eq!(judgement.beyond_noise(0.0), judgement.score);
    }

    #[test]
    fn a_ring_thinner_than_the_lattice_is_judged_by_its_points() {
        // Of radii 0.37 and 0.4; nodes nearer than two spacings are not looked at, which is all of its inside.
        let (outer, _) = circle(|_, _| 0.0);
        let points: Vec<[f64; 2]> = outer.iter().copied().chain(outer.iter().map(|p| p.map(|x| 0.925 * x))).collect();
        let knots = KnotVector::uniform(3, -0.6, 1.2 / 128.0, 128).unwrap();
        let at = |i: usize| -0.6 + (i as f64 - 1.0) * 1.2 / 128.0;
        let ring = |strays: f64| {
            // Off it f may be negative here and there for want of points.
            let value = |x: f64, y: f64| {
                (x.hypot(y) - 0.385).abs() - 0.015 - strays * (-((x - 0.435).powi(2) + y * y) / 1e-4).exp()
            };
            let coefficients = (0..131 * 131).map(|flat| value(at(flat / 131), at(flat % 131))).collect();
            judged(&points, &Spline::from_flat([knots.clone(), knots.clone()], coefficients).unwrap()).0
        };
        let [right, strays] = [0.0, 0.2].map(ring);
        assert!(right.inside == 0.0 && right.disagreement == 0.0 && right.score < 0.1, "{right:?}");
        // Relative to an inside of no nodes even one would be a half.
        assert!(strays.inside == 0.0 && strays.disagreement > 0.0 && strays.score < right.score + 0.1, "{strays:?}");
    }

    #[test]
    fn sides_that_point_the_same_way_score_badly() {
        let (points, f) = circle(|x, _| x);
        let (judgement, _) = judged(&points, &f);
        assert!(judgement.score > 0.5, "{judgement:?}");
    }

    /// A ring with three gaps, in which there are no points but an inside all the same.
    #[test]
    fn points_beside_holes_are_judged_by_their_own_winding_numbers() {
        let (mut points, cells) = (Vec::new(), 24_usize);
        for i in 0..4000 {
            let [u, v] = [0.618_033_988_749_895, 0.754_877_666_246_693].map(|step| (f64::from(i) * step).fract());
            if (3.0 * u).fract() > 0.35 {
                let [u, v] = [u, v].map(|share| share * std::f64::consts::TAU);
                let radius = 0.4 + 0.12 * v.cos();
                points.push([radius * u.cos(), radius * u.sin(), 0.12 * v.sin()]);
            }
        }
        let knots = KnotVector::uniform(3, -0.6, 1.2 / cells as f64, cells).unwrap();
        let at = |i: usize| -0.6 + (i as f64 - 1.0) * 1.2 / cells as f64;
        let side = cells + 3;
        let value =
            |flat: usize| (at(flat / side / side).hypot(at(flat / side % side)) - 0.4).hypot(at(flat % side)) - 0.12;
        let coefficients = (0..side.pow(3)).map(value).collect();
        let f = Spline::from_flat([knots.clone(), knots.clone(), knots.clone()], coefficients).unwrap();
        let area = 0.65 * 4.0 * std::f64::consts::PI.powi(2) * 0.4 * 0.12 / points.len() as f64;
        let ones = vec![1.0; points.len()];
        let referee = Referee::new(&points, &ones, area.sqrt(), 1.0 / area, f.knots()).unwrap();
        let (judgement, winding) = referee.judge(&f).unwrap();
        let mean = winding.iter().sum::<f64>() / winding.len() as f64;
        // By the inside, of which a third is in the gaps, they would have 0.58 on average and be off by twice as much each.
        assert!((mean - 0.5).abs() < 0.02 && judgement.principal < 0.07, "{mean}, {judgement:?}");
    }
}
