//! Pixels.

use crate::error::RenderError;

/// Longest side of a picture, in pixels.
const MOST_SIDE: usize = 16_384;
/// Most pixels of a picture.
const MOST_PIXELS: usize = 1 << 26;

/// A picture's size in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Size {
    /// Refuses sizes without pixels, and those of which `count` side by side would be too large.
    pub(crate) fn check(self, count: usize) -> Result<(), RenderError> {
        let sides = [self.width.saturating_mul(count), self.height];
        let all = sides[0].saturating_mul(sides[1]);
        if sides.iter().all(|side| (1..=MOST_SIDE).contains(side)) && all <= MOST_PIXELS {
            return Ok(());
        }
        Err(RenderError::Size { width: sides[0], height: sides[1], most_side: MOST_SIDE, most: MOST_PIXELS })
    }
}

/// A finished picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Its size.
    pub size: Size,
    /// Red, green, blue of each pixel as sRGB bytes; rows from the top, each from the left.
    pub rgb: Vec<u8>,
}

impl Image {
    /// The colour of a pixel, counted from the upper left one.
    ///
    /// # Panics
    /// If there is no such pixel.
    #[track_caller]
    pub fn pixel(&self, column: usize, row: usize) -> [u8; 3] {
        let (width, height) = (self.size.width, self.size.height);
        assert!(column < width && row < height, "no pixel {column}, {row} in {width} x {height}");
        let first = 3 * (row * width + column);
        [self.rgb[first], self.rgb[first + 1], self.rgb[first + 2]]
    }

    /// Pictures of one height side by side.
    pub(crate) fn beside(images: &[Self]) -> Self {
        let height = images.first().map_or(0, |image| image.size.height);
        let width = images.iter().map(|image| image.size.width).sum();
        let mut rgb = Vec::with_capacity(3 * width * height);
        for row in 0..height {
            for image in images {
                let length = 3 * image.size.width;
                rgb.extend_from_slice(&image.rgb[row * length..(row + 1) * length]);
            }
        }
        Self { size: Size { width, height }, rgb }
    }
}
