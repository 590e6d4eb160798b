//! Regions of a closed mesh, and what they hold together.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::f64::consts::PI;

use crate::mesh::TriMesh;
use crate::union_find::UnionFind;

/// A connected region of a closed mesh where a function on its vertices is above zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// The vertex where the function is largest.
    pub highest: usize,
    /// Whether the region has a handle, or closes one of the rest: two of its boundaries hang together without it, as those of a tunnel's wall
    /// do, and those of a sphere's zone do not.
    pub closes_handle: bool,
    /// Its boundaries with the rest.
    pub rims: Vec<Rim>,
}

/// A boundary of a [`Region`], where the function is zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Rim {
    /// Which part of the mesh without the region is beyond, unless that is light: rims with the same number hang together without the region.
    pub beyond: Option<usize>,
    /// The mean place.
    pub centre: [f64; 3],
    /// The integral over its length of the conormal, the unit vector in the surface across it and into the region. For a loop around a cylinder, however it
    /// winds, that is the axis times the circumference, for a loop in a plane zero.
    pub conormal: [f64; 3],
    /// `½ ∮ x × dx`, its vector area: a plane loop's area, along the normal, with the region on the left of the loop where that points to one.
    pub area: [f64; 3],
    /// The mean outward unit normal of the surface. In a plane it points as the area does if the region is within the loop, and against it if the region is
    /// around it.
    pub normal: [f64; 3],
}

impl Rim {
    /// The radius of a circle with its area.
    pub fn radius(&self) -> f64 {
        (norm(&self.area) / PI).sqrt()
    }

    /// Where the surface goes on beyond it: its conormal over the length of that circle. The sine of the angle between surface and plane for a plane circle,
    /// so that it is as long as 1 where a tube ends and 0 around a hole in a plane.
    pub fn onward(&self) -> [f64; 3] {
        let length = 2.0 * PI * self.radius();
        self.conormal.map(|x| if length > 0.0 { x / length } else { 0.0 })
    }
}

impl TriMesh {
    /// The connected regions of vertices with `g > 0`, by their first vertices. Parts beside them in which the `weights` of the vertices add up to less than
    /// `least` are light. For closed meshes.
    ///
    /// Panics if there are fewer values or weights than vertices.
    pub fn regions_above(&self, g: &[f64], weights: &[f64], least: f64) -> Vec<Region> {
        let Parts { mut regions, faces_less_edges, boundaries, rims } = Parts::of(self, g);
        // Of the weights in each region.
        let mut sums = vec![0.0; self.vertices.len()];
        // Of each region χ and the number of its boundaries: together 2, less 2 for each handle.
        let mut euler: BTreeMap<usize, i64> = BTreeMap::new();
        let mut found: BTreeMap<usize, Region> = BTreeMap::new();
        for v in 0..self.vertices.len() {
            let region = regions.find(v);
            sums[region] += weights[v];
            if g[v] > 0.0 {
                *euler.entry(region).or_default() += 1 + faces_less_edges[v];
                let new = || Region { highest: v, closes_handle: false, rims: Vec::new() };
                let highest = &mut found.entry(region).or_insert_with(new).highest;
                if g[v] > g[*highest] {
                    *highest = v;
                }
            }
        }
        boundaries.iter().for_each(|[high, _]| *euler.entry(*high).or_default() += 1);
        let core = core(&boundaries, &mut sums, least);
        let cored: BTreeSet<usize> = core.iter().map(|[high, _]| *high).collect();
        let mut beyond: HashMap<[usize; 2], Beyond> = HashMap::new();
        for region in cored {
            beyond
                .extend(self::beyond(region, &core, &sums, least).into_iter().map(|(low, what)| ([region, low], what)));
        }
        for (both, mut rim) in boundaries.iter().zip(rims) {
            let Some(region) = found.get_mut(&both[0]) else { continue };
            if let Some(what) = beyond.get(both) {
                region.closes_handle |= what.rims > 1;
                rim.beyond = what.is_heavy.then_some(what.number);
            }
            region.rims.push(rim);
        }
        for (name, region) in &mut found {
            region.closes_handle |= euler[name] < 2;
        }
        found.into_values().collect()
    }
}

/// A boundary's way through a triangle, from edge to edge, with the region on its left seen from outside.
struct Passage {
    from: usize,
    to: usize,
    /// The triangle's outward unit normal.
    across: [f64; 3],
}

/// A mesh in regions of one sign.
struct Parts {
    /// Of vertices.
    regions: UnionFind,
    /// Triangles less edges with all ends above, each counted at one of its vertices.
    faces_less_edges: Vec<i64>,
    /// The regions above and below each boundary.
    boundaries: Vec<[usize; 2]>,
    /// The boundaries themselves.
    rims: Vec<Rim>,
}

impl Parts {
    fn of(mesh: &TriMesh, g: &[f64]) -> Self {
        let above = |v: u32| g[v as usize] > 0.0;
        let mut regions = UnionFind::new(mesh.vertices.len());
        let mut faces_less_edges = vec![0; mesh.vertices.len()];
        // Edges from one region to another, in the order in which they are met.
        let mut crossing: HashMap<[u32; 2], usize> = HashMap::new();
        let mut ends: Vec<[u32; 2]> = Vec::new();
        // Those that a boundary passes one after the other share a triangle.
        let mut passed = Vec::new();
        for triangle @ &[a, b, c] in &mesh.triangles {
            faces_less_edges[a as usize] += i64::from(triangle.iter().all(|v| above(*v)));
            // Where the boundary comes in, with the region on its left, and where it goes out.
            let mut through = [None; 2];
            for (a, b) in [(a, b), (b, c), (c, a)] {
                if above(a) == above(b) {
                    regions.join(a as usize, b as usize);
                    // The triangle beyond has it the other way round.
                    faces_less_edges[a as usize] -= i64::from(above(a) && a < b);
                    continue;
                }
                let edge = *crossing.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    ends.push(if above(a) { [a, b] } else { [b, a] });
                    ends.len() - 1
                });
                through[usize::from(!above(a))] = Some(edge);
            }
            if let [Some(from), Some(to)] = through {
                let across = mesh.across(triangle);
                let length = norm(&across);
                let across = if length > 0.0 { across.map(|x| x / length) } else { across };
                passed.push(Passage { from, to, across });
            }
        }
        let mut loops = UnionFind::new(ends.len());
        passed.iter().for_each(|passage| _ = loops.join(passage.from, passage.to));
        let firsts: Vec<usize> = (0..ends.len()).filter(|edge| loops.find(*edge) == *edge).collect();
        let boundaries = firsts.iter().map(|edge| ends[*edge].map(|v| regions.find(v as usize))).collect();
        let rims = rims(mesh, g, &ends, &passed, &mut loops, &firsts);
        Self { regions, faces_less_edges, boundaries, rims }
    }
}

/// The boundaries along which edges are `passed` from one to the next, with the region on the left; `ends` has the ends of the edges above and below zero,
/// `firsts` the first edge of each boundary.
fn rims(
    mesh: &TriMesh,
    g: &[f64],
    ends: &[[u32; 2]],
    passed: &[Passage],
    loops: &mut UnionFind,
    firsts: &[usize],
) -> Vec<Rim> {
    let crossing = |ends: &[u32; 2]| {
        let [high, low] = ends.map(|v| v as usize);
        let share = g[high] / (g[high] - g[low]);
        let [a, b] = [mesh.vertices[high], mesh.vertices[low]];
        std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
    };
    let crossings: Vec<[f64; 3]> = ends.iter().map(crossing).collect();
    let numbers: HashMap<usize, usize> = firsts.iter().copied().zip(0..).collect();
    let mut rims: Vec<Rim> =
        vec![
            Rim { beyond: None, centre: [0.0; 3], conormal: [0.0; 3], area: [0.0; 3], normal: [0.0; 3] };
            firsts.len()
        ];
    let mut lengths = vec![0.0; firsts.len()];
    for Passage { from, to, across } in passed {
        let first = loops.find(*from);
        let number = numbers[&first];
        let [origin, a, b] = [first, *from, *to].map(|edge| crossings[edge]);
        let along: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
        let length = norm(&along);
        let twice = cross(&std::array::from_fn(|k| a[k] - origin[k]), &along);
        let conormal = cross(across, &along);
        let rim = &mut rims[number];
        lengths[number] += length;
        for k in 0..3 {
            rim.centre[k] += length * 0.5 * (a[k] + b[k]);
            rim.conormal[k] += conormal[k];
            rim.normal[k] += length * across[k];
            rim.area[k] += 0.5 * twice[k];
        }
    }
    for (rim, length) in rims.iter_mut().zip(lengths).filter(|(_, length)| *length > 0.0) {
        rim.centre = rim.centre.map(|x| x / length);
        rim.normal = rim.normal.map(|x| x / length);
    }
    rims
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: &[f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The boundaries that are left when regions above with only one are taken away, and light regions below with only one, again and again: those on cycles,
/// and between these and heavy regions. The sums of their weights go to those they were on.
fn core(boundaries: &[[usize; 2]], sums: &mut [f64], least: f64) -> Vec<[usize; 2]> {
    let mut left = boundaries.to_vec();
    loop {
        let before = left.len();
        for leaf in [0, 1] {
            let mut count: HashMap<usize, usize> = HashMap::new();
            left.iter().for_each(|both| *count.entry(both[leaf]).or_default() += 1);
            left.retain(|both| {
                let sum = sums[both[leaf]];
                let stays = count[&both[leaf]] > 1 || leaf == 1 && sum >= least;
                if !stays {
                    sums[both[1 - leaf]] += sum;
                }
                stays
            });
        }
        if left.len() == before {
            return left;
        }
    }
}

/// What is beyond a boundary of a region.
struct Beyond {
    /// All that hangs together without the region has the same one.
    number: usize,
    /// Boundaries that the region has with all that.
    rims: usize,
    is_heavy: bool,
}

/// What is beyond the boundaries of a region that are left, by the region below.
fn beyond(region: usize, core: &[[usize; 2]], sums: &[f64], least: f64) -> Vec<(usize, Beyond)> {
    let known: BTreeSet<usize> = core.iter().flatten().copied().filter(|other| *other != region).collect();
    let numbers: HashMap<usize, usize> = known.iter().copied().zip(0..).collect();
    let mut sets = UnionFind::new(numbers.len());
    let (own, others): (Vec<[usize; 2]>, Vec<[usize; 2]>) = core.iter().partition(|[high, _]| *high == region);
    others.iter().for_each(|[high, low]| _ = sets.join(numbers[high], numbers[low]));
    let mut weights = vec![0.0; numbers.len()];
    let mut rims = vec![0; numbers.len()];
    for (number, member) in known.iter().enumerate() {
        weights[sets.find(number)] += sums[*member];
    }
    own.iter().for_each(|[_, low]| rims[sets.find(numbers[low])] += 1);
    let found = |[_, low]: &[usize; 2]| {
        let number = sets.find(numbers[low]);
        (*low, Beyond { number, rims: rims[number], is_heavy: weights[number] >= least })
    };
    own.iter().map(found).collect()
}

#[cfg(test)]
mod tests {
    use crate::{ImplicitFunction, LatticeSamples, Options, Region, Rim, TriMesh, surface};

    /// A torus around the z axis.
    struct Torus;

    impl ImplicitFunction<3> for Torus {
        fn value_and_gradient(&self, [x, y, z]: &[f64; 3]) -> (f64, [f64; 3]) {
            let ring = x.hypot(*y);
            let r = (ring - 0.7).hypot(*z);
            (r - 0.3, [(ring - 0.7) / r * x / ring, (ring - 0.7) / r * y / ring, z / r])
        }
    }

    /// The regions with parts of `least` vertices that are heavy.
    fn regions(g: impl Fn(&[f64; 3]) -> f64, least: f64) -> (TriMesh, Vec<Region>) {
        let axis: Vec<f64> = (0..24).map(|i| -1.15 + 0.1 * f64::from(i)).collect();
        let samples = LatticeSamples::of([axis.clone(), axis.clone(), axis], &Torus).unwrap();
        let mesh = surface(&samples, Some(&Torus), &Options::default()).unwrap().0;
        let values: Vec<f64> = mesh.vertices.iter().map(g).collect();
        let found = mesh.regions_above(&values, &vec![1.0; values.len()], least);
        (mesh, found)
    }

    fn handles(g: impl Fn(&[f64; 3]) -> f64) -> (TriMesh, Vec<usize>) {
        let (mesh, found) = regions(g, 0.0);
        (mesh, found.iter().filter(|region| region.closes_handle).map(|region| region.highest).collect())
    }

    #[test]
    fn a_part_all_round_a_tube_or_a_hole_closes_a_handle() {
        let (mesh, found) = handles(|x| x[0] - 0.2);
        assert_eq!(found.len(), 1);
        assert!(found.iter().all(|v| mesh.vertices[*v][0] > 0.9));
        let (mesh, found) = handles(|x| 0.6 - x[0].hypot(x[1]));
        assert_eq!(found.len(), 1);
        assert!(mesh.vertices[found[0]][0].hypot(mesh.vertices[found[0]][1]) < 0.45);
        // Twice round the tube: without one part the other still closes the handle.
        assert_eq!(handles(|x| x[0].abs() - 0.2).1.len(), 2);
    }

    #[test]
    fn caps_and_islands_close_none() {
        assert_eq!(handles(|x| x[0] - 0.9).1, [0; 0]);
        // A cap with an island in it.
        let around = |x: &[f64; 3]| (x[0] - 1.0).hypot(x[1]).hypot(x[2]);
        assert_eq!(handles(|x| (0.2 - (around(x) - 0.25).abs()).min(around(x) - 0.1)).1, [0; 0]);
        assert_eq!(handles(|_| -1.0).1, [0; 0]);
    }

    #[test]
    fn a_part_may_have_a_handle_of_its_own() {
        // All but a disc.
        let (mesh, found) = handles(|x| 0.9 - x[0]);
        assert_eq!(found.len(), 1);
        assert!(mesh.vertices[found[0]][0] < -0.9);
        assert_eq!(handles(|_| 1.0).1.len(), 1);
    }

    #[test]
    fn a_tube_goes_on_and_a_hole_does_not() {
        let (_, found) = regions(|x| x[1], 0.0);
        let [half] = &found[..] else { panic!("{found:?}") };
        assert_eq!(half.rims.len(), 2);
        for rim in &half.rims {
            // A circle of chords a tenth long, in a radius of 0.3.
            assert!((rim.radius() - 0.3).abs() < 0.01, "{rim:?}");
            assert!((rim.onward()[1] - 1.0).abs() < 0.02, "{rim:?}");
            assert!((rim.centre[0].abs() - 0.7).abs() < 0.01 && rim.centre[1].abs() < 1e-9, "{rim:?}");
            // The half is on the left of either loop, as the end of a limb is.
            assert!(rim.area[1] > 0.0, "{rim:?}");
        }
        // Within 0.1 of the top of the tube, whose slope there is a third at most.
        let (_, found) = regions(|x| 0.1 - (x[0] - 0.7).hypot(x[1]).hypot(x[2] - 0.3), 0.0);
        let [hole] = &found[..] else { panic!("{found:?}") };
        let onward = hole.rims[0].onward();
        assert!(onward.iter().map(|x| x * x).sum::<f64>() < 0.1, "{onward:?}");
        assert!(hole.rims[0].area[2] > 0.02, "{:?}", hole.rims);
    }

    #[test]
    fn rims_tell_what_hangs_together_without_the_region() {
        let beyond = |found: &[Region]| -> Vec<Vec<Option<usize>>> {
            found.iter().map(|region| region.rims.iter().map(|rim| rim.beyond).collect()).collect()
        };
        // The rest hangs together.
        let found = beyond(&regions(|x| x[1].abs() - 0.2, 10.0).1);
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|rims| rims.len() == 2 && rims[0].is_some() && rims[0] == rims[1]), "{found:?}");
        // An island, and all the rest.
        let zone = |x: &[f64; 3]| 0.1 - ((x[0] - 1.0).hypot(x[1]).hypot(x[2]) - 0.3).abs();
        let (_, found) = regions(zone, 4.0);
        let within = |rim: &Rim| rim.area.iter().zip(&rim.normal).map(|(a, n)| a * n).sum::<f64>() / rim.area[0].abs();
        let mut within: Vec<f64> = found[0].rims.iter().map(within).collect();
        within.sort_unstable_by(f64::total_cmp);
        // The outer loop is 0.4 from the middle, and bends round the tube, whose radius is 0.3.
        assert!(within[0] < -0.8 && within[1] > 0.4, "{within:?}");
        let found = beyond(&found);
        assert!(found.len() == 1 && found[0].len() == 2, "{found:?}");
        assert!(found[0][0].is_some() && found[0][1].is_some() && found[0][0] != found[0][1], "{found:?}");
        // A light island is no part, and then the region is on the edge of one part.
        assert_eq!(beyond(&regions(zone, 200.0).1), [[None, None]]);
    }
}
