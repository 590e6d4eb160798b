//! Fewer points for coarse levels, which cannot tell all of them apart.

use rayon::prelude::*;
use std::cmp::Ordering;

use crate::level_objective::{CHUNK, Weighted};

/// Not worth it unless so many points become one on average.
const WORTH: usize = 2;

/// One point for all that lie in a cell of a lattice with these sides and have about the same normal, with their weights: the one
/// nearest to the cell's centre, so that the choice depends on positions alone. Nothing if there are not many per cell.
pub(crate) fn merged<const D: usize>(weighted: &Weighted<D>, sides: &[f64; D]) -> Option<Weighted<D>> {
    let entry = |index: usize| {
        let at: [f64; D] = std::array::from_fn(|axis| weighted.points[index][axis] / sides[axis]);
        let cell = at.map(|x| x.floor() as i64);
        let off: f64 = (0..D).map(|axis| (at[axis] - cell[axis] as f64 - 0.5).powi(2)).sum();
        Entry { cell, facing: weighted.normals.get(index).map_or(0, facing), off, index }
    };
    let mut entries: Vec<Entry<D>> =
        (0..weighted.points.len()).into_par_iter().with_min_len(CHUNK).map(entry).collect();
    let by_position = |a: &Entry<D>, b: &Entry<D>| {
        let [p, q] = [a, b].map(|entry| &weighted.points[entry.index]);
        let coordinates = p.iter().zip(q).map(|(p, q)| p.total_cmp(q)).fold(Ordering::Equal, Ordering::then);
        coordinates.then(weighted.roots[a.index].total_cmp(&weighted.roots[b.index]))
    };
    entries.par_sort_unstable_by(|a, b| {
        let places = a.cell.cmp(&b.cell).then(a.facing.cmp(&b.facing)).then(a.off.total_cmp(&b.off));
        places.then_with(|| by_position(a, b)).then(a.index.cmp(&b.index))
    });
    let groups: Vec<&[Entry<D>]> = entries.chunk_by(|a, b| a.cell == b.cell && a.facing == b.facing).collect();
    if WORTH * groups.len() > entries.len() {
        return None;
    }
    let weight = |group: &&[Entry<D>]| group.iter().map(|entry| weighted.roots[entry.index].powi(2)).sum::<f64>();
    let first = || groups.iter().map(|group| group[0].index);
    Some(Weighted {
        points: first().map(|index| weighted.points[index]).collect(),
        roots: groups.iter().map(|group| weight(group).sqrt()).collect(),
        normals: if weighted.normals.is_empty() { vec![] } else { first().map(|i| weighted.normals[i]).collect() },
    })
}

/// A point, with the cell that it lies in.
struct Entry<const D: usize> {
    cell: [i64; D],
    facing: u8,
    /// Squared distance from the cell's centre, in cells.
    off: f64,
    index: usize,
}

/// Which face of a cube a normal points to, so that the two sides of a thin wall stay apart; zero where it is not known.
fn facing<const D: usize>(normal: &[f64; D]) -> u8 {
    let axis = (1..D).fold(0, |best, axis| if normal[axis].abs() > normal[best].abs() { axis } else { best });
    match normal[axis] {
        x if x > 0.0 => 1 + 2 * axis as u8,
        x if x < 0.0 => 2 + 2 * axis as u8,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both sides of a sheet, as near to each other as points are.
    fn sheet() -> Weighted<3> {
        let at = |i: usize| [0.754_877_666, 0.569_840_296].map(|step| (i as f64 * step).fract());
        let side = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        Weighted {
            points: (0..20_000).map(|i| [at(i)[0], at(i)[1], 0.5 + 0.005 * side(i)]).collect(),
            roots: (0..20_000).map(|i| if i % 3 == 0 { 2.0 } else { 1.0 }).collect(),
            normals: (0..20_000).map(|i| [0.0, 0.1, side(i)]).collect(),
        }
    }

    #[test]
    fn one_point_a_cell_and_side_has_the_weight_of_all() {
        let all = sheet();
        let few = merged(&all, &[0.05; 3]).unwrap();
        assert_eq!(few.points.len(), 2 * 20 * 20);
        let area = |weighted: &Weighted<3>| weighted.roots.iter().map(|a| a * a).sum::<f64>();
        // Twenty thousand sums of rounded squares.
        assert!((area(&few) - area(&all)).abs() < 1e-9 * area(&all));
        for (point, normal) in few.points.iter().zip(&few.normals) {
            assert_eq!(point[2] > 0.5, normal[2] > 0.0);
            assert!(all.points.contains(point));
        }
        // Without normals the sides are one.
        let bare = Weighted { normals: vec![], ..all.clone() };
        assert_eq!(merged(&bare, &[0.05, 0.05, 10.0]).unwrap().points.len(), 20 * 20);
        // Cells with hardly more points than one.
        assert!(merged(&all, &[0.01; 3]).is_none());
    }

    #[test]
    fn the_choice_does_not_depend_on_the_order() {
        let all = sheet();
        let turned = Weighted {
            points: all.points.iter().rev().copied().collect(),
            roots: all.roots.iter().rev().copied().collect(),
            normals: all.normals.iter().rev().copied().collect(),
        };
        let [a, b] = [all, turned].map(|weighted| merged(&weighted, &[0.05; 3]).unwrap());
        assert_eq!((a.points, a.roots, a.normals), (b.points, b.roots, b.normals));
    }
}
