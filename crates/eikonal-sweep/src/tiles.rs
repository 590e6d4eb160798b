//! A lattice in pieces that can be swept at the same time.

use std::array::from_fn;

use rayon::prelude::*;

use crate::ghost::Ghosted;
use crate::sweep::sweep_order;

/// So many nodes are more work than handing them out.
const ENOUGH: usize = 2048;

/// The rows of a tile along an axis are a multiple of this: so many are visited at once.
const MULTIPLE: usize = 8;

/// What a scheme knows of the nodes of a ghosted lattice.
pub(crate) trait Field<const D: usize>: Sized + Send + Sync {
    /// Visits every node of a lattice once, in the order of this sweep, and returns the largest decrease. `first` is the first node's
    /// place in the whole lattice.
    fn relax(&mut self, lattice: &Ghosted<D>, first: [usize; D], sweep: usize) -> f64;

    /// The part in a tile, where the nodes around it are ghosts.
    fn part(&self, tile: &Tile<'_, D>) -> Self;

    /// Takes over parts that have been visited.
    fn put_back(&mut self, parts: &Parts<'_, '_, D, Self>);
}

/// Tiles of one diagonal, by their place along the first axis, with their parts of a field.
pub(crate) struct Parts<'l, 't, const D: usize, F> {
    tiles: &'t [Tile<'l, D>],
    parts: Vec<F>,
}

impl<'l, const D: usize, F: Sync> Parts<'l, '_, D, F> {
    pub(crate) fn par_iter(&self) -> impl IndexedParallelIterator<Item = (&Tile<'l, D>, &F)> {
        self.tiles.par_iter().zip(&self.parts)
    }

    /// For each tile what [`Tile::put_back`] takes of an array. Tiles of a diagonal lie in different slabs.
    pub(crate) fn slabs<'w, T: Send>(&self, whole: &'w mut [T]) -> impl IndexedParallelIterator<Item = &'w mut [T]> {
        let Tile { tiles, number, .. } = &self.tiles[0];
        let plane = tiles.whole.strides()[0];
        whole[plane..].par_chunks_mut(tiles.side * plane).skip(number[0])
    }
}

/// The tiles of a lattice: in space all rows of nodes along the last axis in a square of places, the last ones cut; in the plane, or
/// with one thread, one tile.
pub(crate) struct Tiles<'l, const D: usize> {
    whole: &'l Ghosted<D>,
    side: usize,
    counts: [usize; 2],
}

impl<'l, const D: usize> Tiles<'l, D> {
    pub(crate) fn new(whole: &'l Ghosted<D>) -> Self {
        let [first, second] = [whole.shape()[0], if D == 3 { whole.shape()[1] } else { 1 }];
        let side = ENOUGH.div_ceil(whole.row_len()).isqrt().next_multiple_of(MULTIPLE);
        let side = if D == 3 && rayon::current_num_threads() > 1 { side } else { first.max(second) };
        Self { whole, side, counts: [first.div_ceil(side), second.div_ceil(side)] }
    }

    /// As [`Field::relax`] on the whole lattice: it sees neighbours as if the rows were visited one after the other. Tiles on a
    /// diagonal are no neighbours of each other, so that they can be visited at the same time, diagonal after diagonal (Detrixhe,
    /// Gibou and Min 2013).
    pub(crate) fn relax(&self, field: &mut impl Field<D>, sweep: usize) -> f64 {
        if self.counts == [1, 1] {
            return field.relax(self.whole, [0; D], sweep);
        }
        let forwards = sweep_order::<D>(sweep);
        let mut largest = 0.0;
        for number in 0..self.counts[0] + self.counts[1] - 1 {
            let tiles = self.diagonal(number, [forwards[0], forwards[1]]);
            let one = |tile: &Tile<'_, D>| {
                let mut part = field.part(tile);
                let decrease = part.relax(&tile.lattice, tile.first(), sweep);
                (part, decrease)
            };
            let (parts, decreases): (Vec<_>, Vec<f64>) = tiles.par_iter().map(one).unzip();
            largest = decreases.into_iter().fold(largest, f64::max);
            field.put_back(&Parts { tiles: &tiles, parts });
        }
        largest
    }

    /// The tiles so many steps from the one where a visit begins, by their place along the first axis.
    fn diagonal(&self, steps: usize, forwards: [bool; 2]) -> Vec<Tile<'_, D>> {
        let firsts = steps.saturating_sub(self.counts[1] - 1)..=steps.min(self.counts[0] - 1);
        let number = |first| {
            let steps = [first, steps - first];
            from_fn(|axis| if forwards[axis] { steps[axis] } else { self.counts[axis] - 1 - steps[axis] })
        };
        let mut tiles: Vec<_> = firsts.map(|first| self.tile(number(first))).collect();
        tiles.sort_unstable_by_key(|tile| tile.number);
        tiles
    }

    fn tile(&self, number: [usize; 2]) -> Tile<'_, D> {
        let mut shape = self.whole.shape();
        for axis in 0..2 {
            shape[axis] = self.side.min(shape[axis] - number[axis] * self.side);
        }
        Tile { tiles: self, number, lattice: Ghosted::new(shape) }
    }
}

/// A part of a lattice in space.
pub(crate) struct Tile<'l, const D: usize> {
    tiles: &'l Tiles<'l, D>,
    number: [usize; 2],
    /// The nodes with those around them as ghosts.
    lattice: Ghosted<D>,
}

impl<const D: usize> Tile<'_, D> {
    /// The part of an array.
    pub(crate) fn part<T: Copy>(&self, whole: &[T]) -> Vec<T> {
        let [plane, row] = [self.tiles.whole.strides()[0], self.tiles.whole.strides()[1]];
        let first = self.first();
        let mut part = Vec::with_capacity(self.lattice.len());
        for i in first[0]..first[0] + self.lattice.shape()[0] + 2 {
            part.extend_from_slice(&whole[i * plane + first[1] * row..][..self.lattice.strides()[0]]);
        }
        part
    }

    /// Copies the part of an array, without ghosts, into the planes that the tile lies in.
    pub(crate) fn put_back<T: Copy>(&self, planes: &mut [T], part: &[T]) {
        let [plane, row] = [self.tiles.whole.strides()[0], self.tiles.whole.strides()[1]];
        let (own_plane, [deep, wide]) = (self.lattice.strides()[0], [self.lattice.shape()[0], self.lattice.shape()[1]]);
        for i in 0..deep {
            let from = &part[(i + 1) * own_plane + row..][..wide * row];
            planes[i * plane + (self.first()[1] + 1) * row..][..wide * row].copy_from_slice(from);
        }
    }

    /// The first node's place in the whole lattice.
    fn first(&self) -> [usize; D] {
        from_fn(|axis| if axis < 2 && D == 3 { self.number[axis] * self.tiles.side } else { 0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often each node has been visited, and what its neighbours looked like; ghosts beyond the lattice are negative.
    struct Visits {
        times: Vec<i32>,
    }

    impl Field<3> for Visits {
        fn relax(&mut self, lattice: &Ghosted<3>, first: [usize; 3], sweep: usize) -> f64 {
            assert_eq!(self.times.len(), lattice.len());
            let forwards = sweep_order(sweep);
            for number in 0..lattice.row_count() {
                let start = lattice.row(number, forwards).start;
                for axis in 0..2 {
                    let stride = lattice.strides()[axis];
                    let [before, after] = if forwards[axis] {
                        [start - stride, start + stride]
                    } else {
                        [start + stride, start - stride]
                    };
                    let here = self.times[start];
                    assert!(self.times[before] < 0 || self.times[before] == here + 1, "visited before");
                    assert!(self.times[after] < 0 || self.times[after] == here, "not yet visited");
                }
                self.times[start..start + lattice.row_len()].iter_mut().for_each(|times| *times += 1);
            }
            (first[0] + first[1]) as f64
        }

        fn part(&self, tile: &Tile<'_, 3>) -> Self {
            Self { times: tile.part(&self.times) }
        }

        fn put_back(&mut self, parts: &Parts<'_, '_, 3, Self>) {
            let slabs = parts.slabs(&mut self.times).zip(parts.par_iter());
            slabs.for_each(|(times, (tile, part))| tile.put_back(times, &part.times));
        }
    }

    #[test]
    fn rows_are_visited_as_if_one_after_the_other() {
        // Several tiles along both axes, the last ones cut; one tile along an axis; one tile in all.
        let cases = [
            ([19, 11, 130], [3, 2]),
            ([50, 29, 13], [4, 2]),
            ([40, 3, 8], [3, 1]),
            ([3, 40, 8], [1, 3]),
            ([4, 4, 4], [1, 1]),
        ];
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        pool.install(|| cases.into_iter().for_each(|(shape, counts)| visit(shape, counts)));
    }

    fn visit(shape: [usize; 3], counts: [usize; 2]) {
        let whole = Ghosted::new(shape);
        let tiles = Tiles::new(&whole);
        assert_eq!(tiles.counts, counts);
        let mut times = vec![-100; whole.len()];
        for number in 0..whole.row_count() {
            let start = whole.row(number, [true; 3]).start;
            times[start..start + shape[2]].fill(0);
        }
        let mut field = Visits { times };
        // All directions of the first two axes.
        let sweeps = [0, 2, 4, 6];
        for sweep in sweeps {
            let largest = tiles.relax(&mut field, sweep);
            let last = counts.map(|count| ((count - 1) * tiles.side) as f64);
            assert_eq!(largest, if counts == [1, 1] { 0.0 } else { last[0] + last[1] });
        }
        let visited: i32 = whole.strip(&field.times, |times| times).into_iter().sum();
        assert_eq!(visited as usize, sweeps.len() * shape.iter().product::<usize>());
        assert!(field.times.iter().all(|times| *times == 4 || *times == -100));
    }
}
