//! The corners of the triangles of an STL file, ascii or binary.

use std::collections::HashSet;
use std::io::BufRead;

use crate::points::lines::Lines;
use crate::points::source::Source;
use crate::points::{Dimension, Points, Rows};
use crate::read_error::{Malformed, Place, quoted};

/// Bytes before the triangles of a binary file: a free text, and their number.
const HEADER: usize = 84;
/// Bytes of a triangle: its normal, its corners, and two of no fixed meaning.
const TRIANGLE: usize = 50;

/// Reads every corner once, in the order of the first appearance.
pub(crate) fn read(source: &mut Source) -> Result<Points, Malformed> {
    let length = source.length();
    let head = source.peek(HEADER)?;
    let count = head.get(80..).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let claimed = count.map(|count| HEADER as u64 + u64::from(count) * TRIANGLE as u64);
    // Some binary files begin with "solid" too: the size decides first.
    match (count, claimed) {
        (Some(count), Some(claimed)) if claimed == length => read_binary(source, count),
        _ if begins_with_solid(source)? => read_ascii(source),
        (Some(count), Some(claimed)) if claimed > length => Err(Malformed::file(format!(
            "the STL header claims {count} triangles, which need {claimed} bytes, but the file has {length}: it is damaged or cut short"
        ))),
        (Some(count), Some(_)) => read_binary(source, count),
        _ => Err(Malformed::file("an STL file begins with \"solid\" or has 84 bytes of header; this one does not")),
    }
}

/// Whether that is the first word, behind any blanks.
fn begins_with_solid(source: &mut Source) -> Result<bool, Malformed> {
    loop {
        let piece = source.fill_buf().map_err(Malformed::unread)?;
        let blanks = piece.len() - piece.trim_ascii_start().len();
        if blanks == 0 {
            break;
        }
        source.consume(blanks);
    }
    let word = source.peek(5)?;
    source.go_to(0)?;
    Ok(word.eq_ignore_ascii_case(b"solid"))
}

/// The header's count fits the bytes; whatever follows the triangles is left alone.
fn read_binary(source: &mut Source, count: u32) -> Result<Points, Malformed> {
    let mut corners = Corners::new();
    let mut triangle = [0; TRIANGLE];
    source.go_to(HEADER as u64)?;
    for index in 0..count as usize {
        source.fill(&mut triangle)?;
        let (numbers, _) = triangle.get(12..48).unwrap_or_default().as_chunks::<4>();
        for (corner, xyz) in numbers.as_chunks::<3>().0.iter().enumerate() {
            let place = Place::Byte(HEADER + index * TRIANGLE + 12 + corner * 12);
            let xyz = xyz.map(|number| f64::from(f32::from_le_bytes(number)));
            corners.push(xyz).map_err(|problem| Malformed { place, problem })?;
        }
    }
    corners.rows.finish()
}

/// Reads the lines `vertex x y z`; all others are left alone.
fn read_ascii(source: &mut Source) -> Result<Points, Malformed> {
    let mut corners = Corners::new();
    let mut closed = false;
    let mut lines = Lines::new(source)?;
    while lines.advance()? {
        let at = |problem: String| Malformed::line(lines.number(), problem);
        let text = lines.text();
        let mut fields = text.split_whitespace();
        match fields.next() {
            Some(word) if word.eq_ignore_ascii_case("vertex") => {}
            Some(word) => {
                closed = word.eq_ignore_ascii_case("endsolid") || (closed && !word.eq_ignore_ascii_case("solid"));
                continue;
            }
            None => continue,
        }
        let mut xyz = [0.0; 3];
        for (axis, value) in xyz.iter_mut().enumerate() {
            let field = fields.next().ok_or_else(|| at(format!("3 coordinates are needed, {axis} found")))?;
            *value = field.parse().map_err(|_| at(format!("{} is not a number", quoted(field))))?;
        }
        corners.push(xyz).map_err(at)?;
    }
    if !closed {
        return Err(Malformed::file("the STL file ends without a line \"endsolid\": it is cut short"));
    }
    corners.rows.finish()
}

/// Corners without their repetitions.
struct Corners {
    seen: HashSet<[u64; 3]>,
    rows: Rows,
}

impl Corners {
    fn new() -> Self {
        Self { seen: HashSet::new(), rows: Rows::new(Dimension::Three, false) }
    }

    fn push(&mut self, xyz: [f64; 3]) -> Result<(), String> {
        // −0 and 0 are the same place.
        if self.seen.insert(xyz.map(|c| (c + 0.0).to_bits())) {
            self.rows.push(&xyz)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::format::{PointFormat, parse_points};

    const TRIANGLES: [[[f32; 3]; 3]; 2] =
        [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.0]], [[-0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.5e6]]];
    const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 2.5e6]];

    fn binary(title: &[u8], triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = title.to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for corners in triangles {
            bytes.extend([0; 12]);
            bytes.extend(corners.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
            bytes.extend([7, 7]);
        }
        bytes
    }

    fn read(bytes: &[u8]) -> Vec<[f64; 3]> {
        match parse_points(bytes, PointFormat::Stl) {
            Ok(Points::Three(set)) => set.points,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn corners_come_once_from_binary_files_whatever_their_title() {
        for title in [&b"made by hand"[..], b"solid in binary", b"\xff\xfe"] {
            assert_eq!(read(&binary(title, &TRIANGLES)), CORNERS);
        }
        let mut longer = binary(b"", &TRIANGLES);
        longer.extend(b"a trailer");
        assert_eq!(read(&longer), CORNERS);
    }

    #[test]
    fn ascii_files_may_have_any_case_line_ends_and_several_solids() {
        let triangle = |corners: [[f32; 3]; 3]| {
            let lines = corners.map(|[x, y, z]| format!("      vertex {x:e} {y} {z}\n")).concat();
            format!("  facet normal nan nan nan\n    outer loop\n{lines}    endloop\n  endfacet\n")
        };
        let [first, second] = TRIANGLES.map(triangle);
        let text = format!("solid café\n{first}endsolid café\nsolid b\n{second}endsolid b\n");
        for text in [text.replace('\n', "\r\n"), text.replace('\n', "\r"), text.to_uppercase(), text] {
            assert_eq!(read(text.as_bytes()), CORNERS);
        }
    }

    #[test]
    fn damaged_files_say_where() {
        let sentence = |bytes: &[u8]| parse_points(bytes, PointFormat::Stl).unwrap_err().to_string();
        let whole = binary(b"", &TRIANGLES);
        assert!(sentence(&whole[..150]).contains("claims 2 triangles, which need 184 bytes, but the file has 150"));
        assert!(sentence(&whole[..50]).contains("begins with \"solid\""));
        assert!(sentence(&binary(b"", &[])).contains("no points"));
        let mut broken = whole.clone();
        broken[84 + 50 + 12 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(sentence(&broken).contains("byte 158: y is nan"), "{}", sentence(&broken));
        assert!(sentence(b"solid a\nvertex 1 2\nendsolid").contains("line 2: 3 coordinates are needed, 2 found"));
        assert!(sentence(b"solid a\nvertex 1 2 z\nendsolid").contains("line 2: \"z\" is not a number"));
        assert!(sentence(b"solid a\nvertex 1 2 3\n").contains("cut short"));
    }
}
