//! Holes of the data: a third-order fit in place of f̂, which flattens there.

use kiddo::SquaredEuclidean;
use rayon::prelude::*;
use zeroset_bspline::{Derivatives, KnotVector, Spline};
use zeroset_gefm::{HermiteOptions, hermite_fit};

use crate::error::ReconstructError;
use crate::lattice::domain::{Domain, Nodes};
use crate::memory::MemoryReport;
use crate::phi::inventions::inventions;
use crate::phi::sign_field::SignField;
use crate::points::kd_tree::tree_of;
use crate::points::spacing::{Spacing, distances_to};
use crate::points::support::{Nearest, Support};
use crate::points::thinning::{Choice, ENOUGH, thinned};

/// A hole begins where no point is near enough to [support](Support::nearest) a surface, and none within this share of a coarse cell; from
/// twice that distance on the fit speaks alone.
const CELLS: f64 = 0.5;
/// Holes are filled if more than this share of the zero set is in them: a few places of any cloud are so by chance.
const SHARE: f64 = 0.005;
/// A gradient that differs from the normal by 1 counts as much as a value of so many spacings.
const NORMAL_LENGTH: f64 = 0.5;
/// The normals are taken from the fit so often.
const ROUNDS: usize = 5;
/// With more coefficients than this on the coarse lattice the fit would take seconds: it is made on cells twice as wide, or not at all.
const MOST: usize = 15_000;
/// The fit is heard only beyond points that it passes within this share of the distance at which a hole begins, with its gradient less
/// than 45° from the normal: it knows neither details nor walls thinner than its cells.
const FITS: f64 = 0.3;
const TURNED: f64 = 0.7;
/// It is heard up to twice so many times as far from a hole's surface as that is from the points.
const BESIDE: f64 = 1.0;
/// Farther than a coarse cell from all points it is not heard where winding numbers are so far from ½.
const CLEAR: f64 = 0.45;

/// What came of it.
pub enum Filling {
    /// There are no holes.
    NoHoles,
    /// There is not enough memory for the fit.
    NoRoom,
    /// Nodes that have changed.
    Filled(usize),
}

/// Where the `crossings` of the zero set run far from all `sites`, lets a third-order fit to these with the normals of f̂ fade in: in `field`,
/// on the nodes of the lattice after `halvings`. `ratio` is the smoothing length of f̂ in spacings.
///
/// # Errors
/// If the lattice is not valid.
pub fn fill_holes<const D: usize>(
    field: &mut SignField,
    crossings: &[[f64; D]],
    sites: &[[f64; D]],
    (f_hat, ratio): (&Spline<D>, f64),
    (domain, halvings): (&Domain<D>, u32),
    memory: &MemoryReport,
) -> Result<Filling, ReconstructError> {
    let wide = CELLS * domain.spacing;
    let enough = |holes: &[[f64; D]]| !holes.is_empty() && holes.len() as f64 >= SHARE * crossings.len() as f64;
    // Most surfaces are nowhere as far from their points as that: they are done with here.
    let far = distances_to(sites, crossings);
    let far: Vec<[f64; D]> = crossings.iter().zip(far).filter(|(_, d)| *d > wide).map(|(place, _)| *place).collect();
    if !enough(&far) {
        return Ok(Filling::NoHoles);
    }
    let all = Spacing::of(sites);
    let few = thinned(sites, &all, Choice::Even(ENOUGH));
    let (sites, spacing) = few.as_ref().map_or((sites, &all), |(few, spacing)| (few, spacing));
    let support = Support::new(sites, spacing);
    // Of a place: 1 where a hole begins.
    let depth = |nearest: &Nearest| nearest.remoteness.min(nearest.distance / wide);
    let (holes, depths): (Vec<[f64; D]>, Vec<f64>) = far
        .iter()
        .zip(support.nearest(&far))
        .filter(|(_, nearest)| depth(nearest) > 1.0)
        .map(|(place, nearest)| (*place, nearest.distance))
        .unzip();
    if !enough(&holes) {
        return Ok(Filling::NoHoles);
    }

    let mut knots = domain.knots(3, 0)?;
    let unknowns = |knots: &[KnotVector; D]| knots.iter().map(KnotVector::basis_count).product::<usize>();
    if unknowns(&knots) > MOST {
        knots = domain.bottom(3)?;
    }
    // A box with a wide margin.
    if unknowns(&knots) > MOST {
        return Ok(Filling::NoHoles);
    }
    if !memory.has_room_to_factor::<D>(unknowns(&knots), 3) {
        return Ok(Filling::NoRoom);
    }

    let normals = f_hat.evaluate(sites, Derivatives::Gradient).gradients;
    let settings = HermiteOptions {
        density: spacing.density,
        smoothing_length: ratio * spacing.typical,
        normal_length: NORMAL_LENGTH * spacing.typical,
        rounds: ROUNDS,
    };
    // Sites that hardly leave a plane have no unique fit: f̂ has to do.
    let Ok(fit) = hermite_fit(sites, &normals, &spacing.areas, &knots, &settings) else { return Ok(Filling::NoHoles) };
    let at_sites = fit.evaluate(sites, Derivatives::Gradient);
    let heard: Vec<bool> = at_sites
        .sampson_distances()
        .iter()
        .zip(at_sites.gradients.iter().zip(&normals))
        .zip(support.reaches())
        .map(|((distance, (gradient, normal)), reach)| {
            let begins = reach.max(wide);
            distance.abs() < FITS * begins && cosine(gradient, normal) > TURNED
        })
        .collect();

    let nodes = Nodes::new(domain, halvings);
    let (flat, filled) = (f_hat.sample(&nodes.axes, [0; D]), fit.sample(&nodes.axes, [0; D]));
    let tree = tree_of(&holes);
    let share = |(node, winding): (usize, &f64)| {
        let place = nodes.at(node);
        let hole = tree.query(&place).nearest_one::<SquaredEuclidean<f64>>().execute();
        let beside = (2.0 - hole.distance.sqrt() / (BESIDE * depths[hole.item as usize])).clamp(0.0, 1.0);
        if beside == 0.0 {
            return 0.0;
        }
        let nearest = support.nearest_to(&place);
        let told_otherwise = winding.abs() > CLEAR && nearest.distance > domain.spacing;
        if told_otherwise || !heard[nearest.sample] { 0.0 } else { beside * (depth(&nearest) - 1.0).clamp(0.0, 1.0) }
    };
    let Some(winding) = field.winding.as_slice() else { return Ok(Filling::NoHoles) };
    let shares: Vec<f64> = winding.par_iter().enumerate().map(share).collect();
    let mut values = field.value.clone();
    let mut changed = 0;
    for ((value, share), (flat, filled)) in values.iter_mut().zip(shares).zip(flat.iter().zip(&filled)) {
        if share > 0.0 {
            *value = (1.0 - share) * flat + share * filled;
            changed += 1;
        }
    }
    for node in inventions(&field.value, &values, &nodes.shape) {
        if let (Some(value), Some(was)) = (values.as_slice_mut(), field.value.as_slice()) {
            value[node] = was[node];
        }
        changed -= 1;
    }
    field.value = values;
    Ok(Filling::Filled(changed))
}

fn cosine<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let dot = |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
}
