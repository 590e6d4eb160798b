//! Of surfaces: tunnels and bridges, parts that are linked, and ends that face each other.

use rayon::prelude::*;
use zeroset_isosurface::{Region, Rim, TriMesh};

use crate::points::frame::Frame;
use crate::points::support::{Nearest, Support};

/// Where no point is within this share of the farthest that is supported, the surface may be another. (Of random samples one place in twelve
/// is as far from all.)
const AWAY: f64 = 0.6;
/// Around the edge of a hole in a wall that is thinner than that no place is as far from both of its sides, and this is enough, for the surface stands out
/// from the points there. (Of random samples one place in three is as far from all, but not all along an edge.)
const EDGE_AWAY: f64 = 0.4;
/// The surface stands out where the nearest point is behind it by this share of its distance.
const BEHIND: f64 = 0.5;
/// What is farther from all points than they support is a hole even if nothing runs through it,
const HOLE: f64 = 1.0;
/// unless its radius is below this, in spacings, as that of one that chance has made.
const WIDE: f64 = 1.0;

/// Less than so many points' share of the surface is no part that could hang together with others.
const PART: f64 = 50.0;
/// Nor is what has a smaller radius, in spacings, the end of one.
const THINNEST: f64 = 0.5;
/// [`Rim::onward`] is longer than this where a limb ends: 1 around the end of a cylinder, 0 around a hole in a wall.
const STUMP: f64 = 0.6;
/// Ends face each other if the cosine of the angle between `onward` and the way to the other end is at least this,
const FACING: f64 = 0.5;
/// or this, if the other is a hole in a wall, which does not say where it goes on,
const STRAIGHT: f64 = 0.7;
/// and if they are no more than so many times the sum of their radii apart.
const REACH: f64 = 10.0;
/// A rim is around an island in the region, and not in another part, if the surface's normal there is against its area by this share of it.
const AGAINST: f64 = 0.5;
/// Rims go on into each other if `onward` has this component to the other one.
const GOES_ON: f64 = 0.3;

/// Warnings of a closed `mesh` of `points`, both in the frame; `nearest` has the nearest point of every vertex, `shares` how many points stand for the
/// area around it.
pub fn gap_warnings(
    mesh: &TriMesh,
    points: &[[f64; 3]],
    (support, nearest): (&Support<'_, 3>, &[Nearest]),
    shares: &[f64],
    frame: &Frame<3>,
) -> Vec<String> {
    let away = away(mesh, points, support, nearest);
    let mut regions = mesh.regions_above(&away, shares, PART);
    // The first one is named.
    regions.sort_by(|a, b| away[b.highest].total_cmp(&away[a.highest]));
    let places = |is_one: &dyn Fn(&Region) -> bool| -> Vec<[f64; 3]> {
        regions.iter().filter(|region| is_one(region)).map(|region| mesh.vertices[region.highest]).collect()
    };
    let handles = places(&|region| region.closes_handle);
    let links = places(&|region| !region.closes_handle && links_parts(region));
    let ends = regions.iter().filter_map(|region| End::of(region, support, nearest));
    let (stumps, holes): (Vec<End>, Vec<End>) = ends.partition(End::is_stump);
    let holes: Vec<End> = holes.into_iter().filter(End::is_wide).collect();
    let facing = |(i, stump): (usize, &End)| {
        let others = stumps[..i].iter().filter(|other| stump.faces(other));
        others.chain(holes.iter().filter(|hole| stump.enters(hole))).map(|other| stump.between(other)).collect()
    };
    let facing: Vec<[f64; 3]> = stumps.iter().enumerate().flat_map::<Vec<_>, _>(facing).collect();
    let together = "whether they hang together";
    let found = [
        (handles, "a tunnel or a bridge runs through a gap between the points", "whether it is there"),
        (links, "parts are linked through a gap between the points alone", together),
        (facing, "parts end facing each other across a gap between the points", together),
    ];
    found.into_iter().filter_map(|(places, what, unknown)| super::warning(&places, what, unknown, frame)).collect()
}

/// Above zero where the surface may be another, for every vertex.
fn away(mesh: &TriMesh, points: &[[f64; 3]], support: &Support<'_, 3>, nearest: &[Nearest]) -> Vec<f64> {
    let at = |((vertex, normal), nearest): ((&[f64; 3], &[f64; 3]), &Nearest)| {
        let behind = dot(&from(&points[nearest.sample], vertex), normal);
        let least = if behind > BEHIND * nearest.distance { EDGE_AWAY } else { AWAY };
        // Others than the nearest are asked where that may make a difference.
        let remoteness = if nearest.remoteness > least { support.remoteness(vertex) } else { nearest.remoteness };
        remoteness / least - 1.0
    };
    mesh.vertices.par_iter().zip(&mesh.normals).zip(nearest).map(at).collect()
}

/// Whether parts hang together by this region, other than by going on into each other as those of a limb do: they might as well be closed each by itself.
/// (Where points are far denser in one place than around it, that is an island: no point is near to its border for a spacing of those around.)
fn links_parts(region: &Region) -> bool {
    let is_island = |rim: &Rim| dot(&rim.normal, &rim.area) < -AGAINST * norm(&rim.area);
    let parts: Vec<&Rim> = region.rims.iter().filter(|rim| rim.beyond.is_some() && !is_island(rim)).collect();
    let [a, b] = parts[..] else { return parts.len() > 2 };
    let to = from(&a.centre, &b.centre);
    let (distance, [p, q]) = (norm(&to), [a, b].map(Rim::onward));
    let go_on = dot(&p, &to) > GOES_ON * distance && dot(&q, &to) < -GOES_ON * distance;
    // The edge of a hole through a wall, too, goes on from one side to the other. It is short, and its solid is outside.
    let is_edge = dot(&p, &a.area) < 0.0 && distance < a.radius() + b.radius();
    !go_on || is_edge
}

/// Where a part ends in a gap.
struct End {
    centre: [f64; 3],
    radius: f64,
    /// The spacing around it.
    spacing: f64,
    /// Where it would go on.
    onward: [f64; 3],
    /// How far its farthest place is from all points, over what they support.
    remoteness: f64,
}

impl End {
    /// If only one part, or none that is large, is beside the region.
    fn of(region: &Region, support: &Support<'_, 3>, nearest: &[Nearest]) -> Option<Self> {
        if region.closes_handle || region.rims.iter().any(|rim| rim.beyond.is_some()) {
            return None;
        }
        // The others are around islands.
        let rim = region.rims.iter().max_by(|a, b| a.radius().total_cmp(&b.radius()))?;
        let nearest = nearest[region.highest];
        let spacing = support.share(nearest.sample).sqrt();
        let end = Self {
            centre: rim.centre,
            radius: rim.radius(),
            spacing,
            onward: rim.onward(),
            remoteness: nearest.remoteness,
        };
        (end.radius > THINNEST * spacing).then_some(end)
    }

    fn is_stump(&self) -> bool {
        norm(&self.onward) > STUMP
    }

    /// Whether chance has not made it.
    fn is_wide(&self) -> bool {
        self.remoteness > HOLE && self.radius > WIDE * self.spacing
    }

    fn leads_to(&self, other: &Self, least: f64) -> bool {
        let to = from(&self.centre, &other.centre);
        let distance = norm(&to);
        distance < REACH * (self.radius + other.radius)
            && dot(&self.onward, &to) > least * norm(&self.onward) * distance
    }

    /// Whether two stumps might be one limb.
    fn faces(&self, other: &Self) -> bool {
        self.leads_to(other, FACING) && other.leads_to(self, FACING)
    }

    /// Whether a stump might go on into a hole of a wall.
    fn enters(&self, hole: &Self) -> bool {
        self.remoteness > HOLE && hole.radius > 0.5 * self.radius && self.leads_to(hole, STRAIGHT)
    }

    fn between(&self, other: &Self) -> [f64; 3] {
        std::array::from_fn(|k| 0.5 * (self.centre[k] + other.centre[k]))
    }
}

fn from(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| b[k] - a[k])
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn norm(a: &[f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
