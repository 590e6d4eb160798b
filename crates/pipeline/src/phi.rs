//! φ: the signed distance at the nodes of the dense lattice, sign(f̂) · d, equation (14), with the sign cleaned and holes closed, and d where no
//! point is near taken from f̂.

use std::cell::LazyCell;

use ndarray::ArrayD;
use zeroset_eikonal_sweep::{self as eikonal_sweep, Lattice};

use crate::error::ReconstructError;
use crate::lattice::domain::Domain;
use crate::memory::MemoryReport;
use crate::options::Options;
use crate::phi::crossings::{Closeness, crossings, gaps, supported_share};
use crate::phi::hole_filling::{Filling, fill_holes};
use crate::phi::sign::{SignReport, synthesize};
use crate::phi::sign_field::{SignField, sign_field};
use crate::points::left_out::kept;
use crate::report::{DistanceReport, StageFigures};
use crate::sides::Sides;

pub(crate) mod crossings;
pub(crate) mod denoising;
pub(crate) mod hole_filling;
pub(crate) mod inventions;
pub(crate) mod sign;
pub(crate) mod sign_field;

/// Holes are filled up to this noise, in spacings.
const FILLABLE_NOISE: f64 = 0.5;

/// What φ is made from.
pub struct SignStage<'a, const D: usize> {
    pub sides: &'a Sides<D>,
    /// Where the distance is measured from: the points, or their feet on f̂ if they are noisy.
    pub sites: &'a [[f64; D]],
    pub domain: &'a Domain<D>,
    /// From the coarsest lattice to the dense one.
    pub halvings: u32,
    pub memory: &'a MemoryReport,
    pub options: &'a Options,
}

/// What comes of it.
pub struct Signed<const D: usize> {
    /// At the nodes of the dense lattice.
    pub phi: ArrayD<f64>,
    /// Its absolute value.
    pub distance: ArrayD<f64>,
    /// Which of the points lie on no part of the surface.
    pub off: Vec<bool>,
    /// Whether there are holes that memory did not suffice to close with their curvature.
    pub no_room: bool,
}

impl<const D: usize> SignStage<'_, D> {
    /// Gives `distance`, from the sites, its sign.
    ///
    /// # Errors
    /// If the lattice is not valid.
    pub fn run(&self, distance: ArrayD<f64>) -> Result<(Signed<D>, StageFigures), ReconstructError> {
        let Self { sides, domain, halvings, options, .. } = *self;
        let Sides { f_hat, points, spacing, ratio, noise, .. } = sides;
        let (cell, nodes) = (domain.spacing(halvings), domain.nodes(halvings));
        // Data support the zero set where they lie within a cell and a spacing of both ends of a lattice edge.
        let reach = |spacing: f64| 1.5 * cell.max(spacing) + cell;

        let (few, few_spacing) = sides.few();
        let mut field = match sides.agreed {
            true => SignField::of(f_hat, domain, halvings),
            false => sign_field(f_hat, few, few_spacing, domain, halvings, &distance, sides.calibration)?,
        };
        let (mut phi, mut report) = synthesize(&field, &distance, reach(spacing.typical));
        let mut places = crossings(&field.value, &phi, &nodes);
        let detail = cell.max(ratio * spacing.typical);
        let closeness = Closeness { points, local: &spacing.local, detail, noise: *noise };
        let off = closeness.off_the_surface(&places);
        let sites = kept(self.sites, &off);
        let mut no_room = false;
        // What is left open needs no filling, and where noise is deep what is far from all points may well be f̂'s mistake.
        if !options.open && *noise < FILLABLE_NOISE * spacing.typical {
            match fill_holes(&mut field, &places, &sites, (f_hat, *ratio), (domain, halvings), self.memory)? {
                Filling::Filled(nodes_filled) => {
                    let (filled, found) = synthesize(&field, &distance, reach(spacing.typical));
                    let crossed = crossings(&field.value, &filled, &nodes);
                    // Unless little is left of a shape that was all hole.
                    if closeness.is_kept(&crossed, &places) {
                        (phi, report, places) = (filled, SignReport { nodes_filled, ..found }, crossed);
                    }
                }
                Filling::NoRoom => no_room = true,
                Filling::NoHoles => {}
            }
        }
        // Between sparse points it runs where points are, too.
        let local = LazyCell::new(|| spacing.smoothed(points));
        report.supported = supported_share(&places, points, reach(spacing.typical), |i| reach(local[i]));
        let gaps = gaps(&places, &sites, cell.max(spacing.typical));
        let distance = if gaps.is_empty() && sites.len() == points.len() {
            distance
        } else {
            let (distance, _) = unsigned_distance(&[sites, gaps].concat(), domain, halvings, options)?;
            phi.zip_mut_with(&distance, |phi, d| *phi = d.copysign(*phi));
            distance
        };
        Ok((Signed { phi, distance, off, no_room }, StageFigures::Sign(report)))
    }
}

/// The distance from the points at the nodes of the dense lattice.
///
/// # Errors
/// If the lattice is not valid.
pub fn unsigned_distance<const D: usize>(
    points: &[[f64; D]],
    domain: &Domain<D>,
    halvings: u32,
    options: &Options,
) -> Result<(ArrayD<f64>, StageFigures), ReconstructError> {
    let shape = domain.cells(halvings).map(|cells| cells + 1);
    let lattice = Lattice::new(domain.lower, domain.spacing(halvings), shape)?;
    let settings = eikonal_sweep::Options { method: options.distance, ..eikonal_sweep::Options::default() };
    let distance = eikonal_sweep::distance(points, &lattice, &settings)?;
    let report = DistanceReport {
        nodes: shape.to_vec(),
        sweeps: distance.report.sweeps,
        last_change: distance.report.last_change,
    };
    Ok((distance.values, StageFigures::Distance(report)))
}
