//! Points that the others do not foretell: beside the surface that their neighbours lie on.
//!
//! A function that is fitted to all points vanishes at strays too, so its value there says nothing. The tangent planes of the other points
//! do: of a point on their surface they pass by at a small distance, of one beside it at the distance from the surface (as in the implicit
//! moving least squares of Kolluri 2008, with medians for means, and without the point itself).

use std::num::NonZero;

use kiddo::SquaredEuclidean;
use rayon::prelude::*;

use crate::points::kd_tree::tree_of;
use crate::points::spacing::{ROUND, Spacing, roundness};

/// Whose planes are asked: so many neighbours of a point on a surface, half as many on a curve.
const NEIGHBOURS: usize = 12;
/// Fewer of them with known normals say nothing.
const FEWEST: usize = 4;
/// Neighbours on the other side of a thin wall have normals at more than 120° from the nearest one's; it takes so many to say where that side is.
const OPPOSED: f64 = -0.5;
const FEWEST_OPPOSED: usize = 3;
/// A point is a stray if it lies off by more than so many times what three quarters of its neighbours do: at creases and tips all do.
const TIMES: f64 = 5.0;
/// But not below so many spacings, nor standard deviations of the noise;
const LEAST: f64 = 0.5;
const DEVIATIONS: f64 = 6.0;
/// and above so many spacings it is one whatever the neighbours do.
const MOST: f64 = 0.9;
/// Unless there are hardly any strays. Of points of a surface one in eight hundred at most lies so far off, at creases and tips;
const FAR: f64 = 1.1;
/// while no larger share than this of all points does or is known to be a stray,
const HARDLY_ANY: f64 = 0.003;
/// only those are strays that lie off so far.
const FARTHEST: f64 = 1.4;
/// How many points one parallel task takes at least.
const CHUNK: usize = 256;
/// On a curve these lengths are so many times larger, the last two by the other number once more: the spacing of random points varies there
/// from place to place.
const CURVE: f64 = 1.5;
const CURVE_FAR: f64 = 1.3;
/// Strays are strewn, some of them far off. Where none is farther than so many times that from a curve, its corners and ends are what lies
/// off, beside gaps that random points leave: up to 3 on 16 of 17 such outlines, 6 and more among 1 to 3 % of strays.
const STREWN: f64 = 4.0;

/// The neighbours of points of which one or the other may be a stray.
pub struct LeaveOneOut<'a, const D: usize> {
    points: &'a [[f64; D]],
    /// So many for each, the nearest first.
    neighbours: Vec<u32>,
    count: usize,
    /// For each the usual spacing of its neighbours, on a curve one and a half of it: all distances are in these.
    usual: Vec<f64>,
}

impl<'a, const D: usize> LeaveOneOut<'a, D> {
    /// Looks for the neighbours of points with their spacing. Of a few points no neighbours are asked.
    pub fn new(points: &'a [[f64; D]], spacing: &Spacing) -> Self {
        let count = if D == 2 { NEIGHBOURS / 2 } else { NEIGHBOURS };
        if points.len() <= 2 * count {
            return Self { points, neighbours: vec![], count, usual: vec![] };
        }
        let tree = tree_of(points);
        // The point itself is among its own neighbours.
        let wanted = NonZero::<usize>::MIN.saturating_add(count);
        let around = |i: usize| {
            let mut found = tree.query(&points[i]).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
            found.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.item.cmp(&b.item)));
            found.into_iter().map(|near| near.item).filter(move |near| *near as usize != i).take(count)
        };
        let neighbours: Vec<u32> =
            (0..points.len()).into_par_iter().with_min_len(CHUNK).flat_map_iter(around).collect();
        let scale = if D == 2 { CURVE } else { 1.0 };
        let middle_of = |around: &[u32]| scale * middle(around.iter().map(|i| spacing.local[*i as usize]).collect());
        let usual = neighbours.par_chunks(count).with_min_len(CHUNK).map(middle_of).collect();
        Self { points, neighbours, count, usual }
    }

    /// How far each point is off what its neighbours' normals make of it; 0 where too few normals are known. Unknown ones are zero.
    fn off(&self, normals: &[[f64; D]]) -> Vec<f64> {
        let all = self.neighbours.par_chunks(self.count).with_min_len(CHUNK).zip(&self.usual).enumerate();
        all.map(|(i, (around, usual))| distance(&self.points[i], around, self.points, normals) / usual).collect()
    }

    /// For every point whether it is a stray by these normals, where points have a standard deviation of `noise` and so many strays are
    /// `known` besides.
    pub fn strays(&self, normals: &[[f64; D]], noise: f64, known: usize) -> Vec<bool> {
        if self.neighbours.is_empty() {
            return vec![false; self.points.len()];
        }
        let off = self.off(normals);
        let beyond = |i: usize, most: f64| off[i] > most.max(DEVIATIONS * noise / self.usual[i]);
        let wider = if D == 2 { CURVE_FAR } else { 1.0 };
        let far = known + (0..off.len()).filter(|i| beyond(*i, wider * FAR)).count();
        let strewn = D == 3 || known > 0 || (0..off.len()).any(|i| beyond(i, STREWN));
        if far as f64 <= HARDLY_ANY * (known + off.len()) as f64 || !strewn {
            return (0..off.len()).map(|i| beyond(i, wider * FARTHEST)).collect();
        }
        let is_stray = |(i, around): (usize, &[u32])| {
            let mut theirs: Vec<f64> = around.iter().map(|i| off[*i as usize]).collect();
            theirs.sort_by(f64::total_cmp);
            beyond(i, (TIMES * theirs[3 * theirs.len() / 4 - 1]).clamp(LEAST, MOST))
        };
        let around = || self.neighbours.par_chunks(self.count).with_min_len(CHUNK).enumerate();
        let found: Vec<bool> = around().map(is_stray).collect();
        // Strays are strewn; where a third of a sheet is found it is the surface that is wrong.
        let in_a_sheet = |i: usize, around: &[u32]| {
            let both: Vec<usize> = around.iter().map(|near| *near as usize).chain([i]).collect();
            3 * both.iter().filter(|i| found[**i]).count() > both.len() && roundness(self.points, &both) < ROUND
        };
        around().map(|(i, around)| found[i] && !in_a_sheet(i, around)).collect()
    }
}

/// How far a point is off what its neighbours' normals make of it: by their tangent planes, or by what follows a curved surface, the planes
/// across the mean of a neighbour's normal and that of all on the same side; the nearer of both. Of a thin wall either side may be the point's own.
fn distance<const D: usize>(point: &[f64; D], around: &[u32], points: &[[f64; D]], normals: &[[f64; D]]) -> f64 {
    let known: Vec<usize> = around.iter().map(|i| *i as usize).filter(|i| normals[*i] != [0.0; D]).collect();
    let Some(nearest) = known.first().filter(|_| known.len() >= FEWEST) else { return 0.0 };
    let from = |i: usize| -> [f64; D] { std::array::from_fn(|axis| point[axis] - points[i][axis]) };
    let flat = middle(known.iter().map(|i| dot(&normals[*i], &from(*i))).collect());
    let along = |i: usize| dot(&normals[i], &normals[*nearest]);
    let curved = |side: Vec<usize>| {
        let sum: [f64; D] = std::array::from_fn(|axis| side.iter().map(|i| normals[*i][axis]).sum());
        let length = dot(&sum, &sum).sqrt();
        let planes = side.iter().map(|i| {
            let both: [f64; D] = std::array::from_fn(|axis| normals[*i][axis] + sum[axis] / length);
            dot(&both, &from(*i)) / dot(&both, &both).sqrt().max(0.5)
        });
        middle(planes.collect()).abs()
    };
    let near_side = known.iter().copied().filter(|i| along(*i) > 0.0).collect();
    let far_side: Vec<usize> = known.iter().copied().filter(|i| along(*i) < OPPOSED).collect();
    let nearer = flat.abs().min(curved(near_side));
    if far_side.len() < FEWEST_OPPOSED { nearer } else { nearer.min(curved(far_side)) }
}

/// The median.
fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::Domain;
    use crate::lattice::domain::tests::spline;
    use crate::sides::normals::normals;
    use zeroset_bspline::Spline;

    /// Roberts' quasi-random sequences.
    fn quasi<const D: usize>(i: usize) -> [f64; D] {
        let steps = [0.819_172_513, 0.671_043_607, 0.549_700_478];
        std::array::from_fn(|axis| (i as f64 * steps[axis]).fract())
    }

    /// A point of a sphere about the origin.
    fn on_sphere(i: usize, radius: f64) -> [f64; 3] {
        let [u, v, _] = quasi::<3>(i);
        let (z, angle) = (2.0 * u - 1.0, std::f64::consts::TAU * v);
        let ring = (1.0 - z * z).sqrt();
        [radius * ring * angle.cos(), radius * ring * angle.sin(), radius * z]
    }

    /// The faces of a cube of side 0.8.
    fn cube(count: usize) -> Vec<[f64; 3]> {
        let place = |i: usize| {
            let [u, v, _] = quasi::<3>(i).map(|x| 0.8 * x - 0.4);
            let end = if i.is_multiple_of(2) { 0.4 } else { -0.4 };
            let mut point = [end, u, v];
            point.rotate_right(i / 2 % 3);
            point
        };
        (0..count).map(place).collect()
    }

    fn beside<const D: usize>(f: &Spline<D>, points: &[[f64; D]], noise: f64, known: usize) -> Vec<bool> {
        LeaveOneOut::new(points, &Spacing::of(points)).strays(&normals(f, points, 0.0), noise, known)
    }

    #[test]
    fn strays_near_a_cube_are_told_from_its_edges() {
        let domain = Domain::around(&[1.2; 3], 36);
        let f = spline(&domain, 1, |x| x.map(|x| x.abs() - 0.4).into_iter().fold(f64::MIN, f64::max));
        let clean = cube(4800);
        let spacing = Spacing::of(&clean);
        let found = beside(&f, &clean, 0.0, 0);
        assert_eq!(found.iter().filter(|stray| **stray).count(), 0, "edges and corners");

        // One in forty, up to four spacings off a face's midst, on either side.
        let off = |i: usize| {
            let [u, v, w] = quasi::<3>(i);
            let far = spacing.typical * (1.0 + 3.0 * w) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
            [0.6 * u - 0.3, 0.6 * v - 0.3, 0.4 + far]
        };
        let points: Vec<[f64; 3]> = clean.iter().copied().chain((0..120).map(off)).collect();
        let found = beside(&f, &points, 0.0, 0);
        let (of_cube, of_strays) = found.split_at(clean.len());
        let count = |found: &[bool]| found.iter().filter(|stray| **stray).count();
        // Where strays are dense they hide each other; they go in the next round.
        assert!(count(of_strays) > 100, "{}", count(of_strays));
        assert!(count(of_cube) < 15, "{}", count(of_cube));
    }

    #[test]
    fn the_other_side_of_a_wall_is_no_stray_and_hides_none() {
        // A shell as thick as its points are apart: of the neighbours some lie on the other side, by chance more than half.
        let (outer, inner, count) = (0.4, 0.375, 6000);
        let domain = Domain::around(&[1.2; 3], 96);
        let shell = 0.5 * (outer + inner);
        let radius = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let f = spline(&domain, 1, |x| (radius(&x) - shell).abs() - 0.5 * (outer - inner));
        // Chosen by a hash: evenly spaced ones alternate.
        let hash = |i: usize| ((i as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
        let of_shell = |i: usize| on_sphere(i, if hash(i) < 0.5 { outer } else { inner });
        let mut points: Vec<[f64; 3]> = (0..count).map(of_shell).collect();
        let found = beside(&f, &points, 0.0, 0);
        assert_eq!(found.iter().filter(|stray| **stray).count(), 0);
        // One in sixty, outside and inside, two spacings off.
        let off = |i: usize| on_sphere(7 * i, if i.is_multiple_of(2) { outer + 0.05 } else { inner - 0.05 });
        points.extend((0..100).map(off));
        let found = beside(&f, &points, 0.0, 0);
        let (of_shell, of_strays) = found.split_at(count);
        let count = |found: &[bool]| found.iter().filter(|stray| **stray).count();
        assert!(count(of_shell) < 6 && count(of_strays) > 90, "{} {}", count(of_shell), count(of_strays));
    }

    #[test]
    fn noise_is_no_stray() {
        let domain = Domain::around(&[0.8; 3], 16);
        let f = spline(&domain, 1, |x| x.iter().map(|x| x * x).sum::<f64>().sqrt() - 0.4);
        // Even noise of two spacings at most: a standard deviation of 1.2.
        let place = |i: usize| on_sphere(i, 0.4 + 0.04 * (2.0 * quasi::<3>(i)[2] - 1.0));
        let points: Vec<[f64; 3]> = (0..5000).map(place).collect();
        let found = beside(&f, &points, 0.023, 100);
        assert_eq!(found.iter().filter(|stray| **stray).count(), 0);
    }

    #[test]
    fn of_curves_too() {
        let domain = Domain::around(&[1.0; 2], 30);
        let f = spline(&domain, 2, |x: [f64; 2]| x[0].hypot(x[1]) - 0.4);
        let circle = |i: usize| std::f64::consts::TAU * quasi::<2>(i)[0];
        let mut points: Vec<[f64; 2]> = (0..400).map(circle).map(|t| [0.4 * t.cos(), 0.4 * t.sin()]).collect();
        assert_eq!(beside(&f, &points, 0.0, 0).iter().filter(|stray| **stray).count(), 0);
        // Five spacings off, on either side.
        let radius = |i: usize| if i.is_multiple_of(2) { 0.43 } else { 0.37 };
        points.extend((0..12).map(|i| (radius(i), 0.5 * i as f64)).map(|(r, t)| [r * t.cos(), r * t.sin()]));
        let found = beside(&f, &points, 0.0, 0);
        assert!(found[400..].iter().all(|stray| *stray) && !found[..400].contains(&true));
    }

    #[test]
    fn corners_of_random_outlines_are_no_strays_where_none_are_strewn() {
        // A cross with twelve corners, points 0.03 apart on average.
        let arms = |[x, y]: [f64; 2]| (x.abs().max(3.0 * y.abs())).min(y.abs().max(3.0 * x.abs())) - 0.45;
        let f = spline(&Domain::<2>::around(&[1.0; 2], 30), 2, arms);
        let corners = [[0.15, 0.15], [0.15, 0.45], [-0.15, 0.45], [-0.15, 0.15], [-0.45, 0.15], [-0.45, -0.15]];
        let corners: Vec<[f64; 2]> = corners.iter().copied().chain(corners.map(|[x, y]| [-x, -y])).collect();
        let mut random = (0u64..).map(|i| ((i as f64 * 12.9898 + 0.3).sin() * 43_758.545_3).rem_euclid(1.0));
        let mut outline = || -> Vec<[f64; 2]> {
            let mut place = || {
                let along = 12.0 * random.next().unwrap();
                let (from, to) = (corners[along as usize], corners[(along as usize + 1) % 12]);
                [0, 1].map(|axis| from[axis] + along.fract() * (to[axis] - from[axis]))
            };
            (0..120).map(|_| place()).collect()
        };
        let (mut alone, mut among) = (0, 0);
        for _ in 0..20 {
            let points = outline();
            let count = |found: &[bool]| found.iter().filter(|stray| **stray).count();
            alone += count(&beside(&f, &points, 0.0, 0));
            among += count(&beside(&f, &points, 0.0, 1));
        }
        // Of 2400 points; with a stray that is known elsewhere they are looked at more closely.
        assert!(alone < 20 && among > 50, "{alone} {among}");
    }
}
