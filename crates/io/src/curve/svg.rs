//! Curves and points as an SVG picture.

use std::io::{self, Write};

use crate::axis_by_axis::axis_by_axis;
use crate::curve::Curves;

/// Width of the picture in pixels; the height follows the data.
const WIDTH: f64 = 800.0;
/// Margin on every side, as a share of the longer side of the data's bounding box.
const MARGIN: f64 = 0.05;
/// Radius of a point and width of the curve, as shares of the same length.
const POINT: f64 = 0.003;
const STROKE: f64 = 0.003;

/// Draws the inside (even-odd rule) filled, the curves as strokes, the points as dots; y points up.
///
/// Coordinates are the data's own minus the lower left corner of the picture, which keeps them exact to a renderer's f32 where
/// the data lie far from the origin; `data-origin` on the root element holds that corner.
pub(crate) fn write(out: &mut impl Write, curves: &Curves<'_>) -> io::Result<()> {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in curves.vertices().chain(curves.points) {
        (low, high) = (axis_by_axis(low, *p, f64::min), axis_by_axis(high, *p, f64::max));
    }
    if low[0] > high[0] {
        (low, high) = ([0.0; 2], [1.0; 2]);
    }
    // A single point, or a row of them, still needs an area to be drawn on.
    let longest = match (high[0] - low[0]).max(high[1] - low[1]) {
        side if side > 0.0 && side.is_finite() => side,
        _ => 1.0,
    };
    let margin = MARGIN * longest;
    let origin = low.map(|c| c - margin);
    let [width, height] = axis_by_axis(high, low, |high, low| high - low + 2.0 * margin);

    writeln!(
        out,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{:.0}" viewBox="0 0 {width} {height}" data-origin="{} {}">"#,
        WIDTH * height / width,
        origin[0],
        origin[1]
    )?;
    writeln!(out, r#"<rect width="{width}" height="{height}" fill="white"/>"#)?;
    writeln!(out, r#"<g transform="translate(0 {height}) scale(1 -1)">"#)?;
    let stroke = STROKE * longest;
    for (lines, fill, end) in [(curves.curves, "#dce8f4", "Z"), (curves.paths, "none", "")] {
        if lines.is_empty() {
            continue;
        }
        write!(
            out,
            r##"<path fill="{fill}" fill-rule="evenodd" stroke="#1f5a96" stroke-width="{stroke:?}" stroke-linejoin="round" d=""##
        )?;
        for curve in lines {
            for (i, [x, y]) in curve.iter().enumerate() {
                write!(out, "{}{:?} {:?}", if i == 0 { "M" } else { "L" }, x - origin[0], y - origin[1])?;
            }
            if !curve.is_empty() {
                out.write_all(end.as_bytes())?;
            }
        }
        writeln!(out, r#""/>"#)?;
    }
    if !curves.points.is_empty() {
        writeln!(out, r##"<g fill="#c0392b">"##)?;
        let radius = POINT * longest;
        for [x, y] in curves.points {
            writeln!(out, r#"<circle cx="{:?}" cy="{:?}" r="{radius:?}"/>"#, x - origin[0], y - origin[1])?;
        }
        writeln!(out, "</g>")?;
    }
    writeln!(out, "</g>\n</svg>")
}
