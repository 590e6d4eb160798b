use crate::winding::Winding;
use crate::winding_error::{WindingError, check};

/// How W is summed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// ε, in the unit of the points, at least 0: ε² is added to every squared distance. Default 0.
    pub regularisation: f64,
    /// The absolute error of W that is aimed at, above 0; see the crate's front page for what is guaranteed. Default 1e-3.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { regularisation: 0.0, tolerance: 1e-3 }
    }
}

/// Points in the order of a tree of boxes: what does not depend on normals.
#[derive(Debug, Clone)]
pub struct Tree<const D: usize> {
    pub(crate) options: Options,
    pub(crate) points: Vec<[f64; D]>,
}

impl<const D: usize> Tree<D> {
    /// The tree of `points` (`N × D`, any number, also equal ones).
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond 1e60, options out of range, more than 2³² − 1 points.
    pub fn new(points: &[[f64; D]], options: Options) -> Result<Self, WindingError> {
        const { assert!(D == 2 || D == 3, "winding numbers are for curves in 2D and surfaces in 3D") }
        check_options(&options)?;
        check("point", points)?;
        Ok(Self { options, points: points.to_vec() })
    }

    /// W for the area vectors `aᵢ nᵢ` (`N × D`, in the order of the points given to [`Tree::new`]; length in 2D, area in
    /// 3D), n outward where W shall be 1 inside.
    ///
    /// # Errors
    /// Another number of area vectors than of points; a component that is not finite or beyond 1e60.
    pub fn with_normals(&self, area_vectors: &[[f64; D]]) -> Result<Winding<'_, D>, WindingError> {
        if area_vectors.len() != self.points.len() {
            return Err(WindingError::CountMismatch { points: self.points.len(), area_vectors: area_vectors.len() });
        }
        check("area vector", area_vectors)?;
        Ok(Winding { tree: self, area_vectors: area_vectors.to_vec() })
    }
}

fn check_options(options: &Options) -> Result<(), WindingError> {
    let Options { regularisation, tolerance } = *options;
    if !(0.0..=crate::LARGEST).contains(&regularisation) {
        return Err(WindingError::Option { option: "regularisation", value: regularisation, range: "0 to 1e60" });
    }
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(WindingError::Option { option: "tolerance", value: tolerance, range: "above 0 and finite" });
    }
    Ok(())
}
