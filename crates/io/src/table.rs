//! What a function is worth at query points: `.csv`, `.txt` and `.npy`.

use std::io::{self, Write};
use std::path::Path;

use ndarray::Array2;
use ndarray_npy::WriteNpyExt;

use crate::extension::{TABLE_EXTENSIONS, extension_among};
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// Value, gradient and Hessian at `N` query points. NaN stands for points outside the function's box.
#[derive(Debug, Clone, Copy)]
pub struct EvaluationTable<'a, const D: usize> {
    /// The query points, `N × D`, data units.
    pub points: &'a [[f64; D]],
    /// f, `N`.
    pub values: &'a [f64],
    /// ∇f, `N × D`; empty where it was not asked for.
    pub gradients: &'a [[f64; D]],
    /// The symmetric Hessian of f, `N × D × D`; empty where it was not asked for.
    pub hessians: &'a [[[f64; D]; D]],
    /// The signed distance from `f = 0`, `N`, data units; empty where it was not asked for.
    pub distances: &'a [f64],
}

impl<const D: usize> EvaluationTable<'_, D> {
    /// The names of the columns: `x y [z] f`, then `fx fy [fz]`, then `fxx fxy [fxz] fyy [fyz fzz]`, then `distance`.
    pub fn columns(&self) -> Vec<String> {
        let axes = || ["x", "y", "z"].into_iter().take(D);
        let mut names: Vec<String> = axes().map(Into::into).collect();
        names.push("f".into());
        if !self.gradients.is_empty() {
            names.extend(axes().map(|a| format!("f{a}")));
        }
        if !self.hessians.is_empty() {
            names.extend(axes().enumerate().flat_map(|(k, a)| axes().skip(k).map(move |b| format!("f{a}{b}"))));
        }
        if !self.distances.is_empty() {
            names.push("distance".into());
        }
        names
    }

    fn problem(&self) -> Option<String> {
        let n = self.points.len();
        [
            ("values", self.values.len(), true),
            ("gradients", self.gradients.len(), false),
            ("Hessians", self.hessians.len(), false),
            ("distances", self.distances.len(), false),
        ]
        .into_iter()
        .find(|(_, count, needed)| *count != n && (*needed || *count != 0))
        .map(|(name, count, _)| format!("{n} points but {count} {name}"))
    }

    fn row(&self, i: usize, row: &mut Vec<f64>) {
        row.clear();
        row.extend(self.points.get(i).into_iter().flatten());
        row.extend(self.values.get(i));
        row.extend(self.gradients.get(i).into_iter().flatten());
        if let Some(hessian) = self.hessians.get(i) {
            row.extend(hessian.iter().enumerate().flat_map(|(a, derivatives)| derivatives.iter().skip(a)));
        }
        row.extend(self.distances.get(i));
    }
}

/// Writes a table as `.csv` (a header line, commas), `.txt` (the header behind `#`, blanks: `np.loadtxt` reads it) or `.npy`
/// (`N × k`, f64, the columns of [`EvaluationTable::columns`]). Decimals are the shortest that read back to the same f64.
///
/// # Errors
/// [`WriteError`]; lengths that differ are refused, and the file at `path` is replaced only when everything was written.
pub fn write_table<const D: usize>(path: impl AsRef<Path>, table: &EvaluationTable<'_, D>) -> Result<(), WriteError> {
    const { assert!(D == 2 || D == 3, "points lie in the plane or in space") }
    let path = path.as_ref();
    let extension = extension_among(path, TABLE_EXTENSIONS)?;
    if let Some(problem) = table.problem() {
        return Err(WriteError::Invalid { path: path.to_owned(), problem });
    }
    replace_file(path, |out| match extension {
        "csv" => write_text(out, table, "", ","),
        "txt" => write_text(out, table, "# ", " "),
        _ => write_npy(out, table),
    })
}

fn write_text<const D: usize>(
    out: &mut impl Write,
    table: &EvaluationTable<'_, D>,
    before_header: &str,
    separator: &str,
) -> io::Result<()> {
    writeln!(out, "{before_header}{}", table.columns().join(separator))?;
    let mut row = Vec::new();
    for i in 0..table.points.len() {
        table.row(i, &mut row);
        for (k, value) in row.iter().enumerate() {
            write!(out, "{}{value:?}", if k == 0 { "" } else { separator })?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn write_npy<const D: usize>(out: &mut impl Write, table: &EvaluationTable<'_, D>) -> io::Result<()> {
    let mut values = Vec::with_capacity(table.points.len() * table.columns().len());
    let mut row = Vec::new();
    for i in 0..table.points.len() {
        table.row(i, &mut row);
        values.extend_from_slice(&row);
    }
    let array =
        Array2::from_shape_vec((table.points.len(), table.columns().len()), values).map_err(io::Error::other)?;
    array.write_npy(out).map_err(io::Error::other)
}
