//! Splines whose finer levels exist only where they are needed.

use std::sync::Arc;
use thiserror::Error;

use crate::basis::Basis;
use crate::block_field::BlockField;
use crate::cell_band::{BandError, SUPPORT, cell_extent, check_uniform, function_extent, halved, supports};
use crate::index_set::IndexSet;
use crate::knot_vector::KnotVector;
use crate::spline::{Spline, SplineError};
use crate::two_scale::prolonged;

/// Why a hierarchical spline could not be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum HierarchyError {
    /// The dense spline's knots admit no levels.
    #[error(transparent)]
    Band(#[from] BandError),
    /// The set's extent is not the number of basis functions.
    #[error("level {level}: active functions of a lattice of {found:?} functions, where there are {needed:?}")]
    Extent {
        /// Level, from 1.
        level: usize,
        /// Extent of the set.
        found: Vec<u32>,
        /// Basis functions along each axis.
        needed: Vec<u32>,
    },
    /// An active function's support is not inside the box, or inside the supports of the level above.
    #[error("level {level}: the supports of {count} cells' functions leave the box or the cells of the level above")]
    NotNested {
        /// Level, from 1.
        level: usize,
        /// Cells that stick out, or active functions that do.
        count: usize,
    },
    /// Not one coefficient per active function.
    #[error("level {level}: {found} coefficients were given for {needed} active functions")]
    Corrections {
        /// Level, from 1.
        level: usize,
        /// Coefficients given.
        found: usize,
        /// Active functions.
        needed: usize,
    },
    /// A coefficient is NaN or infinite.
    #[error("level {level}: the coefficient of active function {index} is not a finite number")]
    NotFinite {
        /// Level, from 1.
        level: usize,
        /// Place among the active functions.
        index: usize,
    },
    /// The dense spline could not be made.
    #[error(transparent)]
    Spline(#[from] SplineError),
}

/// `f = f₀ + Σ_j Σ_k δ_{j,k} B_{j,k}`: a dense spline with corrections on ever finer lattices.
///
/// A spline with levels is cubic on uniform knots; without levels it may be any [`Spline`].
///
/// Level `j` has the knots of `f₀` halved `j` times and a set of active functions; its cells Ω_j are those in their supports,
/// and lie within Ω_{j−1}. As every term is a B-spline of the whole lattice, f is twice continuously differentiable
/// everywhere, and equals the coarser function where no finer one is active.
///
/// Beside δ each level stores the *total* coefficients of all functions that act on Ω_j: those of all coarser terms, exactly
/// prolonged, plus δ. On a cell of Ω_j that no finer level covers, f is the B-spline of this level with these coefficients,
/// so that evaluation needs `4^D` numbers, however many levels there are.
#[derive(Debug, Clone, PartialEq)]
pub struct HierarchicalSpline<const D: usize> {
    root: Spline<D>,
    levels: Vec<Level<D>>,
}

/// One level of a [`HierarchicalSpline`].
#[derive(Debug, Clone, PartialEq)]
pub struct Level<const D: usize> {
    knots: [KnotVector; D],
    cells: IndexSet<D>,
    active: Arc<IndexSet<D>>,
    corrections: Vec<f64>,
    total: BlockField<D>,
}

impl<const D: usize> Level<D> {
    /// A dense spline on the supports of some of its functions, as a level 0: what refinement changes first.
    ///
    /// # Errors
    /// Knots that are not cubic and uniform, a set of another extent, supports that leave the box.
    pub fn of_dense(spline: &Spline<D>, active: Arc<IndexSet<D>>) -> Result<Self, HierarchyError> {
        check_uniform(spline.knots())?;
        let cells = supports_within(&active, spline.knots(), 0)?;
        let mut total = BlockField::zeros(Arc::new(cells.dilated(0..=SUPPORT, active.extent())));
        let (coefficients, shape) = (spline.as_flat(), spline.shape());
        let at = |k: [u32; D]| coefficients[flat(k, shape)];
        let members: Vec<f64> = total.set().iter().map(at).collect();
        total.scatter(&members);
        let corrections = vec![0.0; active.len()];
        Ok(Self { knots: spline.knots().clone(), cells, active, corrections, total })
    }

    /// The dense spline whose level 0 this is, plus corrections of the active functions in their order.
    ///
    /// # Errors
    /// A spline on another lattice, not one coefficient per active function, or one that overflows.
    pub fn corrected(&self, spline: &Spline<D>, corrections: &[f64]) -> Result<Spline<D>, HierarchyError> {
        let (found, needed) = (function_extent(spline.knots()), self.active.extent());
        if found != needed {
            return Err(HierarchyError::Extent { level: 0, found: found.to_vec(), needed: needed.to_vec() });
        }
        if corrections.len() != self.active.len() {
            return Err(HierarchyError::Corrections { level: 0, found: corrections.len(), needed: self.active.len() });
        }
        let mut coefficients = spline.as_flat().to_vec();
        for (k, correction) in self.active.iter().zip(corrections) {
            coefficients[flat(k, spline.shape())] += correction;
        }
        Ok(Spline::from_flat(spline.knots().clone(), coefficients)?)
    }

    /// The knots of the whole lattice.
    pub fn knots(&self) -> &[KnotVector; D] {
        &self.knots
    }

    /// Sides of the cells along each axis.
    pub fn cell_sides(&self) -> [f64; D] {
        std::array::from_fn(|axis| {
            let (start, end) = self.knots[axis].domain();
            (end - start) / f64::from(self.cells.extent()[axis])
        })
    }

    /// The longest of [`Level::cell_sides`].
    pub fn cell_side(&self) -> f64 {
        self.cell_sides().into_iter().fold(0.0, f64::max)
    }

    /// Ω_j: the cells on which functions of this level are active.
    pub fn cells(&self) -> &IndexSet<D> {
        &self.cells
    }

    /// The active functions. Function `k` has the support of cells `k − 3 … k` along each axis.
    pub fn active(&self) -> &Arc<IndexSet<D>> {
        &self.active
    }

    /// δ: one coefficient per active function, in the order of [`Level::active`].
    pub fn corrections(&self) -> &[f64] {
        &self.corrections
    }

    /// The coefficients of f without finer levels, for all functions that act on this level's cells.
    pub fn total(&self) -> &BlockField<D> {
        &self.total
    }
}

impl<const D: usize> HierarchicalSpline<D> {
    /// A dense spline, of any degree and on any knots, without finer levels.
    ///
    /// # Errors
    /// None at present: knots that admit no levels are refused by [`HierarchicalSpline::push_level`].
    pub fn new(root: Spline<D>) -> Result<Self, HierarchyError> {
        Ok(Self { root, levels: vec![] })
    }

    /// A dense spline with levels, each given by its active functions and their coefficients in the order of the set.
    ///
    /// # Errors
    /// As [`HierarchicalSpline::new`] and [`HierarchicalSpline::push_level`], coefficients that do not fit or are not finite.
    pub fn with_levels(
        root: Spline<D>,
        levels: impl IntoIterator<Item = (Arc<IndexSet<D>>, Vec<f64>)>,
    ) -> Result<Self, HierarchyError> {
        let mut spline = Self::new(root)?;
        for (active, corrections) in levels {
            spline.push_level(active)?;
            spline.correct_finest(corrections)?;
        }
        Ok(spline)
    }

    /// Basis functions along each axis of the level that comes next.
    ///
    /// # Errors
    /// If the dense spline's knots are not cubic and uniform, or the cells would be too small.
    pub fn next_extent(&self) -> Result<[u32; D], HierarchyError> {
        Ok(function_extent(&self.next_knots()?))
    }

    fn next_knots(&self) -> Result<[KnotVector; D], HierarchyError> {
        let level = self.levels.len();
        if level == 0 {
            check_uniform(self.root.knots())?;
        }
        Ok(halved(self.knots_of(level), level + 1)?)
    }

    /// Adds a finer level whose coefficients are zero: the function remains the same, up to rounding.
    ///
    /// # Errors
    /// A dense spline that is not a uniform cubic, a set of another extent, supports that leave the box or the cells of the finest level, cells that are too small.
    pub fn push_level(&mut self, active: Arc<IndexSet<D>>) -> Result<(), HierarchyError> {
        let level = self.levels.len() + 1;
        let knots = self.next_knots()?;
        let cells = supports_within(&active, &knots, level)?;
        if let Some(outer) = self.levels.last() {
            let count = cells.len() - cells.with_parents_in(&outer.cells).len();
            if count > 0 {
                return Err(HierarchyError::NotNested { level, count });
            }
        }
        let corrections = vec![0.0; active.len()];
        let total = self.prolonged_to(Arc::new(cells.dilated(0..=SUPPORT, active.extent())));
        self.levels.push(Level { knots, cells, active, corrections, total });
        Ok(())
    }

    /// Replaces the coefficients δ of the finest level.
    ///
    /// # Errors
    /// Not one coefficient per active function, or one that is not finite.
    pub fn correct_finest(&mut self, corrections: Vec<f64>) -> Result<(), HierarchyError> {
        let level = self.levels.len();
        let needed = self.levels.last().map_or(0, |finest| finest.active.len());
        if corrections.len() != needed {
            return Err(HierarchyError::Corrections { level, found: corrections.len(), needed });
        }
        if let Some(index) = corrections.iter().position(|c| !c.is_finite()) {
            return Err(HierarchyError::NotFinite { level, index });
        }
        if let Some(mut finest) = self.levels.pop() {
            if finest.corrections.iter().any(|c| *c != 0.0) {
                finest.total = self.prolonged_to(Arc::clone(finest.total.set()));
            }
            finest.total.add(&finest.active, &corrections);
            finest.corrections = corrections;
            self.levels.push(finest);
        }
        Ok(())
    }

    /// Removes the finest level, if there is one.
    pub fn pop_level(&mut self) {
        self.levels.pop();
    }

    /// `f₀`.
    pub fn root(&self) -> &Spline<D> {
        &self.root
    }

    /// Level 1, 2, …
    pub fn levels(&self) -> &[Level<D>] {
        &self.levels
    }

    /// The same function times a factor.
    ///
    /// # Errors
    /// If a coefficient overflows.
    pub fn scaled(&self, factor: f64) -> Result<Self, HierarchyError> {
        Self::with_levels(self.root.scaled(factor)?, self.scaled_levels(factor))
    }

    /// The function plus a constant, which `f₀` takes up ([`Spline::plus_constant`]): the corrections remain.
    ///
    /// # Errors
    /// If a coefficient overflows, or the constant is not finite.
    pub fn plus_constant(&self, constant: f64) -> Result<Self, HierarchyError> {
        Self::with_levels(self.root.plus_constant(constant)?, self.scaled_levels(1.0))
    }

    /// The function in other coordinates: `y = scale · x + shift`, and values times `scale`, so that a signed distance
    /// stays one.
    ///
    /// # Errors
    /// If the map makes knots coincide or overflow.
    pub fn mapped(&self, scale: f64, shift: [f64; D]) -> Result<Self, HierarchyError> {
        Self::with_levels(self.root.mapped(scale, shift)?, self.scaled_levels(scale))
    }

    fn scaled_levels(&self, factor: f64) -> impl Iterator<Item = (Arc<IndexSet<D>>, Vec<f64>)> + '_ {
        self.levels
            .iter()
            .map(move |level| (Arc::clone(&level.active), level.corrections.iter().map(|c| factor * c).collect()))
    }

    /// Knots of a level, those of the dense lattice for 0.
    pub(crate) fn knots_of(&self, level: usize) -> &[KnotVector; D] {
        if level == 0 { self.root.knots() } else { &self.levels[level - 1].knots }
    }

    /// The function's coefficients on the lattice after the finest level's.
    fn prolonged_to(&self, needed: Arc<IndexSet<D>>) -> BlockField<D> {
        prolonged(needed, |first, side, out| self.gather(self.levels.len(), first, side, out))
    }

    /// Copies total coefficients of a level, `side` along each axis.
    pub(crate) fn gather(&self, level: usize, first: [i64; D], side: usize, out: &mut [f64]) {
        if level > 0 {
            return self.levels[level - 1].total.gather(first, side, out);
        }
        let (coefficients, shape) = (self.root.as_flat(), self.root.shape());
        let length = shape[D - 1] as i64;
        // The part of a line that exists.
        let start = first[D - 1].clamp(0, length);
        let end = (first[D - 1] + side as i64).clamp(start, length);
        for (row, out) in out.chunks_exact_mut(side).enumerate() {
            let mut rest = row;
            let (mut line, mut stride) = (Some(0), shape[D - 1]);
            for axis in (0..D - 1).rev() {
                let k = first[axis] + (rest % side) as i64;
                rest /= side;
                line = line.filter(|_| k >= 0 && k < shape[axis] as i64).map(|line| line + k as usize * stride);
                stride *= shape[axis];
            }
            out.fill(0.0);
            if let Some(line) = line.filter(|_| start < end) {
                let places = (start - first[D - 1]) as usize..(end - first[D - 1]) as usize;
                out[places].copy_from_slice(&coefficients[line + start as usize..line + end as usize]);
            }
        }
    }

    /// The finest level whose cells hold a point, and the point's cell there (if there are levels); none outside the box.
    pub(crate) fn locate(&self, x: &[f64; D]) -> Option<(usize, [u32; D])> {
        if self.levels.is_empty() {
            // Its knots may be any, and nobody needs the cell.
            return self.root.contains(x).then_some((0, [0; D]));
        }
        let finest = self.levels.len();
        let knots = self.knots_of(finest);
        let mut cell = [0; D];
        for axis in 0..D {
            cell[axis] = knots[axis].span(x[axis])? as u32 - SUPPORT as u32;
        }
        for level in (1..=finest).rev() {
            if self.levels[level - 1].cells.contains(cell) {
                return Some((level, cell));
            }
            cell = cell.map(|c| c / 2);
        }
        Some((0, cell))
    }

    /// The `4^D` total coefficients that act on a cell of a level, and the basis functions at a point in it.
    pub(crate) fn local(
        &self,
        (level, cell): (usize, [u32; D]),
        x: &[f64; D],
        order: usize,
    ) -> ([f64; LOCAL], [Basis; D]) {
        let mut coefficients = [0.0; LOCAL];
        let wanted = &mut coefficients[..WIDTH.pow(D as u32)];
        match level {
            0 => self.gather(0, cell.map(i64::from), WIDTH, wanted),
            _ => self.levels[level - 1].total.gather_cell(cell, wanted),
        }
        let knots = self.knots_of(level);
        let basis = std::array::from_fn(|axis| {
            let span = (cell[axis] + SUPPORT as u32) as usize;
            let mut basis = Basis::in_span(&knots[axis], span, x[axis], order);
            // Places are counted from the cell's first coefficient.
            basis.first = 0;
            basis
        });
        (coefficients, basis)
    }
}

/// The cells in the supports of a level's functions, which must lie in the box.
fn supports_within<const D: usize>(
    active: &IndexSet<D>,
    knots: &[KnotVector; D],
    level: usize,
) -> Result<IndexSet<D>, HierarchyError> {
    let needed = function_extent(knots);
    if active.extent() != needed {
        return Err(HierarchyError::Extent { level, found: active.extent().to_vec(), needed: needed.to_vec() });
    }
    let cells = supports(active, cell_extent(knots));
    let inside = cells.eroded(0..=SUPPORT, needed);
    let count = active.iter().filter(|k| !inside.contains(*k)).count();
    if count > 0 { Err(HierarchyError::NotNested { level, count }) } else { Ok(cells) }
}

/// The place of a function of a dense lattice in C order.
fn flat<const D: usize>(k: [u32; D], shape: [usize; D]) -> usize {
    (0..D).fold(0, |flat, axis| flat * shape[axis] + k[axis] as usize)
}

/// Functions that act on a cell, along each axis.
pub(crate) const WIDTH: usize = 4;

/// The most functions that act on a cell.
pub(crate) const LOCAL: usize = WIDTH * WIDTH * WIDTH;

/// Strides of the coefficients of one cell.
pub(crate) fn local_strides<const D: usize>() -> [usize; D] {
    crate::tensor::strides(&[WIDTH; D])
}
