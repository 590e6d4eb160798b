//! Readers meet the same points and errors however few bytes they are handed at a time.

use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use ndarray::{Array2, ShapeBuilder};
use ndarray_npy::WriteNpyExt;

use crate::points::Points;
use crate::points::format::{PointFormat, parse_points, read_source};
use crate::points::source::Source;
use crate::read_error::Malformed;

/// Hands out one to three bytes at a time, is interrupted in between, and breaks at one place for good.
struct Sips<'a> {
    bytes: Cursor<&'a [u8]>,
    breaks_at: u64,
    turn: usize,
}

impl Read for Sips<'_> {
    fn read(&mut self, place: &mut [u8]) -> io::Result<usize> {
        self.turn += 1;
        if self.turn.is_multiple_of(5) {
            return Err(io::ErrorKind::Interrupted.into());
        }
        let left = self.breaks_at.saturating_sub(self.bytes.position()) as usize;
        if left == 0 {
            return Err(io::Error::other("the disk is gone"));
        }
        let most = left.min(1 + self.turn % 3).min(place.len());
        self.bytes.read(&mut place[..most])
    }
}

impl Seek for Sips<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

/// What the readers make of the bytes, and what the operating system said.
fn sip(bytes: &[u8], breaks_at: u64, format: PointFormat) -> (Result<Points, Malformed>, Option<io::Error>) {
    let mut sips = Sips { bytes: Cursor::new(bytes), breaks_at, turn: 0 };
    let mut source = Source::new(&mut sips, bytes.len() as u64);
    let points = read_source(&mut source, format);
    (points, source.failure())
}

/// Every file of points in these folders of fixtures.
fn fixtures() -> Vec<(String, Vec<u8>, PointFormat)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let entries = ["foreign", "hostile"].into_iter().flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap());
    let file = |path: &Path| {
        let format = PointFormat::of(path).ok()?;
        Some((path.file_name()?.to_str()?.to_owned(), std::fs::read(path).unwrap(), format))
    };
    entries.filter_map(|entry| file(&entry.unwrap().path())).collect()
}

#[test]
fn files_cut_at_every_byte_are_answered_alike() {
    for (name, bytes, format) in fixtures() {
        for length in 0..=bytes.len() {
            let cut = &bytes[..length];
            let (points, failure) = sip(cut, u64::MAX, format);
            assert_eq!(points, parse_points(cut, format), "{name}, {length} bytes");
            assert!(failure.is_none(), "{name}, {length} bytes");
        }
    }
}

#[test]
fn what_the_operating_system_said_is_not_lost() {
    for (name, bytes, format) in fixtures() {
        let whole = parse_points(&bytes, format);
        for breaks_at in 0..bytes.len() as u64 {
            match sip(&bytes, breaks_at, format) {
                (_, Some(failure)) => assert_eq!(failure.to_string(), "the disk is gone"),
                // What stands behind the points, or behind an error, need not be read.
                (points, None) => assert_eq!(points, whole, "{name}, {breaks_at} bytes"),
            }
        }
    }
}

#[test]
fn files_that_become_shorter_are_answered() {
    for (name, bytes, format) in fixtures() {
        for length in 0..bytes.len() {
            let mut shorter = Cursor::new(&bytes[..length]);
            let mut source = Source::new(&mut shorter, bytes.len() as u64);
            if let Err(malformed) = read_source(&mut source, format) {
                assert!(!malformed.problem.is_empty(), "{name}, {length} bytes");
            }
        }
    }
}

/// Whole numbers, which all formats hold exactly: enough of them for several buffers.
fn grid() -> Vec<[f64; 3]> {
    (0..9000).map(|i| [f64::from(i), f64::from(i % 1000), f64::from(-i)]).collect()
}

fn large_files() -> Vec<(&'static str, PointFormat, Vec<u8>)> {
    let points = grid();
    let text = |before: &str, row: &str, end: &str, after: &str| {
        let rows = points.iter().map(|[x, y, z]| format!("{row}{x} {y} {z}{end}"));
        format!("{before}{}{after}", rows.collect::<String>()).into_bytes()
    };
    let binary = |before: &[u8], row: &dyn Fn(&[f64; 3]) -> Vec<u8>| {
        [before, &points.iter().flat_map(row).collect::<Vec<u8>>()].concat()
    };
    let ply = |encoding: &str, number: &str| {
        let names = ["x", "y", "z"].map(|name| format!("property {number} {name}\n")).concat();
        format!("ply\nformat {encoding} 1.0\nelement vertex {}\n{names}end_header\n", points.len())
    };
    let array = |fortran: bool| {
        let mut bytes = Vec::new();
        let shape = (points.len(), 3).set_f(fortran);
        Array2::from_shape_fn(shape, |(row, axis)| points[row][axis]).write_npy(&mut bytes).unwrap();
        bytes
    };
    let stl = {
        let mut bytes = [&[b' '; 80][..], &(points.len() as u32 / 3).to_le_bytes()].concat();
        for triangle in points.as_chunks::<3>().0 {
            let corners = triangle.iter().flatten().flat_map(|c| (*c as f32).to_le_bytes());
            bytes.extend([0; 12].into_iter().chain(corners).chain([0; 2]));
        }
        bytes
    };
    vec![
        ("text", PointFormat::Text, text("", "", "\n", "")),
        ("text with lone CR", PointFormat::Text, text("x y z\r", "", "\r", "")),
        ("obj", PointFormat::Obj, text("", "v ", "\r\n", "f 1 2 3\n")),
        ("ascii stl", PointFormat::Stl, text("solid\n", "vertex ", "\n", "endsolid\n")),
        ("binary stl", PointFormat::Stl, stl),
        ("ascii ply", PointFormat::Ply, text(&ply("ascii", "int"), "", "\n", "")),
        ("little ply", PointFormat::Ply, {
            binary(ply("binary_little_endian", "double").as_bytes(), &|p| p.map(f64::to_le_bytes).concat())
        }),
        ("big ply", PointFormat::Ply, {
            binary(ply("binary_big_endian", "float").as_bytes(), &|p| p.map(|c| (c as f32).to_be_bytes()).concat())
        }),
        ("npy", PointFormat::Npy, array(false)),
        ("npy in columns", PointFormat::Npy, array(true)),
        #[cfg(feature = "las")]
        ("las", PointFormat::Las, {
            let mut header = [0; 227];
            header[..4].copy_from_slice(b"LASF");
            header[24..26].copy_from_slice(&[1, 2]);
            header[94..100].copy_from_slice(&[227, 0, 227, 0, 0, 0]);
            header[105..107].copy_from_slice(&20u16.to_le_bytes());
            header[107..111].copy_from_slice(&(points.len() as u32).to_le_bytes());
            header[131..155].copy_from_slice([1.0f64.to_le_bytes(); 3].as_flattened());
            binary(&header, &|p| [p.map(|c| (c as i32).to_le_bytes()).as_flattened(), &[0; 8]].concat())
        }),
    ]
}

#[test]
fn large_files_come_out_right() {
    for (name, format, bytes) in large_files() {
        assert!(bytes.len() > 100_000, "{name} has {} bytes", bytes.len());
        let (points, _) = sip(&bytes, u64::MAX, format);
        let Ok(Points::Three(set)) = points else { panic!("{name} gave {points:?}") };
        assert_eq!(set.points, grid(), "{name}");
    }
}
