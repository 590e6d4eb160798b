//! The spline file: an `.npz` archive that NumPy opens and SciPy's `NdBSpline` evaluates.

pub(crate) mod level;

use std::io;
use std::path::Path;

use ndarray::{ArrayD, Dimension, arr0, aview1};
use ndarray_npy::NpzWriter;
use zip::CompressionMethod;
use zip::write::SimpleFileOptions;

use crate::extension::{SPLINE_EXTENSIONS, extension_among};
use crate::npz::NpzArchive;
use crate::points::read_bytes;
use crate::read_error::{Malformed, ReadError};
use crate::replace_file::replace_file;
use crate::spline::level::SplineLevel;
use crate::write_error::WriteError;

/// The highest version that is read. It rises when a file may no longer be read as if the new entries were not there: version 1
/// is a dense spline, 2 one with levels. The lowest that will do is written.
pub const SPLINE_VERSION: i64 = 2;

const DENSE_VERSION: i64 = 1;

const KNOTS: [&str; 3] = ["knots_x", "knots_y", "knots_z"];

/// A tensor-product B-spline in the plane or in space, as it is stored (paper eq. 1).
///
/// The function at a point X of the data is `Σ c[i, j, …] B_i(X₁ − origin₁) B_j(X₂ − origin₂) …`, the root, plus the same sum for
/// every level over its own functions and coefficients.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SplineFile {
    /// What is subtracted from a point before the knots are looked up, data units, `D`; 0 unless coordinates are large.
    pub origin: Vec<f64>,
    /// One knot vector per axis, non-decreasing, data units relative to `origin`; all knots, the outer ones included.
    pub knots: Vec<Vec<f64>>,
    /// The degree along every axis, 1 to 5.
    pub degree: usize,
    /// The control coefficients, axis order x, y\[, z\]; along each axis `knots − degree − 1` of them, in the data's length unit.
    pub coefficients: ArrayD<f64>,
    /// Level 1, 2, …, if the degree is 3 and all knots are uniform; each on knots halved once more.
    pub levels: Vec<SplineLevel>,
    /// Whether the zero set was wanted only where the points are, which the function itself does not tell.
    pub open: bool,
}

impl SplineFile {
    /// Puts the parts of a dense spline together.
    ///
    /// # Errors
    /// [`Malformed`] in words of the file's entries: axes, lengths or shapes that do not fit, a knot vector that falls or spans
    /// no cell, a number that is not finite, a degree outside 1 to 5.
    pub fn new(
        origin: Vec<f64>,
        knots: Vec<Vec<f64>>,
        degree: usize,
        coefficients: ArrayD<f64>,
    ) -> Result<Self, Malformed> {
        let spline = Self { origin, knots, degree, coefficients, levels: vec![], open: false };
        match spline.problem() {
            Some(problem) => Err(Malformed::file(problem)),
            None => Ok(spline),
        }
    }

    /// The same spline with these levels. Whether its knots are uniform, and the supports of each level lie within those of the
    /// level above, is not checked here.
    ///
    /// # Errors
    /// [`Malformed`] in words of the file's entries: a degree other than 3, lengths or shapes that do not fit, indices that the
    /// lattice does not have or that come twice, more than two million functions along an axis, a number that is not finite.
    pub fn with_levels(self, levels: Vec<SplineLevel>) -> Result<Self, Malformed> {
        match level::problem(&levels, self.degree, self.coefficients.shape()) {
            Some(problem) => Err(Malformed::file(problem)),
            None => Ok(Self { levels, ..self }),
        }
    }

    /// The same spline with its zero set wanted only where the points are, or not.
    #[must_use]
    pub fn with_open(self, open: bool) -> Self {
        Self { open, ..self }
    }

    /// The number of axes, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.knots.len()
    }

    fn problem(&self) -> Option<String> {
        let (d, p) = (self.knots.len(), self.degree);
        if !matches!(d, 2 | 3) {
            return Some(format!("a spline of {d} axes; 2 or 3 are known"));
        }
        if !(1..=5).contains(&p) {
            return Some(format!("degree {p}; 1 to 5 are known"));
        }
        if self.origin.len() != d {
            return Some(format!("origin has {} numbers for {d} axes", self.origin.len()));
        }
        if self.coefficients.ndim() != d {
            return Some(format!("coefficients have {} axes, the knots {d}", self.coefficients.ndim()));
        }
        if let Some(bad) = self.origin.iter().find(|c| !c.is_finite()) {
            return Some(format!("origin holds {bad}"));
        }
        for ((name, knots), &count) in KNOTS.iter().zip(&self.knots).zip(self.coefficients.shape()) {
            if let Some(bad) = knots.iter().find(|t| !t.is_finite()) {
                return Some(format!("{name} holds {bad}"));
            }
            if let Some((at, (from, to))) = (1..).zip(knots.iter().zip(knots.iter().skip(1))).find(|(_, (a, b))| a > b)
            {
                return Some(format!("{name} falls from {from} to {to} at entry {at}"));
            }
            let n = knots.len().saturating_sub(p + 1);
            if n <= p {
                return Some(format!("{name} has {} knots; degree {p} needs at least {}", knots.len(), 2 * (p + 1)));
            }
            if n != count {
                return Some(format!(
                    "{name} has {} knots, which asks for {n} coefficients of degree {p} along that axis; there are {count}",
                    knots.len()
                ));
            }
            if let (Some(from), Some(to)) = (knots.get(p), knots.get(n))
                && from >= to
            {
                return Some(format!("{name} spans no cell: its interval is from {from} to {to}"));
            }
        }
        // Iterating without indices is many times faster.
        if self.coefficients.iter().all(|c| c.is_finite()) {
            return level::problem(&self.levels, p, self.coefficients.shape());
        }
        let (index, c) = self.coefficients.indexed_iter().find(|(_, c)| !c.is_finite())?;
        Some(format!("coefficient {:?} is {c}", index.slice()))
    }
}

/// Writes a spline as `.npz`: `version`, `origin`, `degree`, `knots_x`, `knots_y`\[, `knots_z`\], `coefficients`, and where there are
/// levels `levels`, `level1_index`, `level1_coefficients`, …, and `open` if it is. Only indices are compressed: coefficients would
/// shrink by little.
///
/// # Errors
/// [`WriteError`]; parts that do not fit are refused, and the file at `path` is replaced only when everything was written.
pub fn write_spline(path: impl AsRef<Path>, spline: &SplineFile) -> Result<(), WriteError> {
    let path = path.as_ref();
    extension_among(path, SPLINE_EXTENSIONS)?;
    if let Some(problem) = spline.problem() {
        return Err(WriteError::Invalid { path: path.to_owned(), problem });
    }
    let degree = spline.degree as i64;
    let coefficients = spline.coefficients.as_standard_layout();
    replace_file(path, |out| {
        let mut npz = NpzWriter::new(out);
        // Scalars are 0-dimensional: SciPy takes such a degree for all axes.
        let version = if spline.levels.is_empty() { DENSE_VERSION } else { SPLINE_VERSION };
        npz.add_array("version", &arr0(version)).map_err(io::Error::other)?;
        npz.add_array("origin", &aview1(&spline.origin)).map_err(io::Error::other)?;
        npz.add_array("degree", &arr0(degree)).map_err(io::Error::other)?;
        for (name, knots) in KNOTS.iter().zip(&spline.knots) {
            npz.add_array(*name, &aview1(knots)).map_err(io::Error::other)?;
        }
        npz.add_array("coefficients", &coefficients).map_err(io::Error::other)?;
        if !spline.levels.is_empty() {
            npz.add_array("levels", &arr0(spline.levels.len() as i64)).map_err(io::Error::other)?;
        }
        // Higher levels take three times as long for the same size.
        let compressed =
            SimpleFileOptions::default().compression_method(CompressionMethod::Deflated).compression_level(Some(3));
        for (k, level) in (1..).zip(&spline.levels) {
            let [index, coefficients] = level::entries(k);
            npz.add_array_with_options(index, &level.index, compressed).map_err(io::Error::other)?;
            npz.add_array(coefficients, &aview1(&level.coefficients)).map_err(io::Error::other)?;
        }
        if spline.open {
            npz.add_array("open", &arr0(1_i64)).map_err(io::Error::other)?;
        }
        npz.finish().map(drop).map_err(io::Error::other)
    })
}

/// Reads a spline from `.npz`, compressed or not. Entries that this version does not know are left alone.
///
/// # Errors
/// [`ReadError`]; every shape and number is checked as in [`SplineFile::new`], and sizes before anything is allocated.
pub fn read_spline(path: impl AsRef<Path>) -> Result<SplineFile, ReadError> {
    let path = path.as_ref();
    extension_among(path, SPLINE_EXTENSIONS)?;
    parse_spline(&read_bytes(path)?).map_err(|malformed| ReadError::Malformed { path: path.to_owned(), malformed })
}

/// Reads a spline from the bytes of a whole `.npz` file.
///
/// # Errors
/// [`Malformed`], as [`read_spline`] has it, without a path.
pub fn parse_spline(bytes: &[u8]) -> Result<SplineFile, Malformed> {
    let mut archive = NpzArchive::open(bytes)?;
    let version = archive.integer("version")?;
    if !(DENSE_VERSION..=SPLINE_VERSION).contains(&version) {
        return Err(Malformed::file(format!(
            "spline files of version {version} are not known here, only up to {SPLINE_VERSION}; a newer zeroset reads them"
        )));
    }
    let count = match version {
        // Whoever added levels to such a file must say so, for a reader that does not know them.
        DENSE_VERSION if archive.has("level1_index") => {
            return Err(Malformed::file(
                "the archive has an entry \"level1_index\" but is of version 1; levels need version 2",
            ));
        }
        DENSE_VERSION => 0,
        _ => archive.integer("levels")?,
    };
    if count < 0 {
        return Err(Malformed::file(format!("levels is {count}")));
    }
    let origin = archive.vector("origin")?;
    if !matches!(origin.len(), 2 | 3) {
        return Err(Malformed::file(format!("origin has {} numbers; 2 or 3 are known", origin.len())));
    }
    let degrees = archive.integers("degree")?;
    let degree = match degrees.iter().next() {
        // One for all axes, or the same for each.
        Some(&first) if degrees.len() <= origin.len() && degrees.iter().all(|d| *d == first) => {
            usize::try_from(first).map_err(|_| Malformed::file(format!("degree {first}; 1 to 5 are known")))?
        }
        _ => return Err(Malformed::file(format!("degree is {degrees}; one number for all axes is needed"))),
    };
    let knots = KNOTS.iter().take(origin.len()).map(|name| archive.vector(name)).collect::<Result<_, _>>()?;
    let root = SplineFile::new(origin, knots, degree, archive.floats("coefficients")?)?;
    let mut levels = Vec::new();
    for k in 1..=count as usize {
        let [index, coefficients] = level::entries(k);
        levels.push(SplineLevel { index: archive.indices(&index)?, coefficients: archive.vector(&coefficients)? });
    }
    let open = if archive.has("open") { archive.integer("open")? } else { 0 };
    let open = match open {
        0 => false,
        1 => true,
        other => return Err(Malformed::file(format!("open is {other}; 0 and 1 are known"))),
    };
    Ok(root.with_levels(levels)?.with_open(open))
}
