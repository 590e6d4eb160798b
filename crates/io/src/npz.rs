//! `.npz` archives read from bytes, with a bound on what they may unpack to.

use std::io::{Cursor, Read};

use ndarray::{Array, Array2, ArrayD, Dimension, Ix1};
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

    /// The one number in the integer array `name`.
    pub(crate) fn integer(&mut self, name: &str) -> Result<i64, Malformed> {
        let array = self.integers(name)?;
        match array.iter().next() {
            Some(number) if array.len() == 1 => Ok(*number),
            _ => Err(Malformed::file(format!("{name} has {} numbers; 1 is needed", array.len()))),
        }
    }

    /// The two-dimensional array `name` of 32- or 64-bit integers.
    pub(crate) fn indices(&mut self, name: &str) -> Result<Array2<i32>, Malformed> {
        let array = npy::parse_indices(&self.unpack(name)?);
        with_axes(name, array.map_err(|problem| Malformed::file(format!("{name}: {problem}")))?)
    }

    /// The one-dimensional array `name` of f32 or f64.
    pub(crate) fn vector(&mut self, name: &str) -> Result<Vec<f64>, Malformed> {
        Ok(with_axes::<_, Ix1>(name, self.floats(name)?)?.to_vec())
    }

    /// Whether there is an entry `name`.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.zip.index_for_name(&format!("{name}.npy")).is_some()
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

fn with_axes<T, D: Dimension>(name: &str, array: ArrayD<T>) -> Result<Array<T, D>, Malformed> {
    let axes = array.ndim();
    let needed = D::NDIM.unwrap_or(axes);
    array.into_dimensionality().map_err(|_| {
        Malformed::file(format!("{name} has {axes} axes; {needed} {} needed", if needed == 1 { "is" } else { "are" }))
    })
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
