//! Of a file no more is held than the points and a buffer of fixed size. One test in a file of its own, since the memory is counted
//! for the whole process.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs::File;
use std::io::{BufWriter, Write};

use peak_alloc::PeakAlloc;
use zeroset_io::read_points;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The buffer, a block of rows, and what tests and formats need beside.
const BUFFERS: usize = 256 << 10;

/// A file of some 4 MiB: `row` again and again, between `before` and `after`.
fn read_with_little_memory(name: &str, before: &[u8], row: &[u8], after: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let mut file = BufWriter::new(File::create(&path).unwrap());
    file.write_all(before).unwrap();
    for _ in 0..rows(row.len()) {
        file.write_all(row).unwrap();
    }
    file.write_all(after).unwrap();
    drop(file);

    let start = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let points = read_points(&path).unwrap();
    let used = MEMORY.peak_usage() - start;
    // An array that grows is copied to one of twice the size.
    let allowed = BUFFERS + points.len() * 3 * 24;
    assert!(used <= allowed, "{name}: {used} bytes for {} points, {allowed} are allowed", points.len());
}

fn rows(width: usize) -> usize {
    (4 << 20) / width
}

#[test]
fn the_file_is_not_held() {
    let ply = |encoding: &str, width: usize| {
        let (before, vertices) = (format!("element camera {}\nproperty int a\n", rows(width)), "element vertex 1\n");
        let names = "property char x\nproperty char y\n";
        format!("ply\nformat {encoding} 1.0\n{before}{vertices}{names}end_header\n").into_bytes()
    };
    read_with_little_memory("a.xyz", b"1 2 3\n", b"# a remark that takes its place\n", b"4 5 6");
    read_with_little_memory("a.xyz", b"1 2 3\r", b"# a remark that takes its place\r", b"4 5 6");
    read_with_little_memory("a.obj", b"v 1 2 3\n", b"f 1 1 1\n", b"");
    read_with_little_memory("a.stl", b"solid\n", b"vertex 1 2 3\n", b"endsolid");
    read_with_little_memory("a.stl", &[&[0; 80], &(rows(50) as u32).to_le_bytes()[..]].concat(), &[0; 50], b"");
    read_with_little_memory("a.ply", &ply("ascii", 8), b"1234567\n", b"1 2");
    read_with_little_memory("a.ply", &ply("binary_little_endian", 4), &[7; 4], &[1, 2]);
    read_with_little_memory("a.ply", &ply("binary_big_endian", 4), &[7; 4], &[1, 2]);
    for order in ["False", "True"] {
        let header = format!("{{'descr': '<f8', 'fortran_order': {order}, 'shape': ({}, 2), }}", rows(16));
        let header = format!("{header:117}\n").into_bytes();
        read_with_little_memory("a.npy", &[b"\x93NUMPY\x01\x00v\x00", &header[..]].concat(), &[0; 16], b"");
    }
}
