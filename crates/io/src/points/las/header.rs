//! The header of a LAS or LAZ file (ASPRS LAS 1.0 to 1.4), checked against the bytes that are there.

use crate::points::source::Source;
use crate::read_error::{Malformed, Place};

/// What of the header reading points needs.
pub(crate) struct LasHeader {
    /// The number of points.
    pub(crate) count: u64,
    /// Bytes of a point, compressed or not; the first twelve are x, y, z as 32-bit integers.
    pub(crate) record: usize,
    /// Where the points begin, in bytes.
    pub(crate) points: u64,
    /// What the integers are multiplied by, and what is added then.
    pub(crate) scale: [f64; 3],
    pub(crate) offset: [f64; 3],
    /// The body of the record that describes the compression, if any.
    pub(crate) laszip: Option<Vec<u8>>,
}

const SHORTEST: usize = 227;
/// With the number of points as LAS 1.4 has it.
const LONGEST: usize = 255;
/// Of a variable length record, without its body.
const RECORD_HEADER: usize = 54;

impl LasHeader {
    pub(crate) fn read(source: &mut Source) -> Result<Self, Malformed> {
        let bytes = &source.peek(LONGEST)?[..];
        if !bytes.starts_with(b"LASF") {
            return Err(Malformed::file("a LAS or LAZ file begins with \"LASF\"; this one does not"));
        }
        let cut = || Malformed::file(format!("the LAS header needs {SHORTEST} bytes or more: the file is cut short"));
        let header = bytes.first_chunk::<SHORTEST>().ok_or_else(cut)?;
        let (major, minor) = (header[24], header[25]);
        if major != 1 || minor > 4 {
            return Err(Malformed {
                place: Place::Byte(24),
                problem: format!("LAS {major}.{minor} is not known here, 1.0 to 1.4 are"),
            });
        }
        let size = u64::from(u16_at(bytes, 94).ok_or_else(cut)?);
        let points = u64::from(u32_at(bytes, 96).ok_or_else(cut)?);
        let extras = u32_at(bytes, 100).ok_or_else(cut)?;
        let record = usize::from(u16_at(bytes, 105).ok_or_else(cut)?);
        let mut count = u64::from(u32_at(bytes, 107).ok_or_else(cut)?);
        if minor >= 4 && count == 0 {
            count = bytes.get(247..255).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes).ok_or_else(cut)?;
        }
        if points < size || points > source.length() {
            let problem = format!("the points are said to begin at byte {points} of {}", source.length());
            return Err(Malformed { place: Place::Byte(96), problem });
        }
        if record < 20 {
            return Err(Malformed {
                place: Place::Byte(105),
                problem: format!("points of {record} bytes; 20 are the least"),
            });
        }
        let numbers = |at: usize| std::array::from_fn(|axis| f64_at(bytes, at + 8 * axis).unwrap_or(f64::NAN));
        // The two highest bits of the format number say that the points are compressed; so does the record, and it says how.
        let compressed = header[104] & 0xc0 != 0;
        let laszip = if compressed { find_laszip(source, size, extras)? } else { None };
        if compressed && laszip.is_none() {
            return Err(Malformed::file("the points are compressed, but the record that says how is missing"));
        }
        Ok(Self { count, record, points, scale: numbers(131), offset: numbers(155), laszip })
    }
}

/// The body of the variable length record of LASzip among the first `count` behind the header.
fn find_laszip(source: &mut Source, mut at: u64, count: u32) -> Result<Option<Vec<u8>>, Malformed> {
    let mut header = [0; RECORD_HEADER];
    for _ in 0..count {
        source.go_to(at)?;
        if source.remaining() < RECORD_HEADER as u64 {
            break;
        }
        source.fill(&mut header)?;
        let size = u16_at(&header, 20).unwrap_or_default();
        if header.get(2..18).is_some_and(|user| user.starts_with(b"laszip encoded"))
            && u16_at(&header, 18) == Some(22204)
        {
            let body = source.peek(size.into())?;
            return Ok(Some(body).filter(|body| body.len() == usize::from(size)));
        }
        at += RECORD_HEADER as u64 + u64::from(size);
    }
    Ok(None)
}

pub(crate) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}

pub(crate) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

pub(crate) fn i32_at(bytes: &[u8], at: usize) -> Option<i32> {
    Some(i32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

fn f64_at(bytes: &[u8], at: usize) -> Option<f64> {
    Some(f64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?))
}
