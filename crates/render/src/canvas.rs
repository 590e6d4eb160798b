//! Rows of a picture, several samples per pixel, drawn band by band.

use rayon::prelude::*;

use crate::colour::{Light, WHITE, srgb};
use crate::image::{Image, Size};

/// Samples per pixel along each axis: the anti-aliasing.
pub(crate) const SAMPLES: usize = 3;
/// Rows of pixels per band. Bands are the same for any number of threads, and so is the picture.
const BAND: usize = 16;

/// Some rows of a picture in samples.
pub(crate) struct Band {
    /// The first row of samples.
    pub(crate) top: usize,
    /// The row of samples after the last.
    pub(crate) bottom: usize,
    /// Samples along a row.
    pub(crate) width: usize,
    pub(crate) light: Vec<Light>,
}

impl Band {
    /// The samples in a box of the whole picture: rows, and columns of each.
    pub(crate) fn clip(&self, x: [f64; 2], y: [f64; 2]) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        // The centre of sample k lies at k + ½.
        let first =
            |from: f64, least: usize, most: usize| (from - 0.5).ceil().clamp(least as f64, most as f64) as usize;
        let after = |to: f64, least: usize, most: usize| (to + 0.5).floor().clamp(least as f64, most as f64) as usize;
        let rows = first(y[0], self.top, self.bottom)..after(y[1], self.top, self.bottom);
        (rows, first(x[0], 0, self.width)..after(x[1], 0, self.width))
    }

    /// The place of a sample in [`Band::light`].
    pub(crate) fn index(&self, row: usize, column: usize) -> usize {
        (row - self.top) * self.width + column
    }
}

/// A white picture on which `draw` draws each band, given its number.
pub(crate) fn paint(size: Size, draw: impl Fn(&mut Band, usize) + Sync) -> Image {
    let width = size.width * SAMPLES;
    let mut rgb = vec![0; 3 * size.width * size.height];
    rgb.par_chunks_mut(3 * size.width * BAND).enumerate().for_each(|(number, bytes)| {
        let rows = bytes.len() / (3 * size.width);
        let top = number * BAND * SAMPLES;
        let light = vec![WHITE; rows * SAMPLES * width];
        let mut band = Band { top, bottom: top + rows * SAMPLES, width, light };
        draw(&mut band, number);
        for (pixel, bytes) in bytes.chunks_exact_mut(3).enumerate() {
            let (row, column) = (pixel / size.width * SAMPLES, pixel % size.width * SAMPLES);
            let mut sum = [0.0; 3];
            for sample in 0..SAMPLES * SAMPLES {
                let light = &band.light[(row + sample / SAMPLES) * width + column + sample % SAMPLES];
                (0..3).for_each(|channel| sum[channel] += light[channel]);
            }
            bytes.copy_from_slice(&srgb(sum.map(|sum| sum / (SAMPLES * SAMPLES) as f32)));
        }
    });
    Image { size, rgb }
}

/// The bands that samples from `top` to `bottom` fall into.
pub(crate) fn bands(size: Size, top: f64, bottom: f64) -> std::ops::Range<usize> {
    let count = band_count(size);
    let band = |y: f64| (y / (BAND * SAMPLES) as f64).floor().clamp(0.0, count as f64) as usize;
    band(top)..(band(bottom) + 1).min(count)
}

pub(crate) fn band_count(size: Size) -> usize {
    size.height.div_ceil(BAND)
}
