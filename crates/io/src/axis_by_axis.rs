//! Points put together coordinate by coordinate.

/// One number per axis, from those of two points.
#[expect(clippy::indexing_slicing, reason = "the axes are counted up to D, the length of both")]
pub(crate) fn axis_by_axis<A: Copy, B: Copy, T, const D: usize>(
    a: [A; D],
    b: [B; D],
    pick: impl Fn(A, B) -> T,
) -> [T; D] {
    std::array::from_fn(|axis| pick(a[axis], b[axis]))
}
