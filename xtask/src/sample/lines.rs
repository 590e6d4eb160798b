//! Points along the lines in which planes cut a mesh, as scanners and slices leave them.

use std::f64::consts::TAU;

use zeroset_tests::Random;

use super::surface::Surface;
use super::triangles::Triangle;

/// About `count` points, for the planes cut slanting parts of the surface at larger distances: evenly along lines that are `ratio` times as far
/// from each other.
pub fn points(surface: &Surface, count: usize, ratio: f64, random: &mut Random) -> Vec<[f64; 3]> {
    let along = (surface.area() / (ratio * count as f64)).sqrt();
    let across = ratio * along;
    let direction = direction(random);
    let height = |point: &[f64; 3]| (0..3).map(|k| direction[k] * point[k]).sum::<f64>() / across;
    let shift = random.uniform();
    // From the end of one segment to the next, so that short segments have their share.
    let mut rest = random.uniform() * along;
    let mut points = Vec::new();
    for triangle in surface.triangles() {
        let heights = triangle.map(|corner| height(&corner) - shift);
        let (low, high) =
            heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(*h), high.max(*h)));
        let mut plane = low.ceil();
        while plane < high {
            if let Some([from, to]) = cut(triangle, &heights, plane) {
                let step: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
                let length = step[0].hypot(step[1]).hypot(step[2]);
                while rest < length {
                    points.push(std::array::from_fn(|k| from[k] + rest / length * step[k]));
                    rest += along;
                }
                rest -= length;
            }
            plane += 1.0;
        }
    }
    points
}

/// Where a plane at that height cuts a triangle whose corners are at these.
fn cut(triangle: &Triangle, heights: &[f64; 3], plane: f64) -> Option<[[f64; 3]; 2]> {
    let mut ends = (0..3).filter_map(|k| {
        let [a, b] = [k, (k + 1) % 3];
        let t = (plane - heights[a]) / (heights[b] - heights[a]);
        let crosses = (heights[a] < plane) != (heights[b] < plane);
        crosses.then(|| std::array::from_fn(|axis| triangle[a][axis] + t * (triangle[b][axis] - triangle[a][axis])))
    });
    Some([ends.next()?, ends.next()?])
}

/// Any, none more likely than another.
pub fn direction(random: &mut Random) -> [f64; 3] {
    let z = random.between(-1.0, 1.0);
    let (s, c) = (random.uniform() * TAU).sin_cos();
    let ring = (1.0 - z * z).sqrt();
    [ring * c, ring * s, z]
}
