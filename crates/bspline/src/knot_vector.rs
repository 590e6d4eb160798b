//! Knot vectors of one axis.

use thiserror::Error;

/// The highest degree that is supported.
pub const MAX_DEGREE: usize = 5;

/// Why a knot vector was refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum KnotError {
    /// The degree is not one of 1 to [`MAX_DEGREE`].
    #[error("degree {0} is not supported: choose 1 to {MAX_DEGREE}")]
    Degree(usize),
    /// Fewer than `2 (degree + 1)` knots: there is no span on which all basis functions live.
    #[error("{found} knots are too few for degree {degree}: at least {needed} are needed")]
    TooFew {
        /// Number of knots given.
        found: usize,
        /// Degree asked for.
        degree: usize,
        /// Smallest number of knots that works.
        needed: usize,
    },
    /// A knot is NaN or infinite.
    #[error("knot {0} is not a finite number")]
    NotFinite(usize),
    /// A knot is smaller than the one before it.
    #[error("knot {0} is smaller than the knot before it: sort the knots in non-decreasing order")]
    Decreasing(usize),
    /// A knot is repeated more than `degree + 1` times.
    #[error("knot {index} is repeated {found} times: at most degree + 1 = {most} are allowed")]
    Multiplicity {
        /// Index of the first of the equal knots.
        index: usize,
        /// How often it stands there.
        found: usize,
        /// How often it may.
        most: usize,
    },
    /// The domain `[ξ_d, ξ_m]` has no length.
    #[error("the domain between knot {first} and knot {last} is empty: give distinct knots there")]
    EmptyDomain {
        /// Index of the knot that begins the domain.
        first: usize,
        /// Index of the knot that ends it.
        last: usize,
    },
    /// The cell size is not a positive finite number, or too small beside the coordinates to separate knots.
    #[error("cells of size {0} cannot be laid out here: use a positive size that the coordinates can resolve")]
    Spacing(f64),
    /// No cells were asked for.
    #[error("a knot vector needs at least one cell")]
    NoCells,
}

/// A non-decreasing knot vector with its degree: `ξ` of equation (1).
///
/// A vector of `m + d + 1` knots carries `m` basis functions of degree `d`; they sum to one on the *domain*
/// `[ξ_d, ξ_m]` (counting from zero), the only place where splines are evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
    /// Distance of neighbouring knots, if it is the same everywhere but for rounding.
    spacing: Option<f64>,
}

/// Distance of neighbouring knots, if they are equally far from each other up to the rounding of their coordinates.
fn uniform_spacing(knots: &[f64]) -> Option<f64> {
    let (first, last) = (*knots.first()?, *knots.last()?);
    let spacing = (last - first) / (knots.len() - 1) as f64;
    let tolerance = 4.0 * f64::EPSILON * first.abs().max(last.abs());
    let is_near = |(i, knot): (usize, &f64)| (knot - (first + i as f64 * spacing)).abs() <= tolerance;
    // Where rounding is no small part of a cell, cells are not alike.
    (tolerance < 1e-9 * spacing && knots.iter().enumerate().all(is_near)).then_some(spacing)
}

impl KnotVector {
    /// Takes any non-decreasing knots: uniform, clamped or not.
    ///
    /// # Errors
    /// A degree outside 1 to [`MAX_DEGREE`], fewer than `2 (degree + 1)` knots, knots that are not finite or decrease, a
    /// knot repeated more than `degree + 1` times, or a domain without length.
    pub fn new(degree: usize, knots: Vec<f64>) -> Result<Self, KnotError> {
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(KnotError::Degree(degree));
        }
        let needed = 2 * (degree + 1);
        if knots.len() < needed {
            return Err(KnotError::TooFew { found: knots.len(), degree, needed });
        }
        if let Some(index) = knots.iter().position(|t| !t.is_finite()) {
            return Err(KnotError::NotFinite(index));
        }
        if let Some(index) = knots.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(KnotError::Decreasing(index + 1));
        }
        let mut index = 0;
        while index < knots.len() {
            let found = knots[index..].iter().take_while(|&&t| t == knots[index]).count();
            if found > degree + 1 {
                return Err(KnotError::Multiplicity { index, found, most: degree + 1 });
            }
            index += found;
        }
        let last = knots.len() - 1 - degree;
        if knots[degree] >= knots[last] {
            return Err(KnotError::EmptyDomain { first: degree, last });
        }
        let spacing = uniform_spacing(&knots);
        Ok(Self { degree, knots, spacing })
    }

    /// The cardinal knot vector: `cells` cells of size `spacing` from `start`, with `degree` further cells on each side
    /// that only serve the basis functions at the ends. It carries `cells + degree` basis functions.
    ///
    /// # Errors
    /// As [`KnotVector::new`], a `spacing` that is not positive, or no cells.
    pub fn uniform(degree: usize, start: f64, spacing: f64, cells: usize) -> Result<Self, KnotError> {
        if cells == 0 {
            return Err(KnotError::NoCells);
        }
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(KnotError::Spacing(spacing));
        }
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(KnotError::Degree(degree));
        }
        let knots: Vec<f64> = (0..=cells + 2 * degree).map(|i| start + (i as f64 - degree as f64) * spacing).collect();
        if knots.windows(2).any(|pair| pair[1] <= pair[0]) {
            return Err(KnotError::Spacing(spacing));
        }
        Self::new(degree, knots)
    }

    /// The clamped knot vector on strictly increasing `breakpoints`: the first and the last are repeated `degree + 1`
    /// times.
    ///
    /// # Errors
    /// As [`KnotVector::new`].
    pub fn clamped(degree: usize, breakpoints: &[f64]) -> Result<Self, KnotError> {
        let (Some(&first), Some(&last)) = (breakpoints.first(), breakpoints.last()) else {
            return Err(KnotError::NoCells);
        };
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(KnotError::Degree(degree));
        }
        let mut knots = vec![first; degree];
        knots.extend_from_slice(breakpoints);
        knots.extend(std::iter::repeat_n(last, degree));
        Self::new(degree, knots)
    }

    /// Polynomial degree `d` of the pieces.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The distance of neighbouring knots, if it is the same everywhere but for rounding.
    pub(crate) fn uniform_spacing(&self) -> Option<f64> {
        self.spacing
    }

    /// All `m + d + 1` knots.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Number `m` of basis functions.
    pub fn basis_count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// The interval `[ξ_d, ξ_m]` on which the basis functions sum to one.
    pub fn domain(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.basis_count()])
    }

    /// The index `μ` with `ξ_μ ≤ x < ξ_{μ+1}` inside the domain; at its right end the last span that is not empty.
    /// `None` outside the domain and for NaN.
    pub fn span(&self, x: f64) -> Option<usize> {
        let (start, end) = self.domain();
        if !(x >= start && x <= end) {
            return None;
        }
        let inner = &self.knots[self.degree..=self.basis_count()];
        if let Some(spacing) = self.spacing {
            // A guess that rounding may make wrong by one.
            let mut cell = (((x - start) / spacing) as usize).min(inner.len() - 2);
            if x < inner[cell] {
                cell -= 1;
            } else if cell + 2 < inner.len() && x >= inner[cell + 1] {
                cell += 1;
            }
            return Some(self.degree + cell);
        }
        let after = if x == end { inner.partition_point(|&t| t < end) } else { inner.partition_point(|&t| t <= x) };
        Some(self.degree + after - 1)
    }

    /// The spans of positive length in the domain, as `(μ, ξ_μ, ξ_{μ+1})`: the cells of this axis.
    pub fn cells(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        (self.degree..self.basis_count())
            .map(|mu| (mu, self.knots[mu], self.knots[mu + 1]))
            .filter(|&(_, start, end)| start < end)
    }

    /// The largest number of times that a knot strictly inside the domain is repeated; 0 without such knots.
    pub fn interior_multiplicity(&self) -> usize {
        let (start, end) = self.domain();
        let interior: Vec<f64> = self.knots.iter().copied().filter(|&t| t > start && t < end).collect();
        interior.chunk_by(|a, b| a == b).map(<[f64]>::len).max().unwrap_or(0)
    }

    /// The knot vector with every cell halved. Knots outside the domain move to half their distance from it, so that
    /// uniform knots stay uniform and clamped ones clamped; interior knots keep their multiplicity.
    pub fn halved(&self) -> Self {
        let (start, end) = self.domain();
        let mut knots: Vec<f64> = self.knots[..self.degree].iter().map(|t| start - 0.5 * (start - t)).collect();
        let inner = &self.knots[self.degree..=self.basis_count()];
        for pair in inner.windows(2) {
            knots.push(pair[0]);
            if pair[0] < pair[1] {
                knots.push(pair[0] + 0.5 * (pair[1] - pair[0]));
            }
        }
        knots.push(end);
        knots.extend(self.knots[self.basis_count() + 1..].iter().map(|t| end + 0.5 * (t - end)));
        let spacing = uniform_spacing(&knots);
        Self { degree: self.degree, knots, spacing }
    }

    /// The knot vector that this one is the [halved](Self::halved) one of, but for rounding; none if there is none: for an odd
    /// number of cells, one cell, or cells of which two neighbours do not make one.
    pub fn doubled(&self) -> Option<Self> {
        let (start, end) = self.domain();
        let inner = &self.knots[self.degree..=self.basis_count()];
        let is_middle = |knots: &[f64]| {
            let tolerance = 4.0 * f64::EPSILON * knots[0].abs().max(knots[2].abs());
            knots[0] < knots[1] && knots[1] < knots[2] && (0.5 * (knots[0] + knots[2]) - knots[1]).abs() <= tolerance
        };
        if inner.len() < 5 || inner.len().is_multiple_of(2) || !inner.windows(3).step_by(2).all(is_middle) {
            return None;
        }
        let mut knots: Vec<f64> = self.knots[..self.degree].iter().map(|t| start - 2.0 * (start - t)).collect();
        knots.extend(inner.iter().step_by(2));
        knots.extend(self.knots[self.basis_count() + 1..].iter().map(|t| end + 2.0 * (t - end)));
        Self::new(self.degree, knots).ok()
    }

    /// The knot vector in other units: every knot becomes `scale · ξ + shift`.
    ///
    /// # Errors
    /// As [`KnotVector::new`], for instance when `scale` is not positive.
    pub fn mapped(&self, scale: f64, shift: f64) -> Result<Self, KnotError> {
        Self::new(self.degree, self.knots.iter().map(|t| scale * t + shift).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_knots_have_cells_plus_degree_functions() {
        let knots = KnotVector::uniform(3, -1.0, 0.5, 4).unwrap();
        assert_eq!(knots.basis_count(), 7);
        assert_eq!(knots.domain(), (-1.0, 1.0));
        assert_eq!(knots.cells().count(), 4);
    }

    #[test]
    fn the_domain_is_closed_at_both_ends() {
        for knots in [
            KnotVector::uniform(2, 0.0, 1.0, 3).unwrap(),
            KnotVector::clamped(2, &[0.0, 1.0, 2.0, 3.0]).unwrap(),
            KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 3.0, 3.0, 3.0]).unwrap(),
        ] {
            assert_eq!(knots.knots()[knots.span(0.0).unwrap()], 0.0);
            let last = knots.span(3.0).unwrap();
            assert!(knots.knots()[last] < 3.0 && knots.knots()[last + 1] == 3.0);
            assert_eq!(knots.span(-1e-9), None);
            assert_eq!(knots.span(3.0 + 1e-9), None);
            assert_eq!(knots.span(f64::NAN), None);
        }
    }

    #[test]
    fn halving_keeps_uniform_uniform_and_clamped_clamped() {
        let uniform = KnotVector::uniform(3, -0.75, 0.25, 6).unwrap();
        assert_eq!(uniform.halved(), KnotVector::uniform(3, -0.75, 0.125, 12).unwrap());
        let clamped = KnotVector::clamped(3, &[0.0, 1.0, 3.0]).unwrap();
        assert_eq!(clamped.halved(), KnotVector::clamped(3, &[0.0, 0.5, 1.0, 2.0, 3.0]).unwrap());
    }

    #[test]
    fn doubling_undoes_halving() {
        for knots in [
            KnotVector::uniform(3, -0.75, 0.25, 5).unwrap(),
            KnotVector::uniform(2, 0.1, 0.1, 2).unwrap(),
            KnotVector::clamped(3, &[0.0, 1.0, 3.0]).unwrap(),
        ] {
            let doubled = knots.halved().doubled().unwrap();
            // Rounding only.
            let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-15;
            assert!(doubled.knots().iter().zip(knots.knots()).all(is_near) && doubled.degree() == knots.degree());
        }
        assert_eq!(KnotVector::uniform(3, 0.0, 1.0, 5).unwrap().doubled(), None, "five cells");
        assert_eq!(KnotVector::uniform(3, 0.0, 1.0, 2).unwrap().doubled(), None, "one cell has no parts to tell");
        assert_eq!(KnotVector::clamped(3, &[0.0, 1.0, 3.0, 4.0, 5.0]).unwrap().doubled(), None, "halves differ");
    }

    #[test]
    fn bad_knots_are_refused_with_their_place() {
        assert_eq!(KnotVector::new(0, vec![0.0; 9]), Err(KnotError::Degree(0)));
        assert_eq!(KnotVector::new(6, vec![0.0; 9]), Err(KnotError::Degree(6)));
        assert_eq!(KnotVector::new(1, vec![0.0, 1.0, 2.0]), Err(KnotError::TooFew { found: 3, degree: 1, needed: 4 }));
        assert_eq!(KnotVector::new(1, vec![0.0, 1.0, f64::NAN, 2.0]), Err(KnotError::NotFinite(2)));
        assert_eq!(KnotVector::new(1, vec![0.0, 1.0, 0.5, 2.0]), Err(KnotError::Decreasing(2)));
        assert_eq!(
            KnotVector::new(1, vec![0.0, 1.0, 1.0, 1.0, 2.0]),
            Err(KnotError::Multiplicity { index: 1, found: 3, most: 2 })
        );
        assert_eq!(
            KnotVector::new(2, vec![0.0, 1.0, 2.0, 2.0, 2.0, 3.0]),
            Err(KnotError::EmptyDomain { first: 2, last: 3 })
        );
        assert_eq!(KnotVector::uniform(3, 0.0, 0.0, 4), Err(KnotError::Spacing(0.0)));
        assert_eq!(KnotVector::uniform(3, 1e17, 1.0, 4), Err(KnotError::Spacing(1.0)));
        assert_eq!(KnotVector::uniform(3, 0.0, 1.0, 0), Err(KnotError::NoCells));
        assert_eq!(KnotVector::uniform(6, 0.0, 1.0, 4), Err(KnotError::Degree(6)));
        assert_eq!(KnotVector::clamped(3, &[]), Err(KnotError::NoCells));
        assert_eq!(KnotVector::clamped(0, &[0.0, 1.0]), Err(KnotError::Degree(0)));
    }
}
