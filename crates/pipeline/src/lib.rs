//! Raw points in, a smooth implicit B-spline curve or surface out: no normals needed.
//!
//! [`reconstruct`] takes points on a closed curve (2D) or surface (3D) and returns a function f, a tensor-product
//! B-spline, negative inside, positive outside, and close to a signed distance near the points. [`extract_curve`] and
//! [`extract_surface`] give its zero set.
//!
//! ```
//! use zeroset::{Options, extract_curve, reconstruct};
//!
//! // Two hundred points on an ellipse with half axes 3 and 2, in no order and without normals.
//! let points: Vec<[f64; 2]> = (0..200)
//!     .map(|i| (f64::from(i * 77 % 200) / 200.0 * std::f64::consts::TAU).sin_cos())
//!     .map(|(s, c)| [3.0 * c, 2.0 * s])
//!     .collect();
//! let mut ellipse = reconstruct(&points, &Options::default())?;
//! let (curves, topology) = extract_curve(&mut ellipse)?;
//!
//! assert_eq!(curves.loops.len(), 1);
//! assert!((topology.area - 6.0 * std::f64::consts::PI).abs() < 0.01);
//! let (origin, f) = ellipse.in_data_units()?;
//! assert!(f.value(&[0.5 - origin[0], 0.5 - origin[1]]) < 0.0, "inside");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The road
//!
//! One direction, one crate per step; each is usable by itself.
//!
//! | step | crate | in the paper |
//! |---|---|---|
//! | points → [`Frame`], [`Spacing`], [`Domain`] | here | |
//! | → f̂, a spline whose sign is right | [`gefm`] | section 3 |
//! | → d, distance on a lattice | [`eikonal_sweep`] | section 4 |
//! | → φ = sign(f̂) · d, cleaned | here | equation (14) |
//! | → f̄, the initial shape | [`lsq_init`] | equation (15) |
//! | → f*, the dynamic reconstruction | [`trust_region`] | section 2.3 |
//! | → curve or mesh | [`isosurface`] | |
//!
//! **Guaranteed.** The zero set is extracted closed, manifold and outward, or, with [`Options::open`], manifold with a boundary
//! that follows the sampling; the same bytes for any number of threads; the [`Report`] says what was not covered by data.
//!
//! **Not here.** Sharp creases (they are rounded over about a cell), files (see
//! `zeroset-io`).

mod distance;
mod error;
mod ground;
mod lattice;
mod memory;
mod options;
mod phi;
mod point;
mod points;
mod reconstruct;
mod refinement;
mod report;
mod sides;
mod topology;
mod trust;
mod warnings;
mod zero_set;

pub use distance::calibration::DistanceFigures;
pub use distance::signed_distance::SignedDistance;
pub use error::{InputError, ReconstructError};
pub use lattice::cell_widths::coarse_cells;
pub use lattice::domain::Domain;
pub use memory::{MemoryReport, extraction_need, memory_limit};
pub use options::{Normals, Options, Topology};
pub use phi::crossings::{Closeness, crossings, gaps};
pub use phi::sign::{SignReport, synthesize};
pub use phi::sign_field::{SignField, sign_field};
pub use point::Point;
pub use points::frame::Frame;
pub use points::heavy_tails::HeavyTails;
pub use points::lines::Lines;
pub use points::rows::rows;
pub use points::spacing::Spacing;
pub use reconstruct::{Reconstruction, reconstruct, reconstruct_watched, reconstruct_with_normals};
pub use report::{
    DistanceReport, ExtractionReport, FrameReport, InputReport, REPORT_VERSION, Report, StageFigures, StageReport,
    TrustReport,
};
pub use topology::fragile::FragilePlace;
pub use topology::simplified::SimplificationReport;
pub use trust::confidence::RegionReport;
pub use trust::oriented::OrientedPoint;
pub use trust::{NO_TRUST, SOME_DOUBT};
pub use zero_set::extraction::{Figures, extract_curve, extract_surface};
pub use zero_set::samples_around::SamplesAround;

pub use zeroset_bspline as bspline;
pub use zeroset_eikonal_sweep as eikonal_sweep;
pub use zeroset_gefm as gefm;
pub use zeroset_isosurface as isosurface;
pub use zeroset_lsq_init as lsq_init;
pub use zeroset_trust_region as trust_region;
pub use zeroset_watch::{CancelToken, Cancelled, Progress, Watch};
