//! Settings of a reconstruction.

use zeroset_eikonal_sweep::Method;

use crate::error::ReconstructError;

/// Settings of [`reconstruct`](crate::reconstruct). The defaults need no knob on ordinary data.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Cells along the longest side of the points' bounding box on the finest level, 8 to 1024; where the points are denser
    /// or sparser than usual, cells follow them. `None`: from the spacing of the points.
    pub resolution: Option<usize>,
    /// Degree of the B-splines, 2 to 5.
    pub degree: usize,
    /// How inside is told from outside.
    pub topology: Topology,
    /// Smoothing length ℓ of the final fit, in the data's unit: detail smaller than this is smoothed away. `None`: the
    /// iteration stops by itself.
    pub smoothing: Option<f64>,
    /// How the distance of section 4 is computed.
    pub distance: Method,
    /// Whether the curve or surface ends where its points do. If not it is closed: over holes, and over the open side of a
    /// bowl. The function is the same kind in both cases, with an inside; only what the points support is extracted.
    pub open: bool,
    /// Whether the initial shape (section 5) is refined by the dynamic reconstruction (section 2.3).
    pub refine: bool,
    /// Memory that the run may use, bytes. Where more would be needed there are fewer levels, with a warning. `None`: 70 % of what
    /// is free, or no limit where that is not known.
    pub memory: Option<u64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            resolution: None,
            degree: 3,
            topology: Topology::default(),
            smoothing: None,
            distance: Method::default(),
            open: false,
            refine: true,
            memory: None,
        }
    }
}

/// How inside is told from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Topology {
    /// The generalized eigenvector for θ = 1, made robust by continuation in the exponent p.
    #[default]
    Continuation,
    /// Section 3 of the paper as written: generalized eigenvectors with θ-reweighting alone.
    Paper,
}

impl Options {
    /// Refuses what is out of range.
    pub(crate) fn check(&self) -> Result<(), ReconstructError> {
        if !(2..=5).contains(&self.degree) {
            return Err(ReconstructError::Option(format!("degree {} is not possible: choose 2 to 5", self.degree)));
        }
        if let Some(cells) = self.resolution.filter(|cells| !(8..=1024).contains(cells)) {
            return Err(ReconstructError::Option(format!(
                "resolution {cells} is not possible: choose 8 to 1024 cells"
            )));
        }
        if let Some(length) = self.smoothing.filter(|length| !(length.is_finite() && *length > 0.0)) {
            return Err(ReconstructError::Option(format!(
                "a smoothing length of {length} is not possible: it must be positive"
            )));
        }
        Ok(())
    }
}
