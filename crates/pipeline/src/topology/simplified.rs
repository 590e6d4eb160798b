//! The function without its shallow features.

use serde::Serialize;
use tracing::debug;
use zeroset_bspline::{CellBand, HierarchicalSpline};
use zeroset_trust_region::{Place, within_bounds};
use zeroset_watch::CancelToken;

use crate::error::ReconstructError;
use crate::lattice::domain::Domain;
use crate::points::spacing::{NOISY, SECOND_ORDER, Spacing};
use crate::report::StageFigures;
use crate::topology::shallow::shallow;
use crate::topology::strays::strays_alone;

/// So often: what goes in one place may leave something in another.
const ROUNDS: usize = 4;
/// In the places of a feature, or of a speck, f is brought so many spacings to the other side.
const BEYOND: f64 = 0.05;

/// What has gone.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SimplificationReport {
    /// Tunnels that have been closed and strands that have been cut.
    pub handles: usize,
    /// Components that were no more than specks.
    pub specks: usize,
    /// Points whose specks have gone with them, since they stand alone.
    pub strays: usize,
    /// Places in which f was brought to the other side.
    pub places: usize,
    /// How often.
    pub rounds: usize,
}

/// What is left.
pub struct Simplified<const D: usize> {
    pub function: (HierarchicalSpline<D>, StageFigures),
    /// Which points do not belong to it.
    pub stray: Vec<bool>,
}

/// What simplification depends on; frame units.
pub struct Simplification<'a, const D: usize> {
    /// The points that were fitted, with their spacing.
    pub points: &'a [[f64; D]],
    pub spacing: &'a Spacing,
    /// Standard deviation of the points' distances from their surface.
    pub noise: f64,
    pub domain: &'a Domain<D>,
    /// From the coarsest lattice to that of the initial shape.
    pub halvings: u32,
    pub band: &'a CellBand<D>,
    pub cancel: &'a CancelToken,
}

impl<const D: usize> Simplification<'_, D> {
    /// f, which is about the distance near its zero set, without handles and specks that go if it changes by little, and without those that a
    /// point has to itself that stands alone; and which of the points have lost theirs. Of noisy points there are none, which are not fitted
    /// closely.
    pub fn run(&self, mut f: HierarchicalSpline<D>) -> Result<Simplified<D>, ReconstructError> {
        let spacing = self.spacing.typical;
        let is_noisy = self.noise > NOISY * spacing;
        let mut report = SimplificationReport::default();
        let (mut stray, mut areas) = (vec![false; self.points.len()], self.spacing.areas.clone());
        while report.rounds < ROUNDS && !self.cancel.is_cancelled() {
            let found = shallow(&f, self.domain, self.halvings, spacing);
            debug!(?found, "shallow features");
            let alone = if is_noisy { vec![] } else { strays_alone(&f, self.points, self.spacing, &stray) };
            debug!(points = alone.len(), "points with a speck to themselves");
            if found.is_empty() && alone.is_empty() {
                break;
            }
            let specks = alone.iter().map(|point| (&point.places, point.value < 0.0));
            let features = found.iter().map(|feature| (&feature.places, feature.inside));
            let held = |(at, inside): (&Vec<[f64; D]>, bool)| {
                let bound = if inside { -BEYOND * spacing } else { BEYOND * spacing };
                at.iter().map(|at| Place { at: *at, bound, weight: 1.0 }).collect::<Vec<_>>()
            };
            let places: Vec<Place<D>> = features.chain(specks).flat_map(held).collect();
            for point in &alone {
                (stray[point.index], areas[point.index]) = (true, 0.0);
            }
            let energy = (self.spacing.density, SECOND_ORDER * spacing);
            f = within_bounds(&f, self.band.near(), (self.points, &areas), &places, energy)?;
            report.rounds += 1;
            report.places += places.len();
            report.specks += found.iter().filter(|feature| feature.is_speck).count();
            report.handles += found.iter().filter(|feature| !feature.is_speck).count();
            report.strays += alone.len();
        }
        Ok(Simplified { function: (f, StageFigures::Simplification(report)), stray })
    }
}

#[cfg(test)]
mod tests {
    use zeroset_bspline::Derivatives;

    use super::*;
    use crate::lattice::domain::tests::spline;
    use crate::topology::shallow::tests::{HALVINGS, box_of_one, plate};

    /// What is left of f for points with so much noise, what has gone, and which points with it.
    fn simplified(
        f: &HierarchicalSpline<3>,
        points: &[[f64; 3]],
        noise: f64,
    ) -> (HierarchicalSpline<3>, SimplificationReport, Vec<bool>) {
        let domain = box_of_one();
        let band = CellBand::new(&domain.knots(3, HALVINGS).unwrap(), points, &vec![0; points.len()], [7, 3]).unwrap();
        let settings = Simplification {
            points,
            spacing: &Spacing::of(points),
            noise,
            domain: &domain,
            halvings: HALVINGS,
            band: &band,
            cancel: &CancelToken::new(),
        };
        let Simplified { function: (simple, figures), stray } = settings.run(f.clone()).unwrap();
        let StageFigures::Simplification(report) = figures else { panic!() };
        (simple, report, stray)
    }

    #[test]
    fn a_pinhole_is_closed_and_the_points_hardly_notice() {
        let f = plate(0.004);
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
        let (simple, report, _) = simplified(&f, &points, 0.0);
        assert_eq!(genus(&simple), (1, 0));
        assert_eq!((report.handles, report.specks), (1, 0));
        // Beside the hole they are moved, by less than its depth and what it is closed by.
        let values = simple.evaluate(&points, Derivatives::Value).values;
        let most = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        assert!(most < 0.1 * spacing.typical, "{most}");
        // Elsewhere nothing has changed.
        let far = [0.3, 0.1, 0.02];
        assert_eq!(simple.value(&far), f.value(&far));
        assert_eq!(simplified(&simple, &points, 0.0).0, simple);
    }

    /// Too deep to hang on little: a ball of three quarters of a spacing above a plate, with the one point to itself.
    #[test]
    fn a_speck_of_a_point_that_stands_alone_goes_with_it() {
        let f = |[x, y, z]: [f64; 3]| {
            let plate = (x.hypot(y) - 0.35).max(0.0).hypot(z) - 0.06;
            plate.min(x.hypot(y - 0.05).hypot(z - 0.28) - 0.06)
        };
        let f = HierarchicalSpline::new(spline(&box_of_one(), HALVINGS, f)).unwrap();
        let mesh = zeroset_isosurface::surface_of(&f, 0, &Default::default()).unwrap().0;
        assert_eq!(mesh.topology().components, 2);
        let of_plate = mesh.vertices.iter().copied().filter(|v| v[2] < 0.15).step_by(40);
        let points: Vec<[f64; 3]> = of_plate.chain([[0.06, 0.05, 0.28]]).collect();
        let spacing = Spacing::of(&points);
        assert!((0.05..0.1).contains(&spacing.typical), "{}", spacing.typical);
        let (simple, report, stray) = simplified(&f, &points, 0.0);
        assert_eq!((report.strays, report.specks, report.handles), (1, 0, 0));
        assert_eq!(stray.iter().position(|stray| *stray), Some(points.len() - 1));
        assert_eq!(zeroset_isosurface::surface_of(&simple, 0, &Default::default()).unwrap().0.topology().components, 1);
        assert!(simple.value(&[0.0, 0.05, 0.28]) > 0.5 * spacing.typical, "as far outside as it looks");
        let values = simple.evaluate(&points[..points.len() - 1], Derivatives::Value).values;
        let most = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        assert!(most < 0.1 * spacing.typical, "{most}: the plate stays");
        // A fit that does not follow the points closely has no point to itself.
        assert_eq!(simplified(&f, &points, 0.2 * spacing.typical).0, f);
    }
}
