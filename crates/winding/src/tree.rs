use crate::direct_sum::sphere;
use crate::multi_index::Tables;
use crate::multipole::{Source, fields};
use crate::opening::{Ball, balls, openings};
use crate::partition::Partition;
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

/// The most points of a leaf: below, one expansion costs more than the points themselves.
const LEAF: usize = 32;

/// Points in the order of a tree of boxes: all that does not depend on normals.
#[derive(Debug, Clone)]
pub struct Tree<const D: usize> {
    pub(crate) options: Options,
    pub(crate) partition: Partition<D>,
    pub(crate) balls: Vec<Ball<D>>,
    pub(crate) tables: Tables,
}

impl<const D: usize> Tree<D> {
    /// The tree of `points` (`N × D`, any number, also equal ones).
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond [`crate::LARGEST`], options out of range, more than 2³² − 1 points.
    pub fn new(points: &[[f64; D]], options: Options) -> Result<Self, WindingError> {
        const { assert!(D == 2 || D == 3, "winding numbers are for curves in 2D and surfaces in 3D") }
        check_options(&options)?;
        check("point", points)?;
        let partition = Partition::new(points, LEAF);
        let balls = balls(&partition);
        Ok(Self { options, partition, balls, tables: Tables::new::<D>() })
    }

    /// W for the area vectors `aᵢ nᵢ` (`N × D`, in the order of the points given to [`Tree::new`]; aᵢ is a length in 2D, an
    /// area in 3D), with n outward where W shall be 1 inside.
    ///
    /// # Errors
    /// Another number of area vectors than of points; a component that is not finite or beyond [`crate::LARGEST`].
    pub fn with_normals(&self, area_vectors: &[[f64; D]]) -> Result<Winding<'_, D>, WindingError> {
        let partition = &self.partition;
        if area_vectors.len() != partition.points.len() {
            return Err(WindingError::CountMismatch {
                points: partition.points.len(),
                area_vectors: area_vectors.len(),
            });
        }
        check("area vector", area_vectors)?;
        let oriented = |(point, &index): (&[f64; D], &u32)| [*point, area_vectors[index as usize]];
        let sources: Vec<Source<D>> = partition.points.iter().zip(&partition.order).map(oriented).collect();
        let fields = fields(&self.tables, partition, &self.balls, &sources);
        let openings = openings(partition, &self.balls, &sources, self.options.tolerance);
        Ok(Winding { tree: self, sources, fields, openings, scale: 1.0 / sphere::<D>() })
    }

    /// ε².
    pub(crate) fn regular(&self) -> f64 {
        self.options.regularisation * self.options.regularisation
    }
}

fn check_options(options: &Options) -> Result<(), WindingError> {
    let Options { regularisation, tolerance } = *options;
    if !(0.0..=crate::LARGEST).contains(&regularisation) {
        return Err(WindingError::Option { option: "regularisation", value: regularisation, range: "0 to 1e50" });
    }
    if !(1e-12..=1.0).contains(&tolerance) {
        return Err(WindingError::Option { option: "tolerance", value: tolerance, range: "1e-12 to 1" });
    }
    Ok(())
}
