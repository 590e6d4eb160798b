//! The finer levels of a spline file.

use ndarray::Array2;

/// The most basis functions along an axis of a level. Three such numbers are one of 63 bits.
const LARGEST_EXTENT: usize = 1 << 21;

/// Corrections on a finer lattice, as they are stored: `Σ δ_n B_n`, B cubic B-splines on the root's knots halved `k` times.
///
/// Halving puts a knot in the middle between neighbours. The lattice keeps the root's box and has three knots beyond it on each
/// side as the root has, so that an axis with `m` basis functions has `2 m − 3` on the next level.
#[derive(Debug, Clone, PartialEq)]
pub struct SplineLevel {
    /// Which basis functions have a coefficient, `N × D`: their numbers along each axis, from 0. In any order, none twice.
    pub index: Array2<i32>,
    /// Their coefficients δ, `N`, in the data's length unit.
    pub coefficients: Vec<f64>,
}

/// Names of the entries of level `k`, from 1.
pub(crate) fn entries(k: usize) -> [String; 2] {
    [format!("level{k}_index"), format!("level{k}_coefficients")]
}

/// What is wrong with the levels of a spline whose root has coefficients of the given shape.
pub(crate) fn problem(levels: &[SplineLevel], degree: usize, shape: &[usize]) -> Option<String> {
    if degree != 3 && !levels.is_empty() {
        return Some(format!("levels of a spline of degree {degree}; only those of degree 3 have levels"));
    }
    let mut extent = shape.to_vec();
    for (k, level) in (1..).zip(levels) {
        // At least four functions each.
        extent.iter_mut().for_each(|n| *n = 2 * *n - 3);
        if let Some(n) = extent.iter().find(|n| **n > LARGEST_EXTENT) {
            return Some(format!(
                "level {k} has {n} basis functions along an axis; at most {LARGEST_EXTENT} are known"
            ));
        }
        if let Some(problem) = level.problem(&entries(k), &extent) {
            return Some(problem);
        }
    }
    None
}

impl SplineLevel {
    fn problem(&self, [index, coefficients]: &[String; 2], extent: &[usize]) -> Option<String> {
        let (n, d) = self.index.dim();
        if d != extent.len() || n == 0 {
            return Some(format!("{index} has shape [{n}, {d}]; N × {} with N of at least 1 is needed", extent.len()));
        }
        if self.coefficients.len() != n {
            let found = self.coefficients.len();
            return Some(format!("{coefficients} has {found} numbers for the {n} rows of {index}"));
        }
        if let Some((at, bad)) = self.coefficients.iter().enumerate().find(|(_, c)| !c.is_finite()) {
            return Some(format!("{coefficients} holds {bad} at entry {at}"));
        }
        let mut keys = Vec::with_capacity(n);
        for (at, row) in self.index.rows().into_iter().enumerate() {
            let mut key = 0;
            for (&i, &n) in row.iter().zip(extent) {
                let Some(i) = usize::try_from(i).ok().filter(|i| *i < n) else {
                    return Some(format!("{index} holds {i} in row {at}; the lattice has functions 0 to {}", n - 1));
                };
                key = key * LARGEST_EXTENT as u64 + i as u64;
            }
            keys.push(key);
        }
        keys.sort_unstable();
        let (twice, _) = keys.iter().zip(keys.iter().skip(1)).find(|(key, next)| key == next)?;
        let row = |axis: usize| twice >> (21 * (d - 1 - axis)) & (LARGEST_EXTENT as u64 - 1);
        Some(format!("{index} names function {:?} twice", (0..d).map(row).collect::<Vec<_>>()))
    }
}
