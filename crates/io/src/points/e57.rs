//! The points of an E57 file (ASTM E2807).

use e57::{CartesianCoordinate, E57Reader, PointCloud, RecordDataType};

use crate::points::refuse_panic::refuse_panic;
use crate::points::source::Source;
use crate::points::{Dimension, Points, Rows};
use crate::read_error::Malformed;

/// So many points may come out of one byte.
const POINTS_PER_BYTE: u64 = 4;
/// Where the header has the size of a page; the length of the XML part stands before it.
const PAGE_SIZE: usize = 40;

/// Reads the points of all scans, each moved to its place; points that the scanner marked as invalid are passed over.
pub(crate) fn read(source: &mut Source) -> Result<Points, Malformed> {
    let head = source.peek(PAGE_SIZE + 8)?;
    if !head.starts_with(b"ASTM-E57") {
        return Err(Malformed::file("an E57 file begins with \"ASTM-E57\"; this one does not"));
    }
    for (name, at) in [("XML part", PAGE_SIZE - 8), ("page", PAGE_SIZE)] {
        let length = head.get(at..at + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        if length.is_none_or(|length| length > source.length()) {
            return Err(Malformed::file(format!("the {name} is longer than the file: it is damaged or cut short")));
        }
    }
    refuse_panic(|| read_scans(source))
}

fn read_scans(source: &mut Source) -> Result<Points, Malformed> {
    let damaged = |error: e57::Error| Malformed::file(format!("the E57 file cannot be read: {error}"));
    let bytes = source.length();
    let mut file = E57Reader::new(source).map_err(damaged)?;
    let mut rows = Rows::new(Dimension::Three, false);
    let mut left = POINTS_PER_BYTE * bytes;
    for scan in file.pointclouds() {
        left = left.checked_sub(scan.records).filter(|_| takes_space(&scan)).ok_or_else(|| {
            let points = scan.records;
            Malformed::file(format!("the E57 file claims {points} points that its {bytes} bytes cannot hold"))
        })?;
        if scan.records == 0 {
            continue;
        }
        for point in file.pointcloud_simple(&scan).map_err(damaged)? {
            if let CartesianCoordinate::Valid { x, y, z } = point.map_err(damaged)?.cartesian {
                rows.push(&[x, y, z]).map_err(|problem| Malformed::point(rows.len(), problem))?;
            }
        }
    }
    rows.finish()
}

/// Whether a point has anything but constants, which take no bits: the decoder would never come to an end of them.
fn takes_space(scan: &PointCloud) -> bool {
    scan.records == 0
        || scan.prototype.iter().any(|record| match record.data_type {
            RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => min < max,
            _ => true,
        })
}
