//! Where one function has another topology than the one that it came from.
//!
//! Both are sampled at the centres of small cells near the surface. From the inside of the first function, cells whose sign
//! differs are moved to the other side one by one, as long as each is a simple point: one whose move does not change the
//! topology (Bertrand and Malandain 1994). Where the surface has only moved all of them go; where it has pierced a wall,
//! bridged a gap, or made a speck, some are left (as in the topology-preserving level sets of Han, Xu and Prince 2003).

use rayon::prelude::*;
use zeroset_bspline::{Derivatives, Implicit, IndexSet};

use crate::lattice::domain::{Domain, flat_index, multi_index};
use crate::topology::cell_sides::{CellSides, cells_around};
use crate::topology::neighbours::Neighbours;

/// The smallest cells have at most so many spacings: a pierced wall is hardly narrower.
const SMALLEST: f64 = 0.4;
/// Of cells no larger than so many spacings only those are halved where a slope on the straight way from one function to the
/// other is below the second: where the topology changes on that way, the slope vanishes.
const TURNING: f64 = 1.1;
const FLAT: f64 = 0.5;
/// Slopes near the surface are hardly greater.
const STEEPEST: f64 = 1.2;
/// Most halvings of the dense lattice's cells.
const MOST_HALVINGS: u32 = 6;
/// Most cells, of about a hundred bytes each: where there are more points, only larger changes are found.
const MOST_CELLS: usize = 2_000_000;

/// Where `after` has another topology than `before`: the places of one change touch each other.
#[derive(Debug, Clone, PartialEq)]
pub struct TopologyChange<const D: usize> {
    /// Centres of small cells in which the functions have to differ in sign.
    pub places: Vec<[f64; D]>,
    /// The values there.
    pub before: Vec<f64>,
    pub after: Vec<f64>,
}

impl<const D: usize> TopologyChange<D> {
    /// How far `after` gets across zero, in the values that `before` had.
    pub fn clearness(&self) -> f64 {
        let greatest = |values: &[f64]| values.iter().fold(0.0f64, |greatest, value| greatest.max(value.abs()));
        greatest(&self.after) / greatest(&self.before)
    }
}

/// Where `after` has another topology than `before`; both are about the distance near their zero sets.
///
/// Looked at are those of the lattice's cells after `halvings` that are `near`, given by their lowest corner, and those that are
/// connected with what has moved there; `spacing` is that of the points. All in frame units.
pub fn topology_changes<const D: usize>(
    before: &impl Implicit<D>,
    after: &impl Implicit<D>,
    domain: &Domain<D>,
    halvings: u32,
    near: impl Fn([usize; D]) -> bool,
    spacing: f64,
) -> Vec<TopologyChange<D>> {
    let shape = domain.cells(halvings);
    let all = 0..shape.iter().product();
    let mut cells = Cells { halvings, keys: all.filter(|key| near(multi_index(*key, &shape))).collect() };
    while cells.side(domain) > SMALLEST * spacing && cells.halvings < halvings + MOST_HALVINGS {
        let Some(halved) = cells.halved(before, after, domain, spacing) else { break };
        cells = halved;
    }
    // The sides of the moves are cut off where the slopes are steep; what is left then is looked at with all of its surroundings.
    let mut changed = cells.sides(before, after, domain, FLAT).moved();
    if !changed.is_empty() {
        cells.keys = changed.iter().map(|moving| moving.key).collect();
        changed = cells.sides(before, after, domain, f64::INFINITY).moved();
    }
    let change = |group: Vec<Moving>| TopologyChange {
        places: group.iter().map(|moving| domain.centre(cells.halvings, moving.key)).collect(),
        before: group.iter().map(|moving| moving.before).collect(),
        after: group.iter().map(|moving| moving.after).collect(),
    };
    touching(changed, &domain.cells(cells.halvings)).into_iter().map(change).collect()
}

/// A cell that is to move to the other side, with both functions there.
#[derive(Debug, Clone, Copy)]
struct Moving {
    key: usize,
    before: f64,
    after: f64,
}

/// Groups of cells that are connected through faces, edges and corners, by their first cells; their cells in order.
fn touching<const D: usize>(mut cells: Vec<Moving>, shape: &[usize; D]) -> Vec<Vec<Moving>> {
    cells.sort_unstable_by_key(|moving| moving.key);
    let mut is_new = vec![true; cells.len()];
    let mut groups = Vec::new();
    for first in 0..cells.len() {
        if !std::mem::take(&mut is_new[first]) {
            continue;
        }
        let (mut group, mut done) = (vec![first], 0);
        while done < group.len() {
            for key in cells_around(cells[group[done]].key, *shape, u32::MAX) {
                if let Ok(found) = cells.binary_search_by_key(&key, |moving| moving.key)
                    && std::mem::take(&mut is_new[found])
                {
                    group.push(found);
                }
            }
            done += 1;
        }
        group.sort_unstable();
        groups.push(group.into_iter().map(|i| cells[i]).collect());
    }
    groups
}

/// Some of the cells of a lattice.
struct Cells {
    halvings: u32,
    /// Places in C order on the lattice.
    keys: Vec<usize>,
}

impl Cells {
    fn side<const D: usize>(&self, domain: &Domain<D>) -> f64 {
        domain.spacing(self.halvings)
    }

    fn centres<const D: usize>(&self, domain: &Domain<D>) -> Vec<[f64; D]> {
        self.keys.par_iter().with_min_len(1024).map(|key| domain.centre(self.halvings, *key)).collect()
    }

    /// The halves of those cells in which the functions can differ in topology; none if they are too many.
    fn halved<const D: usize>(
        &self,
        before: &impl Implicit<D>,
        after: &impl Implicit<D>,
        domain: &Domain<D>,
        spacing: f64,
    ) -> Option<Self> {
        let (shape, next) = (domain.cells(self.halvings), domain.cells(self.halvings + 1));
        let reach = STEEPEST * 0.5 * (D as f64).sqrt() * self.side(domain);
        let turning = self.side(domain) <= TURNING * spacing;
        let derivatives = if turning { Derivatives::Gradient } else { Derivatives::Value };
        let index = |key: &usize| multi_index(*key, &shape).map(|i| i as u32);
        let set = IndexSet::new(shape.map(|n| n as u32), &self.keys.par_iter().map(index).collect::<Vec<_>>());
        let cells =
            Self { keys: set.iter().map(|index| flat_index(&index.map(|i| i as usize), &shape)).collect(), ..*self };
        let centres = cells.centres(domain);
        let [before, after] = [before.evaluate(&centres, derivatives), after.evaluate(&centres, derivatives)];
        // Or else a slope turns round from one cell to the next.
        let is_flat = |i: usize| {
            flattest(&before.gradients[i], &after.gradients[i]) <= FLAT
                || beside(cells.keys[i], &shape)
                    .filter_map(|key| set.rank(index(&key)))
                    .any(|j| [&before, &after].iter().any(|f| flattest(&f.gradients[i], &f.gradients[j]) <= FLAT))
        };
        let wanted = |i: &usize| {
            let (a, b) = (before.values[*i], after.values[*i]);
            let crossed = (a < 0.0) != (b < 0.0) || a.abs().min(b.abs()) <= reach;
            crossed && (!turning || is_flat(*i))
        };
        let chosen: Vec<usize> =
            (0..cells.keys.len()).into_par_iter().with_min_len(1024).filter(wanted).map(|i| cells.keys[i]).collect();
        if chosen.len() << D > MOST_CELLS {
            return None;
        }
        let mut keys = Vec::with_capacity(chosen.len() << D);
        for key in chosen {
            let index = multi_index(key, &shape);
            for half in 0..1usize << D {
                keys.push(flat_index(&std::array::from_fn(|axis| 2 * index[axis] + (half >> axis & 1)), &next));
            }
        }
        Some(Self { halvings: self.halvings + 1, keys })
    }

    /// The cells where both functions differ in sign, with all such cells that they are connected with through such cells
    /// where the slope is at most `steepest` on the way from one to the other, and those around them.
    fn sides<const D: usize>(
        &self,
        before: &impl Implicit<D>,
        after: &impl Implicit<D>,
        domain: &Domain<D>,
        steepest: f64,
    ) -> Sides<D> {
        let mut sides = Sides { cells: CellSides::new(domain.cells(self.halvings)), moving: Vec::new() };
        let mut cells = Self { keys: self.keys.clone(), ..*self };
        while !cells.keys.is_empty() {
            let centres = cells.centres(domain);
            let first = before.evaluate(&centres, Derivatives::Gradient);
            let second = after.evaluate(&centres, Derivatives::Gradient);
            let (mut flat, begun) = (Vec::new(), !sides.moving.is_empty());
            for (i, key) in cells.keys.iter().enumerate() {
                let (a, b) = (first.values[i], second.values[i]);
                let moves = (a < 0.0) != (b < 0.0);
                if moves {
                    sides.moving.push(Moving { key: *key, before: a, after: b });
                    if flattest(&first.gradients[i], &second.gradients[i]) <= steepest {
                        flat.push(*key);
                    }
                }
                // Of the first cells those that stay are looked at again if one beside them moves.
                if moves || begun {
                    sides.cells.insert(*key, a < 0.0);
                }
            }
            cells.keys = sides.unknown_around(&flat);
        }
        cells.keys = sides.unknown_around(&sides.moving.iter().map(|moving| moving.key).collect::<Vec<_>>());
        let values = before.evaluate(&cells.centres(domain), Derivatives::Value).values;
        cells.keys.iter().zip(&values).for_each(|(key, value)| sides.cells.insert(*key, *value < 0.0));
        sides
    }
}

/// The keys of the cells that share a face with one.
fn beside<const D: usize>(key: usize, shape: &[usize; D]) -> impl Iterator<Item = usize> + use<D> {
    let (shape, index) = (*shape, multi_index(key, shape));
    (0..2 * D).filter_map(move |face| {
        let mut index = index;
        index[face / 2] = if face % 2 == 0 { index[face / 2].checked_sub(1)? } else { index[face / 2] + 1 };
        (index[face / 2] < shape[face / 2]).then(|| flat_index(&index, &shape))
    })
}

/// The shortest vector on the segment between two.
fn flattest<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let way: [f64; D] = std::array::from_fn(|axis| b[axis] - a[axis]);
    let dot = |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let t = (-dot(a, &way) / dot(&way, &way).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    let nearest: [f64; D] = std::array::from_fn(|axis| a[axis] + t * way[axis]);
    dot(&nearest, &nearest).sqrt()
}

/// The cells where two functions differ in sign, on the side where they are now, and those around them.
struct Sides<const D: usize> {
    cells: CellSides<D>,
    /// The cells that are to move.
    moving: Vec<Moving>,
}

impl<const D: usize> Sides<D> {
    /// The cells around some whose side is not known, in order.
    fn unknown_around(&self, keys: &[usize]) -> Vec<usize> {
        let around = |key: &usize| self.cells.keys_around(*key, self.cells.around(*key).unknown);
        let mut unknown: Vec<usize> = keys.par_iter().with_min_len(1024).flat_map_iter(around).collect();
        unknown.par_sort_unstable();
        unknown.dedup();
        unknown
    }

    /// Moves all cells that can be, those first where the second function is surest; gives those that are left.
    fn moved(mut self) -> Vec<Moving> {
        let (mut left, neighbours) = (self.moving, Neighbours::new::<D>());
        left.par_sort_unstable_by(|a, b| b.after.abs().total_cmp(&a.after.abs()).then(a.key.cmp(&b.key)));
        loop {
            let count = left.len();
            left.retain(|Moving { key, .. }| {
                let inside = self.cells.around(*key).inside;
                let simple = neighbours.is_simple(inside);
                if simple {
                    self.cells.insert(*key, !neighbours.is_middle(inside));
                }
                !simple
            });
            if left.len() == count {
                return left;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use zeroset_bspline::Spline;

    use super::*;
    use crate::lattice::domain::tests::spline;

    #[test]
    fn moved_surfaces_are_no_change_but_holes_bridges_and_specks_are() {
        let domain = Domain::around(&[1.0, 1.0, 1.0], 8);
        // A plate with rounded rim, and the same with a hole, with a bubble inside, and with a speck beside it.
        let plate = |x: [f64; 3], thickness: f64| {
            let outside = (x[0].hypot(x[1]) - 0.35).max(0.0);
            outside.hypot(x[2]) - thickness
        };
        let ball = |x: [f64; 3], y: f64, z: f64, r: f64| r - x[0].hypot(x[1] - y).hypot(x[2] - z);
        let before = spline(&domain, 2, |x| plate(x, 0.1));
        let changes = |after: &Spline<3>| topology_changes(&before, after, &domain, 2, |_| true, 0.04);
        assert_eq!(changes(&spline(&domain, 2, |x| plate(x, 0.07))), []);
        assert_eq!(changes(&spline(&domain, 2, |x| plate(x, 0.13))), []);
        assert_eq!(changes(&spline(&domain, 2, |x| plate([x[0] + 0.02, x[1], x[2] - 0.01], 0.1))), []);
        for (y, z, r) in [(0.1, 0.0, 0.14), (0.0, 0.0, 0.06), (0.0, 0.35, 0.06)] {
            let sign = if z > 0.0 { -1.0 } else { 1.0 };
            let after = spline(&domain, 2, |x| {
                let (a, b) = (plate(x, 0.1), sign * ball(x, y, z, r));
                if sign > 0.0 { a.max(b) } else { a.min(b) }
            });
            let found = changes(&after);
            let [change] = &found[..] else { panic!("{y} {z} {r}: {found:?}") };
            let far = |p: &[f64; 3]| p[0].hypot(p[1] - y).hypot(p[2] - z);
            // The function of the coefficients is about the function itself.
            assert!(change.places.iter().all(|p| far(p) < r + 0.03));
            assert!(change.before.iter().all(|v| (*v < 0.0) == (sign > 0.0)));
            assert!(change.after.iter().all(|v| (*v > 0.0) == (sign > 0.0)));
        }
    }

    #[test]
    fn curves_too() {
        let domain = Domain::around(&[1.0, 1.0], 12);
        let dumbbell = |x: [f64; 2], neck: f64| {
            let bar = x[1].abs().max(x[0].abs() - 0.3) - neck;
            ((x[0].abs() - 0.3).hypot(x[1]) - 0.15).min(bar)
        };
        let [whole, parted] = [0.06, -0.06].map(|neck| spline(&domain, 2, |x| dumbbell(x, neck)));
        assert!(!topology_changes(&whole, &parted, &domain, 2, |_| true, 0.05).is_empty());
        assert!(!topology_changes(&parted, &whole, &domain, 2, |_| true, 0.05).is_empty());
        assert_eq!(topology_changes(&whole, &whole, &domain, 2, |_| true, 0.05), []);
    }

    #[test]
    fn what_only_just_crosses_is_told_from_what_does_so_clearly() {
        let domain = Domain::around(&[1.0, 1.0], 12);
        // A bar between two discs, and a gap there.
        let discs = |x: [f64; 2]| (x[0].abs() - 0.3).hypot(x[1]) - 0.15;
        let bar = |neck: f64| spline(&domain, 2, move |x| discs(x).min(x[1].abs().max(x[0].abs() - 0.3) - neck));
        let clearness = |gap: f64| {
            let found = topology_changes(&bar(0.06), &bar(-gap), &domain, 2, |_| true, 0.05);
            let [change] = &found[..] else { panic!("{gap}: {found:?}") };
            change.clearness()
        };
        let (hardly, clearly) = (clearness(0.002), clearness(0.06));
        // The gap's width over the bar's, both rounded by splines.
        assert!(hardly < 0.25 && (0.5..2.0).contains(&clearly), "{hardly} {clearly}");
    }
}
