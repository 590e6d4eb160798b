//! Memory that is warm when a run asks for it.
//!
//! The host of a virtual machine may take back memory that has been free for some seconds; whoever touches a page of it next waits
//! for the host, many times as long as for a page that was freed just before. So as much as a run is going to take stays in use
//! until the run takes it: what is timed is the program, not its host.

use std::hint::black_box;
use std::time::Instant;

/// Bytes that are given back at a time; more than allocators keep for themselves.
const PIECE: usize = 64 << 20;
/// So many bytes are given back before they are needed.
const AHEAD: usize = 512 << 20;
/// At most one part in so many of what a run may take is kept in use: finding little free, it would make do with less.
const PARTS: u64 = 2;

/// Memory in use, to be given back piece by piece.
pub struct Ballast {
    pieces: Vec<Vec<u8>>,
    /// Bytes that the run takes at its peak.
    peak: usize,
}

impl Ballast {
    /// For a run that takes so many bytes at its peak: zero if that is not known. What it needs first is free again, but warm. Where
    /// memory is short there is none.
    pub fn new(peak: usize) -> Self {
        let limit = zeroset::memory_limit(None).unwrap_or(0);
        if peak.saturating_add(AHEAD) as u64 > limit / PARTS {
            return Self { pieces: vec![], peak };
        }
        let mut ballast = Self { pieces: touched(peak.saturating_add(AHEAD)), peak };
        ballast.make_room(0);
        ballast
    }

    /// Makes room for a run that takes so many bytes by now.
    pub fn make_room(&mut self, taken: usize) {
        self.pieces.truncate(self.peak.saturating_sub(taken.saturating_add(AHEAD)) / PIECE);
    }
}

/// At least so many bytes, of which every page has been touched.
fn touched(bytes: usize) -> Vec<Vec<u8>> {
    // Zeros would be promised only.
    black_box((0..bytes.div_ceil(PIECE)).map(|_| vec![1; PIECE]).collect())
}

/// Seconds per 10⁹ bytes that the first touch of memory takes: as it is found, and just after it was given back.
pub fn first_touch() -> [f64; 2] {
    [(); 2].map(|()| {
        let start = Instant::now();
        drop(touched(AHEAD));
        start.elapsed().as_secs_f64() / (AHEAD as f64 / 1e9)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_leave_as_the_run_grows() {
        let mut ballast = Ballast { pieces: vec![vec![]; 9], peak: AHEAD + 5 * PIECE / 2 };
        let mut left = |taken| {
            ballast.make_room(taken);
            ballast.pieces.len()
        };
        assert_eq!([left(0), left(PIECE), left(0), left(usize::MAX)], [2, 1, 1, 0]);
    }
}
