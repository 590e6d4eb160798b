//! Pictures: `.png` and `.svg`.

use std::io::{self, Write};
use std::path::Path;

use crate::extension::extension_among;
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// A picture, borrowed from whoever drew it.
#[derive(Debug, Clone, Copy)]
pub enum Picture<'a> {
    /// For `.png`.
    Pixels {
        /// Pixels along a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Red, green, blue of each pixel as sRGB bytes, rows from the top.
        rgb: &'a [u8],
    },
    /// For `.svg`: the document.
    Svg(&'a str),
}

/// Writes a picture: pixels as `.png` (8 bits per channel, sRGB), a document as `.svg`.
///
/// # Errors
/// [`WriteError`]; the file at `path` is replaced only when everything was written.
pub fn write_picture(path: impl AsRef<Path>, picture: &Picture) -> Result<(), WriteError> {
    let path = path.as_ref();
    match *picture {
        Picture::Svg(document) => {
            extension_among(path, &["svg"])?;
            replace_file(path, |out| out.write_all(document.as_bytes()))
        }
        Picture::Pixels { width, height, rgb } => {
            extension_among(path, &["png"])?;
            let invalid = |problem| WriteError::Invalid { path: path.to_owned(), problem };
            let bytes = encode_png(width, height, rgb).map_err(invalid)?;
            replace_file(path, |out| out.write_all(&bytes))
        }
    }
}

/// The bytes of a `.png` file (8 bits per channel, sRGB): red, green, blue of each pixel, rows from the top.
///
/// # Errors
/// A sentence, where there are no pixels or not as many bytes as they need.
pub fn encode_png(width: usize, height: usize, rgb: &[u8]) -> Result<Vec<u8>, String> {
    let refused = || format!("{} bytes are no picture of {width} x {height} pixels", rgb.len());
    let sides = [width, height].map(|side| u32::try_from(side).ok().filter(|side| *side > 0));
    let whole = width.checked_mul(height).is_some_and(|n| n.checked_mul(3) == Some(rgb.len()));
    let ([Some(columns), Some(rows)], true) = (sides, whole) else { return Err(refused()) };
    let mut bytes = Vec::new();
    write_png(&mut bytes, columns, rows, rgb).map_err(|error| error.to_string())?;
    Ok(bytes)
}

fn write_png(out: &mut impl Write, width: u32, height: u32, rgb: &[u8]) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let rgb: Vec<u8> = (0..18).map(|k| 13 * k).collect();
        write_picture(&path, &Picture::Pixels { width: 3, height: 2, rgb: &rgb }).unwrap();
        let file = io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut back = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut back).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (3, 2, png::ColorType::Rgb));
        assert_eq!(back, rgb);
        for (width, height) in [(3, 3), (0, 0), (usize::MAX, 2)] {
            let result = write_picture(&path, &Picture::Pixels { width, height, rgb: &rgb });
            assert!(matches!(result, Err(WriteError::Invalid { .. })));
        }
    }

    #[test]
    fn each_kind_has_its_extension() {
        let pixels = Picture::Pixels { width: 1, height: 1, rgb: &[0; 3] };
        assert!(matches!(write_picture("no/a.svg", &pixels), Err(WriteError::UnknownExtension(_))));
        assert!(matches!(write_picture("no/a.png", &Picture::Svg("")), Err(WriteError::UnknownExtension(_))));
        assert!(matches!(write_picture("no/a.svg", &Picture::Svg("")), Err(WriteError::NoFolder { .. })));
    }
}
