//! Compressed LAS points, one by one.
//!
//! The decoder believes what it reads about sizes, so all of them are checked here first: the kinds of data in a point, the number
//! of chunks, and the layers of each chunk.

use std::fmt::Display;

use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use laz::{DecompressionSelection, LazItem, LazItemType, LazVlr};

use crate::points::las::header::{LasHeader, u16_at};
use crate::points::source::Source;
use crate::read_error::Malformed;

/// So many points may come out of one byte. Scans need two bytes for a point and more; without a bound a few bytes could claim
/// any number of equal points.
const POINTS_PER_BYTE: u64 = 4;
/// Each extra byte of a point costs the decoder some 12 kB of tables.
const MOST_EXTRA_BYTES: u16 = 256;
/// How points are arranged: all in one chunk, in chunks, or in chunks with a layer for each kind of data.
const ONE_CHUNK: u16 = 1;
const CHUNKS: u16 = 2;
const LAYERED: u16 = 3;
/// The offset of the table of chunks stands before the first of them. Neither is needed.
const OFFSET: u64 = 8;

/// Decodes one record after the other.
pub(crate) struct LazRecords<'a, 's> {
    decoder: Box<dyn RecordDecompressor<&'a mut Source<'s>> + 'a>,
    items: Vec<LazItem>,
    /// The numbers of points of the chunks to come, and of those behind them.
    chunks: std::vec::IntoIter<u64>,
    usual: u64,
    /// The number of points of this chunk to come.
    left: u64,
    record: Vec<u8>,
}

impl<'a, 's> LazRecords<'a, 's> {
    /// `description` is the body of the LASzip record, and `source` stands where the points begin.
    pub(crate) fn open(description: &[u8], source: &'a mut Source<'s>, header: &LasHeader) -> Result<Self, Malformed> {
        let vlr = LazVlr::from_buffer(description).map_err(damaged)?;
        let arrangement = u16_at(description, 0);
        let layered = arrangement == Some(LAYERED);
        let layers = check_items(&vlr, header.record, layered).map_err(damaged)?;
        if header.count > POINTS_PER_BYTE * source.remaining() {
            return Err(damaged(format!("{} points in {} bytes", header.count, source.remaining())));
        }
        let (mut chunks, mut usual) = (Vec::new(), u64::MAX);
        if arrangement != Some(ONE_CHUNK) {
            if source.remaining() < OFFSET {
                return Err(damaged("there are none"));
            }
            source.go_to(source.at() + OFFSET)?;
            if layered {
                chunks = check_layers(source, header, &vlr, layers)?;
            } else if arrangement != Some(CHUNKS) {
                return Err(damaged("Compressor type None is not supported"));
            } else if vlr.uses_variable_size_chunks() {
                return Err(damaged(
                    "chunks with different numbers of points are read in the point formats from 6 on only",
                ));
            } else {
                usual = vlr.chunk_size().into();
            }
        }
        let mut decoder: Box<dyn RecordDecompressor<&'a mut Source<'s>> + 'a> = match layered {
            true => Box::new(LayeredPointRecordDecompressor::new(source)),
            false => Box::new(SequentialPointRecordDecompressor::new(source)),
        };
        decoder.set_fields_from(vlr.items()).map_err(damaged)?;
        let (items, record) = (vlr.items().clone(), vec![0; header.record]);
        Ok(Self { decoder, items, chunks: chunks.into_iter(), usual, left: 0, record })
    }

    /// The next record, unpacked.
    pub(crate) fn next(&mut self) -> Result<&[u8], String> {
        if self.left == 0 {
            self.decoder.reset();
            self.decoder.set_fields_from(&self.items).map_err(|error| error.to_string())?;
            self.decoder.set_selection(DecompressionSelection::xy_returns_channel().decompress_z());
            self.left = self.chunks.next().unwrap_or(self.usual);
        }
        self.decoder.decompress_next(&mut self.record).map_err(|error| error.to_string())?;
        self.left = self.left.checked_sub(1).ok_or("the chunks have no points")?;
        Ok(&self.record)
    }
}

fn damaged(what: impl Display) -> Malformed {
    Malformed::file(format!("the compressed points cannot be read: {what}"))
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

/// Walks over the chunks: a point, the number of points, the sizes of the layers, the layers. Returns their numbers of points; the
/// source stands at the first of them again.
fn check_layers(source: &mut Source, header: &LasHeader, vlr: &LazVlr, layers: usize) -> Result<Vec<u64>, Malformed> {
    let start = source.at();
    let mut counts = Vec::new();
    let mut numbers = vec![[0; 4]; 1 + layers];
    let mut left = header.count;
    while left > 0 {
        let at = source.at() - start;
        let cut = || damaged(format!("the chunk at byte {at} of them is cut short"));
        if source.remaining() < (header.record + 4 * numbers.len()) as u64 {
            return Err(cut());
        }
        source.go_to(source.at() + header.record as u64)?;
        source.fill(numbers.as_flattened_mut())?;
        let mut sizes = numbers.iter().map(|bytes| u64::from(u32::from_le_bytes(*bytes)));
        let count = sizes.next().filter(|_| vlr.uses_variable_size_chunks()).unwrap_or(vlr.chunk_size().into());
        let size = sizes.sum::<u64>();
        if size > source.remaining() {
            return Err(cut());
        }
        if count == 0 {
            return Err(damaged(format!("the chunk at byte {at} of them has no points")));
        }
        source.go_to(source.at() + size)?;
        counts.push(count);
        left = left.saturating_sub(count);
    }
    source.go_to(start)?;
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

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
        let mut body = coder.into_inner();
        let length = body.get_ref().len() as u64;
        body.set_position(0);
        let mut source = Source::new(&mut body, length);
        let header =
            LasHeader { count: count as u64, record: size, points: 0, scale: [1.0; 3], offset: [0.0; 3], laszip: None };
        let mut records = LazRecords::open(&description, &mut source, &header)?;
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
