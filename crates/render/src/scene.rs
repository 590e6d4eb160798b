//! What is drawn, and how large.

use rayon::prelude::*;

use crate::canvas::SAMPLES;
use crate::error::RenderError;
use crate::image::{Image, Size};
use crate::surface::{Placed, draw_placed};
use crate::view::{Rows, View, cross};

/// A surface and points, in any unit.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scene<'a> {
    /// Vertices, `N × 3`.
    pub vertices: &'a [[f64; 3]],
    /// Outward normals of the vertices, `N × 3`; where there are none they are averaged from the triangles.
    pub normals: &'a [[f64; 3]],
    /// Corners from 0, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Points, `M × 3`.
    pub points: &'a [[f64; 3]],
}

/// Free at each side, as a share of the picture.
const MARGIN: f64 = 0.05;

/// Draws the views side by side, each of `size` and all in one scale.
///
/// # Errors
/// If there is nothing to draw, a size, direction or triangle is not possible, or a coordinate is not finite.
pub fn draw(scene: &Scene, views: &[View], size: Size) -> Result<Image, RenderError> {
    size.check(views.len().max(1))?;
    if views.is_empty() || (scene.triangles.is_empty() && scene.points.is_empty()) {
        return Err(RenderError::Empty);
    }
    scene.check()?;
    let own;
    let normals = if scene.normals.is_empty() {
        own = averaged(scene);
        &own
    } else {
        scene.normals
    };
    let used: Vec<[f64; 3]> = scene.triangles.iter().flatten().map(|&corner| scene.vertices[corner as usize]).collect();
    let (lower, upper) = extent(used.iter().chain(scene.points).copied());
    let centre: [f64; 3] = std::array::from_fn(|axis| 0.5 * (lower[axis] + upper[axis]));
    let frames: Vec<Frame> = views
        .iter()
        .map(|view| {
            let rows = view.rows()?;
            // Relative to the centre before anything is added up: coordinates may be large beside the extent.
            let seen = used.iter().chain(scene.points).map(|p| turned(&rows, p, &centre));
            let (lower, upper) = extent(seen);
            Ok(Frame { rows, centre, lower, upper })
        })
        .collect::<Result<_, RenderError>>()?;
    let [width, height] = [size.width, size.height].map(|side| (side * SAMPLES) as f64);
    let scale = frames.iter().map(|frame| frame.scale(width, height)).fold(f64::INFINITY, f64::min);
    // Extents beyond f64 leave no scale.
    if !(scale.is_finite() && scale > 0.0) || frames.iter().any(|frame| frame.lower.iter().any(|c| !c.is_finite())) {
        return Err(RenderError::NotFinite { what: "picture" });
    }
    let images: Vec<Image> = frames
        .iter()
        .map(|frame| {
            let place = |p: &[f64; 3]| frame.placed(p, scale, width, height);
            let placed = Placed {
                vertices: scene.vertices.par_iter().map(place).collect(),
                normals: normals.par_iter().map(|n| turned(&frame.rows, n, &[0.0; 3])).collect(),
                triangles: scene.triangles,
                points: scene.points.par_iter().map(place).collect(),
            };
            draw_placed(&placed, size)
        })
        .collect();
    Ok(Image::beside(&images))
}

impl Scene<'_> {
    fn check(&self) -> Result<(), RenderError> {
        let vertices = self.vertices.len();
        if !self.normals.is_empty() && self.normals.len() != vertices {
            return Err(RenderError::Normals { normals: self.normals.len(), vertices });
        }
        if let Some(&corner) = self.triangles.iter().flatten().find(|&&corner| corner as usize >= vertices) {
            return Err(RenderError::Corner { corner, vertices });
        }
        let parts = [("vertices", self.vertices), ("normals", self.normals), ("points", self.points)];
        for (what, part) in parts {
            if part.iter().flatten().any(|c| !c.is_finite()) {
                return Err(RenderError::NotFinite { what });
            }
        }
        Ok(())
    }
}

/// A view's axes, and the box of what it sees along them.
struct Frame {
    rows: Rows,
    centre: [f64; 3],
    lower: [f64; 3],
    upper: [f64; 3],
}

impl Frame {
    /// Samples per unit.
    fn scale(&self, width: f64, height: f64) -> f64 {
        let fit = |side: f64, axis: usize| (1.0 - 2.0 * MARGIN) * side / (self.upper[axis] - self.lower[axis]);
        match fit(width, 0).min(fit(height, 1)) {
            // A single point has no extent, and any scale will do.
            scale if scale == f64::INFINITY => 1.0,
            scale => scale,
        }
    }

    /// Samples to the right, samples down, and towards the viewer in the same unit.
    fn placed(&self, point: &[f64; 3], scale: f64, width: f64, height: f64) -> [f64; 3] {
        let [right, up, towards] = turned(&self.rows, point, &self.centre);
        let middle = |axis: usize| 0.5 * (self.lower[axis] + self.upper[axis]);
        [0.5 * width + scale * (right - middle(0)), 0.5 * height - scale * (up - middle(1)), scale * towards]
    }
}

fn turned(rows: &Rows, point: &[f64; 3], centre: &[f64; 3]) -> [f64; 3] {
    rows.map(|row| (0..3).map(|axis| row[axis] * (point[axis] - centre[axis])).sum())
}

fn extent(points: impl Iterator<Item = [f64; 3]>) -> ([f64; 3], [f64; 3]) {
    points.fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(lower, upper), p| {
        (std::array::from_fn(|k| lower[k].min(p[k])), std::array::from_fn(|k| upper[k].max(p[k])))
    })
}

/// Normals of the vertices: the mean of their triangles' by area.
fn averaged(scene: &Scene) -> Vec<[f64; 3]> {
    let mut normals = vec![[0.0; 3]; scene.vertices.len()];
    for triangle in scene.triangles {
        let [a, b, c] = triangle.map(|corner| scene.vertices[corner as usize]);
        let side = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| p[axis] - a[axis]) };
        let normal = cross(side(b), side(c));
        for &corner in triangle {
            (0..3).for_each(|axis| normals[corner as usize][axis] += normal[axis]);
        }
    }
    normals
}
