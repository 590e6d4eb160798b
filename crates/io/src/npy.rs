//! NumPy arrays: checked reading from bytes, whatever they claim.

use std::io::Cursor;

use ndarray::ArrayD;
use ndarray_npy::npy::header::Header;
use ndarray_npy::{ReadNpyExt, ReadableElement};

use crate::points::{Dimension, Points, Rows};
use crate::read_error::Malformed;

/// NumPy's own headers of plain arrays have 118 bytes; nothing plain needs more than this.
const LONGEST_HEADER: usize = 4096;

/// Reads an `N × 2` or `N × 3` array of f32, f64 or integers as points.
pub(crate) fn parse_points(bytes: &[u8]) -> Result<Points, Malformed> {
    let array = parse_numbers(bytes).map_err(Malformed::file)?;
    let shape = array.shape();
    let (count, dimension) = match shape {
        [count, 2] => (*count, Dimension::Two),
        [count, 3] => (*count, Dimension::Three),
        [2 | 3, _] => {
            let problem = "N × 2 or N × 3 is needed; its transpose would do";
            return Err(Malformed::file(format!("the array has shape {shape:?}; {problem}")));
        }
        _ => return Err(Malformed::file(format!("the array has shape {shape:?}; N × 2 or N × 3 is needed"))),
    };
    let mut rows = Rows::new(dimension, false);
    rows.reserve(count);
    let mut values = Vec::with_capacity(3);
    for (index, row) in array.rows().into_iter().enumerate() {
        values.clear();
        values.extend(row);
        rows.push(&values).map_err(|problem| Malformed::point(index, problem))?;
    }
    rows.finish()
}

/// Reads floats, or integers that f64 holds exactly.
fn parse_numbers(bytes: &[u8]) -> Result<ArrayD<f64>, String> {
    match descriptor(bytes)?.as_str() {
        "|i1" | "<i1" | ">i1" => Ok(parse_elements::<i8>(bytes)?.mapv(f64::from)),
        "|u1" | "<u1" | ">u1" => Ok(parse_elements::<u8>(bytes)?.mapv(f64::from)),
        "<i2" | ">i2" => Ok(parse_elements::<i16>(bytes)?.mapv(f64::from)),
        "<u2" | ">u2" => Ok(parse_elements::<u16>(bytes)?.mapv(f64::from)),
        "<i4" | ">i4" => Ok(parse_elements::<i32>(bytes)?.mapv(f64::from)),
        "<u4" | ">u4" => Ok(parse_elements::<u32>(bytes)?.mapv(f64::from)),
        "<i8" | ">i8" => exactly(parse_elements::<i64>(bytes)?.mapv(i128::from)),
        "<u8" | ">u8" => exactly(parse_elements::<u64>(bytes)?.mapv(i128::from)),
        _ => parse_floats(bytes),
    }
}

fn exactly(integers: ArrayD<i128>) -> Result<ArrayD<f64>, String> {
    match integers.iter().find(|&&n| n as f64 as i128 != n) {
        Some(n) => Err(format!("{n} has more digits than a 64-bit float; subtract an origin before saving")),
        None => Ok(integers.mapv(|n| n as f64)),
    }
}

/// Reads an array of f32 or f64 of any shape without empty axes, either byte order and either layout, as f64 in the array's
/// own axis order.
pub(crate) fn parse_floats(bytes: &[u8]) -> Result<ArrayD<f64>, String> {
    match descriptor(bytes)?.as_str() {
        "<f8" | ">f8" => parse_elements::<f64>(bytes),
        "<f4" | ">f4" => Ok(parse_elements::<f32>(bytes)?.mapv(f64::from)),
        other => Err(format!("the array holds {other:?}; f4 or f8 (np.float32, np.float64) is needed")),
    }
}

/// Reads an array of 32- or 64-bit signed integers.
pub(crate) fn parse_integers(bytes: &[u8]) -> Result<ArrayD<i64>, String> {
    match descriptor(bytes)?.as_str() {
        "<i8" | ">i8" => parse_elements::<i64>(bytes),
        "<i4" | ">i4" => Ok(parse_elements::<i32>(bytes)?.mapv(i64::from)),
        other => Err(format!("the array holds {other:?}; i4 or i8 (np.int32, np.int64) is needed")),
    }
}

/// Reads an array of 32- or 64-bit signed integers that fit 32 bits.
pub(crate) fn parse_indices(bytes: &[u8]) -> Result<ArrayD<i32>, String> {
    if matches!(descriptor(bytes)?.as_str(), "<i4" | ">i4") {
        return parse_elements::<i32>(bytes);
    }
    let wide = parse_integers(bytes)?;
    match wide.iter().find(|n| i32::try_from(**n).is_err()) {
        Some(n) => Err(format!("holds {n}, which is no index of 32 bits")),
        None => Ok(wide.mapv(|n| n as i32)),
    }
}

fn parse_elements<T: ReadableElement>(bytes: &[u8]) -> Result<ArrayD<T>, String> {
    ArrayD::<T>::read_npy(Cursor::new(bytes)).map_err(|error| error.to_string())
}

/// The element type, once the header is known to fit the bytes that follow it.
fn descriptor(bytes: &[u8]) -> Result<String, String> {
    check_header_text(bytes)?;
    let mut reader = Cursor::new(bytes);
    let header = Header::from_reader(&mut reader).map_err(|error| format!("not a NumPy array: {error}"))?;
    let descriptor = header.type_descriptor.as_string().cloned().unwrap_or_else(|| header.type_descriptor.to_string());
    let size: usize = descriptor.get(2..).and_then(|s| s.parse().ok()).unwrap_or(0);
    let remaining = bytes.len() as u128 - u128::from(reader.position());
    let claimed = header.shape.iter().try_fold(size as u128, |product, &n| product.checked_mul(n as u128));
    if header.shape.contains(&0) {
        return Err(format!("the array has shape {:?}: no values", header.shape));
    }
    if claimed != Some(remaining) {
        return Err(format!(
            "the array of shape {:?} and type {descriptor:?} does not fit the {remaining} bytes after its header: the file is \
             damaged or cut short",
            header.shape
        ));
    }
    Ok(descriptor)
}

/// The header's length is checked before it is allocated, and its nesting before a recursive parser meets it.
fn check_header_text(bytes: &[u8]) -> Result<(), String> {
    let not_npy = || "not a NumPy array: the file does not begin as one".to_string();
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(not_npy());
    }
    let (length, start) = match *bytes.get(6..12).ok_or_else(not_npy)? {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([a, b])), 10),
        [_, _, a, b, c, d] => (u32::from_le_bytes([a, b, c, d]) as usize, 12),
        _ => return Err(not_npy()),
    };
    if length > LONGEST_HEADER {
        return Err(format!("the NumPy header claims {length} bytes; at most {LONGEST_HEADER} are read"));
    }
    let header = bytes.get(start..start + length).ok_or("the NumPy header is cut short")?;
    if header.iter().filter(|b| matches!(b, b'(' | b'[' | b'{')).count() > 2 {
        return Err("the NumPy header is not that of a plain array".into());
    }
    Ok(())
}
