//! No file, however damaged, makes a reader panic, abort, hang or take more memory than a small multiple of its size.
//!
//! `ZEROSET_MUTATIONS=100000 cargo test -p zeroset-io --release --test mutated_files` runs more cases than the usual 2 000. The bytes
//! of a case that fails are left in the folder that the message names.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use ndarray::{Array2, ShapeBuilder};
use ndarray_npy::WriteNpyExt;
use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::TestRunner;
use zeroset_io::{
    Curves, PointFormat, Points, SplineFile, SplineLevel, TriMesh, parse_points, parse_spline, write_curves,
    write_mesh, write_oriented, write_spline,
};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Points take 16 bytes and more where a text row can do with 4, and a growing array is copied to a larger one.
const MULTIPLE: usize = 24;
/// Buffers of a fixed size: ply-rs makes room for 65 536 entries of a list before it reads them.
const CONSTANT: usize = 1 << 20;
/// As `npz.rs` has it: archives may unpack to much more than their size, on purpose.
const UNPACKED: usize = 64 << 20;

/// Memory is counted for the whole process, so the tests of this file run one by one. A decoder that gives up with a panic, which
/// the readers turn into an error, would tell so with a backtrace that takes megabytes: it is not asked.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let is_decoder = |file: &str| file.contains("laz-") || file.contains("e57-");
            if !panic.location().is_some_and(|place| is_decoder(place.file())) {
                usual(panic);
            }
        }));
    });
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A sound file.
#[derive(Clone)]
struct Sample {
    name: String,
    bytes: Vec<u8>,
    /// Whether every shorter file is damaged for sure: text may be cut behind a digit, and the faces of a mesh are not read.
    whole: bool,
}

const POINTS: [[f64; 3]; 3] = [[0.0, 0.5, 1.0], [1.5, -2.0, 2.5], [3.0, 3.5, 1e6]];

fn spline() -> SplineFile {
    let knots = vec![0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0];
    let coefficients = Array2::from_shape_fn((4, 4), |(i, j)| (i * 4 + j) as f64).into_dyn();
    SplineFile::new(vec![0.0, 0.0], vec![knots.clone(), knots], 2, coefficients).unwrap()
}

/// Two levels on 4 × 4 cells.
fn spline_with_levels() -> SplineFile {
    let knots: Vec<f64> = (0..11).map(f64::from).collect();
    let coefficients = Array2::from_shape_fn((7, 7), |(i, j)| (i * 7 + j) as f64).into_dyn();
    let root = SplineFile::new(vec![0.0, 0.0], vec![knots.clone(), knots], 3, coefficients).unwrap();
    let level = |count: usize| SplineLevel {
        index: Array2::from_shape_fn((count, 2), |(row, axis)| 3 + (row / (1 + axis)) as i32),
        coefficients: (0..count).map(|row| row as f64 / 3.0).collect(),
    };
    root.with_levels(vec![level(5), level(9)]).unwrap()
}

/// Small files for each reader: of our own writers, and by hand where those have no such form.
fn small_samples() -> Vec<Sample> {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, whole: bool, write: &dyn Fn(&Path)| {
        let path = folder.path().join(name);
        write(&path);
        Sample { name: name.into(), bytes: std::fs::read(path).unwrap(), whole }
    };
    let by_hand = |name: &str, bytes: Vec<u8>, whole: bool| Sample { name: name.into(), bytes, whole };
    let array = |whole: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = Vec::new();
        whole(&mut bytes);
        by_hand("a.npy", bytes, true)
    };
    let colours = [[1, 2, 3]; 3];
    let mesh = TriMesh {
        vertices: &POINTS,
        normals: &POINTS,
        triangles: &[[0, 1, 2]],
        colours: &colours,
        ..Default::default()
    };
    let far = POINTS.map(|p| p.map(|c| c + 5e8));
    let curves = [vec![[0.0, 0.5], [1.0, 2.0], [3.0, 1e-9]]];
    let big_endian = {
        let header = "ply\nformat binary_big_endian 1.0\nelement c 2\nproperty list uchar short l\nelement vertex 1\n\
                      property int x\nproperty double y\nproperty uchar z\nend_header\n";
        let body = [1, 0, 7, 0].into_iter().chain(9i32.to_be_bytes()).chain(2.5f64.to_be_bytes()).chain([3]);
        header.bytes().chain(body).collect()
    };
    let ascii = "ply\nformat ascii 1.0\ncomment c\nelement vertex 2\nproperty float x\nproperty float y\n\
                 property list uchar int l\nend_header\n0 .5 2 7 8\n1.25 -3e1 0\n";
    vec![
        made("mesh.ply", false, &|path| write_mesh(path, &mesh).unwrap()),
        made("oriented.ply", true, &|path| write_oriented(path, &POINTS, &POINTS, &[1.0; 3], &[false; 3]).unwrap()),
        by_hand("big_endian.ply", big_endian, true),
        by_hand("ascii.ply", ascii.into(), false),
        by_hand("a.csv", "x,y,z\n0,0.5,1\n1.5;-2 2.5\n# end\n".into(), false),
        by_hand("a.pts", "2\n0 0 0 0 0 1\n1 2 3 1 0 0\n".into(), false),
        by_hand("a.txt", "Scan of 1999\n//X Y Z Intensity\n1,5;2;3;9\n0,25;2;1;8\n".into(), false),
        made("curve.csv", false, &|path| {
            write_curves(path, &Curves { curves: &curves, ..Default::default() }).unwrap()
        }),
        by_hand("a.xy", "1 2 3\n4 5 6\n".into(), false),
        made("mesh.obj", false, &|path| write_mesh(path, &mesh).unwrap()),
        made("binary.stl", true, &|path| write_mesh(path, &mesh).unwrap()),
        made("ascii.stl", false, &|path| write_mesh(path, &TriMesh { vertices: &far, ..mesh }).unwrap()),
        array(&|out| Array2::from_shape_fn((3, 2), |(i, j)| (i + j) as f32).write_npy(out).unwrap()),
        array(&|out| Array2::from_shape_fn((3, 3).f(), |(i, j)| (i + j) as f64).write_npy(out).unwrap()),
        array(&|out| Array2::from_shape_fn((9, 3), |(i, j)| (i + j) as u8).write_npy(out).unwrap()),
        made("spline.npz", true, &|path| write_spline(path, &spline()).unwrap()),
        made("levels.npz", true, &|path| write_spline(path, &spline_with_levels()).unwrap()),
    ]
}

fn fixtures(folder: &str) -> Vec<Sample> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(folder);
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let sample = |path: &Path| {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        Sample { name, bytes: std::fs::read(path).unwrap(), whole: false }
    };
    // Scripts and descriptions stand beside the data; some formats are features.
    let is_read = |path: &&PathBuf| PointFormat::of(path).is_ok() || path.extension().is_some_and(|e| e == "npz");
    paths.iter().filter(is_read).map(|path| sample(path)).collect()
}

/// Reads the bytes under that name; anything is right that is no panic, as long as the points are there and finite, and the memory
/// is bounded. Whether the file was read.
fn read(name: &str, bytes: &[u8]) -> Result<bool, String> {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let is_spline = name.ends_with("npz");
    let points = if is_spline {
        parse_spline(bytes).map(|_| None)
    } else {
        parse_points(bytes, PointFormat::of(Path::new(name)).unwrap()).map(Some)
    };
    // Tables of the decoder of `.laz`, some for each byte of a point.
    let decoder = if name.ends_with("laz") { 8 << 20 } else { 0 };
    let used = MEMORY.peak_usage().saturating_sub(before);
    let allowed = CONSTANT + decoder + MULTIPLE * bytes.len() + if is_spline { UNPACKED + 64 * bytes.len() } else { 0 };
    if used > allowed {
        return Err(format!("{used} bytes were taken for a file of {}; {allowed} are allowed", bytes.len()));
    }
    let finite = |numbers: &[f64]| numbers.iter().all(|c| c.is_finite());
    let sound = match &points {
        Ok(Some(Points::Two(set))) => !set.points.is_empty() && finite(set.points.as_flattened()),
        Ok(Some(Points::Three(set))) => {
            let normals = set.normals.as_ref();
            !set.points.is_empty()
                && finite(set.points.as_flattened())
                && normals.is_none_or(|n| n.len() == set.points.len() && finite(n.as_flattened()))
        }
        Ok(None) => true,
        Err(malformed) => !malformed.problem.is_empty() && malformed.problem.len() < 500,
    };
    if sound { Ok(points.is_ok()) } else { Err(format!("{name} gave {points:?}")) }
}

#[test]
fn sound_samples_are_read_and_cut_ones_are_answered() {
    let _alone = alone();
    for Sample { name, bytes, whole } in [small_samples(), fixtures("foreign")].concat() {
        assert!(read(&name, &bytes).unwrap(), "{name} is sound");
        for length in 0..bytes.len() {
            let sound = read(&name, &bytes[..length]).unwrap();
            assert!(!(sound && whole), "{name} cut to {length} of {} bytes", bytes.len());
        }
    }
}

/// Files of about a megabyte that hold as much as they can for their size.
fn dense_files() -> Vec<(&'static str, Vec<u8>)> {
    let repeated = |name, head: &str, row: &[u8], tail: &str| {
        let rows = row.iter().copied().cycle().take(row.len() * ((1 << 20) / row.len()));
        (name, head.bytes().chain(rows).chain(tail.bytes()).collect::<Vec<u8>>())
    };
    let count = |width: usize| (1 << 20) / width;
    let ply = |encoding: &str, count: usize, number: &str| {
        format!(
            "ply\nformat {encoding} 1.0\nelement vertex {count}\nproperty {number} x\nproperty {number} y\nend_header\n"
        )
    };
    let npy = |rows: usize| {
        let header = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({rows}, 2), }}");
        format!("\u{1}{header:117}\n").into_bytes().split_off(1)
    };
    let mut array = [&b"\x93NUMPY\x01\x00v\x00"[..], &npy(count(2))].concat();
    array.resize(array.len() + 2 * count(2), 7);
    let mut stl = [vec![b' '; 80], (count(50) as u32).to_le_bytes().to_vec()].concat();
    for triangle in 0..count(50) as u32 {
        let numbers = (0..12).flat_map(|k| (triangle as f32 + k as f32 / 16.0).to_le_bytes());
        stl.extend(numbers.chain([0; 2]));
    }
    vec![
        repeated("a.txt", "", b"1 2\n", ""),
        repeated("a.txt", "", b"1 2\r", ""),
        repeated("a.csv", "", b"1,2,", ""),
        repeated("a.csv", "", b"# x y\n", ""),
        repeated("a.csv", "", b"a\n", ""),
        repeated("a.csv", "", b"a ", ""),
        repeated("a.xyz", "", b"\n", "1 2 3"),
        repeated("a.xyz", "", b"1 ", ""),
        repeated("a.obj", "", b"v 1 2 3\n", ""),
        repeated("a.obj", "v 1 2 3\n", b"\xff", ""),
        repeated("a.stl", "solid\n", b"vertex 1 2 3\n", "endsolid"),
        repeated("a.ply", &ply("ascii", count(4), "char"), b"1 2\n", ""),
        repeated("a.ply", &ply("ascii", 1, "char"), b"\xff", ""),
        repeated("a.ply", &ply("binary_little_endian", count(2), "char"), &[7, 7], ""),
        repeated("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n", b"property char a\n", "end_header\n1"),
        repeated("a.ply", "ply\nformat ascii 1.0\n", b"element a 0\n", "end_header\n1"),
        repeated("a.ply", "ply\nformat ascii 1.0\n", b"\xff", "\nend_header\n1"),
        ("a.npy", array),
        ("a.stl", stl),
    ]
}

#[test]
fn the_densest_files_take_a_small_multiple_of_their_size() {
    let _alone = alone();
    let mut read_well = 0;
    for (index, (name, bytes)) in dense_files().into_iter().enumerate() {
        let outcome = read(name, &bytes);
        assert!(outcome.is_ok(), "{index}, {name}: {outcome:?}");
        read_well += u32::from(outcome == Ok(true));
    }
    assert_eq!(read_well, 10, "most are sound");
}

#[test]
fn hostile_files_are_refused() {
    let _alone = alone();
    for Sample { name, bytes, .. } in fixtures("hostile") {
        assert!(!read(&name, &bytes).unwrap(), "{name} was read");
    }
}

/// One change to a file.
#[derive(Debug, Clone)]
enum Mutation {
    /// Other bytes in place of as many.
    Overwrite(Index, Vec<u8>),
    Flip(Index, u8),
    Insert(Index, Vec<u8>),
    Remove(Index, Index),
    /// A piece of the file again, elsewhere.
    Repeat(Index, Index, Index),
    /// A piece of another file.
    Splice(Index, Index, Index),
    Cut(Index),
    /// Another number in place of one of the decimal numbers.
    Number(Index, &'static str),
}

/// Numbers, words and binary values that readers have fallen over.
const NUMBERS: &[&str] = &[
    "-1",
    "0",
    "300000000",
    "4294967295",
    "4294967296",
    "9223372036854775808",
    "18446744073709551615",
    "1e308",
    "-1e309",
    "5e-324",
    "nan",
    "inf",
    "0x1p3",
    "1,5",
    "1.5d3",
    "99999999999999999999999",
    "",
    "- 1",
    "\u{feff}",
    "é",
];
const WORDS: &[&[u8]] = &[
    b"\r",
    b"\n",
    b"\r\n",
    b"\0",
    b"#",
    b"//",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"element vertex 300000000\n",
    b"property list uint double l\n",
    b"property float x\n",
    b"end_header\n",
    b"endsolid\n",
    b"vertex ",
    b"v 1 2 3\n",
    b"((((((((",
    b"x,y,z\n",
    b"1 2 3\n",
];

fn piece() -> impl Strategy<Value = Vec<u8>> {
    let extremes =
        [0u64, 1, 0x7f, 0x80, 0xff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, u64::MAX >> 1, u64::MAX, 0x7ff8 << 48];
    prop_oneof![
        prop::collection::vec(any::<u8>(), 1..9),
        prop::sample::select(WORDS).prop_map(<[u8]>::to_vec),
        (prop::sample::select(extremes.to_vec()), prop::sample::select(vec![2usize, 4, 8]), any::<bool>()).prop_map(
            |(value, width, big)| {
                if big { value.to_be_bytes()[8 - width..].to_vec() } else { value.to_le_bytes()[..width].to_vec() }
            }
        ),
    ]
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let at = any::<Index>;
    prop_oneof![
        3 => (at(), piece()).prop_map(|(at, piece)| Mutation::Overwrite(at, piece)),
        2 => (at(), 0..8u8).prop_map(|(at, bit)| Mutation::Flip(at, bit)),
        2 => (at(), piece()).prop_map(|(at, piece)| Mutation::Insert(at, piece)),
        1 => (at(), at()).prop_map(|(a, b)| Mutation::Remove(a, b)),
        1 => (at(), at(), at()).prop_map(|(a, b, to)| Mutation::Repeat(a, b, to)),
        1 => (at(), at(), at()).prop_map(|(a, b, to)| Mutation::Splice(a, b, to)),
        1 => at().prop_map(Mutation::Cut),
        3 => (at(), prop::sample::select(NUMBERS)).prop_map(|(at, number)| Mutation::Number(at, number)),
    ]
}

/// The part of `bytes` between two places, at most 4 KiB.
fn part(bytes: &[u8], a: &Index, b: &Index) -> std::ops::Range<usize> {
    let (a, b) = (a.index(bytes.len() + 1), b.index(bytes.len() + 1));
    a.min(b)..a.max(b).min(a.min(b) + 4096)
}

fn mutate(bytes: &mut Vec<u8>, other: &[u8], mutation: &Mutation) {
    let place = |at: &Index| at.index(bytes.len() + 1);
    match mutation {
        Mutation::Overwrite(at, piece) => {
            let at = place(at);
            let end = bytes.len().min(at + piece.len());
            bytes[at..end].copy_from_slice(&piece[..end - at]);
        }
        Mutation::Flip(at, bit) if !bytes.is_empty() => {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        Mutation::Flip(..) => {}
        Mutation::Insert(at, piece) => {
            let at = place(at);
            bytes.splice(at..at, piece.iter().copied());
        }
        Mutation::Remove(a, b) => {
            bytes.drain(part(bytes, a, b));
        }
        Mutation::Repeat(a, b, to) => {
            let (piece, to) = (bytes[part(bytes, a, b)].to_vec(), place(to));
            bytes.splice(to..to, piece);
        }
        Mutation::Splice(a, b, to) => {
            let (piece, to) = (other[part(other, a, b)].to_vec(), place(to));
            bytes.splice(to..to, piece);
        }
        Mutation::Cut(at) => bytes.truncate(place(at)),
        Mutation::Number(at, number) => {
            let at = place(at);
            let digits = |b: &u8| b.is_ascii_digit() || b"+-.".contains(b);
            let Some(start) = bytes[at..].iter().position(digits).map(|found| at + found) else { return };
            let end = bytes[start..].iter().position(|b| !digits(b)).map_or(bytes.len(), |length| start + length);
            bytes.splice(start..end, number.bytes());
        }
    }
}

/// Makes the checksums of an E57 file right again, so that a reader looks behind them: CRC-32C at the end of each page.
fn repair_checksums(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(1024) {
        let (data, checksum) = page.split_at_mut(1020);
        let crc = data.iter().fold(u32::MAX, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ if crc & 1 == 1 { 0x82f6_3b78 } else { 0 })
        });
        checksum.copy_from_slice(&(!crc).to_be_bytes());
    }
}

#[test]
fn repaired_checksums_are_right() {
    for Sample { name, mut bytes, .. } in fixtures("foreign") {
        if name.ends_with("e57") {
            let original = bytes.clone();
            repair_checksums(&mut bytes);
            assert_eq!(bytes, original);
        }
    }
}

#[test]
fn mutated_files_are_answered() {
    let _alone = alone();
    let cases = std::env::var("ZEROSET_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(2000);
    let samples: Vec<Sample> = [small_samples(), fixtures("foreign"), fixtures("points"), fixtures("hostile")].concat();
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    let strategy = (any::<Index>(), any::<Index>(), prop::collection::vec(mutation(), 1..6));
    let answers = Cell::new([0u32; 2]);
    TestRunner::new(config)
        .run(&strategy, |(which, other, mutations)| {
            let Sample { name, bytes, .. } = &samples[which.index(samples.len())];
            let mut bytes = bytes.clone();
            for mutation in &mutations {
                mutate(&mut bytes, &samples[other.index(samples.len())].bytes, mutation);
            }
            if name.ends_with("e57") {
                repair_checksums(&mut bytes);
            }
            let outcome = std::panic::catch_unwind(|| read(name, &bytes));
            let problem = match outcome {
                Ok(Ok(sound)) => {
                    let [refused, read] = answers.get();
                    answers.set([refused + u32::from(!sound), read + u32::from(sound)]);
                    return Ok(());
                }
                Ok(Err(problem)) => problem,
                Err(_) => "the reader panicked".into(),
            };
            let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
            std::fs::write(&path, &bytes).unwrap();
            Err(TestCaseError::fail(format!("{}: {problem}", path.display())))
        })
        .unwrap();
    // Neither all too gentle nor all too rough.
    let [refused, read] = answers.get();
    assert!(refused > cases / 5 && read > cases / 20, "{refused} refused, {read} read");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn noise_is_answered(noise in prop::collection::vec(any::<u8>(), 0..300), text in "[0-9xyzevd.,; #\n-]{0,80}") {
        let _alone = alone();
        for extension in zeroset_io::POINT_EXTENSIONS.iter().chain(zeroset_io::SPLINE_EXTENSIONS) {
            let name = format!("a.{extension}");
            prop_assert_eq!(read(&name, &noise).err(), None);
            prop_assert_eq!(read(&name, text.as_bytes()).err(), None);
        }
        let header = b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty list int double l\nproperty float x\nproperty float y\nend_header\n";
        prop_assert_eq!(read("a.ply", &[header, &noise[..]].concat()).err(), None);
    }
}
