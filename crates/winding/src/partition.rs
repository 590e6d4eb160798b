//! Points in boxes of few points: halved by number across the longest side, again and again.

use std::cmp::Ordering;

/// Parts are split at multiples of this many points, so that all leaves but the last fill whole vector registers.
pub(crate) const BLOCK: usize = 8;
/// Halves of fewer points are sorted by one thread.
const FEW: usize = 1 << 12;

/// A box: a run of points in the partition's order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part {
    pub first: u32,
    pub end: u32,
    /// The next part in preorder that does not lie in this one.
    pub skip: u32,
}

impl Part {
    /// The points, in the partition's order.
    pub fn run(&self) -> std::ops::Range<usize> {
        self.first as usize..self.end as usize
    }

    /// Whether part `index`, this one, has no parts of its own. If it has, they are `index + 1` and that one's `skip`.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.skip as usize == index + 1
    }
}

/// Boxes within boxes, in preorder.
#[derive(Debug, Clone)]
pub(crate) struct Partition<const D: usize> {
    /// The points in such an order that every box has a run of them.
    pub points: Vec<[f64; D]>,
    /// Their places in the input.
    pub order: Vec<u32>,
    pub parts: Vec<Part>,
}

impl<const D: usize> Partition<D> {
    /// Splits boxes of more than `most` points, at least [`BLOCK`]. As halves have nearly equal numbers, the depth is at
    /// most log₂ N however the points lie. The order of the input decides between equal points only, also inside leaves.
    pub fn new(points: &[[f64; D]], most: usize) -> Self {
        debug_assert!(most >= BLOCK && points.len() <= u32::MAX as usize);
        let mut entries: Vec<([f64; D], u32)> = points.iter().copied().zip(0..).collect();
        sort_halves(&mut entries, most);
        let mut parts = Vec::new();
        let mut waiting = Vec::new();
        waiting.extend((!points.is_empty()).then_some(0..points.len()));
        while let Some(run) = waiting.pop() {
            parts.push(Part { first: run.start as u32, end: run.end as u32, skip: 0 });
            if run.len() > most {
                let half = run.start + half(run.len());
                waiting.push(half..run.end);
                waiting.push(run.start..half);
            }
        }
        for index in (0..parts.len()).rev() {
            let leaf = parts[index].run().len() <= most;
            parts[index].skip = if leaf { index as u32 + 1 } else { parts[parts[index + 1].skip as usize].skip };
        }
        let (points, order) = entries.into_iter().unzip();
        Self { points, order, parts }
    }

    /// The parts that have no parts.
    pub fn leaves(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().enumerate().filter(|(index, part)| part.is_leaf(*index)).map(|(_, part)| part)
    }
}

/// Of a number of points, those in the first half.
fn half(count: usize) -> usize {
    (count / 2).next_multiple_of(BLOCK)
}

/// Sorts points so that every half, of halves of more than `most` points, is a run.
fn sort_halves<const D: usize>(part: &mut [([f64; D], u32)], most: usize) {
    let axis = longest_side(part);
    if part.len() <= most {
        part.sort_unstable_by(|a, b| compare(axis, a, b));
        return;
    }
    let half = half(part.len());
    part.select_nth_unstable_by(half, |a, b| compare(axis, a, b));
    let (low, high) = part.split_at_mut(half);
    if low.len() < FEW {
        sort_halves(low, most);
        sort_halves(high, most);
    } else {
        rayon::join(|| sort_halves(low, most), || sort_halves(high, most));
    }
}

/// The smallest and the largest coordinates.
pub(crate) fn bounds<'a, const D: usize>(points: impl IntoIterator<Item = &'a [f64; D]>) -> [[f64; D]; 2] {
    let mut bounds = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];
    for point in points {
        for axis in 0..D {
            bounds[0][axis] = bounds[0][axis].min(point[axis]);
            bounds[1][axis] = bounds[1][axis].max(point[axis]);
        }
    }
    bounds
}

/// The first of equals.
fn longest_side<const D: usize>(part: &[([f64; D], u32)]) -> usize {
    let [low, high] = bounds(part.iter().map(|(point, _)| point));
    (1..D).fold(0, |best, axis| if high[axis] - low[axis] > high[best] - low[best] { axis } else { best })
}

/// By the coordinate on `axis`, then by those on the axes that follow cyclically, then by the place in the input.
fn compare<const D: usize>(axis: usize, a: &([f64; D], u32), b: &([f64; D], u32)) -> Ordering {
    let by_coordinates = (axis..axis + D).map(|k| a.0[k % D].total_cmp(&b.0[k % D]));
    by_coordinates.fold(Ordering::Equal, Ordering::then).then(a.1.cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const D: usize>(points: &[[f64; D]]) -> Partition<D> {
        let partition = Partition::new(points, 16);
        let mut order = partition.order.clone();
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..points.len() as u32));
        assert!(partition.order.iter().zip(&partition.points).all(|(&i, p)| points[i as usize] == *p));
        let mut end = 0;
        for leaf in partition.leaves() {
            assert!(leaf.run().start == end && (1..=16).contains(&leaf.run().len()));
            end = leaf.run().end;
            assert!(end % BLOCK == 0 || end == points.len());
        }
        assert_eq!(end, points.len());
        partition
    }

    #[test]
    fn runs_of_leaves_follow_each_other() {
        for count in [0, 1, 8, 15, 16, 17, 24, 33, 1000] {
            let points: Vec<[f64; 3]> =
                (0..count).map(|i| [f64::from(i * 7 % 11), f64::from(i * i % 13), f64::from(i % 5)]).collect();
            check(&points);
        }
        let depth_two = check(&vec![[1.0, 2.0]; 40]);
        // 40 = 24 + 16, 24 = 16 + 8: equal points are split by number as others are.
        assert_eq!(depth_two.parts.len(), 5);
    }

    #[test]
    fn the_order_of_the_input_does_not_matter() {
        let points: Vec<[f64; 2]> = (0..500).map(|i| [f64::from(i * 37 % 101), f64::from(i / 101)]).collect();
        let reversed: Vec<[f64; 2]> = points.iter().rev().copied().collect();
        assert_eq!(check(&points).points, check(&reversed).points);
    }
}
