//! Pictures of results: surfaces with their points, and the levels of plane functions.

use std::path::Path;

use zeroset::bspline::HierarchicalSpline;
use zeroset::isosurface::{self, TriMesh};
use zeroset_io::Picture;
use zeroset_render::{Image, Layer, Plan, RenderError, Scene, Size, Up, View};

use crate::failure::Failure;
use crate::lattice;

/// Each view of a preview, and the room for one of a plane function.
pub const PREVIEW: Size = Size { width: 640, height: 640 };
/// More points would hide the surface.
const MOST_POINTS: usize = 20_000;
/// About so many levels are shown.
const LEVELS: f64 = 16.0;
/// Cells that curves of the levels are searched in, along the longest side of the box.
const CELLS: usize = 192;
/// What the levels fade to, inside and outside.
const DEEP_INSIDE: [f64; 3] = [74.0, 127.0, 193.0];
const FAR_OUTSIDE: [f64; 3] = [205.0, 178.0, 128.0];

/// From the front, obliquely, and from above.
pub fn three_views(up: Up) -> [View; 3] {
    [View::front(up), View::oblique(up), View::top(up)]
}

/// What a preview's views show.
const VIEW_NAMES: [&str; 3] = ["From the front", "Obliquely", "From above"];

/// The views of a preview one by one, in one scale, as the bytes of PNG files with their captions.
pub fn surface_views(mesh: &TriMesh, points: &[[f64; 3]], up: Up) -> Result<Vec<(&'static str, Vec<u8>)>, Failure> {
    let image = draw_surface(mesh, points, &three_views(up), PREVIEW)?;
    let row = 3 * PREVIEW.width;
    let view = |(k, name)| {
        let rows = image.rgb.chunks(3 * row);
        let rgb: Vec<u8> = rows.filter_map(|all| all.chunks_exact(row).nth(k)).flatten().copied().collect();
        let bytes = zeroset_io::encode_png(PREVIEW.width, PREVIEW.height, &rgb).map_err(Failure::internal)?;
        Ok((name, bytes))
    };
    VIEW_NAMES.into_iter().enumerate().map(view).collect()
}

fn draw_surface(mesh: &TriMesh, points: &[[f64; 3]], views: &[View], size: Size) -> Result<Image, Failure> {
    let shown = some(points);
    let scene = Scene { vertices: &mesh.vertices, normals: &mesh.normals, triangles: &mesh.triangles, points: &shown };
    zeroset_render::draw(&scene, views, size).map_err(refused)
}

pub fn write_surface(
    path: &Path,
    mesh: &TriMesh,
    points: &[[f64; 3]],
    views: &[View],
    size: Size,
) -> Result<(), Failure> {
    write_image(path, &draw_surface(mesh, points, views, size)?)
}

/// Every so many-th point, so that not too many are left.
fn some<const D: usize>(points: &[[f64; D]]) -> Vec<[f64; D]> {
    points.iter().copied().step_by(points.len().div_ceil(MOST_POINTS).max(1)).collect()
}

/// The levels of a function of two variables, in its box.
pub struct Levels {
    lower: [f64; 2],
    upper: [f64; 2],
    background: [u8; 3],
    layers: Vec<Layer>,
    curves: Vec<Vec<[f64; 2]>>,
    points: Vec<[f64; 2]>,
}

impl Levels {
    /// `points` are in data coordinates, `origin` is what the function's knots are relative to; `iso` is the value that is drawn as
    /// a curve.
    pub fn of(
        spline: &HierarchicalSpline<2>,
        origin: &[f64; 2],
        points: &[[f64; 2]],
        iso: f64,
    ) -> Result<Self, Failure> {
        let (lower, upper) = spline.domain();
        let values = spline.sample(&lattice::nodes(spline, lattice::longest_side(spline) / 64.0)?, [0; 2]);
        let finite = values.iter().filter(|f| f.is_finite());
        let (least, most) = finite.fold((0.0, 0.0), |(least, most): (f64, f64), f| (least.min(*f), most.max(*f)));
        let step = round_step((most - least) / LEVELS);
        let colour = |band: f64| shade((band + 0.5) * step, least, most);
        let (first, last) = ((least / step).floor(), (most / step).ceil());
        let mut layers = Vec::new();
        // What lies below each level, from the highest on; each leaves a band of the one before to be seen.
        let mut level = last - 1.0;
        while level > first {
            let loops = curves(spline, level * step)?;
            layers.push(Layer { loops, colour: colour(level - 1.0) });
            level -= 1.0;
        }
        let shown = some(points).iter().map(|p| [p[0] - origin[0], p[1] - origin[1]]).collect();
        let background = colour(last - 1.0);
        Ok(Self { lower, upper, background, layers, curves: curves(spline, iso)?, points: shown })
    }

    /// As `.png` or `.svg`, as large as there is room.
    pub fn write(&self, path: &Path, room: Size) -> Result<(), Failure> {
        if zeroset_io::extension_among(path, &["svg"]).is_ok() {
            return zeroset_io::write_picture(path, &Picture::Svg(&self.svg(room)?)).map_err(Failure::writing);
        }
        let plan = self.plan();
        write_image(path, &plan.draw(plan.size(room).map_err(refused)?).map_err(refused)?)
    }

    /// As an SVG document, as large as there is room.
    pub fn svg(&self, room: Size) -> Result<String, Failure> {
        let plan = self.plan();
        let size = plan.size(room).map_err(refused)?;
        plan.to_svg(size.width.max(size.height)).map_err(refused)
    }

    fn plan(&self) -> Plan<'_> {
        Plan {
            lower: self.lower,
            upper: self.upper,
            background: self.background,
            layers: &self.layers,
            curves: &self.curves,
            points: &self.points,
        }
    }
}

/// The curves `f = value`; none where there are none.
fn curves(spline: &HierarchicalSpline<2>, value: f64) -> Result<Vec<Vec<[f64; 2]>>, Failure> {
    let f = spline.plus_constant(-value).map_err(Failure::internal)?;
    match isosurface::curve_of(&f, lattice::halvings(&f, CELLS), &Default::default()) {
        Ok((curves, _)) => Ok(curves.loops),
        Err(isosurface::Error::Empty) => Ok(Vec::new()),
        Err(error) => Err(Failure::internal(error)),
    }
}

/// 1, 2 or 5 times a power of ten, about as large as `step`.
fn round_step(step: f64) -> f64 {
    let power = 10.0_f64.powf(step.log10().floor());
    match step / power {
        share if share < 1.5 => power,
        share if share < 3.5 => 2.0 * power,
        share if share < 7.5 => 5.0 * power,
        _ => 10.0 * power,
    }
}

/// White at zero, blue inside, sand outside.
fn shade(value: f64, least: f64, most: f64) -> [u8; 3] {
    let (share, end) = if value < 0.0 { (value / least, DEEP_INSIDE) } else { (value / most, FAR_OUTSIDE) };
    let share = share.clamp(0.0, 1.0).powf(0.7);
    end.map(|channel| (255.0 + share * (channel - 255.0)).round() as u8)
}

fn write_image(path: &Path, image: &Image) -> Result<(), Failure> {
    let picture = Picture::Pixels { width: image.size.width, height: image.size.height, rgb: &image.rgb };
    zeroset_io::write_picture(path, &picture).map_err(Failure::writing)
}

/// Sizes and views are the user's.
fn refused(error: RenderError) -> Failure {
    match error {
        RenderError::Size { .. } | RenderError::Direction(_) => Failure::usage(error),
        error => Failure::internal(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        for (step, round) in [(0.0123, 0.01), (1.6, 2.0), (340.0, 200.0), (4e-9, 5e-9), (8.0, 10.0)] {
            assert!((round_step(step) / round - 1.0).abs() < 1e-12, "{step}");
        }
    }

    #[test]
    fn no_more_points_than_leave_the_surface_visible() {
        let points: Vec<[f64; 2]> = (0..50_000).map(|i| [f64::from(i), 0.0]).collect();
        let shown = some(&points);
        assert_eq!((shown.len(), shown[1]), (16_667, [3.0, 0.0]));
        assert_eq!(some(&points[..100]).len(), 100);
        assert!(some::<2>(&[]).is_empty());
    }
}
