//! Pictures of fields, curves and surfaces: a small software renderer that writes PNG.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context, Result};

/// Drawn this many times larger and averaged down: the antialiasing.
const OVERSAMPLING: usize = 3;

/// A colour, red, green, blue from 0 to 1.
pub type Colour = [f64; 3];

pub const BLACK: Colour = [0.1, 0.1, 0.12];
pub const WHITE: Colour = [1.0, 1.0, 1.0];
pub const RED: Colour = [0.78, 0.15, 0.12];
pub const BLUE: Colour = [0.13, 0.31, 0.62];

/// A picture under construction. Coordinates are pixels of the finished picture, y downwards.
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
    depth: Vec<f64>,
}

impl Picture {
    pub fn new(width: usize, height: usize) -> Self {
        let count = width * height * OVERSAMPLING * OVERSAMPLING;
        Self { width, height, pixels: vec![WHITE; count], depth: vec![f64::NEG_INFINITY; count] }
    }

    fn columns(&self) -> usize {
        self.width * OVERSAMPLING
    }

    fn rows(&self) -> usize {
        self.height * OVERSAMPLING
    }

    /// Colours every pixel by its position.
    pub fn fill(&mut self, colour: impl Fn(f64, f64) -> Colour) {
        let columns = self.columns();
        for (index, pixel) in self.pixels.iter_mut().enumerate() {
            let centre = |i: usize| (i as f64 + 0.5) / OVERSAMPLING as f64;
            *pixel = colour(centre(index % columns), centre(index / columns));
        }
    }

    /// A filled disc.
    pub fn disc(&mut self, x: f64, y: f64, radius: f64, colour: Colour) {
        self.disc_at(x, y, f64::INFINITY, radius, colour);
    }

    /// A filled disc that is hidden by what is nearer.
    pub fn disc_at(&mut self, x: f64, y: f64, depth: f64, radius: f64, colour: Colour) {
        let scale = OVERSAMPLING as f64;
        let (x, y, radius) = (x * scale, y * scale, radius * scale);
        for (row, column) in self.box_around(x - radius, x + radius, y - radius, y + radius) {
            let index = row * self.columns() + column;
            let near = (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y) <= radius;
            if near && depth >= self.depth[index] {
                self.pixels[index] = colour;
            }
        }
    }

    /// A line of round ends.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], width: f64, colour: Colour) {
        let steps = ((to[0] - from[0]).hypot(to[1] - from[1]) * OVERSAMPLING as f64 / width).ceil().max(1.0) as usize;
        for step in 0..=2 * steps {
            let t = step as f64 / (2 * steps) as f64;
            self.disc(from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1]), 0.5 * width, colour);
        }
    }

    /// A triangle with a depth per corner (larger is nearer), in one colour per corner.
    pub fn triangle(&mut self, corners: [[f64; 3]; 3], colours: [Colour; 3]) {
        let p = corners.map(|[x, y, z]| [x * OVERSAMPLING as f64, y * OVERSAMPLING as f64, z]);
        let area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        if area == 0.0 {
            return;
        }
        let range = |axis: usize| {
            let values = p.map(|p| p[axis]);
            (values.into_iter().fold(f64::INFINITY, f64::min), values.into_iter().fold(f64::NEG_INFINITY, f64::max))
        };
        let ((left, right), (top, bottom)) = (range(0), range(1));
        for (row, column) in self.box_around(left, right, top, bottom) {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let share = |a: usize, b: usize| ((p[a][0] - x) * (p[b][1] - y) - (p[b][0] - x) * (p[a][1] - y)) / area;
            let shares = [share(1, 2), share(2, 0), share(0, 1)];
            if shares.iter().any(|&s| s < 0.0) {
                continue;
            }
            let depth = (0..3).map(|k| shares[k] * p[k][2]).sum();
            let index = row * self.columns() + column;
            if depth > self.depth[index] {
                self.depth[index] = depth;
                self.pixels[index] =
                    std::array::from_fn(|channel| (0..3).map(|k| shares[k] * colours[k][channel]).sum());
            }
        }
    }

    fn box_around(&self, left: f64, right: f64, top: f64, bottom: f64) -> impl Iterator<Item = (usize, usize)> + use<> {
        let clamp = |value: f64, most: usize| value.clamp(0.0, most as f64) as usize;
        let (first, last) = (clamp(left.floor(), self.columns()), clamp(right.ceil(), self.columns()));
        let rows = clamp(top.floor(), self.rows())..clamp(bottom.ceil(), self.rows());
        rows.flat_map(move |row| (first..last).map(move |column| (row, column)))
    }

    /// Writes the finished picture.
    pub fn save(&self, path: &Path) -> Result<()> {
        let file = File::create(path).with_context(|| format!("{} cannot be written", path.display()))?;
        let mut encoder = png::Encoder::new(BufWriter::new(file), self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::High);
        let mut bytes = Vec::with_capacity(self.width * self.height * 3);
        let count = (OVERSAMPLING * OVERSAMPLING) as f64;
        for row in 0..self.height {
            for column in 0..self.width {
                for channel in 0..3 {
                    let mut sum = 0.0;
                    for sub in 0..OVERSAMPLING * OVERSAMPLING {
                        let (down, right) = (sub / OVERSAMPLING, sub % OVERSAMPLING);
                        let index = (row * OVERSAMPLING + down) * self.columns() + column * OVERSAMPLING + right;
                        sum += self.pixels[index][channel];
                    }
                    bytes.push((255.0 * sum / count).round().clamp(0.0, 255.0) as u8);
                }
            }
        }
        encoder.write_header()?.write_image_data(&bytes)?;
        Ok(())
    }
}

/// Blue for negative, white at zero, red for positive values; full colour at ±1, with contour bands of a tenth.
pub fn diverging(value: f64) -> Colour {
    let size = value.abs().min(1.0);
    let end = if value < 0.0 { BLUE } else { RED };
    let band = if (value * 10.0).rem_euclid(2.0) < 1.0 { 1.0 } else { 0.94 };
    std::array::from_fn(|channel| band * (WHITE[channel] + size.powf(0.7) * (end[channel] - WHITE[channel])))
}

/// A surface seen from a direction, with light from the viewer's upper left; the points are drawn where they are not
/// hidden.
pub struct View {
    rows: [[f64; 3]; 3],
    scale: f64,
    middle: [f64; 2],
    centre: [f64; 3],
}

impl View {
    /// Looks at the box of the points, turned by `azimuth` about the vertical axis `up` and lifted by `elevation`
    /// (degrees), and fits it into a picture.
    pub fn around(points: &[[f64; 3]], up: usize, azimuth: f64, elevation: f64, width: usize, height: usize) -> Self {
        let (sa, ca) = azimuth.to_radians().sin_cos();
        let (se, ce) = elevation.to_radians().sin_cos();
        let (first, second) = ((up + 1) % 3, (up + 2) % 3);
        let vector = |a: f64, b: f64, c: f64| {
            let mut v = [0.0; 3];
            (v[first], v[second], v[up]) = (a, b, c);
            v
        };
        let (right, up_there) = (vector(ca, sa, 0.0), vector(-sa * se, ca * se, ce));
        // Towards the viewer: the third row completes a right-handed system.
        let rows = [right, up_there, cross(right, up_there)];
        let corner = |pick: fn(f64, f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|axis| points.iter().map(|p| p[axis]).reduce(pick).unwrap_or(0.0))
        };
        let (lower, upper) = (corner(f64::min), corner(f64::max));
        let centre = std::array::from_fn(|axis| 0.5 * (lower[axis] + upper[axis]));
        let mut view = Self { rows, scale: 1.0, middle: [0.5 * width as f64, 0.5 * height as f64], centre };
        let reach = |axis: usize| {
            points.iter().map(|p| (view.project(p)[axis] - view.middle[axis]).abs()).fold(1e-12, f64::max)
        };
        view.scale = (0.46 * width as f64 / reach(0)).min(0.46 * height as f64 / reach(1));
        view
    }

    /// Picture coordinates and depth.
    pub fn project(&self, point: &[f64; 3]) -> [f64; 3] {
        let relative: [f64; 3] = std::array::from_fn(|axis| point[axis] - self.centre[axis]);
        let along = |row: usize| (0..3).map(|axis| self.rows[row][axis] * relative[axis]).sum::<f64>() * self.scale;
        [self.middle[0] + along(0), self.middle[1] - along(1), along(2)]
    }

    fn shade(&self, normal: &[f64; 3]) -> Colour {
        let along = |row: usize| (0..3).map(|axis| self.rows[row][axis] * normal[axis]).sum::<f64>();
        let light = (-0.35 * along(0) + 0.45 * along(1) + 0.82 * along(2)).abs();
        let tint = if along(2) >= 0.0 { [0.62, 0.72, 0.84] } else { [0.85, 0.55, 0.4] };
        tint.map(|channel: f64| (0.25 + 0.8 * light) * channel)
    }

    /// Draws a mesh, smoothly shaded; its inside is tinted orange.
    pub fn mesh(&self, picture: &mut Picture, vertices: &[[f64; 3]], normals: &[[f64; 3]], triangles: &[[u32; 3]]) {
        for triangle in triangles {
            let corners = triangle.map(|v| self.project(&vertices[v as usize]));
            picture.triangle(corners, triangle.map(|v| self.shade(&normals[v as usize])));
        }
    }

    /// Draws points; `hidden` tells whether the surface hides them.
    pub fn points(&self, picture: &mut Picture, points: &[[f64; 3]], hidden: bool) {
        for point in points {
            let [x, y, depth] = self.project(point);
            // Half on the surface, half below it: lifted a little.
            picture.disc_at(x, y, if hidden { depth + 0.012 * self.scale } else { f64::INFINITY }, 0.9, BLACK);
        }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
