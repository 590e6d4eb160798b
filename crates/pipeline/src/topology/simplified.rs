//! The function without its shallow features.

use serde::Serialize;
use tracing::debug;
use zeroset_bspline::{CellBand, HierarchicalSpline};
use zeroset_trust_region::{Place, within_bounds};
use zeroset_watch::CancelToken;

use crate::error::ReconstructError;
use crate::lattice::domain::Domain;
use crate::points::spacing::{SECOND_ORDER, Spacing};
use crate::report::StageFigures;
use crate::topology::shallow::shallow;

/// So often: what goes in one place may leave something in another.
const ROUNDS: usize = 4;
/// In the places of a feature f is brought so many spacings to the other side.
const BEYOND: f64 = 0.05;

/// What has gone.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SimplificationReport {
    /// Tunnels that have been closed and strands that have been cut.
    pub handles: usize,
    /// Components that were no more than specks.
    pub specks: usize,
    /// Places in which f was brought to the other side.
    pub places: usize,
    /// How often.
    pub rounds: usize,
}

/// What simplification depends on; frame units.
pub struct Simplification<'a, const D: usize> {
    /// The points that were fitted, with their spacing.
    pub points: &'a [[f64; D]],
    pub spacing: &'a Spacing,
    pub domain: &'a Domain<D>,
    /// From the coarsest lattice to that of the initial shape.
    pub halvings: u32,
    pub band: &'a CellBand<D>,
    pub cancel: &'a CancelToken,
}

impl<const D: usize> Simplification<'_, D> {
    /// f, which is about the distance near its zero set, without handles and specks that go if it changes by little.
    pub fn run(&self, mut f: HierarchicalSpline<D>) -> Result<(HierarchicalSpline<D>, StageFigures), ReconstructError> {
        let spacing = self.spacing.typical;
        let mut report = SimplificationReport::default();
        while report.rounds < ROUNDS && !self.cancel.is_cancelled() {
            let found = shallow(&f, self.domain, self.halvings, spacing);
            debug!(?found, "shallow features");
            if found.is_empty() {
                break;
            }
            let mut places = Vec::new();
            for feature in &found {
                let bound = if feature.inside { -BEYOND * spacing } else { BEYOND * spacing };
                places.extend(feature.places.iter().map(|at| Place { at: *at, bound, weight: 1.0 }));
            }
            let points = (self.points, &self.spacing.areas[..]);
            let energy = (self.spacing.density, SECOND_ORDER * spacing);
            f = within_bounds(&f, self.band.near(), points, &places, energy)?;
            report.rounds += 1;
            report.places += places.len();
            report.specks += found.iter().filter(|feature| feature.is_speck).count();
            report.handles += found.iter().filter(|feature| !feature.is_speck).count();
        }
        Ok((f, StageFigures::Simplification(report)))
    }
}

#[cfg(test)]
mod tests {
    use zeroset_bspline::Derivatives;

    use super::*;
    use crate::topology::shallow::tests::{HALVINGS, box_of_one, plate};

    #[test]
    fn a_pinhole_is_closed_and_the_points_hardly_notice() {
        let (f, domain) = (plate(0.004), box_of_one());
        let genus = |f: &HierarchicalSpline<3>| {
            let topology = zeroset_isosurface::surface_of(f, 1, &Default::default()).unwrap().0.topology();
            (topology.components, topology.genus)
        };
        assert_eq!(genus(&f), (1, 1));
        // Vertices as points, about 0.08 apart.
        let mesh = zeroset_isosurface::surface_of(&f, 0, &Default::default()).unwrap().0;
        let points: Vec<[f64; 3]> = mesh.vertices.iter().copied().step_by(40).collect();
        let spacing = Spacing::of(&points);
        assert!((0.05..0.1).contains(&spacing.typical), "{}", spacing.typical);
        let band = CellBand::new(&domain.knots(3, HALVINGS).unwrap(), &points, &vec![0; points.len()], [7, 3]).unwrap();
        let settings = Simplification {
            points: &points,
            spacing: &spacing,
            domain: &domain,
            halvings: HALVINGS,
            band: &band,
            cancel: &CancelToken::new(),
        };
        let (simple, StageFigures::Simplification(report)) = settings.run(f.clone()).unwrap() else { panic!() };
        assert_eq!(genus(&simple), (1, 0));
        assert_eq!((report.handles, report.specks), (1, 0));
        // Beside the hole they are moved, by less than its depth and what it is closed by.
        let values = simple.evaluate(&points, Derivatives::Value).values;
        let most = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        assert!(most < 0.1 * spacing.typical, "{most}");
        // Elsewhere nothing has changed.
        let far = [0.3, 0.1, 0.02];
        assert_eq!(simple.value(&far), f.value(&far));
        let again = settings.run(simple.clone()).unwrap();
        assert_eq!(again.0, simple);
    }
}
