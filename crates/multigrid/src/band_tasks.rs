//! How the blocks of a band level are shared among tasks.

use rayon::prelude::*;
use zeroset_bspline::IndexSet;

/// Blocks per task. Fixed, so that nothing depends on the number of threads.
const BLOCKS: usize = 32;

/// The blocks of a level, as tasks see them.
#[derive(Debug)]
pub(crate) struct BandTasks {
    /// The slots of the blocks around every block.
    around: Vec<u32>,
    /// Blocks around each.
    count: usize,
}

impl BandTasks {
    pub(crate) fn new<const D: usize>(set: &IndexSet<D>) -> Self {
        let count = set.block_count();
        let around_each = 3usize.pow(D as u32);
        let mut around = vec![0; count * around_each];
        around.par_chunks_mut(around_each).enumerate().with_min_len(BLOCKS).for_each(|(slot, slots)| {
            set.slots_around(set.block_start(slot).map(i64::from), 1, slots);
        });
        Self { around, count: around_each }
    }

    /// See [`IndexSet::slots_around`].
    pub(crate) fn slots_around(&self, slot: usize) -> &[u32] {
        &self.around[slot * self.count..][..self.count]
    }

    /// Calls `work` with every block and the entries of its members in `out`.
    pub(crate) fn for_each<const D: usize, B: Send>(
        &self,
        set: &IndexSet<D>,
        out: &mut [f64],
        buffer: impl Fn() -> B + Sync + Send,
        work: impl Fn(&mut B, usize, &mut [f64]) + Sync,
    ) {
        set.shared_out(out, BLOCKS).into_par_iter().for_each_init(buffer, |buffer, (slots, part)| {
            let mut rest = part;
            for slot in slots {
                let (entries, after) = rest.split_at_mut(set.block_ranks(slot).len());
                work(buffer, slot, entries);
                rest = after;
            }
        });
    }
}
