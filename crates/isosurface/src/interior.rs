//! Which loops on a cell's surface are joined by a tunnel through its interior.
//!
//! The cell is swept by slices along z. A slice holds the bilinear interpolant of four values that are linear in the height
//! t, and each component of {f > 0} in a slice contains one of its corners; so the components of {f > 0} in the cell are
//! known from the four vertical edges and from when their positive parts meet. Neighbouring edges meet on a face. Opposite
//! ones meet inside exactly where `A C − B D > 0` while A, C > 0 and B, D < 0: a quadratic in t. The same with f negated
//! gives the components of {f < 0}.

use crate::cell::{edge_corners, face_corners, positives_joined};
use crate::union_find::UnionFind;

/// What the interior of a cell does to the loops of its contour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interior {
    /// Every loop bounds a disc.
    Discs,
    /// Two loops, by their index, bound a tunnel; the others discs.
    Tunnel(usize, usize),
    /// More than one tunnel would be needed: cannot happen for a trilinear function, except by rounding.
    Unclear,
}

pub(crate) fn interior(values: &[f64; 8], loops: &[Vec<usize>]) -> Interior {
    if loops.len() < 2 {
        return Interior::Discs;
    }
    let mut regions = surface_regions(values);
    // The two regions that each loop separates.
    let sides: Vec<[usize; 2]> = loops
        .iter()
        .map(|cycle| {
            let corners = edge_corners(cycle[0]);
            let (negative, positive) =
                if values[corners[0]] < 0.0 { (corners[0], corners[1]) } else { (corners[1], corners[0]) };
            [regions.find(negative), regions.find(positive)]
        })
        .collect();
    let mut tunnel = None;
    for sign in [1.0, -1.0] {
        for diagonal in [[0, 3], [1, 2]] {
            let Some([a, c]) = joined_inside(values, diagonal, sign) else { continue };
            let (a, c) = (regions.find(a), regions.find(c));
            if a == c {
                continue;
            }
            // The loops around both regions towards the one between them.
            let own = usize::from(sign > 0.0);
            let pair = sides.iter().enumerate().filter(|(_, s)| s[own] == a).find_map(|(first, s)| {
                let second = sides.iter().position(|t| t[own] == c && t[1 - own] == s[1 - own])?;
                Some((first, second))
            });
            match (pair, tunnel) {
                (Some(pair), None) => tunnel = Some(pair),
                (Some((a, b)), Some(known)) if known == (a, b) || known == (b, a) => {}
                _ => return Interior::Unclear,
            }
        }
    }
    match tunnel {
        Some((first, second)) => Interior::Tunnel(first, second),
        None => Interior::Discs,
    }
}

/// The regions of one sign on the cell's surface, as sets of corners.
fn surface_regions(values: &[f64; 8]) -> UnionFind {
    let mut regions = UnionFind::new(8);
    let positive = |c: usize| values[c] >= 0.0;
    for edge in 0..12 {
        let [a, b] = edge_corners(edge);
        if positive(a) == positive(b) {
            regions.join(a, b);
        }
    }
    for face in 0..6 {
        let c = face_corners(face);
        if positive(c[0]) == positive(c[2]) && positive(c[1]) == positive(c[3]) && positive(c[0]) != positive(c[1]) {
            let even = positives_joined(c.map(|c| values[c])) == positive(c[0]);
            if even {
                regions.join(c[0], c[2])
            } else {
                regions.join(c[1], c[3])
            };
        }
    }
    regions
}

/// Whether the positive parts (of `sign · f`) of two opposite vertical edges meet strictly inside the cell; if so, a corner
/// in each. A vertical edge is named by its x and y bits.
fn joined_inside(values: &[f64; 8], diagonal: [usize; 2], sign: f64) -> Option<[usize; 2]> {
    let others = if diagonal == [0, 3] { [1, 2] } else { [0, 3] };
    let line = |edge: usize| {
        let (bottom, top) = (sign * values[edge], sign * values[edge | 4]);
        (bottom, top - bottom)
    };
    let ([a, c], [b, d]) = (diagonal.map(line), others.map(line));
    // A C − B D = q0 + q1 t + q2 t²
    let q2 = a.1 * c.1 - b.1 * d.1;
    let q1 = a.0 * c.1 + a.1 * c.0 - b.0 * d.1 - b.1 * d.0;
    let q0 = a.0 * c.0 - b.0 * d.0;
    // Where the quadratic is positive at an end of the interval, faces have joined the two already.
    let t = -0.5 * q1 / q2;
    if !(q2 < 0.0 && t > 0.0 && t < 1.0) {
        return None;
    }
    let at = |line: (f64, f64)| line.0 + t * line.1;
    if at(a) > 0.0 && at(c) > 0.0 && at(b) < 0.0 && at(d) < 0.0 && q0 + 0.5 * q1 * t > 0.0 {
        let positive_end = |edge: usize| if sign * values[edge] > 0.0 { edge } else { edge | 4 };
        Some(diagonal.map(positive_end))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{contour, loops};

    fn decide(values: [f64; 8]) -> (usize, Interior) {
        let loops = loops(&contour(&values));
        (loops.len(), interior(&values, &loops))
    }

    #[test]
    fn opposite_corners_join_when_they_are_strong() {
        // Case 4: two positive corners on the cell's diagonal.
        let values = |strong: f64| std::array::from_fn(|c| if c == 0 || c == 7 { strong } else { -1.0 });
        assert_eq!(decide(values(0.5)), (2, Interior::Discs));
        // f on the diagonal at the middle: (2 s − 6) / 8 > 0 from s = 3 on; the faces separate as long as −s < 1.
        assert_eq!(decide(values(0.9)), (2, Interior::Discs));
        let weak: [f64; 8] = [6.0, -0.05, -1.0, -6.0, -6.0, -1.0, -0.05, 6.0];
        let (count, found) = decide(weak);
        assert!(count == 1 || found != Interior::Unclear);
    }

    #[test]
    fn negating_the_function_keeps_the_decision() {
        let mut state = 1u64;
        let mut tunnels = 0;
        for _ in 0..20_000 {
            let values: [f64; 8] = std::array::from_fn(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
            });
            let (count, found) = decide(values);
            assert_eq!(decide(values.map(|v| -v)).0, count);
            assert_ne!(found, Interior::Unclear, "{values:?}");
            assert_eq!(
                matches!(decide(values.map(|v| -v)).1, Interior::Tunnel(..)),
                matches!(found, Interior::Tunnel(..)),
                "{values:?}"
            );
            tunnels += usize::from(matches!(found, Interior::Tunnel(..)));
        }
        assert!(tunnels > 0, "random cells have tunnels now and then");
    }
}
