//! Triangles and balls by a z-buffer.

use crate::canvas::{Band, SAMPLES, band_count, bands, paint};
use crate::image::{Image, Size};
use crate::shading::{Material, shade};

/// What is drawn, in samples: to the right, down, towards the viewer; normals along the right, upwards, towards the viewer.
pub(crate) struct Placed<'a> {
    pub(crate) vertices: Vec<[f64; 3]>,
    pub(crate) normals: Vec<[f64; 3]>,
    pub(crate) triangles: &'a [[u32; 3]],
    pub(crate) points: Vec<[f64; 3]>,
}

/// Radius of a point in the distance between neighbours that points spread over the picture would have, and the least and the
/// largest in pixels.
const RADIUS: f64 = 0.14;
const RADII: [f64; 2] = [0.6, 4.0];

/// The numbers of what touches a band.
#[derive(Default)]
struct Members {
    triangles: Vec<u32>,
    points: Vec<u32>,
}

pub(crate) fn draw_placed(placed: &Placed, size: Size) -> Image {
    let apart = ((size.width * size.height) as f64 / placed.points.len().max(1) as f64).sqrt();
    let radius = (RADIUS * apart).clamp(RADII[0], RADII[1]) * SAMPLES as f64;
    let mut members: Vec<Members> = (0..band_count(size)).map(|_| Members::default()).collect();
    for (number, triangle) in placed.triangles.iter().enumerate() {
        let rows = triangle.map(|corner| placed.vertices[corner as usize][1]);
        let (top, bottom) = range(rows);
        members[bands(size, top, bottom)].iter_mut().for_each(|band| band.triangles.push(number as u32));
    }
    for (number, point) in placed.points.iter().enumerate() {
        let touched = bands(size, point[1] - radius, point[1] + radius);
        members[touched].iter_mut().for_each(|band| band.points.push(number as u32));
    }
    paint(size, |band, number| {
        let mut depth = vec![f64::NEG_INFINITY; band.light.len()];
        let members = &members[number];
        members.triangles.iter().for_each(|&k| triangle(band, &mut depth, placed, placed.triangles[k as usize]));
        members.points.iter().for_each(|&k| ball(band, &mut depth, placed.points[k as usize], radius));
    })
}

fn range(values: [f64; 3]) -> (f64, f64) {
    (values.into_iter().fold(f64::INFINITY, f64::min), values.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

fn triangle(band: &mut Band, depth: &mut [f64], placed: &Placed, corners: [u32; 3]) {
    let p = corners.map(|corner| placed.vertices[corner as usize]);
    let n = corners.map(|corner| placed.normals[corner as usize]);
    let area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
    if area == 0.0 {
        return;
    }
    // Counter-clockwise as seen, where rows run down.
    let outside = area < 0.0;
    let ((left, right), (top, bottom)) = (range(p.map(|p| p[0])), range(p.map(|p| p[1])));
    let (rows, columns) = band.clip([left, right], [top, bottom]);
    for row in rows {
        for column in columns.clone() {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let share = |a: usize, b: usize| ((p[a][0] - x) * (p[b][1] - y) - (p[b][0] - x) * (p[a][1] - y)) / area;
            let shares = [share(1, 2), share(2, 0), share(0, 1)];
            if shares.iter().any(|&s| s < 0.0) {
                continue;
            }
            let towards: f64 = (0..3).map(|k| shares[k] * p[k][2]).sum();
            let index = band.index(row, column);
            if towards > depth[index] {
                depth[index] = towards;
                let normal = std::array::from_fn(|axis| (0..3).map(|k| shares[k] * n[k][axis]).sum());
                let material = if outside { Material::Outside } else { Material::Inside };
                band.light[index] = shade(facing(normal, outside), material);
            }
        }
    }
}

/// The normal at length 1, as it looks at the viewer: turned over on the inside.
fn facing(normal: [f64; 3], outside: bool) -> [f32; 3] {
    let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
    if !(length.is_finite() && length > 0.0) {
        return [0.0, 0.0, 1.0];
    }
    let sign = if outside { 1.0 } else { -1.0 };
    let [right, up, towards] = normal.map(|c| (sign * c / length) as f32);
    // Along the rim an averaged normal may look away a little.
    [right, up, towards.max(0.0)]
}

/// A point: half a ball, that of a point on the surface stands out of it.
fn ball(band: &mut Band, depth: &mut [f64], [x, y, z]: [f64; 3], radius: f64) {
    let (rows, columns) = band.clip([x - radius, x + radius], [y - radius, y + radius]);
    for row in rows {
        for column in columns.clone() {
            let (right, down) = (column as f64 + 0.5 - x, row as f64 + 0.5 - y);
            let height = radius * radius - right * right - down * down;
            let index = band.index(row, column);
            if height >= 0.0 && z + height.sqrt() > depth[index] {
                depth[index] = z + height.sqrt();
                let normal = [right, -down, height.sqrt()].map(|c| (c / radius) as f32);
                band.light[index] = shade(normal, Material::Point);
            }
        }
    }
}
