//! Places that are to be on a given side, at the price of as little as possible elsewhere.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use zeroset_bspline::{BlockField, HierarchicalSpline, IndexSet, Level};
use zeroset_multigrid::{BandCollocation, BandEnergy, BandOperator, BandRows, Fairness, Truncation, solve_truncated};

use crate::error::Error;
use crate::level_options::LevelError;
use crate::redistance::with_correction;
use crate::sides::{Bounded, Place, Sides};

/// Smoothing length of a correction, in cells of its level.
const SMOOTHING: f64 = 0.3;
/// Places weigh so many times what they did after a step in which some still lack something,
const HEAVIER: f64 = 10.0;
/// so often.
const STEPS: usize = 6;
/// Functions that begin or end within so many cells of a place change.
const REACH: u32 = 5;
/// Steps of conjugate gradients in each.
const CG_STEPS: usize = 60;
const CG_TOLERANCE: f64 = 1e-4;

/// f with the smallest smooth correction that brings it within the bounds of the places: of all levels on which a place lies the finest one
/// is corrected, on the dense level the functions of `near`. At the points f is to stay what it is; they weigh their areas, of mean one, and there
/// are `density` of them per unit length in 2D, per unit area in 3D. `length` is λ in the energy `∫‖∇³δ‖² + ∫‖∇²δ‖²/λ²` of the correction δ.
///
/// # Errors
/// If a place is not valid, or `near` does not belong to the dense lattice.
pub fn within_bounds<const D: usize>(
    f: &HierarchicalSpline<D>,
    near: &Arc<IndexSet<D>>,
    (points, areas): (&[[f64; D]], &[f64]),
    places: &[Place<D>],
    (density, length): (f64, f64),
) -> Result<HierarchicalSpline<D>, LevelError> {
    if areas.len() != points.len() {
        return Err(Error::Areas { found: areas.len(), needed: points.len() }.into());
    }
    let mut sides = Sides { normals: Vec::new(), places: places.to_vec() };
    sides.check(points.len())?;
    let mut f = f.clone();
    for number in (0..=f.levels().len()).rev() {
        let dense = if number == 0 { Some(Level::of_dense(f.root(), Arc::clone(near))?) } else { None };
        let level = dense.as_ref().unwrap_or_else(|| &f.levels()[number - 1]);
        let at: Vec<[f64; D]> = sides.places.iter().map(|place| place.at).collect();
        let mut here = vec![false; at.len()];
        BandCollocation::new(level, &at).indices().iter().for_each(|i| here[*i as usize] = true);
        let (of_level, rest): (Vec<_>, Vec<_>) = sides.places.iter().zip(&here).partition(|(_, here)| **here);
        let of_level = Sides { normals: Vec::new(), places: of_level.into_iter().map(|(place, _)| *place).collect() };
        let rest = rest.into_iter().map(|(place, _)| *place).collect();
        if !of_level.places.is_empty() {
            let delta = correction(level, (points, areas), of_level, (density, length));
            f = with_correction(&f, number, dense.as_ref(), &delta)?;
        }
        sides.places = rest;
    }
    Ok(f)
}

/// δ of one level, on its active functions: those near places that lack something.
fn correction<const D: usize>(
    level: &Level<D>,
    (points, areas): (&[[f64; D]], &[f64]),
    mut sides: Sides<D>,
    (density, length): (f64, f64),
) -> Vec<f64> {
    let mut delta = vec![0.0; level.active().len()];
    let near = functions_near(level, &sides.places);
    let all = BandCollocation::new(level, points);
    let is_near = |i: usize| {
        first_function(level, &points[all.indices()[i] as usize]).is_some_and(|k| near.contains(k.map(|k| k + 1)))
    };
    let on = all.subset(is_near);
    let roots: Vec<f64> = on.indices().iter().map(|i| areas[*i as usize].sqrt()).collect();
    let active = Arc::new(near);
    let fairness = Fairness::third_order(density * (SMOOTHING * level.cell_side()).powi(5), length);
    let energy = BandEnergy::new(Arc::clone(&active), level.cell_sides(), fairness);
    let mut total = level.total().clone();
    let mut moved = BlockField::zeros(Arc::clone(total.set()));
    let mut x = vec![0.0; active.len()];
    for _ in 0..STEPS {
        let bounded = Bounded::new(level, &sides);
        let Some((lacking, residuals)) = bounded.rows(&bounded.lacks(&total)) else { break };
        let at_points: Vec<f64> =
            on.values_and_gradients(&moved).iter().zip(&roots).map(|((value, _), root)| root * value).collect();
        let rows =
            BandRows { beta: vec![[0.0; D]; roots.len()], alpha: roots.clone(), collocation: Cow::Borrowed(&on) };
        let (mut right, mut smooth) = (vec![0.0; active.len()], vec![0.0; active.len()]);
        let add = |sums: &mut [f64]| {
            for (rows, residuals) in [(&rows, &at_points), (&lacking, &residuals)] {
                rows.collocation.add_transposed(&rows.alpha, &rows.beta, residuals, &active, sums);
            }
        };
        energy.sums(add, &mut right);
        energy.apply_to_active(&x, &mut smooth);
        right.iter_mut().zip(&smooth).for_each(|(b, e)| *b = -*b - e);
        let truncation = Truncation { most_steps: CG_STEPS, tolerance: CG_TOLERANCE, radius: f64::INFINITY };
        let step = solve_truncated(&BandOperator::new(vec![rows, lacking], energy.clone()), &right, &truncation).x;
        x.iter_mut().zip(&step).for_each(|(sum, x)| *sum += x);
        total.add(&active, &step);
        moved.add(&active, &step);
        sides.places.iter_mut().for_each(|place| place.weight *= HEAVIER);
    }
    for (index, x) in active.iter().zip(x) {
        if let Some(rank) = level.active().rank(index) {
            delta[rank] = x;
        }
    }
    delta
}

/// The first function along each axis that acts where x is; none outside the box.
fn first_function<const D: usize>(level: &Level<D>, x: &[f64; D]) -> Option<[u32; D]> {
    let mut first = [0; D];
    for axis in 0..D {
        let knots = &level.knots()[axis];
        first[axis] = (knots.span(x[axis])? - knots.degree()) as u32;
    }
    Some(first)
}

/// The active functions that reach so many cells around the places.
fn functions_near<const D: usize>(level: &Level<D>, places: &[Place<D>]) -> IndexSet<D> {
    let cells: BTreeSet<[u32; D]> = places.iter().filter_map(|place| first_function(level, &place.at)).collect();
    let is_near = |index: &[u32; D]| {
        // In the order of the first axis, so that few are looked at.
        let from = index.map(|k| k.saturating_sub(REACH + 3));
        let mut low = [0; D];
        low[0] = from[0];
        let within = |cell: &&[u32; D]| (0..D).all(|axis| (from[axis]..=index[axis] + REACH).contains(&cell[axis]));
        cells.range(low..).take_while(|cell| cell[0] <= index[0] + REACH).any(|cell| within(&cell))
    };
    let chosen: Vec<[u32; D]> = level.active().iter().filter(is_near).collect();
    IndexSet::new(level.active().extent(), &chosen)
}
