//! NumPy arrays: checked reading from bytes, whatever they claim.

use std::io::Cursor;

use ndarray::ArrayD;
use ndarray_npy::npy::header::Header;
use ndarray_npy::{ReadNpyExt, ReadableElement};

/// NumPy's own headers of plain arrays have 118 bytes; nothing plain needs more than this.
const LONGEST_HEADER: usize = 4096;
/// With the twelve bytes at most before the header.
pub(crate) const LONGEST_HEAD: usize = 12 + LONGEST_HEADER;

/// Reads an array of f32 or f64 of any shape without empty axes, either byte order and either layout, as f64 in the array's
/// own axis order.
pub(crate) fn parse_floats(bytes: &[u8]) -> Result<ArrayD<f64>, String> {
    match NpyHeader::of(bytes)?.descriptor.as_str() {
        "<f8" | ">f8" => parse_elements::<f64>(bytes),
        "<f4" | ">f4" => Ok(parse_elements::<f32>(bytes)?.mapv(f64::from)),
        other => Err(no_floats(other)),
    }
}

pub(crate) fn no_floats(descriptor: &str) -> String {
    format!("the array holds {descriptor:?}; f4 or f8 (np.float32, np.float64) is needed")
}

/// Reads an array of 32- or 64-bit signed integers.
pub(crate) fn parse_integers(bytes: &[u8]) -> Result<ArrayD<i64>, String> {
    match NpyHeader::of(bytes)?.descriptor.as_str() {
        "<i8" | ">i8" => parse_elements::<i64>(bytes),
        "<i4" | ">i4" => Ok(parse_elements::<i32>(bytes)?.mapv(i64::from)),
        other => Err(format!("the array holds {other:?}; i4 or i8 (np.int32, np.int64) is needed")),
    }
}

/// Reads an array of 32- or 64-bit signed integers that fit 32 bits.
pub(crate) fn parse_indices(bytes: &[u8]) -> Result<ArrayD<i32>, String> {
    if matches!(NpyHeader::of(bytes)?.descriptor.as_str(), "<i4" | ">i4") {
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

/// What the header says of the numbers behind it, which it is known to fit.
pub(crate) struct NpyHeader {
    /// The element type.
    pub(crate) descriptor: String,
    pub(crate) shape: Vec<usize>,
    /// Whether the first axis varies fastest.
    pub(crate) fortran: bool,
    /// Where the numbers begin, in bytes.
    pub(crate) body: u64,
}

impl NpyHeader {
    fn of(bytes: &[u8]) -> Result<Self, String> {
        Self::parse(bytes, bytes.len() as u64)
    }

    /// `head` is all of a file of `length` bytes, or the first [`LONGEST_HEAD`] bytes of it.
    pub(crate) fn parse(head: &[u8], length: u64) -> Result<Self, String> {
        check_header_text(head)?;
        let mut reader = Cursor::new(head);
        let header = Header::from_reader(&mut reader).map_err(|error| format!("not a NumPy array: {error}"))?;
        let descriptor =
            header.type_descriptor.as_string().cloned().unwrap_or_else(|| header.type_descriptor.to_string());
        let size: usize = descriptor.get(2..).and_then(|s| s.parse().ok()).unwrap_or(0);
        let body = reader.position();
        let remaining = u128::from(length) - u128::from(body);
        let claimed = header.shape.iter().try_fold(size as u128, |product, &n| product.checked_mul(n as u128));
        if header.shape.contains(&0) {
            return Err(format!("the array has shape {:?}: no values", header.shape));
        }
        if claimed != Some(remaining) {
            return Err(format!(
                "the array of shape {:?} and type {descriptor:?} does not fit the {remaining} bytes after its header: the file \
                 is damaged or cut short",
                header.shape
            ));
        }
        Ok(Self { descriptor, shape: header.shape, fortran: header.layout.is_fortran(), body })
    }
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
