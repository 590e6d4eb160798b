//! f as a distance near its zero set: what the last step of the road knows of it.

use kiddo::SquaredEuclidean;
use ndarray::ArrayD;
use rayon::prelude::*;
use zeroset_bspline::{CellBand, HierarchicalSpline};
use zeroset_trust_region::{KnownDistances, RedistanceOptions, redistance};
use zeroset_watch::CancelToken;

use crate::distance::calibration::from_surface;
use crate::error::ReconstructError;
use crate::lattice::domain::{Domain, Nodes, multi_index};
use crate::points::kd_tree::tree_of;
use crate::points::spacing::{SECOND_ORDER, Spacing};
use crate::report::StageFigures;

/// Beside the foot of every point there are zeros so many spacings away,
const ASIDE: f64 = 0.5;
/// but not of more points than these: time and memory grow with the zeros, and cells are larger than the spacing then.
const MANY: usize = 100_000;
/// Newton steps to the zero set, which end within so many spacings of it,
const NEWTON_STEPS: usize = 6;
const ON_IT: f64 = 1e-6;
/// and may not lead farther than so many spacings, or standard deviations of the noise.
const FAR: f64 = 0.5;
const FAR_NOISE: f64 = 4.0;
/// Where the slope is smaller than this f has two sides that are the same to it.
const FLAT: f64 = 0.1;
/// Nodes nearer to the zeros than so many spacings follow from those.
const CLEAR: f64 = 2.0;
/// Where f is this share of the distance from the zeros or less, beside its slope, it has zeros that no points are near, in holes.
const UNHEARD: f64 = 0.5;
/// Smoothing length of corrections, in cells.
const SMOOTHING: f64 = 0.15;
/// What slopes count, in spacings, and distances: little beside the zeros, which are to stay.
const SLOPE_LENGTH: f64 = 0.05;
const DISTANCE_SHARE: f64 = 0.2;
/// Steps of conjugate gradients on each level, where cells are as large as spacings.
const CG_STEPS: f64 = 20.0;

/// What redistancing depends on; frame units.
pub struct Redistancing<'a, const D: usize> {
    /// The points that were fitted, with their spacing and noise.
    pub points: &'a [[f64; D]],
    pub spacing: &'a Spacing,
    pub noise: f64,
    pub domain: &'a Domain<D>,
    /// From the coarsest lattice to that of the initial shape.
    pub halvings: u32,
    pub band: &'a CellBand<D>,
    /// d on the nodes of that lattice.
    pub distance: &'a ArrayD<f64>,
    pub cancel: &'a CancelToken,
}

impl<const D: usize> Redistancing<'_, D> {
    /// f, whose scale is that of a distance, with unit slope on its zero set.
    pub fn run(&self, f: HierarchicalSpline<D>) -> Result<(HierarchicalSpline<D>, StageFigures), ReconstructError> {
        let (spacing, cell) = (self.spacing.typical, self.domain.spacing(self.halvings));
        let zeros = self.zeros(&f, self.points.len() <= MANY);
        let (places, distances) = self.off(&f, &zeros);
        let count = zeros.len() as f64 / self.points.len() as f64;
        let (known, options) = (
            KnownDistances {
                areas: zeros.iter().map(|zero| self.spacing.areas[zero.point]).collect(),
                zeros: zeros.into_iter().map(|zero| zero.place).collect(),
                places,
                distances,
            },
            RedistanceOptions {
                density: count.max(f64::MIN_POSITIVE) * self.spacing.density,
                smoothing: SMOOTHING,
                third_order: SECOND_ORDER * spacing,
                slope_length: SLOPE_LENGTH * spacing,
                distance_share: DISTANCE_SHARE,
                cg_steps: (CG_STEPS * (spacing / cell).max(1.0)).ceil() as usize,
                cancel: self.cancel.clone(),
            },
        );
        let (f, report) = redistance(f, self.band.near(), &known, &options)?;
        Ok((f, StageFigures::Redistancing(report)))
    }

    /// The feet of the points on the zero set, and places beside them.
    fn zeros(&self, f: &HierarchicalSpline<D>, beside: bool) -> Vec<Zero<D>> {
        let around = |point: usize| {
            let x = self.points[point];
            let far = (FAR * self.spacing.local[point]).max(FAR_NOISE * self.noise);
            let foot = self.foot(f, x, point, far);
            let aside = if beside { directions(&foot) } else { Vec::new() };
            let step = ASIDE * self.spacing.local[point];
            let others = aside.into_iter().filter_map(move |direction| {
                let (place, _) = foot?;
                self.foot(f, std::array::from_fn(|k| place[k] + step * direction[k]), point, far)
            });
            foot.into_iter().chain(others).map(|(place, _)| Zero { place, point }).collect::<Vec<_>>()
        };
        (0..self.points.len()).into_par_iter().map(around).collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// The place on the zero set to which Newton steps lead from x, and the unit normal there.
    fn foot(&self, f: &HierarchicalSpline<D>, mut x: [f64; D], point: usize, far: f64) -> Option<([f64; D], [f64; D])> {
        for _ in 0..NEWTON_STEPS {
            let (value, gradient) = f.value_and_gradient(&x);
            let slope = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            let step = value / slope;
            // Outside of the box, and where there is no slope, this is no number.
            if !(slope > FLAT && step.abs() < far) {
                return None;
            }
            if step.abs() < ON_IT * self.spacing.local[point] {
                return Some((x, gradient.map(|g| g / slope)));
            }
            x = std::array::from_fn(|k| x[k] - step / slope * gradient[k]);
        }
        None
    }

    /// Nodes of the dense lattice that its correction reaches, and their distances from the zero set.
    fn off(&self, f: &HierarchicalSpline<D>, zeros: &[Zero<D>]) -> (Vec<[f64; D]>, Vec<f64>) {
        if zeros.is_empty() {
            return (Vec::new(), Vec::new());
        }
        let places: Vec<[f64; D]> = zeros.iter().map(|zero| zero.place).collect();
        let (tree, nodes) = (tree_of(&places), Nodes::new(self.domain, self.halvings));
        let denser = (zeros.len() as f64 / self.points.len() as f64).powf(1.0 / (D as f64 - 1.0));
        let known = |flat: usize| {
            let index = multi_index(flat, &nodes.shape);
            // The function in whose middle the node is.
            if !self.band.near().contains(index.map(|i| i as u32 + 1)) {
                return None;
            }
            let x = nodes.at(flat);
            let nearest = tree.query(&x).nearest_one::<SquaredEuclidean<f64>>().execute();
            let spacing = self.spacing.local[zeros[nearest.item as usize].point];
            let d = nearest.distance.sqrt();
            if d < CLEAR * spacing {
                return None;
            }
            let d = from_surface::<D>(d, spacing / denser);
            let (value, gradient) = f.value_and_gradient(&x);
            let slope = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            (value.abs() > UNHEARD * slope * d).then_some((x, d))
        };
        let far: Vec<usize> =
            nodes.all().zip(self.distance).filter(|(_, d)| **d > self.spacing.typical).map(|(flat, _)| flat).collect();
        far.into_par_iter().filter_map(known).collect::<Vec<_>>().into_iter().unzip()
    }
}

/// A place on the zero set, and the point that it belongs to.
struct Zero<const D: usize> {
    place: [f64; D],
    point: usize,
}

/// Three directions at right angles to a normal and as far from each other as can be; in the plane the two that there are.
fn directions<const D: usize>(foot: &Option<([f64; D], [f64; D])>) -> Vec<[f64; D]> {
    let Some((_, normal)) = foot else { return Vec::new() };
    // The axis that is farthest from the normal, without its part along that.
    let axis = (0..D).min_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs())).unwrap_or(0);
    let part: [f64; D] = std::array::from_fn(|k| f64::from(u8::from(k == axis)) - normal[axis] * normal[k]);
    let length = part.iter().map(|x| x * x).sum::<f64>().sqrt();
    let first = part.map(|x| x / length);
    if D == 2 {
        return vec![first, first.map(|x| -x)];
    }
    let second: [f64; D] = std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % D, (k + 2) % D);
        normal[i] * first[j] - normal[j] * first[i]
    });
    [0.0, 1.0, 2.0]
        .map(|third: f64| (third * std::f64::consts::TAU / 3.0).sin_cos())
        .map(|(sin, cos)| std::array::from_fn(|k| cos * first[k] + sin * second[k]))
        .to_vec()
}
