//! Points put together coordinate by coordinate.

/// One number per axis, from those of two points.
#[expect(clippy::indexing_slicing, reason = "the axes are counted up to D, the length of both")]
pub fn axis_by_axis<A: Copy, B: Copy, T, const D: usize>(a: [A; D], b: [B; D], pick: impl Fn(A, B) -> T) -> [T; D] {
    std::array::from_fn(|axis| pick(a[axis], b[axis]))
}

/// The least and the largest of the points' coordinates, axis by axis; infinities where there are no points.
pub fn bounding_box<const D: usize>(points: &[[f64; D]]) -> [[f64; D]; 2] {
    let bound = |start, pick: fn(f64, f64) -> f64| {
        points.iter().fold([start; D], |bound, point| axis_by_axis(bound, *point, pick))
    };
    [bound(f64::INFINITY, f64::min), bound(f64::NEG_INFINITY, f64::max)]
}
