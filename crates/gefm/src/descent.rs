//! Descent over unit vectors: the limited-memory method of Broyden, Fletcher, Goldfarb and Shanno (Nocedal 1980).

use std::collections::VecDeque;

use zeroset_watch::{CancelToken, Cancelled};

use crate::lanczos::{axpy, dot};

/// Steps are remembered so long.
const MEMORY: usize = 12;
/// No more steps than these,
const MOST_STEPS: usize = 400;
/// nor halvings of one, which falls by at least this share of what its slope promises (Armijo).
const MOST_HALVINGS: usize = 30;
const PROMISED: f64 = 1e-4;
/// The descent ends where so many steps in turn have each lowered the energy by less than this share of it.
const SETTLED: (usize, f64) = (3, 1e-6);

/// What a descent came to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Descent<const D: usize> {
    /// Of unit length.
    pub(crate) vectors: Vec<[f64; D]>,
    pub(crate) energy: f64,
    /// Evaluations of the energy.
    pub(crate) evaluations: usize,
}

/// Unit vectors near `start`, whose own are of any length but zero, at which an energy is about least; `energy` gives it and its gradient
/// for vectors one after the other, `D` numbers each. None if there it is not finite.
///
/// # Errors
/// If it was cancelled.
pub(crate) fn descend<const D: usize>(
    energy: impl Fn(&[f64]) -> (f64, Vec<f64>),
    start: &[[f64; D]],
    cancel: &CancelToken,
) -> Result<Option<Descent<D>>, Cancelled> {
    // Lengths are free, and change nothing: steps are across the vectors.
    let across = |free: &[f64]| {
        let lengths: Vec<f64> = free.chunks(D).map(|v| dot(v, v).sqrt()).collect();
        let unit: Vec<f64> =
            free.chunks(D).zip(&lengths).flat_map(|(v, length)| v.iter().map(move |v| v / length)).collect();
        let (value, mut gradient) = energy(&unit);
        for ((g, u), length) in gradient.chunks_mut(D).zip(unit.chunks(D)).zip(&lengths) {
            let along = dot(g, u);
            g.iter_mut().zip(u).for_each(|(g, u)| *g = (*g - along * u) / length);
        }
        (value, gradient, unit)
    };
    let (mut value, mut gradient, mut at) = across(start.as_flattened());
    let mut evaluations = 1;
    if !(value.is_finite() && gradient.iter().all(|g| g.is_finite())) {
        return Ok(None);
    }
    let mut known: VecDeque<Secant> = VecDeque::new();
    let mut small = 0;
    for _ in 0..MOST_STEPS {
        cancel.check()?;
        let mut direction = downhill(&known, &gradient);
        let mut slope = dot(&direction, &gradient);
        if slope >= 0.0 {
            known.clear();
            direction = downhill(&known, &gradient);
            slope = dot(&direction, &gradient);
        }
        // Without a curvature the first step turns no vector by more than half a radian or so.
        let steepest = direction.chunks(D).map(|d| dot(d, d).sqrt()).fold(0.0, f64::max);
        if steepest == 0.0 {
            break;
        }
        let mut step = if known.is_empty() { 0.5 / steepest } else { 1.0 };
        let mut found = None;
        for _ in 0..MOST_HALVINGS {
            let mut place = at.clone();
            axpy(step, &direction, &mut place);
            evaluations += 1;
            let (lower, slopes, unit) = across(&place);
            if lower <= value + PROMISED * step * slope {
                found = Some((lower, slopes, unit));
                break;
            }
            step *= 0.5;
        }
        let Some((lower, slopes, unit)) = found else { break };
        known.extend(Secant::between((&at, &gradient), (&unit, &slopes)));
        if known.len() > MEMORY {
            known.pop_front();
        }
        small = if value - lower < SETTLED.1 * value.abs() { small + 1 } else { 0 };
        (value, gradient, at) = (lower, slopes, unit);
        if small == SETTLED.0 {
            break;
        }
    }
    let (vectors, _) = at.as_chunks::<D>();
    Ok(Some(Descent { vectors: vectors.to_vec(), energy: value, evaluations }))
}

/// A step, and how the gradient changed over it.
struct Secant {
    step: Vec<f64>,
    change: Vec<f64>,
    /// Their product.
    curvature: f64,
}

impl Secant {
    /// Of places with their gradients; none where the energy is not convex between them.
    fn between(from: (&[f64], &[f64]), to: (&[f64], &[f64])) -> Option<Self> {
        let difference = |from: &[f64], to: &[f64]| -> Vec<f64> { to.iter().zip(from).map(|(t, f)| t - f).collect() };
        let (step, change) = (difference(from.0, to.0), difference(from.1, to.1));
        let curvature = dot(&step, &change);
        (curvature > 1e-12 * dot(&change, &change).sqrt() * dot(&step, &step).sqrt()).then_some(Self {
            step,
            change,
            curvature,
        })
    }
}

/// The inverse of what is known of the second derivatives, times the negative gradient, by the two loops over the steps.
fn downhill(known: &VecDeque<Secant>, gradient: &[f64]) -> Vec<f64> {
    let mut direction: Vec<f64> = gradient.iter().map(|g| -g).collect();
    let mut shares = Vec::with_capacity(known.len());
    for secant in known.iter().rev() {
        let share = dot(&secant.step, &direction) / secant.curvature;
        axpy(-share, &secant.change, &mut direction);
        shares.push(share);
    }
    if let Some(last) = known.back() {
        let scale = last.curvature / dot(&last.change, &last.change);
        direction.iter_mut().for_each(|d| *d *= scale);
    }
    for (secant, share) in known.iter().zip(shares.into_iter().rev()) {
        let back = dot(&secant.change, &direction) / secant.curvature;
        axpy(share - back, &secant.step, &mut direction);
    }
    direction
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `½ Σ ‖vᵢ − vᵢ₊₁‖²` along a chain whose ends are drawn to given vectors, and its gradient.
    fn chain(v: &[f64], ends: [[f64; 3]; 2]) -> (f64, Vec<f64>) {
        let last = v.len() - 3;
        let mut gradient = vec![0.0; v.len()];
        let mut energy = 0.0;
        for i in 0..last {
            let difference = v[i] - v[i + 3];
            energy += 0.5 * difference * difference;
            gradient[i] += difference;
            gradient[i + 3] -= difference;
        }
        for (at, end) in [0, last].into_iter().zip(ends) {
            for axis in 0..3 {
                let difference = v[at + axis] - end[axis];
                energy += 50.0 * difference * difference;
                gradient[at + axis] += 100.0 * difference;
            }
        }
        (energy, gradient)
    }

    #[test]
    fn a_chain_of_unit_vectors_turns_evenly() {
        let ends = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let start: Vec<[f64; 3]> =
            (0..31).map(|i| [1.0, 0.5 * (7.0 * f64::from(i)).sin(), 0.5 * (3.0 * f64::from(i)).cos()]).collect();
        let found = descend(|v| chain(v, ends), &start, &CancelToken::new()).unwrap().unwrap();
        for pair in found.vectors.windows(2) {
            assert!((dot(&pair[0], &pair[0]) - 1.0).abs() < 1e-12, "rounding only");
            // A quarter turn in thirty steps: if the energy is within 1e-5 of the least, each is to a part of about √(30 · 1e-5).
            let turn = dot(&pair[0], &pair[1]).acos();
            assert!((turn * 30.0 / std::f64::consts::FRAC_PI_2 - 1.0).abs() < 0.1, "{turn}");
        }
        // The condition number is about 1e4, and so would be the steps of steepest descent.
        assert!(found.evaluations < 300, "{}", found.evaluations);
        let again = descend(|v| chain(v, ends), &found.vectors, &CancelToken::new()).unwrap().unwrap();
        assert!(again.energy <= found.energy && again.energy > (1.0 - 1e-4) * found.energy);
    }

    #[test]
    fn what_is_not_finite_is_no_descent_and_a_cancelled_one_ends() {
        let nothing = |_: &[f64]| (f64::NAN, vec![0.0; 3]);
        assert_eq!(descend(nothing, &[[1.0, 0.0, 0.0]], &CancelToken::new()), Ok(None));
        let cancel = CancelToken::new();
        cancel.cancel();
        let ends = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert!(descend(|v| chain(v, ends), &[[0.0, 0.0, 1.0]; 5], &cancel).is_err());
    }
}
