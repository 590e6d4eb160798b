//! Floods from several places at once.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

/// Floods of cells, by their numbers, that become one where they meet, or where they come to the same region: cells of which is known that
/// they hang together. They take turns, so that no more is flooded than a few times the smallest piece that hangs together.
pub(crate) struct Floods<'a> {
    /// Where each goes on.
    all: Vec<Ahead<'a>>,
    /// By which each was taken up; itself if it was not.
    taken_up: Vec<usize>,
    count: usize,
    /// Whose turn it is.
    turn: usize,
    /// Which was first in a cell, and in a region.
    of_cell: FxHashMap<usize, usize>,
    of_region: FxHashMap<usize, usize>,
}

/// Cells that a flood has come to, and the cells of regions that it has.
#[derive(Default)]
struct Ahead<'a> {
    cells: Vec<usize>,
    regions: Vec<&'a [usize]>,
}

impl<'a> Floods<'a> {
    /// One from each cell.
    pub(crate) fn from(starts: &BTreeSet<usize>) -> Self {
        Self {
            all: starts.iter().map(|key| Ahead { cells: vec![*key], regions: Vec::new() }).collect(),
            taken_up: (0..starts.len()).collect(),
            count: starts.len(),
            turn: 0,
            of_cell: starts.iter().copied().zip(0..).collect(),
            of_region: FxHashMap::default(),
        }
    }

    /// How many there still are.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The cell from which the next one goes on, to what it is said to meet then; none if it has come to its end.
    pub(crate) fn next(&mut self) -> Option<usize> {
        loop {
            self.turn = (self.turn + 1) % self.all.len().max(1);
            if *self.taken_up.get(self.turn)? != self.turn {
                continue;
            }
            let ahead = &mut self.all[self.turn];
            if let Some(key) = ahead.cells.pop() {
                return Some(key);
            }
            let region = ahead.regions.last_mut()?;
            match region {
                [key, rest @ ..] => {
                    let key = *key;
                    *region = rest;
                    self.meet(key);
                }
                [] => _ = ahead.regions.pop(),
            }
        }
    }

    /// The flood whose turn it is comes to a cell.
    pub(crate) fn meet(&mut self, key: usize) {
        let flood = self.left(self.turn);
        match self.of_cell.insert(key, flood) {
            Some(first) => self.join(flood, first),
            None => self.all[flood].cells.push(key),
        }
    }

    /// The flood whose turn it is comes to a region with these cells.
    pub(crate) fn meet_region(&mut self, region: usize, cells: &'a [usize]) {
        let flood = self.left(self.turn);
        match self.of_region.insert(region, flood) {
            Some(first) => self.join(flood, first),
            None => self.all[flood].regions.push(cells),
        }
    }

    /// The flood that one is part of.
    fn left(&self, mut flood: usize) -> usize {
        while self.taken_up[flood] != flood {
            flood = self.taken_up[flood];
        }
        flood
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.left(a), self.left(b));
        if a == b {
            return;
        }
        let (more, fewer) = if self.all[a].cells.len() < self.all[b].cells.len() { (b, a) } else { (a, b) };
        let mut taken = std::mem::take(&mut self.all[fewer]);
        self.all[more].cells.append(&mut taken.cells);
        self.all[more].regions.append(&mut taken.regions);
        self.taken_up[fewer] = more;
        self.count -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether floods along a line of cells meet, with walls, and a region that cells may belong to.
    fn meet(starts: &[usize], walls: &[usize], region: &[usize]) -> bool {
        let mut floods = Floods::from(&starts.iter().copied().collect());
        while floods.count() > 1 {
            let Some(key) = floods.next() else { return false };
            if region.contains(&key) {
                floods.meet_region(7, region);
            }
            let beside = [key.wrapping_sub(1), key + 1];
            beside.into_iter().filter(|next| *next < 20 && !walls.contains(next)).for_each(|next| floods.meet(next));
        }
        true
    }

    #[test]
    fn floods_meet_where_no_wall_parts_them() {
        assert!(meet(&[3, 4, 17], &[], &[]));
        assert!(!meet(&[3, 4, 17], &[10], &[]));
        assert!(meet(&[3], &[10], &[]) && meet(&[], &[], &[]));
    }

    #[test]
    fn a_region_leads_behind_a_wall() {
        assert!(meet(&[3, 17], &[10], &[0, 19]));
        // It is met in its own piece alone,
        assert!(!meet(&[3, 17], &[10], &[0, 5]));
        // and what is behind two walls has to go through it too.
        assert!(meet(&[3, 12], &[10, 14], &[1, 13, 16]) && !meet(&[3, 12], &[10, 14], &[1, 16]));
    }
}
