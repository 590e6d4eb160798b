//! The points of a LAS or LAZ file.

mod header;
mod laz_records;

use crate::points::las::header::{LasHeader, i32_at};
use crate::points::las::laz_records::LazRecords;
use crate::points::refuse_panic::refuse_panic;
use crate::points::source::Source;
use crate::points::{Dimension, Points, Rows};
use crate::read_error::Malformed;

/// Reads x, y, z of all points, whatever their class.
pub(crate) fn read(source: &mut Source) -> Result<Points, Malformed> {
    let header = LasHeader::read(source)?;
    source.go_to(header.points)?;
    match &header.laszip {
        Some(description) => refuse_panic(|| {
            let mut records = LazRecords::open(description, source, &header)?;
            let mut rows = Rows::new(Dimension::Three, false);
            for index in 0..header.count {
                let record = records.next().map_err(|problem| {
                    Malformed::point(index as usize, format!("{problem}: the file is damaged or cut short"))
                })?;
                push(&mut rows, record, &header)?;
            }
            rows.finish()
        }),
        None => {
            let needed = u128::from(header.count) * header.record as u128;
            if needed > source.remaining().into() {
                return Err(Malformed::file(format!(
                    "the LAS header claims {} points of {} bytes, but {} bytes follow it: the file is damaged or cut short",
                    header.count,
                    header.record,
                    source.remaining()
                )));
            }
            let mut rows = Rows::new(Dimension::Three, false);
            rows.reserve(header.count as usize);
            let mut record = vec![0; header.record];
            for _ in 0..header.count {
                source.fill(&mut record)?;
                push(&mut rows, &record, &header)?;
            }
            rows.finish()
        }
    }
}

fn push(rows: &mut Rows, record: &[u8], header: &LasHeader) -> Result<(), Malformed> {
    let mut xyz = header.offset;
    for ((axis, x), scale) in xyz.iter_mut().enumerate().zip(header.scale) {
        *x += f64::from(i32_at(record, 4 * axis).unwrap_or_default()) * scale;
    }
    rows.push(&xyz).map_err(|problem| Malformed::point(rows.len(), problem))
}
