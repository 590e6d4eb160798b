//! The points in the cells of a band level, block by block.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;
use zeroset_bspline::{BlockField, IndexSet, Level};

use crate::band_kernel::{Rows, TILE, ValueAndGradient};
use crate::bits::Bits;

/// Places of a block along an axis.
const SIDE: usize = 8;

/// A point in its cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place<const D: usize> {
    /// Where its first coefficient is in the block's tile.
    pub(crate) first: u16,
    /// Its position between the cell's faces, 0 to 1.
    pub(crate) position: [f64; D],
}

/// The points of one block of cells.
#[derive(Debug, Clone)]
struct Block<const D: usize> {
    /// First cell, which is also the first function that acts on it.
    start: [i64; D],
    points: Range<usize>,
    /// The rows of its tile that its points touch: bits per place along the second of three axes. In the plane there is one place
    /// along the first.
    rows: [u16; TILE],
}

impl<const D: usize> Block<D> {
    /// The next points, from a given one on.
    fn new(start: [i64; D], places: &[Place<D>], from: usize) -> Self {
        let mut rows = [0; TILE];
        for place in places {
            let row = usize::from(place.first) / TILE;
            let (x, y) = if D == 3 { (row / TILE, row % TILE) } else { (0, row) };
            rows[x..=x + if D == 3 { REACH } else { 0 }].iter_mut().for_each(|rows| *rows |= 0b1111 << y);
        }
        Self { start, points: from..from + places.len(), rows }
    }

    /// The numbers of those rows in the tile.
    fn row_numbers(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows().iter().enumerate().flat_map(|(x, rows)| Bits(*rows).map(move |y| x * TILE + y))
    }

    fn rows(&self) -> &[u16] {
        if D == 3 { &self.rows } else { &self.rows[..1] }
    }
}

/// Cubic functions act on the cell where they begin and so many beyond it.
const REACH: usize = TILE - SIDE;

/// The points that lie in the cells of a level, sorted by cell. Numbers per point come in this order: see
/// [`BandCollocation::indices`].
///
/// The functions that act on the cells of a block are its tile, 11 along each axis: it is copied once for all its points.
#[derive(Debug, Clone)]
pub struct BandCollocation<const D: usize> {
    sides: [f64; D],
    indices: Vec<u32>,
    places: Vec<Place<D>>,
    blocks: Vec<Block<D>>,
}

/// Blocks per task at least.
const FEW: usize = 8;

impl<const D: usize> BandCollocation<D> {
    /// Sorts the points that lie in the level's cells; others are left out.
    pub fn new(level: &Level<D>, points: &[[f64; D]]) -> Self {
        let knots = level.knots();
        let cell = |(index, point): (usize, &[f64; D])| {
            let mut cell = [0u32; D];
            for axis in 0..D {
                cell[axis] = (knots[axis].span(point[axis])? - knots[axis].degree()) as u32;
            }
            let key = (cell.map(|c| c / SIDE as u32), cell.map(|c| c % SIDE as u32), index as u32);
            level.cells().contains(cell).then_some(key)
        };
        let mut keys: Vec<_> = points.par_iter().enumerate().with_min_len(1024).filter_map(cell).collect();
        keys.par_sort_unstable();
        let place = |(block, inner, index): &([u32; D], [u32; D], u32)| Place {
            first: inner.iter().fold(0, |first, k| first * TILE as u16 + *k as u16),
            position: std::array::from_fn(|axis| {
                let knots = &knots[axis];
                let span = (block[axis] * SIDE as u32 + inner[axis]) as usize + knots.degree();
                let (from, to) = (knots.knots()[span], knots.knots()[span + 1]);
                (points[*index as usize][axis] - from) / (to - from)
            }),
        };
        let places: Vec<Place<D>> = keys.par_iter().with_min_len(1024).map(place).collect();
        let mut from = 0;
        let of_block = |group: &[([u32; D], _, _)]| {
            from += group.len();
            (group[0].0.map(|block| i64::from(block) * SIDE as i64), from - group.len()..from)
        };
        let points_of_blocks: Vec<_> = keys.chunk_by(|a, b| a.0 == b.0).map(of_block).collect();
        let block =
            |(start, points): ([i64; D], Range<usize>)| Block::new(start, &places[points.clone()], points.start);
        let blocks = points_of_blocks.into_par_iter().with_min_len(FEW).map(block).collect();
        let indices = keys.par_iter().with_min_len(1024).map(|key| key.2).collect();
        Self { sides: level.cell_sides(), indices, places, blocks }
    }

    /// Those of the points, by their place in the order of this collocation, for which `keep` is true.
    pub fn subset(&self, keep: impl Fn(usize) -> bool) -> Self {
        let (mut indices, mut places, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
        for block in &self.blocks {
            let from = indices.len();
            for point in block.points.clone().filter(|point| keep(*point)) {
                indices.push(self.indices[point]);
                places.push(self.places[point]);
            }
            if indices.len() > from {
                blocks.push(Block::new(block.start, &places[from..], from));
            }
        }
        Self { sides: self.sides, indices, places, blocks }
    }

    /// For every point in the level's cells, its place among the points given.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// `f(Pᵢ)` and `∇f(Pᵢ)` of a function given by the coefficients of all functions that act on the level's cells.
    pub fn values_and_gradients(&self, f: &BlockField<D>) -> Vec<(f64, [f64; D])> {
        let mut out = vec![(0.0, [0.0; D]); self.places.len()];
        self.split(&mut out).into_par_iter().with_min_len(FEW).for_each_init(
            || vec![0.0; TILE.pow(D as u32)],
            |tile, (block, out)| {
                f.gather(block.start, TILE, tile);
                let places = &self.places[block.points.clone()];
                Arch::new().dispatch(ValueAndGradient { tile, places, sides: &self.sides, out });
            },
        );
        out
    }

    /// Adds `Σᵢ yᵢ rᵢ` to the blocks of `sums`, for rows `rᵢ = αᵢ qᵢ + βᵢ · ∇qᵢ`; coefficients of functions that are not
    /// members of `set` are meaningless.
    ///
    /// # Panics
    /// If there is not one α, β and y for every point, or `sums` does not have all blocks of `set`.
    #[track_caller]
    pub fn add_transposed(&self, alpha: &[f64], beta: &[[f64; D]], y: &[f64], set: &IndexSet<D>, sums: &mut [f64]) {
        assert_eq!(y.len(), self.places.len(), "one number per point");
        self.accumulate(alpha, beta, set, sums, |points, rows, tile| {
            Arch::new().dispatch(Transposed { rows, y: &y[points], tile: tile.sums });
        });
    }

    /// Adds the diagonal of `Σᵢ rᵢ rᵢᵀ`. See [`BandCollocation::add_transposed`].
    #[track_caller]
    pub(crate) fn add_squares(&self, alpha: &[f64], beta: &[[f64; D]], set: &IndexSet<D>, sums: &mut [f64]) {
        self.accumulate(alpha, beta, set, sums, |_, rows, tile| {
            Arch::new().dispatch(Squares { rows, tile: tile.sums })
        });
    }

    /// Adds `Σᵢ rᵢ (rᵢᵀ x)`. See [`BandCollocation::add_transposed`].
    #[track_caller]
    pub(crate) fn add_applied(&self, alpha: &[f64], beta: &[[f64; D]], x: &BlockField<D>, sums: &mut [f64]) {
        self.accumulate(alpha, beta, x.set(), sums, |_, rows, tile| {
            let mut input = [0.0; TILE * TILE * TILE];
            let input = &mut input[..TILE.pow(D as u32)];
            x.gather_rows::<0>(tile.slots, tile.rows, input);
            Arch::new().dispatch(Applied { rows, input, tile: tile.sums });
        });
    }

    /// Calls `add` for every block of points with a tile of zeros, and adds the tiles to the blocks of `sums`.
    ///
    /// A tile reaches from its block to the next along each axis. So blocks whose coordinate along the first axis is even
    /// come first, then the others; those of one kind in different slabs write to different blocks. Sums run in the same
    /// order for any number of threads.
    #[track_caller]
    fn accumulate(
        &self,
        alpha: &[f64],
        beta: &[[f64; D]],
        set: &IndexSet<D>,
        sums: &mut [f64],
        add: impl Fn(Range<usize>, Rows<'_, D>, Tile<'_>) + Sync,
    ) {
        let volume = IndexSet::<D>::BLOCK;
        assert_eq!(sums.len(), volume * set.block_count(), "all blocks of the set");
        assert!(alpha.len() == self.places.len() && beta.len() == alpha.len(), "one row per point");
        for parity in 0..2 {
            let mut rest = &mut sums[..];
            let mut done = 0;
            let mut tasks = Vec::new();
            for slab in self.blocks.chunk_by(|a, b| a.start[0] == b.start[0]) {
                let from = slab[0].start[0];
                if from / SIDE as i64 % 2 != parity {
                    continue;
                }
                let slots = set.slab(from as u32, (from + 2 * SIDE as i64) as u32);
                let (_, after) = rest.split_at_mut((slots.start - done) * volume);
                let (part, after) = after.split_at_mut(slots.len() * volume);
                tasks.push((slab, slots.start, part));
                (rest, done) = (after, slots.end);
            }
            tasks.into_par_iter().for_each_init(
                || vec![0.0; TILE.pow(D as u32)],
                |sums, (slab, first, part)| {
                    let mut slots = [0; 8];
                    let slots = &mut slots[..1 << D];
                    for block in slab {
                        set.slots_around(block.start, 0, slots);
                        block.row_numbers().for_each(|row| sums[row * TILE..][..TILE].fill(0.0));
                        let points = block.points.clone();
                        let (places, alpha) = (&self.places[points.clone()], &alpha[points.clone()]);
                        let rows = Rows { places, alpha, beta: &beta[points.clone()], sides: &self.sides };
                        add(points, rows, Tile { sums, slots, rows: block.rows() });
                        add_tile(block, slots, sums, part, first);
                    }
                },
            );
        }
    }

    fn split<'s, T>(&'s self, out: &'s mut [T]) -> Vec<(&'s Block<D>, &'s mut [T])> {
        let mut rest = out;
        let mut parts = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            let (part, after) = rest.split_at_mut(block.points.len());
            parts.push((block, part));
            rest = after;
        }
        parts
    }
}

/// The functions that act on a block of cells.
struct Tile<'a> {
    /// A number for each; arbitrary outside the rows.
    sums: &'a mut [f64],
    /// The blocks that they belong to.
    slots: &'a [u32],
    rows: &'a [u16],
}

/// Adds a block's tile to the blocks that it reaches, those from slot `first` on.
fn add_tile<const D: usize>(block: &Block<D>, slots: &[u32], tile: &[f64], part: &mut [f64], first: usize) {
    for row in block.row_numbers() {
        let (x, y) = if D == 3 { (row / TILE, row % TILE) } else { (0, row) };
        let to = (x % SIDE * SIDE + y % SIDE) * SIDE;
        let slots = &slots[(x / SIDE * 2 + y / SIDE) * 2..][..2];
        let (own, after) = tile[row * TILE..][..TILE].split_at(SIDE);
        add_row::<D, SIDE>(slots[0], own, part, first, to);
        add_row::<D, { TILE - SIDE }>(slots[1], after, part, first, to);
    }
}

/// Adds `N` numbers to a block.
#[inline(always)]
fn add_row<const D: usize, const N: usize>(slot: u32, row: &[f64], part: &mut [f64], first: usize, to: usize) {
    if slot == IndexSet::<D>::NO_SLOT {
        return;
    }
    let out = part[(slot as usize - first) * IndexSet::<D>::BLOCK + to..].first_chunk_mut::<N>();
    if let (Some(out), Some(row)) = (out, row.first_chunk::<N>()) {
        for k in 0..N {
            out[k] += row[k];
        }
    }
}

struct Transposed<'a, const D: usize> {
    rows: Rows<'a, D>,
    y: &'a [f64],
    tile: &'a mut [f64],
}

impl<const D: usize> WithSimd for Transposed<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for index in 0..self.rows.count() {
            self.rows.row(index).add_to(self.tile, self.y[index]);
        }
    }
}

struct Squares<'a, const D: usize> {
    rows: Rows<'a, D>,
    tile: &'a mut [f64],
}

impl<const D: usize> WithSimd for Squares<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for index in 0..self.rows.count() {
            self.rows.row(index).add_squares_to(self.tile);
        }
    }
}

struct Applied<'a, const D: usize> {
    rows: Rows<'a, D>,
    input: &'a [f64],
    tile: &'a mut [f64],
}

impl<const D: usize> WithSimd for Applied<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for index in 0..self.rows.count() {
            let row = self.rows.row(index);
            row.add_to(self.tile, row.dot(self.input));
        }
    }
}
