//! The sparsity pattern of tensor-product bands.

/// Lower triangle, by columns, of the pairs of multi-indices that differ by at most a half bandwidth along each axis.
#[derive(Debug, Clone)]
pub(crate) struct BandPattern<const D: usize> {
    pub(crate) shape: [usize; D],
    half_bandwidth: [usize; D],
    /// Where each column begins, and the end.
    pub(crate) columns: Vec<usize>,
    pub(crate) rows: Vec<usize>,
}

impl<const D: usize> BandPattern<D> {
    pub(crate) fn new(shape: [usize; D], half_bandwidth: [usize; D]) -> Self {
        let size = shape.iter().product();
        let mut pattern = Self { shape, half_bandwidth, columns: vec![0], rows: Vec::new() };
        for column in 0..size {
            let index = pattern.multi_index(column);
            let (lower, upper) = pattern.window(&index);
            // In C order the rows from the diagonal on are exactly the lower triangle.
            let mut row = index;
            loop {
                pattern.rows.push(pattern.flat(&row));
                let Some(axis) = (0..D).rev().find(|&axis| row[axis] < upper[axis]) else { break };
                row[axis] += 1;
                row[axis + 1..].copy_from_slice(&lower[axis + 1..]);
            }
            pattern.columns.push(pattern.rows.len());
        }
        pattern
    }

    pub(crate) fn size(&self) -> usize {
        self.shape.iter().product()
    }

    pub(crate) fn multi_index(&self, mut flat: usize) -> [usize; D] {
        let mut index = [0; D];
        for axis in (0..D).rev() {
            index[axis] = flat % self.shape[axis];
            flat /= self.shape[axis];
        }
        index
    }

    fn flat(&self, index: &[usize; D]) -> usize {
        index.iter().zip(&self.shape).fold(0, |flat, (i, n)| flat * n + i)
    }

    /// First and last neighbour along each axis.
    fn window(&self, index: &[usize; D]) -> ([usize; D], [usize; D]) {
        (
            std::array::from_fn(|a| index[a].saturating_sub(self.half_bandwidth[a])),
            std::array::from_fn(|a| (index[a] + self.half_bandwidth[a]).min(self.shape[a] - 1)),
        )
    }

    /// Where the diagonal entry of a column is stored, and by how much the place of an entry grows with each index of its
    /// row: rows are stored in C order within the column's window.
    pub(crate) fn column(&self, column: &[usize; D]) -> (usize, [usize; D]) {
        let (lower, upper) = self.window(column);
        let mut strides = [1; D];
        for axis in (0..D - 1).rev() {
            strides[axis] = strides[axis + 1] * (upper[axis + 1] - lower[axis + 1] + 1);
        }
        (self.columns[self.flat(column)], strides)
    }

    /// Adds the lower triangle of `r rᵀ`, `r` being zero outside the box of `widths` indices from `first` and given
    /// there in C order. The box must fit into the band.
    pub(crate) fn add_outer_product(&self, entries: &mut [f64], first: &[usize; D], widths: &[usize; D], r: &[f64]) {
        self.add_columns(entries, first, widths, |k, from, entries| {
            for (entry, b) in entries.iter_mut().zip(&r[from..]) {
                *entry += r[k] * b;
            }
        });
    }

    /// Adds the lower triangle of a symmetric matrix that is zero outside the box of `widths` indices from `first`, and
    /// given there row after row.
    pub(crate) fn add_matrix(&self, entries: &mut [f64], first: &[usize; D], widths: &[usize; D], matrix: &[f64]) {
        let size: usize = widths.iter().product();
        self.add_columns(entries, first, widths, |k, from, entries| {
            for (entry, a) in entries.iter_mut().zip(&matrix[k * size + from..]) {
                *entry += a;
            }
        });
    }

    /// Calls `add` with the `k`-th index of a box, the number of another one and the entries of column `k` from that row on,
    /// one line along the last axis after the other.
    fn add_columns(
        &self,
        entries: &mut [f64],
        first: &[usize; D],
        widths: &[usize; D],
        add: impl Fn(usize, usize, &mut [f64]),
    ) {
        // Lines along the last axis are contiguous in every column.
        let width = widths[D - 1];
        let lines: usize = widths[..D - 1].iter().product();
        let lead = |line: usize| -> [usize; D] {
            let mut rest = line;
            let mut lead = [0; D];
            for axis in (0..D - 1).rev() {
                lead[axis] = rest % widths[axis];
                rest /= widths[axis];
            }
            lead
        };
        for k in 0..lines * width {
            let (line, last) = (k / width, k % width);
            let own = lead(line);
            let mut column: [usize; D] = std::array::from_fn(|axis| first[axis] + own[axis]);
            column[D - 1] += last;
            let (diagonal, strides) = self.column(&column);
            add(k, k, &mut entries[diagonal..diagonal + width - last]);
            for other in line + 1..lines {
                let lead = lead(other);
                // Later in C order, so that the sum is not negative although single steps may be.
                let ahead = (0..D - 1).fold(diagonal, |at, axis| at + lead[axis] * strides[axis])
                    - (0..D - 1).fold(last, |back, axis| back + own[axis] * strides[axis]);
                add(k, other * width, &mut entries[ahead..ahead + width]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_ascend_and_strides_find_them() {
        let pattern = BandPattern::new([4, 5, 3], [2, 3, 1]);
        for column in 0..pattern.size() {
            let rows = &pattern.rows[pattern.columns[column]..pattern.columns[column + 1]];
            assert_eq!(rows[0], column);
            assert!(rows.windows(2).all(|pair| pair[0] < pair[1]));
            let c = pattern.multi_index(column);
            let expected: Vec<usize> = (column..pattern.size())
                .filter(|&row| {
                    let r = pattern.multi_index(row);
                    (0..3).all(|a| r[a].abs_diff(c[a]) <= [2, 3, 1][a])
                })
                .collect();
            assert_eq!(rows, expected);
            let (diagonal, strides) = pattern.column(&c);
            for (k, &row) in rows.iter().enumerate() {
                let r = pattern.multi_index(row);
                let place = (0..3).fold(diagonal, |at, a| at + r[a] * strides[a])
                    - (0..3).fold(0, |b, a| b + c[a] * strides[a]);
                assert_eq!(place, pattern.columns[column] + k);
            }
        }
    }
}
