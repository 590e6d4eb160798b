//! Shallow features of the zero set: handles and specks that go if f changes by little.
//!
//! Around critical points of f with values near zero, f is sampled at the centres of small cells. Cells with values near zero then change
//! sides, those nearest to zero first, so that one side grows: each as long as it is a simple point, or closes a ring of the growing side (with two
//! pieces of the other side beside it, that it parts), or is the last of a speck (with no piece of the other side). None that would join two
//! pieces does, so that every ring that is closed is there at zero. Where the other side still hangs together afterwards a handle has
//! gone: a tunnel if the inside has grown, a strand if the outside has. (In the language of persistent homology: a class whose interval
//! reaches beyond zero by little, Edelsbrunner, Letscher and Zomorodian 2002.)

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use rustc_hash::{FxHashMap, FxHashSet};
use zeroset_bspline::{CriticalPoint, Derivatives, HierarchicalSpline};

use crate::lattice::domain::{Domain, flat_index, multi_index};
use crate::topology::cell_sides::{CellSides, cells_around};
use crate::topology::floods::Floods;
use crate::topology::neighbours::{Euler, Neighbours};
use crate::topology::node_parts::NodeParts;

/// Cells have at most so many spacings,
const SMALLEST: f64 = 0.3;
/// and are looked at so many spacings around critical points,
const WINDOW: f64 = 2.5;
/// where f is so near to zero, in spacings: what is farther away stays on its side.
const BAND: f64 = 0.6;
/// What is farther away hangs together as the nodes of a lattice do, with cells of about so many spacings,
const COARSER: f64 = 1.2;
/// or with more than that where there would be more nodes.
const MOST_NODES: usize = 4_000_000;
/// Most halvings of the dense lattice's cells.
const MOST_HALVINGS: u32 = 6;
/// Most cells, of about a hundred bytes each: critical points farther from zero than those that these are around are passed over.
const MOST_CELLS: usize = 400_000;
/// A handle goes if f changes by so many spacings: the zero set is not known better between the points.
const HANDLE: f64 = 0.1;
/// A speck goes if f changes by so many, and no part of it is farther away than so many from where that is: a sphere of as few points as
/// that is deeper.
const SPECK: f64 = 0.2;
const SPECK_RADIUS: f64 = 1.75;
/// The cells that a handle needs are looked for in balls around where its ring closes, of so many cells at first,
const FIRST_BALL: f64 = 1.8;
/// and then so many times as wide again and again.
const WIDER: f64 = 1.4;

/// A handle or a speck that goes if f changes by little.
#[derive(Debug, Clone, PartialEq)]
pub struct Shallow<const D: usize> {
    /// Centres of small cells in which f has the other sign then.
    pub places: Vec<[f64; D]>,
    /// Whether they are inside then: the plug of a tunnel. Otherwise the cut through a strand.
    pub inside: bool,
    /// Whether a component goes rather than a handle.
    pub is_speck: bool,
    /// By how much f changes at most in the place that decides.
    pub height: f64,
}

/// The shallow features of f, negative inside and about the distance near its zero set, the shallowest first after specks between the cells;
/// `spacing` is that of the points. All in frame units.
pub fn shallow<const D: usize>(
    f: &HierarchicalSpline<D>,
    domain: &Domain<D>,
    halvings: u32,
    spacing: f64,
) -> Vec<Shallow<D>> {
    let is_end = |point: &CriticalPoint<D>| point.index == if point.value < 0.0 { 0 } else { D };
    let is_wanted = |point: &CriticalPoint<D>| {
        let is_ring = point.index == if point.value < 0.0 { 1 } else { D - 1 };
        is_end(point) || (is_ring && point.value.abs() <= HANDLE * spacing)
    };
    let mut critical = f.critical_points(SPECK * spacing);
    critical.retain(is_wanted);
    critical.sort_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
    let mut finer = 0;
    while domain.spacing(finer) > SMALLEST * spacing && finer < halvings + MOST_HALVINGS {
        finer += 1;
    }
    let places: Vec<[f64; D]> = critical.iter().map(|point| point.place).collect();
    let Some(mut cells) = Cells::around(f, &places, domain, finer, spacing) else { return Vec::new() };
    let is_between = |point: &&CriticalPoint<D>| is_end(point) && cells.are_around(&point.place, point.value > 0.0);
    let mut features: Vec<Shallow<D>> = critical.iter().filter(is_between).map(Shallow::of_a_point).collect();
    let grown = |inside: bool| cells.grown(inside, SPECK * spacing);
    let ((mut closings, outside), (more, inside)) = rayon::join(|| grown(false), || grown(true));
    let moved = [outside, inside];
    closings.extend(more);
    closings.retain(|closing| closing.is_last || closing.height.0 <= HANDLE * spacing);
    if closings.is_empty() {
        return features;
    }
    closings.sort_unstable_by_key(|closing| (closing.height, closing.key, closing.inside));
    let parts = Parts::new(&cells, f, halvings, HANDLE * spacing, spacing);
    features.extend(closings.iter().filter_map(|closing| {
        let moved = &moved[usize::from(closing.inside)];
        let keys = match closing.is_last {
            true => cells.removed(closing, moved, SPECK_RADIUS * spacing),
            false => cells.undone(closing, moved, WINDOW * spacing, &parts),
        };
        Some(Shallow {
            places: keys?.into_iter().map(|key| cells.centre(key)).collect(),
            inside: closing.inside,
            is_speck: closing.is_last,
            height: closing.height.0,
        })
    }));
    features
}

impl<const D: usize> Shallow<D> {
    /// A speck that no cell's centre lies in.
    fn of_a_point(point: &CriticalPoint<D>) -> Self {
        Self { places: vec![point.place], inside: point.value > 0.0, is_speck: true, height: point.value.abs() }
    }
}

/// A cell that closes a ring of the side that grows, or is the last of a speck of the other one.
struct Closing {
    /// By how much f changes there.
    height: Height,
    key: usize,
    /// The side that grows.
    inside: bool,
    is_last: bool,
}

/// Small cells around some places, by their place in C order, with f at their centres.
struct Cells<'a, const D: usize> {
    domain: &'a Domain<D>,
    halvings: u32,
    shape: [usize; D],
    /// In order.
    keys: Vec<usize>,
    values: FxHashMap<usize, f64>,
    sides: CellSides<D>,
    neighbours: Neighbours,
    euler: Euler,
}

impl<'a, const D: usize> Cells<'a, D> {
    /// Those that come so near to one of the places, the first ones if they are too many; nothing if they are none.
    fn around(
        f: &HierarchicalSpline<D>,
        places: &[[f64; D]],
        domain: &'a Domain<D>,
        halvings: u32,
        spacing: f64,
    ) -> Option<Self> {
        let reach = WINDOW * spacing;
        let shape = domain.cells(halvings);
        let mut cells = Self {
            domain,
            halvings,
            shape,
            keys: Vec::new(),
            values: FxHashMap::default(),
            sides: CellSides::new(shape),
            neighbours: Neighbours::new::<D>(),
            euler: Euler::new::<D>(),
        };
        let mut keys = FxHashSet::default();
        for place in places {
            let [first, last] = [-reach, reach].map(|reach| cells.index_at(&place.map(|x| x + reach)));
            let range: [_; D] = std::array::from_fn(|axis| [first[axis], last[axis]]);
            let extent = range.map(|[first, last]| last + 1 - first);
            let all = (0..extent.iter().product()).map(|flat| {
                let offset = multi_index(flat, &extent);
                flat_index(&std::array::from_fn(|axis| range[axis][0] + offset[axis]), &shape)
            });
            keys.extend(all.filter(|key| distance(&cells.centre(*key), place) <= reach));
            if keys.len() >= MOST_CELLS {
                break;
            }
        }
        cells.keys = keys.into_iter().collect();
        cells.keys.sort_unstable();
        let centres: Vec<[f64; D]> = cells.keys.iter().map(|key| cells.centre(*key)).collect();
        let values = f.evaluate(&centres, Derivatives::Value).values;
        cells.values = cells.keys.iter().copied().zip(values).filter(|(_, f)| f.abs() <= BAND * spacing).collect();
        cells.keys.retain(|key| cells.values.contains_key(key));
        cells.keys.iter().for_each(|key| cells.sides.insert(*key, cells.values[key] < 0.0));
        (!cells.keys.is_empty()).then_some(cells)
    }

    fn centre(&self, key: usize) -> [f64; D] {
        self.domain.centre(self.halvings, key)
    }

    fn apart(&self, a: usize, b: usize) -> f64 {
        distance(&self.centre(a), &self.centre(b))
    }

    /// The cell in which a place is, or which is next to one outside the box.
    fn index_at(&self, place: &[f64; D]) -> [usize; D] {
        let side = self.domain.spacing(self.halvings);
        std::array::from_fn(|axis| {
            let along = (place[axis] - self.domain.lower[axis]) / side;
            along.clamp(0.0, self.shape[axis] as f64 - 1.0) as usize
        })
    }

    /// Whether the cell in which a place is and all that touch it are known, and on that side.
    fn are_around(&self, place: &[f64; D], inside: bool) -> bool {
        let key = flat_index(&self.index_at(place), &self.shape);
        let around = self.sides.around(key);
        let other = if inside { !around.inside } else { around.inside };
        around.unknown == 0 && self.is_inside(key) == inside && self.neighbours.beside(0) & other == 0
    }

    /// The cells that touch one on a side: through faces, edges and corners inside, through faces outside.
    fn beside(&self, key: usize, inside: bool) -> impl Iterator<Item = usize> + use<D> {
        let around = self.sides.around(key);
        let there = if inside { around.inside } else { !around.inside & !around.unknown };
        self.sides.keys_around(key, self.neighbours.beside(usize::from(!inside)) & there)
    }

    fn is_inside(&self, key: usize) -> bool {
        self.neighbours.is_middle(self.sides.around(key).inside)
    }

    /// Lets one side grow as far as f changes by no more than `limit`: what it closes, and all cells that have moved.
    fn grown(&self, inside: bool, limit: f64) -> (Vec<Closing>, FxHashSet<usize>) {
        let mut sides = self.sides.clone();
        let mut heap = BinaryHeap::new();
        // The other side is positive where the inside grows.
        let open = |key: usize| {
            let value = *self.values.get(&key)?;
            let height = Height(if inside { value } else { -value });
            (height.0 <= limit && (value < 0.0) != inside).then_some(Reverse((height, key)))
        };
        heap.extend(self.keys.iter().filter_map(|key| open(*key)));
        let (mut closings, mut moved) = (Vec::new(), FxHashSet::default());
        while let Some(Reverse((height, key))) = heap.pop() {
            let around = sides.around(key);
            if around.unknown != 0 || moved.contains(&key) {
                continue;
            }
            let pieces = [self.neighbours.pieces(0, around.inside), self.neighbours.pieces(1, !around.inside)];
            let [own, other] = if inside { pieces } else { [pieces[1], pieces[0]] };
            if own != 1 || other > 2 {
                continue;
            }
            if other != 1 {
                closings.push(Closing { height, key, inside, is_last: other == 0 });
            }
            sides.insert(key, inside);
            moved.insert(key);
            heap.extend(sides.keys_around(key, u32::MAX).filter(|next| !moved.contains(next)).filter_map(open));
        }
        (closings, moved)
    }

    /// Moves a speck to the other side, if all of it has moved and none of it is farther away than `radius`.
    fn removed(&mut self, closing: &Closing, moved: &FxHashSet<usize>, radius: f64) -> Option<Vec<usize>> {
        let inside = closing.inside;
        if self.is_inside(closing.key) == inside {
            return None;
        }
        let (mut seen, mut stack) = (BTreeSet::from([closing.key]), vec![closing.key]);
        while let Some(key) = stack.pop() {
            let is_near = self.apart(key, closing.key) <= radius;
            if self.sides.around(key).unknown != 0 || !moved.contains(&key) || !is_near {
                return None;
            }
            stack.extend(self.beside(key, !inside).filter(|next| seen.insert(*next)));
        }
        seen.iter().for_each(|key| self.sides.insert(*key, inside));
        Some(seen.into_iter().collect())
    }

    /// Moves as few cells as undo a handle, if a closing does: those around it that have moved, within `reach`.
    fn undone(
        &mut self,
        closing: &Closing,
        moved: &FxHashSet<usize>,
        reach: f64,
        parts: &Parts<D>,
    ) -> Option<Vec<usize>> {
        let inside = closing.inside;
        let (mut seen, mut stack, mut near) = (BTreeSet::from([closing.key]), vec![closing.key], Vec::new());
        while let Some(key) = stack.pop() {
            near.push((Height(self.apart(key, closing.key)), key));
            let is_new =
                |next: &usize| moved.contains(next) && self.apart(*next, closing.key) <= reach && seen.insert(*next);
            stack.extend(cells_around(key, self.shape, u32::MAX).filter(is_new));
        }
        near.retain(|(_, key)| self.is_inside(*key) != inside);
        near.sort_unstable();
        let mut radius = FIRST_BALL * self.domain.spacing(self.halvings);
        while radius <= reach {
            let mut keys: Vec<usize> =
                near.iter().take_while(|(apart, _)| apart.0 <= radius).map(|(_, key)| *key).collect();
            // A handle less makes the Euler characteristic of the inside greater by one.
            let gained: i32 = keys.iter().map(|key| self.moved(*key, inside)).sum();
            if gained >= 1 && self.are_attached(&keys, inside) && self.still_joined(&keys, !inside, parts) {
                // Those that change f most are given back first.
                keys.sort_unstable_by_key(|key| (Reverse(Height(self.values[key].abs())), *key));
                self.give_back(&mut keys, inside);
                return Some(keys);
            }
            keys.iter().for_each(|key| self.sides.insert(*key, !inside));
            radius *= WIDER;
        }
        None
    }

    /// Moves a cell to a side; gives by how much the Euler characteristic of the inside has grown.
    fn moved(&mut self, key: usize, inside: bool) -> i32 {
        let added = self.euler.added(self.sides.around(key).inside);
        self.sides.insert(key, inside);
        if inside { added } else { -added }
    }

    /// Gives back to the other side all cells that can be without changing the topology.
    fn give_back(&mut self, keys: &mut Vec<usize>, inside: bool) {
        loop {
            let count = keys.len();
            keys.retain(|key| {
                let simple = self.neighbours.is_simple(self.sides.around(*key).inside);
                if simple {
                    self.sides.insert(*key, !inside);
                }
                !simple
            });
            if keys.len() == count {
                return;
            }
        }
    }

    /// Whether cells that have moved to a side all hang together with others of it: else they are a piece of their own.
    fn are_attached(&self, keys: &[usize], inside: bool) -> bool {
        let mut free: FxHashSet<usize> = keys.iter().copied().collect();
        let touches = |key: &usize| self.beside(*key, inside).any(|next| !free.contains(&next));
        let mut stack: Vec<usize> = keys.iter().copied().filter(touches).collect();
        stack.iter().for_each(|key| _ = free.remove(key));
        while let Some(key) = stack.pop() {
            stack.extend(self.beside(key, inside).filter(|next| free.remove(next)));
        }
        free.is_empty()
    }

    /// Whether the cells of a side that are beside some hang together: through cells, and through parts of the nodes.
    fn still_joined(&self, keys: &[usize], inside: bool, parts: &Parts<D>) -> bool {
        let beside: BTreeSet<usize> = keys.iter().flat_map(|key| self.beside(*key, inside)).collect();
        let mut floods = Floods::from(&beside);
        while floods.count() > 1 {
            let Some(key) = floods.next() else { return false };
            // One of a part may have moved to the other side.
            if self.is_inside(key) != inside {
                continue;
            }
            if let Some(part) = parts.of(key, inside) {
                floods.meet_region(part, &parts.cells[part]);
            }
            self.beside(key, inside).for_each(|next| floods.meet(next));
        }
        true
    }
}

/// How what is beyond the cells hangs together.
struct Parts<const D: usize> {
    nodes: NodeParts<D>,
    /// The cells at the nodes of each part.
    cells: Vec<Vec<usize>>,
    /// From the nodes' lattice to the cells'.
    halvings: u32,
    shape: [usize; D],
}

impl<const D: usize> Parts<D> {
    /// Of the lattice after so many halvings, or of another one that suits the spacing better; what is no farther from zero than `shallow`
    /// joins nothing.
    fn new(cells: &Cells<D>, f: &HierarchicalSpline<D>, halvings: u32, shallow: f64, spacing: f64) -> Self {
        let (domain, mut halvings) = (cells.domain, halvings.min(cells.halvings));
        let is_too_coarse = |halvings: u32| domain.spacing(halvings) > COARSER * spacing;
        let count = |halvings: u32| domain.cells(halvings).iter().product::<usize>();
        while halvings < cells.halvings && is_too_coarse(halvings) && count(halvings + 1) <= MOST_NODES {
            halvings += 1;
        }
        let nodes = NodeParts::new(f, domain, [halvings, cells.halvings], shallow);
        let mut parts = Self { nodes, cells: Vec::new(), halvings: cells.halvings - halvings, shape: cells.shape };
        parts.cells.resize_with(parts.nodes.count(), Vec::new);
        for key in &cells.keys {
            if let Some(part) = parts.of(*key, cells.is_inside(*key)) {
                parts.cells[part].push(*key);
            }
        }
        parts
    }

    /// The part of the node in the lowest corner of a cell, if there is one and it is clearly on that side.
    fn of(&self, key: usize, inside: bool) -> Option<usize> {
        let cell = multi_index(key, &self.shape);
        let is_node = cell.iter().all(|i| i % (1 << self.halvings) == 0);
        is_node.then(|| self.nodes.of(&cell.map(|i| i >> self.halvings), inside)).flatten()
    }
}

fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// A number, in order.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Height(f64);

impl Eq for Height {}

impl Ord for Height {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Height {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lattice::domain::tests::spline;

    /// Of the points; handles are shallow up to 0.008.
    const SPACING: f64 = 0.08;
    pub(crate) const HALVINGS: u32 = 3;

    pub(crate) fn box_of_one() -> Domain<3> {
        Domain::around(&[1.0, 1.0, 1.0], 8)
    }

    /// A wall whose middle is `off` away, 0.12 thick, but where it is `aside` less than 0.14: there it is thinner, and f rises to `most` in its midst.
    fn wall(off: f64, aside: f64, most: f64) -> f64 {
        let half = (3.1 * aside * aside - most).min(0.06);
        off.hypot(0.02) - 0.02 - half
    }

    /// A round plate with rounded rim and a hole in the middle.
    pub(crate) fn plate(most: f64) -> HierarchicalSpline<3> {
        let f = move |[x, y, z]: [f64; 3]| wall((x.hypot(y) - 0.35).max(0.0).hypot(z), x.hypot(y), most);
        HierarchicalSpline::new(spline(&box_of_one(), HALVINGS, f)).unwrap()
    }

    fn found(f: &HierarchicalSpline<3>) -> Vec<Shallow<3>> {
        shallow(f, &box_of_one(), HALVINGS, SPACING)
    }

    #[test]
    fn a_shallow_tunnel_is_closed_and_a_shallow_strand_cut() {
        let f = plate(0.004);
        let middle = f.value(&[0.0; 3]);
        assert!(middle > 0.001 && middle < 0.1 * SPACING, "{middle}");
        // Its negative is a gap, with a strand across it.
        for (f, inside) in [(f.clone(), true), (f.scaled(-1.0).unwrap(), false)] {
            let all = found(&f);
            let [feature] = &all[..] else { panic!("{all:?}") };
            assert_eq!((feature.inside, feature.is_speck), (inside, false));
            // The centre of a cell is up to 0.008 off the middle of the wall, by which f rises there by 0.0015.
            assert!((feature.height - middle).abs() < 0.0015, "{} for {middle}", feature.height);
            // A disc of the hole's radius, one cell thick.
            assert!(feature.places.iter().all(|[x, y, z]| x.hypot(*y) < 0.06 && z.abs() < 0.02), "{feature:?}");
            assert!(feature.places.iter().all(|x| (f.value(x) > 0.0) == inside));
        }
    }

    #[test]
    fn what_is_deep_stays() {
        let f = plate(0.014);
        assert!(f.value(&[0.0; 3]) > 0.1 * SPACING);
        assert_eq!(found(&f), []);
        assert_eq!(found(&plate(-0.004)), [], "there is no hole");
    }

    #[test]
    fn a_slot_is_closed_from_bank_to_bank() {
        // A hole 0.09 wide and three times as long: what fills its midst alone, and touches neither bank, closes nothing.
        let f = |[x, y, z]: [f64; 3]| wall((x.hypot(y) - 0.4).max(0.0).hypot(z), (x / 3.0).hypot(y), 0.004);
        let f = HierarchicalSpline::new(spline(&box_of_one(), HALVINGS, f)).unwrap();
        let all = found(&f);
        let [feature] = &all[..] else { panic!("{all:?}") };
        assert_eq!((feature.inside, feature.is_speck), (true, false));
        for bank in [-1.0, 1.0] {
            let most = feature.places.iter().map(|[_, y, _]| bank * y).fold(0.0, f64::max);
            assert!(most > 0.02, "{most}: {feature:?}");
        }
    }

    #[test]
    fn of_two_holes_into_a_hollow_one_stays() {
        let f = |[x, y, z]: [f64; 3]| wall(x.hypot(y).hypot(z) - 0.3, x.hypot(y), 0.004 + 0.001 * z);
        let f = HierarchicalSpline::new(spline(&box_of_one(), HALVINGS, f)).unwrap();
        let all = found(&f);
        let [feature] = &all[..] else { panic!("{all:?}") };
        assert_eq!((feature.inside, feature.is_speck), (true, false));
        // The shallower one goes.
        assert!(feature.places.iter().all(|[_, _, z]| *z < 0.0), "{feature:?}");
    }

    #[test]
    fn a_hole_that_lets_into_a_hollow_stays() {
        // Closed it would make two surfaces of one.
        let f = |[x, y, z]: [f64; 3]| {
            let aside = if z > 0.0 { x.hypot(y) } else { 1.0 };
            wall(x.hypot(y).hypot(z) - 0.3, aside, 0.004)
        };
        let f = HierarchicalSpline::new(spline(&box_of_one(), HALVINGS, f)).unwrap();
        let most = (0..100).map(|i| f.value(&[0.0, 0.0, 0.25 + 0.001 * f64::from(i)])).fold(f64::INFINITY, f64::min);
        assert!(most > 0.001 && most < 0.1 * SPACING, "{most}");
        assert_eq!(found(&f), []);
    }

    #[test]
    fn shallow_specks_go() {
        let dent = |deep: f64| {
            let f = move |x: [f64; 3]| {
                let square: f64 = x.iter().map(|x| x * x).sum();
                0.05 - (0.05 + deep) * (-square / 0.005).exp()
            };
            HierarchicalSpline::new(spline(&box_of_one(), HALVINGS, f)).unwrap()
        };
        let f = dent(0.012);
        let depth = -f.value(&[0.0; 3]);
        assert!(depth > 0.005 && depth < 0.2 * SPACING, "{depth}");
        for (f, inside) in [(f.clone(), false), (f.scaled(-1.0).unwrap(), true)] {
            let all = found(&f);
            let [feature] = &all[..] else { panic!("{all:?}") };
            assert_eq!((feature.inside, feature.is_speck), (inside, true));
            // All of it: a ball of radius 0.03 has so many cells of a 64th.
            assert!((20..80).contains(&feature.places.len()), "{}", feature.places.len());
        }
        assert_eq!(found(&dent(0.03)), []);
        // One with a radius of 0.006, between the centres of cells.
        let f = dent(0.0025);
        let depth = -f.value(&[0.0; 3]);
        assert!(depth > 0.0 && depth < 0.001, "{depth}");
        for (f, inside) in [(f.clone(), false), (f.scaled(-1.0).unwrap(), true)] {
            let all = found(&f);
            let [feature] = &all[..] else { panic!("{all:?}") };
            assert_eq!((feature.inside, feature.is_speck, feature.places.len()), (inside, true, 1));
        }
    }
}
