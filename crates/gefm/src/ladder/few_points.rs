//! What few points are fitted with where nothing else convinces: unit normals of least energy, and fairness of third order.

use tracing::debug;
use zeroset_bspline::Spline;

use super::{Ladder, Trial, halved};
use crate::error::GefmError;
use crate::ladder_options::{KnownNormals, ThirdOrderOptions};
use crate::ladder_report::Start;
use crate::rung::Rung;
use crate::third_order::{ThirdOrder, held};
use crate::unit_normals::unit_normals;
use crate::verdict::Verdict;

/// Fewer of the points than this share have both signs about them where third order has made a wall of a flat sheet or a segment: half, but for
/// those with noise of a third of the spacing all around them. Of thin parts 96 % of the points have.
const HELD: f64 = 0.8;

/// Fairness of third order is for lattices with no more coefficients, for its matrix is factored.
pub const MOST_FACTORED: usize = 15_000;

/// Unit normals of least energy are sought for no more points: of so many the matrices take a tenth of a gigabyte, and seconds.
const MOST_UNIT_NORMALS: usize = 1000;
/// With a smoothing length of so many spacings.
const UNIT_RATIO: f64 = 0.2;
/// Their function is taken on the base lattice after so many halvings.
const UNIT_HALVINGS: u32 = 2;
/// The eigenvector's are taken where their energy is less than this share of that of the leader's.
const LOWER: f64 = 0.97;

impl<const D: usize> Ladder<'_, D> {
    /// Whether a candidate of few points needs no other order.
    fn is_convincing(&self, third_order: &ThirdOrderOptions) -> bool {
        let few = self.patches.least();
        self.leader.as_ref().is_some_and(|leader| {
            let Verdict { score, beyond_noise, layered, off, .. } = leader.verdict;
            score < self.options.content || (beyond_noise <= third_order.above && !layered && off <= few)
        })
    }

    /// What few points are fitted with, if they are to be, where nothing has convinced: unit normals, or else third derivatives on the rung.
    pub(super) fn search_third_order(&mut self, rung: &Rung<D>) -> Result<(), GefmError> {
        let Some(third_order) = &self.options.third_order else { return Ok(()) };
        if matches!(self.options.normals, KnownNormals::Trust(_)) || self.is_convincing(third_order) {
            return Ok(());
        }
        let searched = self.search_unit_normals();
        self.passed_over(searched)?;
        if self.report.has_agreed() || rung.unknowns() > MOST_FACTORED {
            return Ok(());
        }
        self.search_on_rung(rung, third_order)
    }

    /// Candidates from scratch whose fairness is of third order.
    fn search_on_rung(&mut self, rung: &Rung<D>, third_order: &ThirdOrderOptions) -> Result<(), GefmError> {
        let points = (self.points, self.areas);
        let fits = ThirdOrder::new(points, rung.knots(), &self.away_from_centroid(), self.options)?;
        for ratio in &third_order.ratios {
            let trial = Trial { order: 3, halvings: rung.halvings, unknowns: rung.unknowns(), ratio: *ratio };
            // Few points of a quadric cost nothing, and A is singular: for shorter lengths too.
            if self.tried(fits.spectral(*ratio), trial, Start::Eigenvector)?.score == f64::INFINITY {
                break;
            }
        }
        Ok(())
    }

    /// Unit normals of least energy, from those of the leader and from the eigenvector, unless they were sought before. They are taken where both
    /// agree, or where the eigenvector's have less energy than the leader's came to and no worse a score: their energy knows more of few points
    /// than winding numbers do.
    fn search_unit_normals(&mut self) -> Result<(), GefmError> {
        let Some(leader) = &self.leader else { return Ok(()) };
        if D != 3 || self.heard.len() > MOST_UNIT_NORMALS || self.report.unit_normals.is_some() {
            return Ok(());
        }
        let areas = self.of_heard(self.areas);
        let starts = (self.of_heard(&self.directions()), self.of_heard(&self.away_from_centroid()));
        let knots = halved(self.base, UNIT_HALVINGS);
        let weight = self.options.third_order_weight(UNIT_RATIO);
        let points = (&*self.of_heard(self.points), &*areas);
        let found = unit_normals(points, weight, (&starts.0, &starts.1), &knots, &self.options.cancel)?;
        let Some((f, evaluations, report)) = found else { return Ok(()) };
        debug!(?report, "unit normals");
        let is_lower = report.from_eigenvector < LOWER * report.from_leader;
        if report.agree() || is_lower {
            let most = if report.agree() { f64::INFINITY } else { leader.verdict.beyond_noise };
            let trial = Trial { order: 3, halvings: UNIT_HALVINGS, unknowns: f.as_flat().len(), ratio: UNIT_RATIO };
            let other = self.assess((f, evaluations), trial, Start::UnitNormals)?;
            if self.is_held(&other.f) && other.verdict.beyond_noise <= most {
                self.lead(other);
            }
        }
        self.report.unit_normals = Some(report);
        Ok(())
    }

    /// Whether the nodes on which the sign is read afterwards can hold what third order found.
    pub(super) fn is_held(&self, f: &Spline<D>) -> bool {
        let cell = self.options.third_order.as_ref().map(|third_order| third_order.cell);
        cell.is_some_and(|cell| held(f, self.points, cell) >= HELD)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::knots;
    use crate::{LadderOptions, ThirdOrderOptions, climb};

    #[test]
    fn third_order_tells_the_sides_of_a_wall_thinner_than_the_spacing() {
        // A bar 0.9 × 0.03, points 0.06 apart, on cells of 0.075.
        let side = |y: f64, from: f64| (0..15).map(move |i| [from + 0.06 * f64::from(i), y]);
        let points: Vec<[f64; 2]> = side(-0.015, -0.44).chain(side(0.015, -0.41)).collect();
        let found = |cell: Option<f64>| {
            let third_order = cell.map(ThirdOrderOptions::new);
            let options = LadderOptions { third_order, last: 1, ..LadderOptions::new(0.06, 1.0 / 0.06) };
            let (f, _, report) = climb(&points, &[1.0; 30], &knots(0.6, 8), &options).unwrap();
            let right = points.iter().filter(|p| f.value_and_gradient(p).1[1] * p[1] > 0.0).count();
            (right.max(30 - right), report.choice().unwrap().order)
        };
        assert_eq!(found(Some(0.02)), (30, 3));
        let (right, order) = found(None);
        assert!(right < 25 && order == 2, "{right}");
        // The nodes of cells many times wider than the bar would see nothing of it.
        assert_eq!(found(Some(0.1)), (right, 2));
    }
}
