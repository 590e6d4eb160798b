//! Points that are left out, and what is left of the others.

use crate::points::spacing::Spacing;

/// If a larger share of the points would be left out, they are the shape.
pub const MOST: f64 = 0.25;

/// Marks more members: `found` says which of those that were not marked before.
pub fn mark(marks: &mut [bool], found: &[bool]) {
    marks.iter_mut().filter(|mark| !**mark).zip(found).for_each(|(mark, found)| *mark = *found);
}

/// Those of the points that are not `off`, with their spacing, where `spacing` is that of all.
pub fn without<const D: usize>(points: &[[f64; D]], off: &[bool], spacing: Spacing) -> (Vec<[f64; D]>, Spacing) {
    let kept = kept(points, off);
    let spacing = if kept.len() < points.len() { Spacing::of(&kept) } else { spacing };
    (kept, spacing)
}

/// Those of the points that are not `off`.
pub fn kept<const D: usize>(points: &[[f64; D]], off: &[bool]) -> Vec<[f64; D]> {
    points.iter().zip(off).filter(|(_, off)| !**off).map(|(point, _)| *point).collect()
}
