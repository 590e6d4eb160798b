//! Points that repeat others, and an order for the rest.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// Points are told apart to `2^-FINEST` of the frame, a millionth: detail of that size is far below any cell.
const FINEST: u32 = 20;
/// Repetitions are told from detail by a gap of so many octaves: lattices over which hardly any group of points falls apart.
const GAP: u32 = 3;
/// How much hardly any is: random samples of a curve that are half apart grow by 1.75 in so many octaves, of a surface by more. What
/// groups grow by comes from those that the border of a cell divides.
const HARDLY: f64 = 1.5;

/// One point, the first, of each group that lies closer together than the rest by far: equal ones, such as differ by rounding, and
/// those of places that were measured again and again. In the frame, where points lie between -1 and 1.
///
/// What a group is the points say themselves. The number of lattice cells that hold them, N(h), grows as the cells' side h is
/// halved until each sample of the surface has its own cell. If N then stands still for several octaves before it grows again to at
/// least twice that number, and most of those cells hold several points, the points come in groups. (A small part that is sampled much
/// more closely than the rest falls apart as late, but is in few of the cells.)
///
/// They come along a curve that stays in a cell until it has seen all of it (Morton 1966): what is near in space is near in memory,
/// and in whatever order the points were given, the rest of the road sees the same one.
pub fn without_repetitions<const D: usize>(points: &[[f64; D]]) -> Vec<[f64; D]> {
    let codes: Vec<u64> = points.par_iter().map(|p| morton(&cell(p, FINEST))).collect();
    let mut sorted = codes.clone();
    sorted.par_sort_unstable();
    let octave = octave_of_groups::<D>(&sorted);
    let mut seen = FxHashSet::with_capacity_and_hasher(points.len(), Default::default());
    let mut kept: Vec<usize> = (0..points.len()).filter(|&index| seen.insert(cell(&points[index], octave))).collect();
    kept.par_sort_unstable_by_key(|&index| (codes[index], index));
    kept.into_iter().map(|index| points[index]).collect()
}

/// The lattice cell that a point lies in, by its indices.
fn cell<const D: usize>(point: &[f64; D], octave: u32) -> [i32; D] {
    // Below 2^21 in size.
    point.map(|x| (x * f64::from(1u32 << octave)).round() as i32)
}

/// Cells of side `2^-octave` hold one group each; `codes` are sorted.
fn octave_of_groups<const D: usize>(codes: &[u64]) -> u32 {
    // Neighbours on the curve first differ at the octave at which their cells do, of D bits per octave the finest being the last; equal
    // ones at none.
    let differ = |pair: &[u64]| match pair[0] ^ pair[1] {
        0 => FINEST as usize + 1,
        bits => FINEST.saturating_sub(bits.ilog2() / D as u32) as usize,
    };
    let splits: Vec<usize> = codes.windows(2).map(differ).collect();
    let mut occupied = [1usize; FINEST as usize + 1];
    let mut alone = [0usize; FINEST as usize + 1];
    let count_from = |counts: &mut [usize], octave: usize| counts.iter_mut().skip(octave).for_each(|count| *count += 1);
    splits.iter().for_each(|&split| count_from(&mut occupied, split));
    // A point has a cell to itself from where it differs from both neighbours.
    let after = splits.iter().copied().chain([0]);
    std::iter::once(0).chain(splits.iter().copied()).zip(after).for_each(|(a, b)| count_from(&mut alone, a.max(b)));
    let most = occupied[FINEST as usize];
    // The longest standstill with half of all cells at most; a lattice that has only begun to fill has too few to tell.
    let stands = |from: u32, to: u32| occupied[to as usize] as f64 <= HARDLY * occupied[from as usize] as f64;
    (1..=FINEST - GAP)
        .filter(|&from| 2 * occupied[from as usize] <= most && occupied[from as usize] >= FEWEST)
        .filter(|&from| 2 * alone[from as usize] <= occupied[from as usize])
        .find(|&from| stands(from, from + GAP))
        .map_or(FINEST, |from| from + 1)
}

/// Fewer groups have no shape.
const FEWEST: usize = 10;

/// The bits of the indices, made positive, in turn.
fn morton<const D: usize>(index: &[i32; D]) -> u64 {
    let mut code = 0;
    for bit in (0..=FINEST).rev() {
        for i in index {
            code = code << 1 | u64::from((i + (1 << FINEST)) as u32 >> bit & 1);
        }
    }
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(count: u32) -> Vec<[f64; 2]> {
        let turn = std::f64::consts::TAU / f64::from(count);
        (0..count).map(|i| (turn * f64::from(i)).sin_cos()).map(|(s, c)| [0.5 * c, 0.5 * s]).collect()
    }

    #[test]
    fn places_that_were_measured_again_are_taken_once() {
        let places = circle(100);
        for jitter in [0.0, 1e-12, 1e-8, 1e-6, 1e-4] {
            let wobble = |i: u32| jitter * (f64::from(i) * 0.754_877_666).fract();
            let again: Vec<[f64; 2]> = (0..2000u32).map(|i| places[i as usize % 100].map(|x| x + wobble(i))).collect();
            let kept = without_repetitions(&again).len();
            // A place on the border of cells is taken up to four times; of a hundred places few are.
            assert!((100..=130).contains(&kept), "{jitter}: {kept}");
        }
    }

    /// By their coordinates, one after the other.
    fn sorted<const D: usize>(mut points: Vec<[f64; D]>) -> Vec<[f64; D]> {
        points.sort_by(|a, b| a.partial_cmp(b).expect("coordinates are finite"));
        points
    }

    #[test]
    fn uneven_samples_are_kept() {
        assert_eq!(sorted(without_repetitions(&circle(1000))), sorted(circle(1000)));
        // A hundred times denser in one part.
        let mut uneven = circle(100);
        uneven.extend((0..1000).map(|i| 1e-5 * 62.8 * f64::from(i)).map(|t| [0.5 * t.cos() + 1e-4, 0.5 * t.sin()]));
        assert_eq!(sorted(without_repetitions(&uneven)), sorted(uneven));
        // A small part that is sampled as densely against its own size: when the large one has fallen apart it still is in a few cells.
        let mut small = circle(100);
        small.extend(circle(150).iter().map(|p| [0.8 + 1e-3 * p[0], 1e-3 * p[1]]));
        assert_eq!(sorted(without_repetitions(&small)), sorted(small));
        let lattice: Vec<[f64; 3]> =
            (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(|x| f64::from(x) / 10.0 - 0.45)).collect();
        assert_eq!(sorted(without_repetitions(&lattice)), sorted(lattice));
    }

    #[test]
    fn neighbours_follow_each_other_in_whatever_order_they_came() {
        let lattice: Vec<[f64; 2]> =
            (0..4096).map(|i| [f64::from(i % 64), f64::from(i / 64)].map(|x| x / 64.0 - 0.5)).collect();
        let ordered = without_repetitions(&lattice);
        // Four by four neighbours, sixteen after sixteen.
        for patch in ordered.chunks(16) {
            assert!(
                (0..2).all(|axis| patch.iter().all(|p| (p[axis] - patch[0][axis]).abs() < 4.0 / 64.0)),
                "{patch:?}"
            );
        }
        let shuffled: Vec<[f64; 2]> = (0..4096).map(|i| lattice[i * 1531 % 4096]).collect();
        assert_eq!(without_repetitions(&shuffled), ordered);
    }
}
