//! How much memory a reconstruction needs, told before it is taken.
//!
//! The counts that decide are cheap: points, coefficients of the dense lattice, active functions of every level (patterns of
//! bits, a thousandth of the coefficients' own memory) and the cells that the surface crosses. The bytes behind each are
//! those of the arrays that live at the same time, rounded up to what was measured; see the constants.

use serde::Serialize;
use sysinfo::{MemoryRefreshKind, System};
use zeroset_bspline::{CellBand, HierarchicalSpline};

use crate::error::ReconstructError;
use crate::lattice::domain::Domain;
use crate::options::{Options, Topology};
use crate::points::spacing::Spacing;
use crate::points::thinning::ENOUGH;
use crate::sides::FINEST_RUNG;
use crate::zero_set::marching::{CUT, MANY_FOR_SAG, halving_at};

/// Share of the free memory that a run may use unless told otherwise.
const SHARE: f64 = 0.7;

// Bytes, from the largest resident memory of the program (two threads) on spheres of 2500 to 640 000 random points, 16 to 2048
// cells along the longest side, 40 MB to 7.7 GB: the model is mostly within a quarter of them.

/// The program itself, its threads' stacks, and buffers that the matrix library keeps.
const PROGRAM: f64 = 20e6;
/// Per point: the points with their spacing (100), and on the level that is being refined their places, normals, rows of the
/// collocation, and residuals and gradients of the function before, after and at its best (430).
const POINT: f64 = 530.0;
/// Per point of the topology stage, which thins them: winding numbers, and the rows of its finest lattice.
const LADDER_POINT: f64 = 2200.0;
/// Per coefficient of the topology stage's finest lattice: vectors of conjugate gradients and of eigenvectors.
const LADDER: f64 = 190.0;
/// Per coefficient of the dense lattice: distance, sign, φ, and the vectors of the least squares.
const DENSE: f64 = 110.0;
/// Per coefficient of the dense lattice that is refined as a whole.
const DENSE_REFINED: f64 = 380.0;
/// Per coefficient of the dense lattice, for what is kept of it while levels are refined.
const DENSE_KEPT: f64 = 30.0;
/// Per active function of the level that is being refined: some twenty vectors of the solver and of states, and fields in
/// blocks on all functions that act on the level's cells, two to three times as many.
const ACTIVE: f64 = 450.0;
/// Per active function of the levels above it: corrections, and the function's own field.
const KEPT: f64 = 50.0;
/// Per cell that the zero set is extracted on: candidates around it with their values, a vertex, two triangles, and their topology.
const CROSSED: f64 = 400.0;
/// Active functions of a level to each of its cells that the zero set crosses, at the least: 3.2 to 3.8 on closed surfaces.
const ACTIVE_PER_CROSSED: f64 = 3.0;
/// Per entry of a Cholesky factor: itself, and part of what it is made in.
const FACTOR: f64 = 10.0;
/// The same where two are kept while a third is made, as in the paper's topology stage.
const FACTORS: f64 = 22.0;

/// Memory allowed and memory needed, bytes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MemoryReport {
    /// What the run may use: as asked for, or 70 % of what was free; `None` where that is not known.
    pub limit: Option<u64>,
    /// What it needs, as estimated before it began, and again where noise asks for a wider band.
    pub need: u64,
    /// Levels above the dense lattice that it may use.
    pub levels: usize,
    /// What it would need with all levels that were wanted.
    pub wanted_need: u64,
    /// Levels above the dense lattice that were wanted.
    pub wanted_levels: usize,
}

impl MemoryReport {
    /// Whether the matrix of a lattice with so many coefficients of a degree can be factored besides.
    pub(crate) fn has_room_to_factor<const D: usize>(&self, coefficients: usize, degree: usize) -> bool {
        let bytes = FACTOR * factor_entries::<D>(coefficients as f64, degree);
        self.limit.is_none_or(|limit| self.need as f64 + bytes <= limit as f64)
    }

    /// Whether so many points can be heard in the topology stage in place of fewer.
    pub(crate) fn has_room_to_hear(&self, points: usize) -> bool {
        self.limit.is_none_or(|limit| self.need as f64 + LADDER_POINT * points as f64 <= limit as f64)
    }
}

/// Entries of the Cholesky factor of a lattice's matrix by nested dissection (George 1973): its separators are as many layers thick as
/// the degree. Above what was counted on 2000 to 21 000 coefficients of
/// degree 2 to 5, and below twice that.
fn factor_entries<const D: usize>(coefficients: f64, degree: usize) -> f64 {
    let n = coefficients;
    let dissected = if D == 2 { 2.0 * n * n.log2() } else { 9.0 * n.powf(4.0 / 3.0) };
    // Small ones are nearly full.
    (dissected * (degree * degree) as f64).min(0.35 * n * n)
}

/// What memory is needed for.
#[derive(Debug, Clone, PartialEq)]
pub struct Counts {
    /// Points given.
    pub points: usize,
    /// Coefficients of the topology stage's finest lattice.
    pub ladder: f64,
    /// Entries of the factors that the paper's topology stage makes; 0 for the ladder, which makes none to speak of.
    pub factor: f64,
    /// Coefficients of the dense lattice.
    pub dense: f64,
    /// Whether the dense lattice is refined as a whole.
    pub dense_refined: bool,
    /// Active functions of the dense lattice near the points, then of every level above it; none without refinement on levels.
    pub active: Vec<usize>,
    /// Cells of the dense lattice that the zero set crosses.
    pub crossed: f64,
    /// 2 in the plane, 3 in space.
    pub dimension: usize,
}

impl Counts {
    /// Of `points` points with a spacing, on the dense lattice of a domain after `halvings`, with its band if there is one.
    pub fn of<const D: usize>(
        points: usize,
        spacing: &Spacing,
        domain: &Domain<D>,
        halvings: u32,
        options: &Options,
        band: Option<&CellBand<D>>,
    ) -> Self {
        let face = |side: f64| side.powi(D as i32 - 1);
        let active = |band: &CellBand<D>| {
            std::iter::once(band.near().len()).chain(band.active().iter().map(|level| level.len())).collect()
        };
        Self {
            points,
            ladder: domain.coefficients(options.degree, halvings.min(FINEST_RUNG)),
            factor: match options.topology {
                Topology::Continuation => 0.0,
                Topology::Paper => factor_entries::<D>(domain.coefficients(options.degree, 0), options.degree),
            },
            dense: domain.coefficients(options.degree, halvings),
            dense_refined: options.refine && band.is_none(),
            active: band.map_or(vec![], active),
            crossed: CUT * spacing.extent() / face(domain.spacing(halvings)),
            dimension: D,
        }
    }

    /// Bytes needed with so many levels above the dense lattice: those of the stage that needs most.
    fn need(&self, levels: usize) -> u64 {
        let used = &self.active[..self.active.len().min(levels + 1)];
        let kept = |count: usize| DENSE_KEPT * self.dense + KEPT * used[..count].iter().sum::<usize>() as f64;
        let ladder = LADDER * self.ladder + FACTORS * self.factor + LADDER_POINT * self.points.min(2 * ENOUGH) as f64;
        let dense = self.dense * if self.dense_refined { DENSE_REFINED } else { DENSE };
        let crossed = self.crossed_with(levels);
        // Where these are few they are mostly halved up to twice.
        let marched = crossed.max((crossed * self.growth(2)).min(MANY_FOR_SAG));
        let extraction = kept(used.len()) + CROSSED * marched;
        let refinement = (0..used.len()).map(|level| kept(level) + ACTIVE * used[level] as f64);
        (PROGRAM + POINT * self.points as f64 + refinement.fold(ladder.max(dense).max(extraction), f64::max)) as u64
    }

    /// By how much the cells that the zero set crosses become more when all are halved so often.
    fn growth(&self, halvings: usize) -> f64 {
        2.0_f64.powi(((self.dimension - 1) * halvings) as i32)
    }

    /// Cells that the zero set is extracted on with so many levels.
    fn crossed_with(&self, levels: usize) -> f64 {
        let of = |level: usize| {
            let all = self.crossed * self.growth(level);
            self.active.get(level).map_or(all, |active| all.min(*active as f64 / ACTIVE_PER_CROSSED))
        };
        // Where there are no finer ones.
        let only = |level: usize| {
            let finer = if level < levels { of(level + 1) / self.growth(1) } else { 0.0 };
            (of(level) - finer).max(0.0)
        };
        let parts = |level: usize| self.growth(halving_at(self.dimension, level, levels, levels) - level);
        (0..=levels).map(|level| parts(level) * only(level)).sum()
    }

    /// As many levels as fit.
    ///
    /// # Errors
    /// If not even the dense lattice does.
    pub fn within(&self, limit: Option<u64>) -> Result<MemoryReport, ReconstructError> {
        let wanted_levels = self.active.len().saturating_sub(1);
        let fits = |levels: &usize| limit.is_none_or(|limit| self.need(*levels) <= limit);
        match (0..=wanted_levels).rev().find(fits) {
            Some(levels) => Ok(MemoryReport {
                limit,
                need: self.need(levels),
                levels,
                wanted_need: self.need(wanted_levels),
                wanted_levels,
            }),
            None => Err(ReconstructError::Memory { need: self.need(0), limit: limit.unwrap_or(u64::MAX) }),
        }
    }
}

impl MemoryReport {
    /// What to tell about it, if levels were left out; `cell` is the side of the dense lattice's cells, frame units.
    pub(crate) fn warning(&self, cell: f64) -> Option<String> {
        let cells = |levels: usize| (2.0_f64.powi(levels as i32) / cell).round();
        (self.levels < self.wanted_levels).then(|| {
            format!(
                "cells are coarser than wanted: up to {} along the longest side in place of {}, which needs about {} of memory \
                 where {} may be used (--memory)",
                cells(self.levels),
                cells(self.wanted_levels),
                said(self.wanted_need),
                said(self.limit.unwrap_or(u64::MAX))
            )
        })
    }
}

/// The limit for a run, bytes: what was asked for, or 70 % of the memory that is free, in the machine or in the group of processes
/// that this one is limited with (Linux control groups). `None` where the system does not tell.
pub fn memory_limit(wanted: Option<u64>) -> Option<u64> {
    let free = || {
        let mut system = System::new();
        system.refresh_memory_specifics(MemoryRefreshKind::nothing().with_ram());
        let machine = Some(system.available_memory()).filter(|free| *free > 0)?;
        Some(system.cgroup_limits().map_or(machine, |group| group.free_memory.min(machine)))
    };
    wanted.or_else(|| free().map(|free| (SHARE * free as f64) as u64))
}

/// Bytes needed to extract the zero set of a function on cells at least as small as those of its dense lattice halved so often, as estimated
/// from its bounds; in space on no smaller ones than it takes ([`HierarchicalSpline::grading`]).
pub fn extraction_need<const D: usize>(spline: &HierarchicalSpline<D>, halvings: u32) -> u64 {
    // Bounds keep more cells than the zero set crosses, which is on the safe side.
    let leaves = spline.leaf_cells(|leaf| leaf.lower < 0.0 && leaf.upper >= 0.0);
    let finest = spline.levels().len();
    let own = |level: usize| halving_at(D, level, finest, finest).max(halvings as usize);
    let parts = |level: usize| 2.0_f64.powi(((D - 1) * (own(level) - level)) as i32);
    let crossed: f64 = leaves.iter().map(|leaf| parts(leaf.level)).sum();
    (PROGRAM + CROSSED * crossed) as u64
}

/// Bytes in words.
pub(crate) fn said(bytes: u64) -> String {
    if bytes >= 1 << 30 {
        format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30))
    } else {
        format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts() -> Counts {
        let active = vec![70_000, 280_000, 1_100_000, 4_400_000];
        let (dense, crossed) = (571_787.0, 77_000.0);
        Counts {
            points: 160_000,
            ladder: dense,
            factor: 0.0,
            dense,
            dense_refined: false,
            active,
            crossed,
            dimension: 3,
        }
    }

    #[test]
    fn as_many_levels_as_fit() {
        let counts = counts();
        let all = counts.within(None).unwrap();
        assert_eq!((all.levels, all.wanted_levels, all.need), (3, 3, all.wanted_need));
        assert!(all.warning(1.0 / 64.0).is_none());
        for levels in 0..3 {
            // The dense lattice needs more than the first levels do.
            let exact = counts.within(Some(counts.need(levels))).unwrap();
            assert!(exact.levels >= levels && exact.need <= counts.need(levels), "{exact:?}");
        }
        let one_less = counts.within(Some(counts.need(3) - 1)).unwrap();
        assert_eq!((one_less.levels, one_less.wanted_need), (2, all.need));
        let warning = one_less.warning(1.0 / 64.0).unwrap();
        assert!(warning.contains("up to 256 along") && warning.contains("in place of 512"), "{warning}");
        let error = counts.within(Some(1 << 20)).unwrap_err();
        assert!(error.is_option() && error.to_string().contains("only 1 MiB may be used"), "{error}");
    }

    #[test]
    fn cells_are_as_small_as_the_finest_only_where_it_is() {
        // Few points want the finest levels.
        let even = Counts { active: vec![300_000, 1_200_000, 4_800_000, 19_200_000], ..counts() };
        assert_eq!(even.crossed_with(3), 77_000.0 * 64.0);
        let uneven = Counts { active: vec![300_000, 30_000, 30_000, 30_000], ..even.clone() };
        // Nearly all on the dense lattice's cells, halved once.
        let most = 4.0 * 77_000.0;
        assert!((most..1.2 * most).contains(&uneven.crossed_with(3)), "{}", uneven.crossed_with(3));
        let plane = Counts { dimension: 2, ..uneven };
        assert_eq!(plane.crossed_with(3), 77_000.0 * 8.0);
    }

    #[test]
    fn a_lattice_refined_as_a_whole_needs_more() {
        let one = Counts { active: vec![], dense_refined: true, ..counts() };
        assert!(one.need(0) > Counts { dense_refined: false, ..one.clone() }.need(0));
        assert_eq!(one.within(None).unwrap().wanted_levels, 0);
    }

    #[test]
    fn a_factor_is_as_large_as_those_that_were_counted() {
        // Lattices of boxes around the bunny and the horse, and the entries of their factors.
        let counted: [(f64, f64); 8] = [
            (factor_entries::<3>(2352.0, 2), 822_560.0),
            (factor_entries::<3>(14_872.0, 2), 11_888_688.0),
            (factor_entries::<3>(2925.0, 3), 1_860_851.0),
            (factor_entries::<3>(16_767.0, 3), 26_035_379.0),
            (factor_entries::<3>(4335.0, 5), 6_176_239.0),
            (factor_entries::<3>(21_025.0, 5), 83_618_564.0),
            (factor_entries::<2>(4060.0, 2), 376_324.0),
            (factor_entries::<2>(4453.0, 5), 1_495_673.0),
        ];
        for (estimated, counted) in counted {
            // Never less, and not so much more that a run is refused that would have fitted.
            assert!((1.0..2.0).contains(&(estimated / counted)), "{estimated:e} {counted:e}");
        }
    }

    #[test]
    fn the_papers_method_needs_its_factors() {
        let paper = Counts { factor: 83_618_564.0, ..counts() };
        // Two were kept while a third was made: 1.76 GB in all.
        assert!((1.7e9..2.2e9).contains(&(paper.need(0) as f64)), "{}", paper.need(0));
        assert!(paper.within(Some(1 << 30)).is_err());
    }

    #[test]
    fn the_limit_is_what_was_asked_for_or_part_of_what_is_free() {
        assert_eq!(memory_limit(Some(5)), Some(5));
        // A system that tells nothing has no limit.
        assert!(memory_limit(None).is_none_or(|limit| limit > 1 << 20));
    }
}
