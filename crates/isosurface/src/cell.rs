//! The combinatorics of one cubic cell.
//!
//! Corner `c` has bit 0 set for the upper end in x, bit 1 in y, bit 2 in z. Edge `4 a + m` runs along axis `a`; the two
//! bits of `m` say where it lies along the axes `a + 1` and `a + 2` (cyclically). Face `2 a + s` is the lower (`s = 0`) or
//! upper (`s = 1`) one along axis `a`.

/// The lower and the upper corner of each edge.
pub(crate) fn edge_corners(edge: usize) -> [usize; 2] {
    let (axis, m) = (edge / 4, edge % 4);
    let lower = ((m & 1) << ((axis + 1) % 3)) | ((m >> 1) << ((axis + 2) % 3));
    [lower, lower | (1 << axis)]
}

/// The edge between two corners that differ in one bit.
pub(crate) fn edge_between(a: usize, b: usize) -> usize {
    let axis = (a ^ b).trailing_zeros() as usize;
    let m = ((a >> ((axis + 1) % 3)) & 1) | (((a >> ((axis + 2) % 3)) & 1) << 1);
    4 * axis + m
}

/// The two faces on which an edge lies, as bits.
pub(crate) fn edge_faces(edge: usize) -> u8 {
    let (axis, m) = (edge / 4, edge % 4);
    let face = |axis: usize, side: usize| 1u8 << (2 * (axis % 3) + side);
    face(axis + 1, m & 1) | face(axis + 2, m >> 1)
}

/// The corners of a face, counter-clockwise seen from outside the cell.
pub(crate) fn face_corners(face: usize) -> [usize; 4] {
    let (axis, side) = (face / 2, face % 2);
    let (b, c) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = side << axis;
    if side == 1 { [base, base | b, base | b | c, base | c] } else { [base, base | c, base | b | c, base | b] }
}

/// Whether the positive corners of a face with alternating signs are joined to each other.
///
/// The asymptotic decider (Nielson and Hamann 1991): they are where the bilinear interpolant is positive at its saddle. Both
/// cells at the face multiply the same pairs, so they decide alike to the last bit.
pub(crate) fn positives_joined(values: [f64; 4]) -> bool {
    let scale = power_of_two_below(&values);
    let v = values.map(|v| v / scale);
    let (first, second) = (v[0] * v[2], v[1] * v[3]);
    if v[0] >= 0.0 { first > second } else { second > first }
}

/// The power of two at or below the largest magnitude: dividing by it is exact, and products neither overflow nor vanish.
pub(crate) fn power_of_two_below(values: &[f64]) -> f64 {
    let largest = values.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    f64::from_bits(largest.to_bits() & EXPONENT)
}

/// The contour on a face: up to two steps from cut edge to cut edge, with f > 0 on their left seen from outside the cell.
pub(crate) fn face_segments(face: usize, values: &[f64; 8]) -> impl Iterator<Item = [usize; 2]> {
    let corners = face_corners(face);
    let v = corners.map(|c| values[c]);
    let leaves = move |k: usize| v[k % 4] >= 0.0 && v[(k + 1) % 4] < 0.0;
    let enters = move |k: &usize| v[k % 4] < 0.0 && v[(k + 1) % 4] >= 0.0;
    let edge = move |k: usize| edge_between(corners[k % 4], corners[(k + 1) % 4]);
    // From where the face's rim leaves the positive corners to where it enters them: back around the same run of positive
    // corners if these are apart, on around the negative run if they are joined.
    let ahead = (0..4).filter(|&k| leaves(k)).count() == 2 && positives_joined(v);
    (0..4).filter(move |&k| leaves(k)).filter_map(move |leave| {
        let step = |step: usize| if ahead { leave + step } else { leave + 4 - step };
        (1..4).map(step).find(enters).map(|enter| [edge(leave), edge(enter)])
    })
}

/// The contour on the cell's surface: `next[e]` is the edge to which the contour goes on from cut edge `e`, with f > 0 on
/// its left seen from outside the cell.
pub(crate) fn contour(values: &[f64; 8]) -> [Option<u8>; 12] {
    let mut next = [None; 12];
    for face in 0..6 {
        for [from, to] in face_segments(face, values) {
            next[from] = Some(to as u8);
        }
    }
    next
}

/// The closed loops of a contour, each beginning at its lowest edge.
pub(crate) fn loops(next: &[Option<u8>; 12]) -> Vec<Vec<usize>> {
    let mut seen = [false; 12];
    let mut loops = Vec::new();
    for start in 0..12 {
        if seen[start] || next[start].is_none() {
            continue;
        }
        let mut cycle = Vec::new();
        let mut edge = start;
        while !seen[edge] {
            seen[edge] = true;
            cycle.push(edge);
            match next[edge] {
                Some(following) => edge = usize::from(following),
                None => break,
            }
        }
        loops.push(cycle);
    }
    loops
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::array::{uniform4, uniform8};
    use proptest::prelude::*;

    #[test]
    fn edges_and_faces_fit_together() {
        for edge in 0..12 {
            let [a, b] = edge_corners(edge);
            assert_eq!(edge_between(a, b), edge);
            for face in 0..6 {
                let on = face_corners(face).contains(&a) && face_corners(face).contains(&b);
                assert_eq!(edge_faces(edge) >> face & 1 == 1, on);
            }
        }
        // Counter-clockwise: the normal by the right-hand rule points out of the cell.
        for face in 0..6 {
            let p = face_corners(face).map(|c| [0, 1, 2].map(|a| (c >> a & 1) as i32));
            let d = |k: usize| [0, 1, 2].map(|a| p[k][a] - p[0][a]);
            let (u, v) = (d(1), d(2));
            let n = [0, 1, 2].map(|a| u[(a + 1) % 3] * v[(a + 2) % 3] - u[(a + 2) % 3] * v[(a + 1) % 3]);
            assert_eq!(n[face / 2], if face % 2 == 1 { 1 } else { -1 });
        }
    }

    proptest! {
        #[test]
        fn neighbours_draw_the_same_contour_on_their_face(
            shared in uniform4(-3i8..=3), rest in uniform8(-1.0..1.0f64), axis in 0usize..3,
        ) {
            // The neighbours' shared corners, by the bits along the two other axes; small integers make ties.
            let bits = |c: usize| (c >> ((axis + 1) % 3) & 1) | ((c >> ((axis + 2) % 3) & 1) << 1);
            let on_upper = |c: usize| c >> axis & 1 == 1;
            let first = std::array::from_fn(|c| if on_upper(c) { 0.1 * f64::from(shared[bits(c)]) } else { rest[c] });
            let second = std::array::from_fn(|c| if on_upper(c) { rest[c] } else { 0.1 * f64::from(shared[bits(c)]) });
            // The edge of the second cell as the first one names it.
            let seen = |edge: usize| {
                let [a, b] = edge_corners(edge);
                edge_between(a | 1 << axis, b | 1 << axis)
            };
            let mut ours: Vec<[usize; 2]> = face_segments(2 * axis + 1, &first).collect();
            let mut theirs: Vec<[usize; 2]> =
                face_segments(2 * axis, &second).map(|[from, to]| [seen(to), seen(from)]).collect();
            ours.sort_unstable();
            theirs.sort_unstable();
            prop_assert_eq!(ours, theirs);
        }

        #[test]
        fn contours_do_not_depend_on_the_scale(values in uniform8(-1.0..1.0f64), exponent in -900i32..1000) {
            let scaled = values.map(|v| v * 2f64.powi(exponent));
            prop_assert_eq!(contour(&values), contour(&scaled));
        }
    }

    #[test]
    fn every_sign_pattern_has_closed_contours() {
        for pattern in 0..256usize {
            let values: [f64; 8] = std::array::from_fn(|c| if pattern >> c & 1 == 1 { 1.0 } else { -0.9 });
            let next = contour(&values);
            let cut = (0..12).filter(|&e| edge_corners(e).map(|c| pattern >> c & 1).iter().sum::<usize>() == 1);
            let cut: Vec<usize> = cut.collect();
            let mut targets: Vec<usize> = next.iter().flatten().map(|&e| usize::from(e)).collect();
            targets.sort_unstable();
            assert_eq!(targets, cut, "one contour in and one out of every cut edge");
            assert_eq!(loops(&next).iter().map(Vec::len).sum::<usize>(), cut.len());
        }
    }
}
