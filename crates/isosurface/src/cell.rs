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
fn edge_between(a: usize, b: usize) -> usize {
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

/// How the positive corners of a face are joined: only for faces with alternating signs is there a question.
///
/// The asymptotic decider (Nielson and Hamann 1991): the positive corners are connected where the bilinear interpolant is
/// positive at its saddle. Both cells at the face multiply the same pairs, so they decide alike to the last bit.
pub(crate) fn positives_joined(values: [f64; 4]) -> bool {
    let (first, second) = (values[0] * values[2], values[1] * values[3]);
    if values[0] >= 0.0 { first > second } else { second > first }
}

/// The contour on the cell's surface: `next[e]` is the edge to which the contour goes on from cut edge `e`, with f > 0 on
/// its left seen from outside the cell.
pub(crate) fn contour(values: &[f64; 8]) -> [Option<u8>; 12] {
    let mut next = [None; 12];
    for face in 0..6 {
        let corners = face_corners(face);
        let v = corners.map(|c| values[c]);
        let edge = |k: usize| edge_between(corners[k % 4], corners[(k + 1) % 4]);
        let positive = |k: usize| v[k % 4] >= 0.0;
        let leaves: Vec<usize> = (0..4).filter(|&k| positive(k) && !positive(k + 1)).collect();
        // From where the face's rim leaves the positive corners to where it enters them: back around the same run of
        // positive corners if these are apart, on around the negative run if they are joined.
        let ahead = leaves.len() == 2 && positives_joined(v);
        for &leave in &leaves {
            let enter = if ahead {
                (1..4).map(|step| leave + step).find(|&k| !positive(k) && positive(k + 1))
            } else {
                (1..4).map(|step| leave + 4 - step).find(|&k| !positive(k) && positive(k + 1))
            };
            if let Some(enter) = enter {
                next[edge(leave)] = Some(edge(enter) as u8);
            }
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
