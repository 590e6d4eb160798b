//! A plan as SVG.

use std::fmt::Write;

use crate::error::RenderError;
use crate::plan::{DOT, LINE, LINE_WIDTH, Plan};

impl Plan<'_> {
    /// The plan as an SVG document whose longer side is `longest` pixels, in which coordinates are rounded to a hundredth of a pixel:
    /// a picture, not data.
    ///
    /// # Errors
    /// If the corners enclose nothing, or a coordinate is not finite.
    pub fn to_svg(&self, longest: usize) -> Result<String, RenderError> {
        self.check()?;
        let [width, height] = self.sides()?;
        let scale = longest as f64 / width.max(height);
        let place = |p: &[f64; 2]| [scale * (p[0] - self.lower[0]), scale * (self.upper[1] - p[1])];
        let path = |loops: &[Vec<[f64; 2]>]| {
            let mut d = String::new();
            for cycle in loops.iter().filter(|cycle| !cycle.is_empty()) {
                for (k, [x, y]) in cycle.iter().map(place).enumerate() {
                    let _ = write!(d, "{}{} {}", if k == 0 { "M" } else { "L" }, short(x), short(y));
                }
                d.push('Z');
            }
            d
        };
        let (w, h) = (short(scale * width), short(scale * height));
        let mut svg = String::new();
        // Writing to a string does not fail.
        let _ =
            writeln!(svg, r#"<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" viewBox="0 0 {w} {h}">"#);
        let _ = writeln!(svg, r#"<rect width="{w}" height="{h}" fill="{}"/>"#, hex(self.background));
        for layer in self.layers {
            let _ =
                writeln!(svg, r#"<path fill="{}" fill-rule="evenodd" d="{}"/>"#, hex(layer.colour), path(&layer.loops));
        }
        if !self.curves.is_empty() {
            let _ = writeln!(
                svg,
                r#"<path fill="none" stroke="{}" stroke-width="{}" stroke-linejoin="round" d="{}"/>"#,
                hex(LINE),
                short(LINE_WIDTH * longest as f64),
                path(self.curves)
            );
        }
        if !self.points.is_empty() {
            let radius = short(self.dot_radius() * longest as f64);
            let _ = writeln!(svg, r#"<g fill="{}">"#, hex(DOT));
            for [x, y] in self.points.iter().map(place) {
                let _ = writeln!(svg, r#"<circle cx="{}" cy="{}" r="{radius}"/>"#, short(x), short(y));
            }
            svg.push_str("</g>\n");
        }
        svg.push_str("</svg>\n");
        Ok(svg)
    }
}

/// A hundredth of a pixel cannot be seen.
fn short(x: f64) -> f64 {
    (100.0 * x).round() / 100.0
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
