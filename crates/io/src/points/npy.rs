//! Points as the rows of a NumPy array.

use crate::npy::{LONGEST_HEAD, NpyHeader, no_floats};
use crate::points::source::Source;
use crate::points::{Dimension, Points, Rows};
use crate::read_error::Malformed;

/// So many rows are held as bytes at a time.
const ROWS: usize = 2048;

/// Reads an `N × 2` or `N × 3` array of f32, f64 or integers that f64 holds exactly, in either byte order and either layout.
pub(crate) fn read(source: &mut Source) -> Result<Points, Malformed> {
    let header = NpyHeader::parse(&source.peek(LONGEST_HEAD)?, source.length()).map_err(Malformed::file)?;
    match header.descriptor.as_str() {
        "|i1" | "<i1" | ">i1" => read_rows(source, &header, |n| Ok(i8::from_le_bytes(n).into())),
        "|u1" | "<u1" | ">u1" => read_rows(source, &header, |n| Ok(u8::from_le_bytes(n).into())),
        "<i2" | ">i2" => read_rows(source, &header, |n| Ok(i16::from_le_bytes(n).into())),
        "<u2" | ">u2" => read_rows(source, &header, |n| Ok(u16::from_le_bytes(n).into())),
        "<i4" | ">i4" => read_rows(source, &header, |n| Ok(i32::from_le_bytes(n).into())),
        "<u4" | ">u4" => read_rows(source, &header, |n| Ok(u32::from_le_bytes(n).into())),
        "<i8" | ">i8" => read_rows(source, &header, |n| exactly(i64::from_le_bytes(n).into())),
        "<u8" | ">u8" => read_rows(source, &header, |n| exactly(u64::from_le_bytes(n).into())),
        "<f4" | ">f4" => read_rows(source, &header, |n| Ok(f32::from_le_bytes(n).into())),
        "<f8" | ">f8" => read_rows(source, &header, |n| Ok(f64::from_le_bytes(n))),
        _ => Err(Malformed::file(no_floats(&header.descriptor))),
    }
}

fn exactly(integer: i128) -> Result<f64, String> {
    let number = integer as f64;
    if number as i128 == integer {
        return Ok(number);
    }
    Err(format!("{integer} has more digits than a 64-bit float; subtract an origin before saving"))
}

/// Reads numbers of `B` bytes, which `number` takes in little endian order.
fn read_rows<const B: usize>(
    source: &mut Source,
    header: &NpyHeader,
    number: impl Fn([u8; B]) -> Result<f64, String>,
) -> Result<Points, Malformed> {
    let (count, dimension) = count(&header.shape).map_err(Malformed::file)?;
    let axes = match dimension {
        Dimension::Two => 2,
        Dimension::Three => 3,
    };
    let mut rows = Rows::new(dimension, false);
    rows.reserve(count);
    let mut block = vec![[0; B]; ROWS * axes];
    let mut values = Vec::with_capacity(axes);
    source.go_to(header.body)?;
    for first in (0..count).step_by(ROWS) {
        let taken = ROWS.min(count - first);
        block.truncate(taken * axes);
        if header.fortran {
            // One axis stands behind the other in the file, and so they do in the block.
            for (axis, column) in block.chunks_exact_mut(taken).enumerate() {
                source.go_to(header.body + ((axis * count + first) * B) as u64)?;
                source.fill(column.as_flattened_mut())?;
            }
        } else {
            source.fill(block.as_flattened_mut())?;
        }
        if header.descriptor.starts_with('>') {
            block.iter_mut().for_each(|bytes| bytes.reverse());
        }
        let (next_row, next_axis) = if header.fortran { (1, taken) } else { (axes, 1) };
        for row in 0..taken {
            values.clear();
            for bytes in block.iter().skip(row * next_row).step_by(next_axis).take(axes) {
                values.push(number(*bytes).map_err(Malformed::file)?);
            }
            rows.push(&values).map_err(|problem| Malformed::point(first + row, problem))?;
        }
    }
    rows.finish()
}

fn count(shape: &[usize]) -> Result<(usize, Dimension), String> {
    let problem = match *shape {
        [count, 2] => return Ok((count, Dimension::Two)),
        [count, 3] => return Ok((count, Dimension::Three)),
        [2 | 3, _] => "N × 2 or N × 3 is needed; its transpose would do",
        _ => "N × 2 or N × 3 is needed",
    };
    Err(format!("the array has shape {shape:?}; {problem}"))
}
