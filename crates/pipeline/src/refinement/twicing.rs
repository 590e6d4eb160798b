//! Twicing: noisy points are fitted more closely where that leaves alone what hangs together.

use kiddo::SquaredEuclidean;
use tracing::debug;
use zeroset_bspline::{HierarchicalSpline, Level};
use zeroset_trust_region as trust_region;

use crate::points::kd_tree::tree_of;
use crate::refinement::ramp::ramp;
use crate::refinement::{Function, Refined, Refinement};
use crate::report::StageFigures;
use crate::topology::fragile;

/// Nothing is added within so many smoothing lengths, or cells if those are longer, of a place where the topology hangs on little, or
/// would change or do so with it, and all of it from twice that on: functions reach two cells.
const AWAY: f64 = 3.0;
/// Such places are looked for so often. If there are some even then, nothing is added anywhere.
const ROUNDS: usize = 4;
/// What is done to the function afterwards moves it a little: so many times as far from zero is on the safe side.
const SAFE: f64 = 1.25;

impl<const D: usize> Refinement<'_, D> {
    /// A function with what [`trust_region::twice`] adds to it, where noise has decided how smooth it is. Not in the plane: along a curve a
    /// few ℓ hold two or three independent numbers, too few to tell shape from noise.
    pub fn twiced(&self, (f, figures): Function<D>, sides: &trust_region::Sides<D>, areas: &[f64]) -> Refined<D> {
        let wanted = D == 3 && !self.cancel.is_cancelled();
        let (StageFigures::Refinement(report), Some(band), true) = (&figures, self.band, wanted) else {
            return Ok((f, figures));
        };
        let options = self.level_options(self.noise);
        let increment = trust_region::twice(self.points, Some(areas), sides, (&f, report), band, &options)?;
        let (Some(increment), Some(length)) = (increment, report.noise_length) else { return Ok((f, figures)) };
        let cell = f.levels().last().map_or(self.domain.spacing(self.halvings), Level::cell_side);
        let reach = AWAY * length.max(cell);
        let known = self.hanging(&f);
        let is_new = beyond(reach, &known);
        let closer = where_harmless(
            reach,
            known,
            |share| increment.added_to(&f, share, self.points),
            |closer| {
                let changes = self.topology_changes(&f, closer).into_iter().flat_map(|change| change.places);
                changes.chain(self.hanging(closer).into_iter().filter(|place| is_new(place) > 0.0)).collect()
            },
        )?;
        let Some(closer) = closer else { return Ok((f, figures)) };
        let mut report = report.clone();
        report.twicings = increment.twicings().to_vec();
        Ok((closer, StageFigures::Refinement(report)))
    }

    /// Where the topology of a function hangs on little.
    fn hanging(&self, f: &HierarchicalSpline<D>) -> Vec<[f64; D]> {
        let found = f.critical_points(SAFE * fragile::reach(self.noise, self.spacing.typical));
        found.into_iter().map(|point| point.place).collect()
    }
}

/// What `add` makes of the share that each place is to have: none around the `mistakes` that it has otherwise, and around those places
/// that are `left_out` from the start. Nothing if there are always more.
fn where_harmless<const D: usize, T, E>(
    reach: f64,
    mut left_out: Vec<[f64; D]>,
    add: impl Fn(&(dyn Fn(&[f64; D]) -> f64 + Sync)) -> Result<T, E>,
    mistakes: impl Fn(&T) -> Vec<[f64; D]>,
) -> Result<Option<T>, E> {
    for _ in 0..ROUNDS {
        let sum = add(&beyond(reach, &left_out))?;
        let found = mistakes(&sum);
        if found.is_empty() {
            return Ok(Some(sum));
        }
        debug!(places = found.len(), first = ?found[0], "twicing is left out where it changes what hangs together");
        left_out.extend(found);
    }
    Ok(None)
}

/// Gives 0 within a distance of some places, 1 from twice that on, and what is smooth between them.
fn beyond<const D: usize>(reach: f64, places: &[[f64; D]]) -> impl Fn(&[f64; D]) -> f64 + Sync + use<D> {
    let tree = (!places.is_empty()).then(|| tree_of(places));
    move |at| {
        let Some(tree) = &tree else { return 1.0 };
        let nearest = tree.query(at).nearest_one::<SquaredEuclidean<f64>>().execute();
        ramp(nearest.distance.sqrt(), reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_harm_is_left_out_there_and_nowhere_else() {
        // Numbers at places along a line, to which all of their share is added; more than a half harms at some.
        let at = |i: usize| [0.1 * i as f64, 0.0];
        let add = |share: &(dyn Fn(&[f64; 2]) -> f64 + Sync)| -> Result<Vec<f64>, ()> {
            Ok((0..20).map(|i| share(&at(i))).collect())
        };
        let harm = |wrong: &'static [usize]| {
            move |sum: &Vec<f64>| wrong.iter().filter(|i| sum[**i] > 0.5).map(|i| at(*i)).collect::<Vec<_>>()
        };
        assert_eq!(where_harmless(0.15, vec![], add, harm(&[])).unwrap().unwrap(), [1.0; 20]);
        let some = where_harmless(0.15, vec![at(5)], add, harm(&[8])).unwrap().unwrap();
        assert_eq!(some[4..10], [0.0; 6]);
        // At 4/3 of the length: t = 1/3.
        assert!((some[3] - 7.0 / 27.0).abs() < 1e-9 && (some[10] - some[3]).abs() < 1e-9, "{some:?}");
        assert!(some[..3].iter().chain(&some[11..]).all(|share| *share == 1.0), "{some:?}");
        // One after the other, as long as there are rounds; what always finds another mistake gets nothing.
        let one_by_one = |sum: &Vec<f64>| (0..20).filter(|i| sum[*i] > 0.5).map(at).take(1).collect::<Vec<_>>();
        assert_eq!(where_harmless(0.01, vec![], add, one_by_one).unwrap(), None);
    }
}
