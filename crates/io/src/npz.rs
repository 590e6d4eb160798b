//! `.npz` archives read from bytes, with a bound on what they may unpack to.

use std::io::{Cursor, Read};

use ndarray::{ArrayD, Ix1};
use zip::ZipArchive;
use zip::result::ZipError;

use crate::npy;
use crate::read_error::Malformed;

/// What an archive may unpack to: this many bytes and [`LARGEST_RATIO`] times its own size. Deflate can blow up a file a
/// thousandfold; coefficients of a real spline shrink to a half at best.
const ALWAYS_ALLOWED: u64 = 64 << 20;
const LARGEST_RATIO: u64 = 64;

/// An archive of NumPy arrays.
pub(crate) struct NpzArchive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    left: u64,
}

impl<'a> NpzArchive<'a> {
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self, Malformed> {
        let zip = ZipArchive::new(Cursor::new(bytes))
            .map_err(|error| Malformed::file(format!("not an .npz archive: {error}")))?;
        Ok(Self { zip, left: ALWAYS_ALLOWED + LARGEST_RATIO * bytes.len() as u64 })
    }

    /// The array `name` of f32 or f64.
    pub(crate) fn floats(&mut self, name: &str) -> Result<ArrayD<f64>, Malformed> {
        npy::parse_floats(&self.unpack(name)?).map_err(|problem| Malformed::file(format!("{name}: {problem}")))
    }

    /// The array `name` of 32- or 64-bit integers.
    pub(crate) fn integers(&mut self, name: &str) -> Result<ArrayD<i64>, Malformed> {
        npy::parse_integers(&self.unpack(name)?).map_err(|problem| Malformed::file(format!("{name}: {problem}")))
    }

    /// The one-dimensional array `name` of f32 or f64.
    pub(crate) fn vector(&mut self, name: &str) -> Result<Vec<f64>, Malformed> {
        let array = self.floats(name)?;
        let axes = array.ndim();
        let array = array
            .into_dimensionality::<Ix1>()
            .map_err(|_| Malformed::file(format!("{name} has {axes} axes; 1 is needed")))?;
        Ok(array.to_vec())
    }

    /// The bytes of one member, read step by step: what the archive claims about its size is not believed.
    fn unpack(&mut self, name: &str) -> Result<Vec<u8>, Malformed> {
        let member = match self.zip.by_name(&format!("{name}.npy")) {
            Ok(member) => member,
            Err(ZipError::FileNotFound) => return Err(Malformed::file(format!("the archive has no entry {name:?}"))),
            Err(error) => return Err(Malformed::file(format!("{name}: {error}"))),
        };
        let mut bytes = Vec::new();
        member
            .take(self.left.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(|error| Malformed::file(format!("{name}: {error}")))?;
        self.left = self
            .left
            .checked_sub(bytes.len() as u64)
            .ok_or_else(|| Malformed::file(format!("{name}: the archive unpacks to more than is allowed here")))?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use ndarray_npy::NpzWriter;

    use super::*;

    #[test]
    fn an_archive_that_unpacks_a_thousandfold_is_refused() {
        let mut npz = NpzWriter::new_compressed(Cursor::new(Vec::new()));
        npz.add_array("small", &ndarray::arr1(&[1.0, 2.0])).unwrap();
        // 128 MiB of zeros in some 130 kB.
        npz.add_array("bomb", &ndarray::Array1::<f64>::zeros(16 << 20)).unwrap();
        let bytes = npz.finish().unwrap().into_inner();
        assert!(bytes.len() < 1 << 20);
        let mut archive = NpzArchive::open(&bytes).unwrap();
        assert_eq!(archive.vector("small").unwrap(), [1.0, 2.0]);
        let error = archive.vector("bomb").unwrap_err();
        assert!(error.problem.contains("unpacks to more"), "{error}");
    }
}
