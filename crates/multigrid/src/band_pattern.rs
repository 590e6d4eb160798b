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

    /// Where the entry of a column and a row (not before it in C order, and within the band) is stored.
    pub(crate) fn position(&self, column: &[usize; D], row: &[usize; D]) -> usize {
        let (lower, upper) = self.window(column);
        let rank =
            |index: &[usize; D]| (0..D).fold(0, |rank, a| rank * (upper[a] - lower[a] + 1) + (index[a] - lower[a]));
        self.columns[self.flat(column)] + rank(row) - rank(column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_ascend_and_positions_find_them() {
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
            for (k, &row) in rows.iter().enumerate() {
                assert_eq!(pattern.position(&c, &pattern.multi_index(row)), pattern.columns[column] + k);
            }
        }
    }
}
