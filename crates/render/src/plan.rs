//! Functions of two variables: filled levels, curves, points.

use crate::canvas::{Band, SAMPLES, paint};
use crate::colour::{Light, light};
use crate::error::RenderError;
use crate::fill::Edges;
use crate::image::{Image, Size};

/// A drawing in the plane, in any unit, y up.
#[derive(Debug, Clone, Copy)]
pub struct Plan<'a> {
    /// The lower left corner of what is drawn.
    pub lower: [f64; 2],
    /// The upper right corner.
    pub upper: [f64; 2],
    /// The colour behind everything, as sRGB bytes.
    pub background: [u8; 3],
    /// Filled one over the other, the first at the bottom.
    pub layers: &'a [Layer],
    /// Closed curves, drawn as lines over the layers.
    pub curves: &'a [Vec<[f64; 2]>],
    /// Drawn as dots, over everything.
    pub points: &'a [[f64; 2]],
}

/// What closed curves enclose (even-odd rule), in one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Closed: the last vertex is joined to the first.
    pub loops: Vec<Vec<[f64; 2]>>,
    /// sRGB bytes.
    pub colour: [u8; 3],
}

/// Of curves and points; widths and radii as shares of the longer side.
pub(crate) const LINE: [u8; 3] = [31, 58, 96];
pub(crate) const DOT: [u8; 3] = [176, 42, 36];
pub(crate) const LINE_WIDTH: f64 = 0.004;
/// Many points lie so close along their curve that larger dots would hide it.
const DOT_RADII: [f64; 2] = [0.0015, 0.004];

impl Plan<'_> {
    /// The size of the largest picture of this shape that there is room for.
    ///
    /// # Errors
    /// If the corners enclose nothing.
    pub fn size(&self, room: Size) -> Result<Size, RenderError> {
        let [width, height] = self.sides()?;
        let scale = (room.width as f64 / width).min(room.height as f64 / height);
        let side = |length: f64| (scale * length).round().max(1.0) as usize;
        Ok(Size { width: side(width), height: side(height) })
    }

    /// Draws the plan as large as fits, its corners in those of the picture.
    ///
    /// # Errors
    /// If the corners enclose nothing, a coordinate is not finite, or a size is not possible.
    pub fn draw(&self, size: Size) -> Result<Image, RenderError> {
        size.check(1)?;
        self.check()?;
        let [width, height] = self.sides()?;
        let scale = ((size.width * SAMPLES) as f64 / width).min((size.height * SAMPLES) as f64 / height);
        let place = |p: &[f64; 2]| [scale * (p[0] - self.lower[0]), scale * (self.upper[1] - p[1])];
        let layers: Vec<(Edges, Light)> = self
            .layers
            .iter()
            .map(|layer| (Edges::new(layer.loops.iter().map(|cycle| cycle.iter().map(place))), light(layer.colour)))
            .collect();
        let curves: Vec<Vec<[f64; 2]>> = self.curves.iter().map(|cycle| cycle.iter().map(place).collect()).collect();
        let points: Vec<[f64; 2]> = self.points.iter().map(place).collect();
        let longest = scale * width.max(height);
        // A pixel at least.
        let half = (0.5 * LINE_WIDTH * longest).max(0.5 * SAMPLES as f64);
        let radius = (self.dot_radius() * longest).max(0.5 * SAMPLES as f64);
        Ok(paint(size, |band, _| {
            band.light.fill(light(self.background));
            for (edges, colour) in &layers {
                edges.fill(band, *colour);
            }
            for cycle in &curves {
                for (a, b) in cycle.iter().zip(cycle.iter().cycle().skip(1)) {
                    stroke(band, *a, *b, half, light(LINE));
                }
            }
            points.iter().for_each(|p| stroke(band, *p, *p, radius, light(DOT)));
        }))
    }

    /// Radius of the points, as a share of the longer side.
    pub(crate) fn dot_radius(&self) -> f64 {
        (0.8 / self.points.len().max(1) as f64).clamp(DOT_RADII[0], DOT_RADII[1])
    }

    /// Width and height.
    pub(crate) fn sides(&self) -> Result<[f64; 2], RenderError> {
        let sides = [self.upper[0] - self.lower[0], self.upper[1] - self.lower[1]];
        if sides.iter().all(|side| side.is_finite()) {
            return if sides.iter().all(|side| *side > 0.0) { Ok(sides) } else { Err(RenderError::Empty) };
        }
        Err(RenderError::NotFinite { what: "corners" })
    }

    pub(crate) fn check(&self) -> Result<(), RenderError> {
        let layers = self.layers.iter().flat_map(|layer| &layer.loops);
        let curves = layers.chain(self.curves).flatten();
        let wrong = |p: &[f64; 2]| p.iter().any(|c| !c.is_finite());
        match (curves.clone().any(wrong), self.points.iter().any(wrong)) {
            (true, _) => Err(RenderError::NotFinite { what: "curves" }),
            (_, true) => Err(RenderError::NotFinite { what: "points" }),
            _ => Ok(()),
        }
    }
}

/// A line with round ends; a disc where both are one.
fn stroke(band: &mut Band, a: [f64; 2], b: [f64; 2], half: f64, colour: Light) {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let range = |axis: usize| [a[axis].min(b[axis]) - half, a[axis].max(b[axis]) + half];
    let (rows, columns) = band.clip(range(0), range(1));
    for row in rows {
        for column in columns.clone() {
            let from = [column as f64 + 0.5 - a[0], row as f64 + 0.5 - a[1]];
            let t = if square > 0.0 { (from[0] * along[0] + from[1] * along[1]) / square } else { 0.0 };
            let t = t.clamp(0.0, 1.0);
            if (from[0] - t * along[0]).hypot(from[1] - t * along[1]) <= half {
                let index = band.index(row, column);
                band.light[index] = colour;
            }
        }
    }
}
