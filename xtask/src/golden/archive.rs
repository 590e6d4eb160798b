//! Reading NumPy archives.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use ndarray::{ArrayD, IxDyn, OwnedRepr};
use ndarray_npy::{NpzReader, ReadableElement};
use zeroset::bspline::KnotVector;

/// A `.npz` file.
pub struct Archive {
    path: PathBuf,
    reader: NpzReader<File>,
}

impl Archive {
    pub fn open(path: &Path) -> Result<Self> {
        let file =
            File::open(path).with_context(|| format!("{}: run `cargo xtask golden --regenerate`", path.display()))?;
        let reader = NpzReader::new(file).with_context(|| path.display().to_string())?;
        Ok(Self { path: path.to_owned(), reader })
    }

    pub fn array<T: ReadableElement>(&mut self, name: &str) -> Result<ArrayD<T>> {
        let array = self.reader.by_name::<OwnedRepr<T>, IxDyn>(name);
        array.with_context(|| format!("{name} of {}", self.path.display()))
    }

    pub fn list<T: ReadableElement + Clone>(&mut self, name: &str) -> Result<Vec<T>> {
        Ok(self.array(name)?.iter().cloned().collect())
    }

    pub fn number(&mut self, name: &str) -> Result<f64> {
        self.array(name)?.first().copied().with_context(|| format!("{name} of {} is empty", self.path.display()))
    }

    /// The knot vectors of case `k`.
    pub fn knots<const D: usize>(&mut self, k: usize) -> Result<[KnotVector; D]> {
        self.knots_named(&k.to_string())
    }

    /// The knot vectors of a case by its name.
    pub fn knots_named<const D: usize>(&mut self, k: &str) -> Result<[KnotVector; D]> {
        let degrees: Vec<i64> = self.list(&format!("{k}_degree"))?;
        let mut knots = Vec::with_capacity(D);
        for (axis, &degree) in degrees.iter().enumerate() {
            knots.push(KnotVector::new(usize::try_from(degree)?, self.list(&format!("{k}_knots_{axis}"))?)?);
        }
        knots.try_into().ok().with_context(|| format!("case {k} of {} has another dimension", self.path.display()))
    }
}
