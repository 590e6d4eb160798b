//! What can be reconstructed: points of the plane and points of space.

use zeroset_watch::Watch;

use crate::error::ReconstructError;
use crate::options::Options;
use crate::reconstruct::{Reconstruction, road};

/// A point that a curve (`[f64; 2]`) or a surface (`[f64; 3]`) can be reconstructed from. There are no others.
///
/// The road is compiled for the two in this crate, so that programs need not compile it again.
#[diagnostic::on_unimplemented(
    message = "curves are reconstructed from `[f64; 2]`, surfaces from `[f64; 3]`: not from `{Self}`"
)]
pub trait Point<const D: usize>: Reconstruct<D> {}

/// The road from such points to f*. Not exported: nobody else implements [`Point`].
pub trait Reconstruct<const D: usize>: Sized {
    fn reconstruct(
        points: &[Self],
        normals: Option<&[Self]>,
        options: &Options,
        watch: &Watch,
    ) -> Result<Reconstruction<D>, ReconstructError>;
}

impl Point<2> for [f64; 2] {}
impl Point<3> for [f64; 3] {}

impl Reconstruct<2> for [f64; 2] {
    fn reconstruct(
        points: &[Self],
        normals: Option<&[Self]>,
        options: &Options,
        watch: &Watch,
    ) -> Result<Reconstruction<2>, ReconstructError> {
        road(points, normals, options, watch)
    }
}

impl Reconstruct<3> for [f64; 3] {
    fn reconstruct(
        points: &[Self],
        normals: Option<&[Self]>,
        options: &Options,
        watch: &Watch,
    ) -> Result<Reconstruction<3>, ReconstructError> {
        road(points, normals, options, watch)
    }
}
