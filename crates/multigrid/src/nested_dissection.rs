//! A fill-reducing order for tensor-product bands (George 1973): cut the longest axis by a separator as wide as the
//! band, number both halves first and the separator last.

/// The order in which to eliminate: `order[k]` is the flat index that comes k-th.
pub(crate) fn nested_dissection<const D: usize>(shape: &[usize; D], half_bandwidth: &[usize; D]) -> Vec<usize> {
    let mut order = Vec::with_capacity(shape.iter().product());
    dissect(shape, half_bandwidth, [0; D], *shape, &mut order);
    order
}

fn dissect<const D: usize>(
    shape: &[usize; D],
    half_bandwidth: &[usize; D],
    lower: [usize; D],
    upper: [usize; D],
    order: &mut Vec<usize>,
) {
    let longest = (0..D).max_by_key(|&a| (upper[a] - lower[a]) / half_bandwidth[a].max(1)).unwrap_or(0);
    let (length, width) = (upper[longest] - lower[longest], half_bandwidth[longest].max(1));
    if length <= 3 * width {
        list(shape, lower, upper, order);
        return;
    }
    let cut = lower[longest] + (length - width) / 2;
    let with = |mut corner: [usize; D], value: usize| {
        corner[longest] = value;
        corner
    };
    dissect(shape, half_bandwidth, lower, with(upper, cut), order);
    dissect(shape, half_bandwidth, with(lower, cut + width), upper, order);
    // The separator is itself a slab of lower dimension: dissecting it further only orders its own dense block.
    list(shape, with(lower, cut), with(upper, cut + width), order);
}

fn list<const D: usize>(shape: &[usize; D], lower: [usize; D], upper: [usize; D], order: &mut Vec<usize>) {
    if (0..D).any(|a| lower[a] >= upper[a]) {
        return;
    }
    let mut index = lower;
    loop {
        order.push(index.iter().zip(shape).fold(0, |flat, (i, n)| flat * n + i));
        let Some(axis) = (0..D).rev().find(|&a| index[a] + 1 < upper[a]) else { return };
        index[axis] += 1;
        index[axis + 1..].copy_from_slice(&lower[axis + 1..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_everything_once() {
        for shape in [[1, 1, 1], [19, 19, 6], [7, 30, 11]] {
            let mut order = nested_dissection(&shape, &[3, 3, 3]);
            order.sort_unstable();
            assert!(order.into_iter().eq(0..shape.iter().product()));
        }
    }
}
