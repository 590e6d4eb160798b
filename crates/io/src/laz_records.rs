//! Compressed LAS points, one by one.
//!
//! The decoder believes what it reads about sizes, so all of them are checked here first: the kinds of data in a point, the number
//! of chunks, and the layers of each chunk.

use std::io::Cursor;

use laz::laszip::{ChunkTable, ChunkTableEntry};
use laz::{DecompressionSelection, LasZipDecompressor, LazItemType, LazVlr};

use crate::las_header::{LasHeader, u16_at, u32_at};
use crate::read_error::Malformed;

/// So many points may come out of one byte. Scans need two bytes for a point and more; without a bound a few bytes could claim
/// any number of equal points.
const POINTS_PER_BYTE: u64 = 4;
/// Each extra byte of a point costs the decoder some 12 kB of tables.
const MOST_EXTRA_BYTES: u16 = 256;
/// How points are arranged: all in one chunk, or in chunks with a layer for each kind of data.
const ONE_CHUNK: u16 = 1;
const LAYERED: u16 = 3;
/// The offset of the chunk table before the points, and an empty one: version and number of chunks.
const OFFSET: usize = 8;
const EMPTY_TABLE: [u8; 8] = [0; 8];

/// Decodes one record after the other.
pub(crate) struct LazRecords {
    decoder: LasZipDecompressor<'static, Cursor<Vec<u8>>>,
    record: Vec<u8>,
}

impl LazRecords {
    /// `description` is the body of the LASzip record, `body` everything from the points to the end of the file.
    pub(crate) fn open(description: &[u8], body: &[u8], header: &LasHeader) -> Result<Self, Malformed> {
        let damaged = |what: &str| Malformed::file(format!("the compressed points cannot be read: {what}"));
        let vlr = LazVlr::from_buffer(description).map_err(|error| damaged(&error.to_string()))?;
        let arrangement = u16_at(description, 0);
        let layered = arrangement == Some(LAYERED);
        let layers = check_items(&vlr, header.record, layered).map_err(|problem| damaged(&problem))?;
        if header.count > POINTS_PER_BYTE * body.len() as u64 {
            return Err(damaged(&format!("{} points in {} bytes", header.count, body.len())));
        }
        let mut source = Vec::with_capacity(OFFSET + body.len() + EMPTY_TABLE.len());
        if arrangement == Some(ONE_CHUNK) {
            source.extend(body);
        } else {
            // The file's own table is not believed. One is needed only where each chunk has its own number of points.
            let points = body.get(OFFSET..).ok_or_else(|| damaged("there are none"))?;
            source.extend((OFFSET as u64 + points.len() as u64).to_le_bytes());
            source.extend(points);
            let table = if layered {
                check_layers(points, header, &vlr, layers).map_err(|problem| damaged(&problem))?
            } else {
                ChunkTable::with_capacity(0)
            };
            if !vlr.uses_variable_size_chunks() {
                source.extend(EMPTY_TABLE);
            } else if layered {
                table.write_to(&mut source, &vlr).map_err(|error| damaged(&error.to_string()))?;
            } else {
                return Err(damaged(
                    "chunks with different numbers of points are read in the point formats from 6 on only",
                ));
            }
        }
        let selection = DecompressionSelection::xy_returns_channel().decompress_z();
        let decoder = LasZipDecompressor::selective(Cursor::new(source), vlr, selection)
            .map_err(|error| damaged(&error.to_string()))?;
        Ok(Self { decoder, record: vec![0; header.record] })
    }

    /// The next record, unpacked.
    pub(crate) fn next(&mut self) -> Result<&[u8], String> {
        self.decoder.decompress_one(&mut self.record).map_err(|error| error.to_string())?;
        Ok(&self.record)
    }
}

/// The kinds of data must make up the record, with x, y, z first. Returns the number of layers that each chunk has, if it has any.
fn check_items(vlr: &LazVlr, record: usize, layered: bool) -> Result<usize, String> {
    let (mut bytes, mut layers, mut extra) = (0, 0, 0);
    for (index, item) in vlr.items().iter().enumerate() {
        let (size, item_layers, first) = match item.item_type() {
            LazItemType::Point10 => (20, 0, true),
            LazItemType::Point14 => (30, 9, true),
            LazItemType::GpsTime => (8, 0, false),
            LazItemType::RGB12 => (6, 0, false),
            LazItemType::RGB14 => (6, 1, false),
            LazItemType::RGBNIR14 => (8, 2, false),
            LazItemType::WavePacket13 => (29, 0, false),
            LazItemType::WavePacket14 => (29, 1, false),
            LazItemType::Byte(size) => (size, 0, false),
            LazItemType::Byte14(size) => (size, usize::from(size), false),
        };
        if matches!(item.item_type(), LazItemType::Byte(_) | LazItemType::Byte14(_)) {
            extra += u32::from(size);
        }
        let version_fits = if layered { matches!(item.version(), 3 | 4) } else { matches!(item.version(), 1 | 2) };
        if item.size() != size || size == 0 || first != (index == 0) || !version_fits {
            return Err(format!("{:?} of {} bytes in place {index}", item.item_type(), item.size()));
        }
        bytes += usize::from(size);
        layers += item_layers;
    }
    if extra > u32::from(MOST_EXTRA_BYTES) {
        return Err(format!("{extra} extra bytes for each point; {MOST_EXTRA_BYTES} are the most"));
    }
    if bytes != record {
        return Err(format!("their kinds of data take {bytes} bytes, but a point has {record}"));
    }
    Ok(layers)
}

/// Walks over the chunks: a point, the number of points, the sizes of the layers, the layers. Returns their table.
fn check_layers(points: &[u8], header: &LasHeader, vlr: &LazVlr, layers: usize) -> Result<ChunkTable, String> {
    let mut table = ChunkTable::with_capacity(0);
    let mut at = 0u64;
    let mut left = header.count;
    while left > 0 {
        let cut = || format!("the chunk at byte {at} of them is cut short");
        let counts = at as usize + header.record;
        let count = u64::from(u32_at(points, counts).ok_or_else(cut)?);
        let mut end = (counts + 4 + 4 * layers) as u64;
        for layer in 0..layers {
            end += u64::from(u32_at(points, counts + 4 + 4 * layer).ok_or_else(cut)?);
        }
        if end > points.len() as u64 {
            return Err(cut());
        }
        let count = if vlr.uses_variable_size_chunks() { count } else { u64::from(vlr.chunk_size()) };
        if count == 0 {
            return Err(format!("the chunk at byte {at} of them has no points"));
        }
        table.push(ChunkTableEntry { point_count: count, byte_count: end - at });
        left = left.saturating_sub(count);
        at = end;
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlrBuilder};

    use super::*;

    /// A point of format 6, or of format 0, at (n, n, n).
    fn record(size: usize, n: i32) -> Vec<u8> {
        let mut record = [n.to_le_bytes(); 3].concat();
        record.resize(size, 0);
        record
    }

    fn coordinates(format: u8, variable: bool, chunks: &[i32]) -> Result<Vec<i32>, Malformed> {
        let items = LazItemRecordBuilder::default_for_point_format_id(format, 0).unwrap();
        let vlr = LazVlrBuilder::new(items).with_fixed_chunk_size(5);
        let vlr = if variable { vlr.with_variable_chunk_size() } else { vlr }.build();
        let size = vlr.items_size() as usize;
        let mut description = Vec::new();
        vlr.write_to(&mut description).unwrap();
        let mut coder = LasZipCompressor::new(Cursor::new(Vec::new()), vlr).unwrap();
        let mut count = 0;
        for &points in chunks {
            for _ in 0..points {
                coder.compress_one(&record(size, count * count)).unwrap();
                count += 1;
            }
            if variable {
                coder.finish_current_chunk().unwrap();
            }
        }
        coder.done().unwrap();
        let body = coder.into_inner().into_inner();
        let header =
            LasHeader { count: count as u64, record: size, points: 0, scale: [1.0; 3], offset: [0.0; 3], laszip: None };
        let mut records = LazRecords::open(&description, &body, &header)?;
        let next = |_| {
            let bytes = records.next().unwrap();
            i32::from_le_bytes(bytes[4..8].try_into().unwrap())
        };
        Ok((0..count).map(next).collect())
    }

    #[test]
    fn chunks_follow_each_other() {
        let squares: Vec<i32> = (0..12).map(|n| n * n).collect();
        for (format, variable) in [(0, false), (6, false), (6, true)] {
            assert_eq!(coordinates(format, variable, &[2, 7, 3]).unwrap(), squares, "{format}, {variable}");
        }
        let refused = coordinates(0, true, &[2, 7, 3]).unwrap_err();
        assert!(refused.problem.contains("different numbers of points"), "{refused}");
    }
}
