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
    /// What normals are good for, where the points have some: [`reconstruct_with_normals`](crate::reconstruct_with_normals).
    pub normals: Normals,
    /// Smoothing length ℓ, in the data's unit: detail smaller than this is smoothed away. It is that of the final fit, and with
    /// [`Topology::Continuation`] the first and longest by which the sides are sought. `None`: as the data suggest.
    pub smoothing: Option<f64>,
    /// Loss length of the final fit, in the data's unit: points that are farther off than their neighbours lose their weight from about this
    /// on, as in [`HeavyTails`](crate::HeavyTails). `None`: least squares, or where the noise has heavy tails the length that suits them.
    pub loss_length: Option<f64>,
    /// Room around the points in which the function is defined, at least, in the data's unit; up to half the longest side of their
    /// bounding box. `None`: one and a half of the coarsest cells.
    pub margin: Option<f64>,
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
            normals: Normals::default(),
            smoothing: None,
            loss_length: None,
            margin: None,
            distance: Method::default(),
            open: false,
            refine: true,
            memory: None,
        }
    }
}

/// What normals of the points are good for. Which way is out they never say: their common sign is found like that of any other
/// orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Normals {
    /// For nothing.
    Ignore,
    /// The search for the sides begins with them, and ends there if winding numbers agree; what is wrong among them is put right.
    #[default]
    Hint,
    /// They decide the sides, right or wrong. Winding numbers still say how far to trust the result.
    Trust,
}

/// How inside is told from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Topology {
    /// The generalized eigenvector for θ = 1, made robust by continuation in the exponent p.
    #[default]
    Continuation,
    /// Section 3 of the paper as written: generalized eigenvectors with θ-reweighting alone. Normals of the points are ignored.
    Paper,
}

impl Options {
    /// Refuses what is out of range whatever the points are, as every reconstruction does first.
    ///
    /// # Errors
    /// [`ReconstructError::Option`].
    pub fn check(&self) -> Result<(), ReconstructError> {
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
        if let Some(length) = self.loss_length.filter(|length| !(length.is_finite() && *length > 0.0)) {
            return Err(ReconstructError::Option(format!(
                "a loss length of {length} is not possible: it must be positive"
            )));
        }
        if let Some(margin) = self.margin.filter(|margin| !(margin.is_finite() && *margin >= 0.0)) {
            return Err(ReconstructError::Option(format!(
                "a margin of {margin} is not possible: it must not be negative"
            )));
        }
        Ok(())
    }

    /// The margin in the frame, whose longest side is 1.
    pub(crate) fn margin_in_frame(&self, scale: f64) -> Result<f64, ReconstructError> {
        let margin = self.margin.unwrap_or(0.0) * scale;
        if margin > 0.5 {
            return Err(ReconstructError::Option(format!(
                "a margin of {} is not possible: the longest side of the points is {}, and half of it is the most",
                self.margin.unwrap_or(0.0),
                1.0 / scale
            )));
        }
        Ok(margin)
    }
}
