//! The header of a PLY file, checked before anything of the body is believed.
//!
//! ply-rs reads headers without bound, refuses names like `scalar.Intensity` and comments that are not UTF-8, and merges
//! properties of the same name; so the header is read here and handed to it in clean form.

use std::io::{BufRead, Read};

use ply_rs::ply::{Encoding, PropertyType, ScalarType};

use crate::points::source::Source;
use crate::read_error::{Malformed, quoted};

/// Headers with embedded camera tables reach some kilobytes; this leaves room.
const LONGEST_HEADER: u64 = 1 << 20;

/// A header whose claims fit the size of the file.
pub(crate) struct PlyHeader {
    pub(crate) encoding: Encoding,
    /// All elements before the vertices.
    pub(crate) before: Vec<PlyElement>,
    /// The vertices.
    pub(crate) vertex: PlyElement,
    /// The number of header lines.
    pub(crate) lines: usize,
}

/// An element as the header declares it.
pub(crate) struct PlyElement {
    pub(crate) name: String,
    pub(crate) count: usize,
    /// Names as in the file, in order, not necessarily different.
    pub(crate) properties: Vec<(String, PropertyType)>,
}

impl PlyHeader {
    /// The source then stands where the body begins.
    pub(crate) fn read(source: &mut Source) -> Result<Self, Malformed> {
        let mut lines = HeaderLines::of(source)?;
        if lines.next()?.trim_end() != "ply" {
            return Err(Malformed::line(1, "a PLY file begins with the line \"ply\"; this one does not"));
        }
        let mut encoding = None;
        let mut elements: Vec<PlyElement> = Vec::new();
        loop {
            let line = lines.next()?;
            let at = |problem: String| Malformed::line(lines.number, problem);
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                [] | ["comment" | "obj_info", ..] => {}
                ["format", kind, _version] => {
                    encoding = Some(match kind {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::BinaryLittleEndian,
                        "binary_big_endian" => Encoding::BinaryBigEndian,
                        _ => return Err(at(format!("unknown PLY format {}", quoted(kind)))),
                    });
                }
                ["element", name, count] => {
                    let count =
                        count.parse().map_err(|_| at(format!("{} is not a number of elements", quoted(count))))?;
                    elements.push(PlyElement { name: name.into(), count, properties: Vec::new() });
                }
                ["property", ref rest @ ..] => {
                    let property = property(rest).map_err(at)?;
                    let element = elements.last_mut().ok_or_else(|| at("a property before any element".into()))?;
                    element.properties.push(property);
                }
                ["end_header"] => break,
                _ => return Err(at(format!("{} is not a PLY header line", quoted(line.trim())))),
            }
        }
        let encoding = encoding.ok_or_else(|| Malformed::file("the PLY header has no format line"))?;
        let vertices = elements
            .iter()
            .position(|e| e.name == "vertex")
            .ok_or_else(|| Malformed::file("the PLY file has no element \"vertex\": there are no points in it"))?;
        elements.truncate(vertices + 1);
        check_counts(&elements, encoding, lines.source.remaining().into())?;
        let vertex = elements.remove(vertices);
        Ok(Self { encoding, before: elements, vertex, lines: lines.number })
    }
}

/// Refuses counts that the bytes after the header cannot hold, before anything is allocated or looped over for them.
fn check_counts(elements: &[PlyElement], encoding: Encoding, remaining: u128) -> Result<(), Malformed> {
    let mut needed = 0u128;
    for element in elements {
        needed += element.count as u128 * element.least_row(encoding);
        if needed > remaining {
            return Err(Malformed::file(format!(
                "the PLY header claims {} × {}, which needs at least {needed} bytes, but {remaining} follow it: the file is \
                 damaged or cut short",
                element.count,
                quoted(&element.name)
            )));
        }
    }
    Ok(())
}

impl PlyElement {
    /// The fewest bytes that one row can take.
    fn least_row(&self, encoding: Encoding) -> u128 {
        let scalars = |t: &PropertyType| match t {
            PropertyType::Scalar(s) | PropertyType::List(s, _) => size_of_scalar(s),
        };
        match encoding {
            // A digit for each entry and a blank or line end between them; the last line's end may be missing.
            Encoding::Ascii => (2 * self.properties.len() as u128).saturating_sub(1),
            _ => self.properties.iter().map(|(_, t)| scalars(t)).sum(),
        }
    }
}

fn size_of_scalar(scalar: &ScalarType) -> u128 {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// `TYPE NAME` or `list TYPE TYPE NAME`; a name may hold blanks, as some exporters write.
fn property(words: &[&str]) -> Result<(String, PropertyType), String> {
    match words {
        ["list", count, entry, name @ ..] if !name.is_empty() => {
            let count = scalar_type(count)?;
            if matches!(count, ScalarType::Float | ScalarType::Double) {
                return Err("the length of a list must be of an integer type".into());
            }
            Ok((name.join(" "), PropertyType::List(count, scalar_type(entry)?)))
        }
        [scalar, name @ ..] if !name.is_empty() && *scalar != "list" => {
            Ok((name.join(" "), PropertyType::Scalar(scalar_type(scalar)?)))
        }
        _ => Err("a property needs a type and a name".into()),
    }
}

fn scalar_type(word: &str) -> Result<ScalarType, String> {
    Ok(match word {
        "char" | "int8" => ScalarType::Char,
        "uchar" | "uint8" => ScalarType::UChar,
        "short" | "int16" => ScalarType::Short,
        "ushort" | "uint16" => ScalarType::UShort,
        "int" | "int32" => ScalarType::Int,
        "uint" | "uint32" => ScalarType::UInt,
        "float" | "float32" => ScalarType::Float,
        "double" | "float64" => ScalarType::Double,
        _ => return Err(format!("unknown PLY type {}", quoted(word))),
    })
}

/// Lines of the header, as text whatever the encoding of its comments.
struct HeaderLines<'a, 's> {
    source: &'a mut Source<'s>,
    number: usize,
    end: u8,
}

impl<'a, 's> HeaderLines<'a, 's> {
    /// Lines end in LF or CRLF; where the first ends in a lone CR, all do.
    fn of(source: &'a mut Source<'s>) -> Result<Self, Malformed> {
        let head = source.peek(5)?;
        let lone_cr = head.starts_with(b"ply\r") && !head.ends_with(b"\n");
        Ok(Self { source, number: 0, end: if lone_cr { b'\r' } else { b'\n' } })
    }

    fn next(&mut self) -> Result<String, Malformed> {
        let limit = self.source.length().min(LONGEST_HEADER);
        let mut line = Vec::new();
        let rest = limit.saturating_sub(self.source.at());
        self.source.by_ref().take(rest).read_until(self.end, &mut line).map_err(Malformed::unread)?;
        self.number += 1;
        if line.pop_if(|last| *last == self.end).is_some() {
            return Ok(String::from_utf8_lossy(&line).into_owned());
        }
        Err(if self.number == 1 {
            Malformed::file("a PLY file begins with the line \"ply\"; this one does not")
        } else {
            Malformed::file(format!("the PLY header has no end_header line in its first {limit} bytes"))
        })
    }
}
