//! Gram matrices of one axis: inner products of basis functions and of their derivatives.

use crate::basis::Basis;
use crate::gauss_legendre::gauss_legendre;
use crate::knot_vector::KnotVector;

/// A symmetric banded matrix, stored by full rows.
#[derive(Debug, Clone, PartialEq)]
pub struct BandedMatrix {
    size: usize,
    half_bandwidth: usize,
    entries: Vec<f64>,
}

impl BandedMatrix {
    fn zeros(size: usize, half_bandwidth: usize) -> Self {
        Self { size, half_bandwidth, entries: vec![0.0; size * (2 * half_bandwidth + 1)] }
    }

    /// The Gram matrix `∫ N_r⁽ᵏ⁾ N_s⁽ᵏ⁾` of the `derivative`-th derivatives over the domain, integrated exactly (span by
    /// span, Gauss–Legendre): mass for 0, stiffness for 1, bending for 2.
    pub fn gram(knots: &KnotVector, derivative: usize) -> Self {
        let degree = knots.degree();
        let mut gram = Self::zeros(knots.basis_count(), degree);
        let rule = gauss_legendre(degree + 1);
        for (span, start, end) in knots.cells() {
            let half = 0.5 * (end - start);
            for &(node, weight) in &rule {
                let basis = Basis::in_span(knots, span, start + half * (1.0 + node), derivative);
                let values = basis.derivative(derivative);
                for (r, a) in values.iter().enumerate() {
                    for (s, b) in values.iter().enumerate() {
                        gram.entries[(basis.first + r) * (2 * degree + 1) + degree + s - r] += half * weight * a * b;
                    }
                }
            }
        }
        gram
    }

    /// Number of rows and of columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Entries further than this from the diagonal are zero.
    pub fn half_bandwidth(&self) -> usize {
        self.half_bandwidth
    }

    /// The entry at a row and a column, zero outside the band.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        if row >= self.size || column >= self.size || row.abs_diff(column) > self.half_bandwidth {
            return 0.0;
        }
        self.entries[row * (2 * self.half_bandwidth + 1) + self.half_bandwidth + column - row]
    }

    /// The first column of a row's band inside the matrix, and the entries from there.
    pub fn row(&self, row: usize) -> (usize, &[f64]) {
        let width = 2 * self.half_bandwidth + 1;
        let first = row.saturating_sub(self.half_bandwidth);
        let last = (row + self.half_bandwidth).min(self.size - 1);
        let offset = row * width + self.half_bandwidth;
        (first, &self.entries[offset + first - row..=offset + last - row])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mass_rows_sum_to_the_integral_of_the_basis_function() {
        let knots = KnotVector::clamped(3, &[0.0, 1.0, 1.5, 4.0]).unwrap();
        let mass = BandedMatrix::gram(&knots, 0);
        for r in 0..mass.size() {
            let sum: f64 = mass.row(r).1.iter().sum();
            let exact = (knots.knots()[r + 4] - knots.knots()[r]) / 4.0;
            // A sum of seven terms of size one.
            assert!((sum - exact).abs() < 1e-14);
        }
    }

    #[test]
    fn cubic_cardinal_stencils_are_the_known_ones() {
        let knots = KnotVector::uniform(3, 0.0, 1.0, 12).unwrap();
        let stencil = |derivative: usize, offset: usize| BandedMatrix::gram(&knots, derivative).get(7, 7 - offset);
        for (offset, exact) in [2416.0, 1191.0, 120.0, 1.0].into_iter().enumerate() {
            assert!((stencil(0, offset) - exact / 5040.0).abs() < 1e-15);
        }
        for (offset, exact) in [80.0, -15.0, -24.0, -1.0].into_iter().enumerate() {
            assert!((stencil(1, offset) - exact / 120.0).abs() < 1e-15);
        }
        for (offset, exact) in [16.0, -9.0, 0.0, 1.0].into_iter().enumerate() {
            assert!((stencil(2, offset) - exact / 6.0).abs() < 1e-14);
        }
    }

    #[test]
    fn derivatives_annihilate_constants() {
        let knots = KnotVector::new(4, vec![0., 0.1, 0.3, 0.5, 1., 1., 2., 2.5, 3., 3.5, 4., 4.5]).unwrap();
        for derivative in 1..=2 {
            let gram = BandedMatrix::gram(&knots, derivative);
            let size = gram.entries.iter().map(|g| g.abs()).fold(0.0, f64::max);
            for r in 0..gram.size() {
                // Rounding of nine terms no larger than the largest entry.
                assert!(gram.row(r).1.iter().sum::<f64>().abs() < 1e-13 * size);
            }
        }
    }
}
