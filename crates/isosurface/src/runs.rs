//! Cells or nodes of a lattice, as runs along its last axis.

use rayon::prelude::*;
use std::ops::Range;
use zeroset_bspline::IndexSet;

/// Consecutive members of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    /// Place of the first along the last axis.
    pub(crate) from: u32,
    /// Place after the last.
    pub(crate) to: u32,
    /// How many members come before.
    pub(crate) first: usize,
}

/// Members of a lattice in C order: a dense one has one run per row, a sparse one a few.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Runs {
    /// Where the runs of each row begin, rows in C order; and the end.
    rows: Vec<usize>,
    runs: Vec<Run>,
    count: usize,
}

impl Runs {
    /// `row` gives the runs of each of `count` rows, apart from each other and in ascending order.
    pub(crate) fn new<I: IntoIterator<Item = [u32; 2]>>(count: usize, mut row: impl FnMut(usize) -> I) -> Self {
        let mut all = Self { rows: Vec::with_capacity(count + 1), runs: vec![], count: 0 };
        all.rows.push(0);
        for index in 0..count {
            for [from, to] in row(index) {
                all.runs.push(Run { from, to, first: all.count });
                all.count += (to - from) as usize;
            }
            all.rows.push(all.runs.len());
        }
        all.runs.shrink_to_fit();
        all
    }

    /// The members of a set, all of which lie in a part of the lattice, by their place in it.
    pub(crate) fn of<const D: usize>(set: &IndexSet<D>, part: &[Range<u32>; D]) -> Self {
        let extent = part.each_ref().map(|part| part.end - part.start);
        let mut found: Vec<(usize, [u32; 2])> = Vec::new();
        for index in set.iter() {
            let index: [u32; D] = std::array::from_fn(|axis| index[axis] - part[axis].start);
            let row = (0..D - 1).fold(0, |row, axis| row * extent[axis] as usize + index[axis] as usize);
            match found.last_mut() {
                Some((last, run)) if *last == row && run[1] == index[D - 1] => run[1] += 1,
                _ => found.push((row, [index[D - 1], index[D - 1] + 1])),
            }
        }
        // The set has them block by block.
        found.par_sort_unstable();
        let mut rest = found.as_slice();
        let count = extent[..D - 1].iter().map(|n| *n as usize).product();
        Self::new(count, |row| {
            let own;
            (own, rest) = rest.split_at(rest.iter().take_while(|(r, _)| *r == row).count());
            union(own.iter().map(|(_, run)| *run).collect())
        })
    }

    /// Number of members.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// The runs of a row.
    pub(crate) fn row(&self, row: usize) -> &[Run] {
        &self.runs[self.rows[row]..self.rows[row + 1]]
    }

    /// Members before a row.
    pub(crate) fn before(&self, row: usize) -> usize {
        self.runs.get(self.rows[row]).map_or(self.count, |run| run.first)
    }

    /// The number of a member.
    pub(crate) fn find(&self, row: usize, place: u32) -> Option<usize> {
        let runs = self.row(row);
        let run = runs.get(runs.partition_point(|run| run.to <= place))?;
        (run.from <= place).then(|| run.first + (place - run.from) as usize)
    }

    /// Looks up members of a row in ascending order.
    pub(crate) fn cursor(&self, row: usize) -> Cursor<'_> {
        Cursor(self.row(row))
    }
}

/// What is left of a row.
pub(crate) struct Cursor<'a>(&'a [Run]);

impl Cursor<'_> {
    /// The number of a member; places must not descend.
    pub(crate) fn find(&mut self, place: u32) -> Option<usize> {
        while let [run, rest @ ..] = self.0 {
            if place < run.to {
                return (run.from <= place).then(|| run.first + (place - run.from) as usize);
            }
            self.0 = rest;
        }
        None
    }
}

/// The union of runs.
pub(crate) fn union(mut all: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    all.sort_unstable();
    let mut joined: Vec<[u32; 2]> = Vec::with_capacity(all.len());
    for [from, to] in all {
        match joined.last_mut() {
            Some(last) if from <= last[1] => last[1] = last[1].max(to),
            _ => joined.push([from, to]),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_numbered_in_order() {
        let rows = [vec![[2, 5], [7, 8]], vec![], vec![[0, 3]]];
        let runs = Runs::new(3, |row| rows[row].clone());
        assert_eq!(runs.len(), 7);
        assert_eq!([0, 1, 2].map(|row| runs.before(row)), [0, 4, 4]);
        let mut number = 0;
        for (row, members) in rows.iter().enumerate() {
            let mut cursor = runs.cursor(row);
            for place in 0..10 {
                let is_member = members.iter().any(|[from, to]| (from..to).contains(&&place));
                let expected = is_member.then_some(number);
                assert_eq!((runs.find(row, place), cursor.find(place)), (expected, expected));
                number += usize::from(is_member);
            }
        }
    }

    #[test]
    fn runs_that_touch_are_joined() {
        assert_eq!(union(vec![[1, 3], [8, 9], [3, 4], [0, 2], [6, 7]]), [[0, 4], [6, 7], [8, 9]]);
    }
}
