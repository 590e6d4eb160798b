//! Which basis functions of a finer lattice are active: those whose whole support lies near the data.

use std::sync::Arc;
use thiserror::Error;

use crate::index_set::IndexSet;
use crate::knot_vector::KnotVector;

/// Why the active functions could not be told.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum BandError {
    /// Only cubics have levels.
    #[error("axis {axis} has degree {degree}: levels are made of cubic functions")]
    Degree {
        /// Axis of the knot vector.
        axis: usize,
        /// Its degree.
        degree: usize,
    },
    /// Only uniform knots have levels.
    #[error("the knots along axis {0} are not uniform: make them with KnotVector::uniform")]
    NotUniform(usize),
    /// Cells cannot be told apart, or counted.
    #[error(
        "level {0} has cells too small for the coordinates' precision, or more than two million (in space 32 thousand) along an axis"
    )]
    TooFine(usize),
    /// The width lies outside its range.
    #[error("a band of {0} cells on each side of the occupied ones: it must be between 3 and 7")]
    Width(usize),
    /// Not one level per point.
    #[error("{found} levels were given for {needed} points")]
    Levels {
        /// Levels given.
        found: usize,
        /// Points there are.
        needed: usize,
    },
    /// A point lies outside the box, or is not finite.
    #[error("point {index} lies outside the box along axis {axis}, or is not finite")]
    Outside {
        /// Index of the point.
        index: usize,
        /// First axis along which it sticks out.
        axis: usize,
    },
}

/// Degree of all levels.
pub(crate) const DEGREE: usize = 3;

/// Functions that act on cell `k` are `k … k + 3`; function `k` has the support `k − 3 … k`.
pub(crate) const SUPPORT: i32 = DEGREE as i32;

/// The active basis functions of every level around a point set.
///
/// Level 0 is a dense lattice with cubic cardinal knots, level `j` the lattice with its cells halved `j` times. The cells
/// Ω_j of level `j` are those within a width of some cells of a cell that holds a point that wants level `j` (or a finer one),
/// along every axis; a basis function is active when its whole support lies in Ω_j. Ω_j lies within Ω_{j−1}. As the width is
/// at least the degree, all functions that act on an occupied cell are active, except within three cells of the box's faces.
#[derive(Debug, Clone)]
pub struct CellBand<const D: usize> {
    near: Arc<IndexSet<D>>,
    active: Vec<Arc<IndexSet<D>>>,
}

impl<const D: usize> CellBand<D> {
    /// The levels 1 to the finest that a point wants, around points in the box of `knots`, the dense lattice's. There are two
    /// widths: of Ω_0, and of all finer levels.
    ///
    /// # Errors
    /// Knots that are not cubic and uniform, a width outside 3..=7, levels that do not fit the points or are too fine,
    /// points outside the box.
    pub fn new(
        knots: &[KnotVector; D],
        points: &[[f64; D]],
        levels: &[u8],
        widths: [usize; 2],
    ) -> Result<Self, BandError> {
        check_uniform(knots)?;
        if let Some(width) = widths.into_iter().find(|width| !(DEGREE..=7).contains(width)) {
            return Err(BandError::Width(width));
        }
        if levels.len() != points.len() {
            return Err(BandError::Levels { found: levels.len(), needed: points.len() });
        }
        for (index, point) in points.iter().enumerate() {
            if let Some(axis) = (0..D).find(|axis| knots[*axis].span(point[*axis]).is_none()) {
                return Err(BandError::Outside { index, axis });
            }
        }
        let around = |fine: &[KnotVector; D], level: u8| {
            let wanting = points.iter().zip(levels).filter(|(_, wanted)| **wanted >= level);
            let occupied: Vec<[u32; D]> = wanting.map(|(point, _)| cell_of(fine, point)).collect();
            let reach = widths[usize::from(level > 0)] as i32;
            IndexSet::new(cell_extent(fine), &occupied).dilated(-reach..=reach, cell_extent(fine))
        };
        let near = around(knots, 0).eroded(0..=SUPPORT, function_extent(knots));
        let (mut fine, mut outer) = (knots.clone(), supports(&near, cell_extent(knots)));
        let mut active = Vec::new();
        for level in 1..=levels.iter().copied().max().unwrap_or(0) {
            fine = halved(&fine, usize::from(level))?;
            let cells = around(&fine, level).with_parents_in(&outer);
            let functions = cells.eroded(0..=SUPPORT, function_extent(&fine));
            outer = supports(&functions, cell_extent(&fine));
            active.push(Arc::new(functions));
        }
        Ok(Self { near: Arc::new(near), active })
    }

    /// The band without the levels above the first `depth`: as if no point had wanted them.
    pub fn shallower(mut self, depth: usize) -> Self {
        self.active.truncate(depth);
        self
    }

    /// Number of levels, the dense one not counted.
    pub fn depth(&self) -> usize {
        self.active.len()
    }

    /// The functions of the dense lattice near the points: those whose support lies in Ω_0.
    pub fn near(&self) -> &Arc<IndexSet<D>> {
        &self.near
    }

    /// The active functions of level 1, 2, …
    pub fn active(&self) -> &[Arc<IndexSet<D>>] {
        &self.active
    }
}

/// For every point the level whose cells come closest, by ratio, to its distance from its neighbours, but at most `finest`.
/// `cell` is the side of level 0's cells; spacings that are not positive numbers want level 0.
pub fn levels_for_spacing(cell: f64, spacings: &[f64], finest: u8) -> Vec<u8> {
    // The conversion takes negative numbers and NaN to zero.
    spacings.iter().map(|s| if *s > 0.0 { ((cell / s).log2().round() as u8).min(finest) } else { 0 }).collect()
}

/// The cells in the supports of functions.
pub(crate) fn supports<const D: usize>(functions: &IndexSet<D>, extent: [u32; D]) -> IndexSet<D> {
    functions.dilated(-SUPPORT..=0, extent)
}

/// The knots of the next level.
pub(crate) fn halved<const D: usize>(knots: &[KnotVector; D], level: usize) -> Result<[KnotVector; D], BandError> {
    let fine = knots.each_ref().map(KnotVector::halved);
    let is_sound = |(coarse, fine): (&KnotVector, &KnotVector)| {
        fine.basis_count() == 2 * coarse.basis_count() - DEGREE
            && fine.basis_count() <= IndexSet::<D>::MAX_EXTENT as usize
            && fine.cells().count() == fine.basis_count() - DEGREE
    };
    if knots.iter().zip(&fine).all(is_sound) { Ok(fine) } else { Err(BandError::TooFine(level)) }
}

pub(crate) fn check_uniform<const D: usize>(knots: &[KnotVector; D]) -> Result<(), BandError> {
    for (axis, knots) in knots.iter().enumerate() {
        let degree = knots.degree();
        if degree != DEGREE {
            return Err(BandError::Degree { axis, degree });
        }
        let t = knots.knots();
        let size = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
        // Knots are rounded at the size of their coordinates.
        let largest = t[0].abs().max(t[t.len() - 1].abs());
        let tolerance = 1e-9 * size + 4.0 * f64::EPSILON * largest;
        if (0..t.len()).any(|i| (t[i] - (t[0] + i as f64 * size)).abs() > tolerance) {
            return Err(BandError::NotUniform(axis));
        }
    }
    Ok(())
}

pub(crate) fn cell_extent<const D: usize>(knots: &[KnotVector; D]) -> [u32; D] {
    knots.each_ref().map(|knots| (knots.basis_count() - DEGREE) as u32)
}

pub(crate) fn function_extent<const D: usize>(knots: &[KnotVector; D]) -> [u32; D] {
    knots.each_ref().map(|knots| knots.basis_count() as u32)
}

/// The cell of a point in the box.
fn cell_of<const D: usize>(knots: &[KnotVector; D], point: &[f64; D]) -> [u32; D] {
    std::array::from_fn(|axis| knots[axis].span(point[axis]).map_or(0, |span| (span - DEGREE) as u32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn knots() -> [KnotVector; 2] {
        [KnotVector::uniform(3, -1.0, 0.25, 8).unwrap(), KnotVector::uniform(3, 0.0, 0.25, 6).unwrap()]
    }

    proptest! {
        #[test]
        fn functions_at_occupied_cells_are_active_and_levels_nest(
            points in proptest::collection::vec(([-0.5..0.5f64, 0.4..1.1f64], 0u8..5), 1..12),
            width in 3usize..=7,
        ) {
            let (points, levels): (Vec<_>, Vec<_>) = points.into_iter().unzip();
            let band = CellBand::new(&knots(), &points, &levels, [width, width]).unwrap();
            prop_assert_eq!(band.depth(), usize::from(*levels.iter().max().unwrap()));
            let capped: Vec<u8> = levels.iter().map(|level| (*level).min(2)).collect();
            let shallow = CellBand::new(&knots(), &points, &capped, [width, width]).unwrap();
            let cut = band.clone().shallower(2);
            prop_assert_eq!(shallow.active(), cut.active());
            let mut fine = knots();
            let mut outer: Option<IndexSet<2>> = None;
            for (level, active) in (1u8..).zip(band.active()) {
                fine = halved(&fine, level.into()).unwrap();
                let cells = supports(active, cell_extent(&fine));
                for (point, wanted) in points.iter().zip(&levels) {
                    let cell = cell_of(&fine, point);
                    let count = (0..16).filter(|k| active.contains([cell[0] + k / 4, cell[1] + k % 4])).count();
                    // A quarter of the box is further from its faces than three cells of level 1.
                    prop_assert!(*wanted < level || count == 16);
                }
                // Nothing further away than the width.
                for cell in cells.iter() {
                    let near = points.iter().zip(&levels).any(|(point, wanted)| {
                        *wanted >= level && (0..2).all(|a| cell_of(&fine, point)[a].abs_diff(cell[a]) as usize <= width)
                    });
                    prop_assert!(near);
                }
                if let Some(outer) = &outer {
                    prop_assert_eq!(cells.with_parents_in(outer).len(), cells.len());
                }
                outer = Some(cells);
            }
        }
    }

    #[test]
    fn levels_follow_the_spacing() {
        let levels = levels_for_spacing(0.5, &[1.0, 0.5, 0.26, 0.12, 1e-9, 0.0, f64::NAN], 6);
        assert_eq!(levels, [0, 0, 1, 2, 6, 0, 0]);
    }

    #[test]
    fn what_cannot_have_levels_is_refused() {
        let error = |knots: [KnotVector; 2], point: [f64; 2], levels: &[u8], width| {
            CellBand::new(&knots, &[point], levels, [3, width]).unwrap_err()
        };
        let clamped = [knots()[0].clone(), KnotVector::clamped(3, &[0.0, 1.0, 2.0]).unwrap()];
        assert_eq!(error(clamped, [0.0, 0.5], &[1], 3), BandError::NotUniform(1));
        let quadratic = [KnotVector::uniform(2, 0.0, 1.0, 3).unwrap(), knots()[1].clone()];
        assert_eq!(error(quadratic, [0.0, 0.5], &[1], 3), BandError::Degree { axis: 0, degree: 2 });
        assert_eq!(error(knots(), [0.0, 0.5], &[1], 2), BandError::Width(2));
        assert_eq!(error(knots(), [0.0, 0.5], &[], 3), BandError::Levels { found: 0, needed: 1 });
        assert_eq!(error(knots(), [0.0, f64::NAN], &[1], 3), BandError::Outside { index: 0, axis: 1 });
        assert_eq!(error(knots(), [0.0, 0.5], &[40], 3), BandError::TooFine(18));
    }
}
