//! The report: what was done, stage by stage, and how far to trust it.

use serde::Serialize;

use crate::distance::calibration::DistanceFigures;
use crate::memory::MemoryReport;
use crate::phi::sign::SignReport;
use crate::points::heavy_tails::HeavyTails;
use crate::topology::fragile::FragilePlace;
use crate::topology::simplified::SimplificationReport;
use crate::trust::confidence::RegionReport;
use crate::zero_set::extraction::Figures;

/// Version of the report's schema.
pub const REPORT_VERSION: u32 = 1;

/// Everything worth knowing about a reconstruction.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Version of this schema.
    pub version: u32,
    /// The points.
    pub input: InputReport,
    /// How data and frame coordinates are related.
    pub frame: FrameReport,
    /// Memory allowed and needed.
    pub memory: MemoryReport,
    /// The stages in the order in which they ran.
    pub stages: Vec<StageReport>,
    /// How far the sides can be trusted.
    pub trust: TrustReport,
    /// How far the function is a signed distance.
    pub distance: DistanceFigures,
    /// What a user should know before trusting the result.
    pub warnings: Vec<String>,
    /// Why the result is not to be trusted, if it is not, and what to try.
    pub doubt: Option<String>,
}

/// What winding numbers say of the final function.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrustReport {
    /// The verdict on f*.
    pub judgement: zeroset_gefm::Judgement,
    /// Its score, without what the points' noise adds to that of right sides: what trust depends on.
    pub score: f64,
    /// Share of the points whose side is unsure.
    pub unsure: f64,
    /// Share of the fitted points that lie farther from the zero set than the rest of the data explains.
    pub misfit: f64,
    /// Points that lie off the zero set together.
    pub off: OffReport,
    /// Mean distance of the fitted points from the zero set over its root mean square ([`zeroset_gefm::layers`]): 0.8 for noise, above
    /// 0.88 where they lie in two layers rather than around it; none where there is too little noise to say.
    pub layers: Option<f64>,
    /// Share of the points where the gradient is shorter than 0.3 of its mean: inside and outside are hardly told apart.
    pub flat: f64,
    /// Where the topology of a closed curve or surface hangs on less than the points can tell, the least sure first.
    pub fragile: Vec<FragilePlace>,
    /// The same as `unsure` part by part, the least sure first.
    pub regions: Vec<RegionReport>,
}

/// Points around which half of the neighbours lie on one side of the zero set, farther than noise explains ([`zeroset_gefm::Patches`]):
/// a hole, a gap or a limb is smoothed over there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OffReport {
    /// How many there are, of those that winding numbers are asked at.
    pub points: usize,
    /// The one farthest from the zero set, in data coordinates.
    pub farthest: Option<Vec<f64>>,
}

/// The points that were given.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputReport {
    /// 2 or 3.
    pub dimension: usize,
    /// Points given.
    pub points: usize,
    /// Points that repeated an earlier one.
    pub repeated: usize,
    /// Points that lie on no surface with others; they were not fitted.
    pub outliers: usize,
    /// Typical distance between neighbouring points, in the data's unit.
    pub spacing: f64,
    /// How many means of the points were fitted in their place, where noise is deeper than they are apart.
    pub averaged: Option<usize>,
    /// Of points in lines (scan lines, slices, strokes), much closer along than across, how many are about as far apart as the spacing
    /// says; the others lie between them.
    pub in_lines: Option<usize>,
    /// Estimated standard deviation of the points' distances from their surface, in the data's unit; detail that is finer
    /// than the spacing counts as noise.
    pub noise: f64,
    /// How points far off have lost their weight, where their noise has heavy tails or a loss length was given.
    pub heavy_tails: Option<HeavyTails>,
}

/// The unit frame and its lattices.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameReport {
    /// Centre of the points' bounding box, in the data's unit: frame = (data − origin) · scale.
    pub origin: Vec<f64>,
    /// Frame units per data unit.
    pub scale: f64,
    /// Cells along each axis of the lattice on which topology is decided.
    pub coarse_cells: Vec<usize>,
    /// Cells along each axis of the final lattice.
    pub cells: Vec<usize>,
    /// Side of a cell of the final lattice, in the data's unit; refinement may add finer levels.
    pub cell: f64,
}

/// One stage.
#[derive(Debug, Clone, Serialize)]
pub struct StageReport {
    /// Wall time in seconds.
    pub seconds: f64,
    /// What the stage has to say.
    #[serde(flatten)]
    pub figures: StageFigures,
}

/// The figures of a stage, frame units unless they say otherwise.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "stage", rename_all = "kebab-case")]
pub enum StageFigures {
    /// Generalized eigenvector fitting as in section 3, once.
    Topology(zeroset_gefm::Report),
    /// Generalized eigenvector fitting at several smoothing lengths and on several lattices.
    Ladder(zeroset_gefm::LadderReport),
    /// Distance on the lattice, section 4.
    Distance(DistanceReport),
    /// Sign synthesis, equation (14).
    Sign(SignReport),
    /// Least-squares initial shape, equation (15).
    InitialShape(zeroset_lsq_init::Report),
    /// Dynamic reconstruction, section 2.3, on levels that follow the surface.
    Refinement(zeroset_trust_region::LevelsReport),
    /// Dynamic reconstruction on one lattice, for degrees other than 3.
    DenseRefinement(zeroset_trust_region::Report),
    /// Redistancing: unit slopes on the zero set.
    Redistancing(zeroset_trust_region::RedistanceReport),
    /// Handles and specks that go if the function changes by little.
    Simplification(SimplificationReport),
    /// Extraction of the zero set.
    Extraction(ExtractionReport),
}

impl StageFigures {
    /// The stage's name, as in the report.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Topology(_) => "topology",
            Self::Ladder(_) => "ladder",
            Self::Distance(_) => "distance",
            Self::Sign(_) => "sign",
            Self::InitialShape(_) => "initial-shape",
            Self::Refinement(_) => "refinement",
            Self::DenseRefinement(_) => "dense-refinement",
            Self::Redistancing(_) => "redistancing",
            Self::Simplification(_) => "simplification",
            Self::Extraction(_) => "extraction",
        }
    }
}

/// The distance stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DistanceReport {
    /// Nodes along each axis.
    pub nodes: Vec<usize>,
    /// Sweeps over the lattice.
    pub sweeps: usize,
    /// Largest change in the last sweep.
    pub last_change: f64,
}

/// The extraction stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtractionReport {
    /// Cells and decisions.
    #[serde(flatten)]
    pub found: zeroset_isosurface::Report,
    /// Share of the vertices farther from every point than four spacings, the typical one and the one around the nearest.
    pub unsupported: f64,
    /// Share of the points farther than two spacings from every vertex.
    pub uncovered: f64,
    /// The result, in the data's unit.
    #[serde(flatten)]
    pub zero_set: Figures,
}
