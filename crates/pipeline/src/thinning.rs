//! Fewer points for the topology stage, which needs no more than its lattices can tell apart.

use std::collections::BTreeMap;

/// At most about so many points are worth hearing on a lattice of 32 cells along the longest side.
pub const ENOUGH: usize = 12_000;

/// One point per cell of a lattice fine enough to leave about [`ENOUGH`]: the one nearest to its cell's centre, so that
/// the choice depends on positions alone. `typical` is the spacing of all points, frame units.
pub fn thinned<const D: usize>(points: &[[f64; D]], typical: f64) -> Option<Vec<[f64; D]>> {
    if points.len() <= 2 * ENOUGH {
        return None;
    }
    let share = points.len() as f64 / ENOUGH as f64;
    let cell = typical * share.powf(1.0 / (D as f64 - 1.0));
    let mut chosen: BTreeMap<[i64; D], (f64, [f64; D])> = BTreeMap::new();
    for point in points {
        let place = point.map(|x| (x / cell).floor());
        let distance: f64 = (0..D).map(|axis| (point[axis] / cell - place[axis] - 0.5).powi(2)).sum();
        let best = chosen.entry(place.map(|x| x as i64)).or_insert((distance, *point));
        if distance.total_cmp(&best.0).then_with(|| compare(point, &best.1)).is_lt() {
            *best = (distance, *point);
        }
    }
    Some(chosen.into_values().map(|(_, point)| point).collect())
}

fn compare<const D: usize>(a: &[f64; D], b: &[f64; D]) -> std::cmp::Ordering {
    a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_choice_does_not_depend_on_the_order() {
        let points: Vec<[f64; 3]> = (0..40_000)
            .map(|i| [0.754_877_666, 0.569_840_296].map(|step| (f64::from(i) * step).fract() - 0.5))
            .map(|[x, y]| [x, y, 0.1])
            .collect();
        let typical = 1.0 / 200.0;
        let few = thinned(&points, typical).unwrap();
        // One per cell of √(40 000 / 12 000) spacings.
        assert!((9_000..=13_000).contains(&few.len()), "{}", few.len());
        let reversed: Vec<_> = points.iter().rev().copied().collect();
        assert_eq!(thinned(&reversed, typical).unwrap(), few);
        assert!(thinned(&points[..1000], typical).is_none());
    }
}
