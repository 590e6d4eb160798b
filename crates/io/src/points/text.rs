//! Points as columns of text: `.xyz .xy .txt .csv .asc .pts`.

mod preamble;
mod row;

use crate::attributes::{Attribute, NumberKind, colour_columns};
use crate::points::columns::Columns;
use crate::points::lines::Lines;
use crate::points::source::Source;
use crate::points::text::preamble::{Names, Preamble, drop_last_empty};
use crate::points::text::row::{number, split, unquoted};
use crate::points::{Dimension, Points, Rows};
use crate::read_error::{Malformed, quoted};

/// From so many rows on, a first column that counts them is taken for what it is.
const ROWS_THAT_COUNT: usize = 10;

/// Reads the columns that a header line names, or else the first two or three, and normals where there are six; where the plane
/// is asked for, x and y alone.
pub(crate) fn read(source: &mut Source, asked: Option<Dimension>) -> Result<Points, Malformed> {
    let mut text = Text { asked, preamble: Preamble::default(), table: None };
    let mut outcome = Ok(());
    let mut lines = Lines::new(source)?;
    while lines.advance()? {
        let line = utf8(&lines)?;
        // What is no text is said before what is wrong with a row, wherever it stands.
        if outcome.is_ok() {
            outcome = text.take(line).map_err(|problem| Malformed::line(lines.number(), problem));
        }
    }
    outcome?;
    text.finish()
}

fn utf8<'a>(lines: &'a Lines) -> Result<&'a str, Malformed> {
    let line = lines.bytes();
    if lines.number() == 1 && (line.starts_with(b"\xFF\xFE") || line.starts_with(b"\xFE\xFF")) {
        return Err(Malformed::file("the text is UTF-16; save it as UTF-8"));
    }
    std::str::from_utf8(line).map_err(|_| {
        Malformed::line(
            lines.number(),
            "this is not UTF-8 text; save the file as UTF-8 (or is it a binary file with a wrong extension?)",
        )
    })
}

/// The lines read so far.
struct Text {
    asked: Option<Dimension>,
    preamble: Preamble,
    table: Option<Table>,
}

impl Text {
    fn take(&mut self, line: &str) -> Result<(), String> {
        let (line, comment) = without_comment(line);
        let mut fields = Vec::new();
        if self.table.is_none() && self.preamble.takes(line, comment, &mut fields)? {
            return Ok(());
        }
        if line.is_empty() {
            return Ok(());
        }
        split(line, &mut fields)?;
        let table = match &mut self.table {
            Some(table) => table,
            None => {
                let (columns, names, unnamed) = self.preamble.columns(&mut fields, self.asked)?;
                self.table.insert(Table::new(columns, names, fields.len(), unnamed))
            }
        };
        table.push(&mut fields, line)
    }

    fn finish(self) -> Result<Points, Malformed> {
        let Some(table) = self.table else {
            return Err(Malformed::file(match self.preamble.words() {
                0 => "the file has no points".into(),
                lines => format!("the file has no points: {lines} lines of words, and no row of numbers"),
            }));
        };
        match self.preamble.announced() {
            Some(count) if count != table.rows.len() as u64 => Err(Malformed::file(format!(
                "the first line announces {count} points, but {} follow: the file is cut short, or its first line is not a count",
                table.rows.len()
            ))),
            _ => table.finish(),
        }
    }
}

/// The row, and the comment behind `#`, or behind `//` or `%` at the beginning of the line.
fn without_comment(line: &str) -> (&str, Option<&str>) {
    let line = line.trim();
    if let Some(comment) = line.strip_prefix("//").or_else(|| line.strip_prefix('%')) {
        return ("", Some(comment));
    }
    match line.split_once('#') {
        Some((row, comment)) => (row.trim_end(), Some(comment)),
        None => (line, None),
    }
}

/// The rows read so far.
struct Table {
    columns: Columns,
    /// Where the attributes are.
    others: Vec<usize>,
    /// The number of fields of each row.
    width: usize,
    /// Whether nothing but their number says what the columns are.
    unnamed: bool,
    /// Whether the first of four or more unnamed columns went up by one from row to row so far.
    counts_rows: bool,
    first: f64,
    rows: Rows,
    values: Vec<f64>,
}

impl Table {
    fn new(columns: Columns, names: Names, width: usize, unnamed: bool) -> Self {
        let others = names.iter().map(|(position, _)| *position).collect();
        let attributes = names.into_iter().map(|(_, name)| (name, NumberKind::F64)).collect();
        let rows = Rows::with_attributes(columns.dimension, columns.with_normals, attributes);
        Self {
            columns,
            others,
            width,
            unnamed,
            counts_rows: unnamed && width > 3,
            first: 0.0,
            rows,
            values: Vec::new(),
        }
    }

    fn push(&mut self, fields: &mut Vec<&str>, line: &str) -> Result<(), String> {
        if fields.len() == self.width + 1 {
            drop_last_empty(fields);
        }
        if fields.len() != self.width {
            return Err(format!("{} columns, but the rows before have {}", fields.len(), self.width));
        }
        self.values.clear();
        for field in self.columns.slots.iter().filter_map(|slot| fields.get(*slot)) {
            let value = number(field).ok_or_else(|| match field.is_empty() {
                true => format!("an empty field in {}", quoted(line)),
                false => format!("{} is not a number (in {})", quoted(unquoted(field)), quoted(line)),
            })?;
            self.values.push(value);
        }
        if let Some(&x) = self.values.first() {
            if self.rows.len() == 0 {
                self.first = x;
            }
            self.counts_rows &= x.fract() == 0.0 && x == self.first + self.rows.len() as f64;
        }
        // A column that holds anything but numbers is left out in the end.
        let others = self.others.iter().filter_map(|slot| fields.get(*slot));
        self.values.extend(others.map(|field| number(field).unwrap_or(f64::NAN)));
        self.rows.push(&self.values)
    }

    fn finish(self) -> Result<Points, Malformed> {
        if self.counts_rows && self.rows.len() >= ROWS_THAT_COUNT {
            return Err(Malformed::file(format!(
                "the first of {} columns counts the rows; give the columns a header line with the names x, y[, z]",
                self.width
            )));
        }
        let mut points = self.rows.finish()?;
        if let (true, Points::Three(set)) = (self.unnamed, &mut points)
            && let Some(colours) = set.normals.take_if(|normals| are_colours(normals))
        {
            set.attributes = ["red", "green", "blue"]
                .into_iter()
                .enumerate()
                .map(|(channel, name)| Attribute {
                    name: name.to_owned(),
                    kind: NumberKind::U8,
                    values: colours.iter().filter_map(|c| c.get(channel)).copied().collect(),
                })
                .collect();
        }
        bytes_as_colours(points.attributes_mut());
        Ok(points)
    }
}

/// Text does not say what type its numbers have; colours in whole numbers up to 255 are bytes.
fn bytes_as_colours(attributes: &mut [Attribute]) {
    let Some(columns) = colour_columns(attributes) else { return };
    let is_byte = |v: &f64| v.fract() == 0.0 && (0.0..=255.0).contains(v);
    let values = || columns.iter().filter_map(|c| attributes.get(*c)).flat_map(|a| &a.values);
    // Zeros and ones alone may be shares of full light.
    if values().all(is_byte) && values().any(|v| *v > 1.0) {
        for column in columns {
            if let Some(attribute) = attributes.get_mut(column) {
                attribute.kind = NumberKind::U8;
            }
        }
    }
}

/// Whether six unnamed columns end in colours: whole numbers up to 255, of which some are large for a component of a normal.
fn are_colours(normals: &[[f64; 3]]) -> bool {
    let components = || normals.iter().flatten();
    components().all(|c| c.fract() == 0.0 && (0.0..=255.0).contains(c)) && components().any(|c| *c > 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::PointSet;
    use crate::points::format::{PointFormat, parse_points};
    use crate::read_error::Place;

    fn plane(text: &str) -> PointSet<2> {
        match parse_points(text.as_bytes(), PointFormat::Text) {
            Ok(Points::Two(set)) => set,
            other => panic!("{text:?} gave {other:?}"),
        }
    }

    fn space(text: &str) -> PointSet<3> {
        match parse_points(text.as_bytes(), PointFormat::Text) {
            Ok(Points::Three(set)) => set,
            other => panic!("{text:?} gave {other:?}"),
        }
    }

    fn refused(text: impl AsRef<[u8]>, place: Place, part: &str) {
        let error = parse_points(text.as_ref(), PointFormat::Text).unwrap_err();
        assert_eq!(error.place, place, "{error}");
        assert!(error.problem.contains(part), "{error}");
    }

    #[test]
    fn separators_comments_blank_lines_and_line_ends_do_not_matter() {
        let expected = [[1.0, -2.5], [3e2, 0.25]];
        for text in [
            "1 -2.5\n3e2 .25\n",
            "1,-2.5\r\n3e2,.25\r\n",
            "1 ; -2.5 ;\n3e2\t.25",
            "\u{feff}1\t-2.5\n\n  \n3e2, +.25,\n",
            "# note\n// note\n1 -2.5 # note\n3e2 .25\n#",
            "x y\n1 -2.5\n3e2 .25",
            "\"x\",\"y\"\n\"1\",\"-2.5\"\n300.,0.25",
            "east north\n1 -2.5\n3e2 .25",
            "1 -2.5\r3e2 .25\r",
            "1;-2,5\n300,0;,25\n",
            "1\t-2,5\r\n3e2\t0,25",
            "1.0D0 -0.25d1\n3D+02 .25",
            "% note\nExported on 2020-01-02 by scan 1.5\n\nx,y\n[m],[m]\n1,-2.5\n3e2,.25",
            "//x y\n1 -2.5\n3e2 .25",
        ] {
            assert_eq!(plane(text).points, expected, "{text:?}");
        }
    }

    #[test]
    fn three_columns_are_space_and_six_have_normals() {
        assert_eq!(space("0 0 0\n1 2 3\n").points, [[0.0; 3], [1.0, 2.0, 3.0]]);
        let set = space("1 2 3 0 0 1\n4 5 6 0 2 0\n");
        assert_eq!(set.points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(set.normals.unwrap(), [[0.0, 0.0, 1.0], [0.0, 2.0, 0.0]]);
    }

    #[test]
    fn a_header_that_names_columns_chooses_them() {
        let set = space("id,Z,y,x,note\n7,3,2,1,first\n8,6,5,4,second\n");
        assert_eq!(set.points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(plane("x,y,f\n1,2,NaN\n").points, [[1.0, 2.0]]);
        assert_eq!(plane("x y nx ny\n1 2 0 1\n").normals.unwrap(), [[0.0, 1.0]]);
        refused("x,y,x\n1,2,3\n", Place::Line(1), "two columns are named x");
    }

    #[test]
    fn columns_behind_the_coordinates_are_passed_over() {
        let points = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        for text in [
            "1 2 3 0.5\n4 5 6 0.25\n",
            "2\n1 2 3 -900 10 20 30\n4 5 6 -800 255 0 0\n",
            "1,2,3,,two words\n4,5,6,0.5,\n",
            "name,x,y,z\nP1,1,2,3\nP2,4,5,6\n",
            "//X Y Z Intensity\n1 2 3 9\n4 5 6 9\n",
            "x,y,z,\n1,2,3,\n4,5,6\n",
        ] {
            assert_eq!(space(text).points, points, "{text:?}");
        }
        // A comment of as many words names the columns, and one of another number does not.
        assert_eq!(plane("# x y f\n1 2 3\n").points, [[1.0, 2.0]]);
        assert_eq!(space("# x y\n1 2 3\n").points, [[1.0, 2.0, 3.0]]);
    }

    #[test]
    fn colours_are_no_normals() {
        let set = space("1 2 3 255 128 0\n4 5 6 0 0 0\n");
        assert_eq!(set.normals, None);
        let green = Attribute { name: "green".into(), kind: NumberKind::U8, values: vec![128.0, 0.0] };
        assert_eq!((set.attributes.len(), &set.attributes[1]), (3, &green));
        assert!(space("1 2 3 1 0 0\n4 5 6 0 1 0\n").normals.is_some());
        assert!(space("x y z nx ny nz\n1 2 3 255 128 0\n").normals.is_some(), "the header line is believed");
    }

    #[test]
    fn named_columns_of_numbers_are_kept() {
        let set = space("x,y,z,R,G,B,label,Intensity,hit\n1,2,3,255,0,7,tree,0.5,1\n4,5,6,0,0,7,car,1.5,\n");
        let names: Vec<(&str, NumberKind)> = set.attributes.iter().map(|a| (a.name.as_str(), a.kind)).collect();
        let (byte, real) = (NumberKind::U8, NumberKind::F64);
        assert_eq!(
            names,
            [("R", byte), ("G", byte), ("B", byte), ("Intensity", real)],
            "words and gaps are no numbers"
        );
        assert_eq!(set.attributes[3].values, [0.5, 1.5]);
    }

    #[test]
    fn where_the_plane_is_asked_for_x_and_y_are_read() {
        for text in ["1 2 9\n", "1 2 0 1\n", "z,y,x\n9,2,1\n", "1,2\n"] {
            let read = parse_points(text.as_bytes(), PointFormat::PlaneText);
            let Ok(Points::Two(set)) = read else { panic!("{text:?} gave {read:?}") };
            assert_eq!((set.points, set.normals), (vec![[1.0, 2.0]], None), "{text:?}");
        }
    }

    #[test]
    fn a_column_that_counts_the_rows_is_no_coordinate() {
        let rows = |width: usize| (1..=12).map(|i| format!("{i}{}\n", " 0.5".repeat(width - 1))).collect::<String>();
        refused(rows(4), Place::File, "the first of 4 columns counts the rows");
        assert_eq!(space(&rows(3)).points.len(), 12);
    }

    #[test]
    fn a_leading_count_is_checked() {
        assert_eq!(space("2\n0 0 0\n1 2 3\n").points.len(), 2);
        refused("3\n0 0 0\n1 2 3\n", Place::File, "announces 3 points, but 2 follow");
    }

    #[test]
    fn rows_that_do_not_fit_are_named_by_line() {
        refused("x y z\n0 0 0 1\n", Place::Line(2), "4 columns under a header line of 3");
        refused("5\n1\n", Place::Line(2), "1 column;");
        refused("0 0\n1 1\n2 2 2\n", Place::Line(3), "3 columns, but the rows before have 2");
        refused("0 0\n1 one\n", Place::Line(2), "\"one\" is not a number");
        refused("1.0.0 2.0.0\n1 1\n", Place::Line(1), "\"1.0.0\" is not a number");
        refused("nan nan\n1 1\n", Place::Line(1), "x is nan");
        refused("0 0\n1 nan\n", Place::Line(2), "y is nan");
        refused("0 0 0\n-inf 1 1\n", Place::Line(2), "x is -inf");
        refused("0 1e999\n", Place::Line(1), "y is inf");
        refused("1 2 3 0 nan 1\n", Place::Line(1), "ny is nan");
        refused("1,,2\n", Place::Line(1), "an empty field");
        refused("0 0\n1,5 2,5\n", Place::Line(2), "commas decimal");
        refused("1,234.5 2,345.6 3,456.7\n", Place::Line(1), "commas decimal");
        refused("x,y,z\n1,,2\n", Place::Line(2), "an empty field");
    }

    #[test]
    fn what_is_no_text_or_has_no_points_is_said_so() {
        refused(b"0 0\n1 1\n\xff\xfe 2\n", Place::Line(3), "not UTF-8");
        refused(b"\xff\xfe1\0 \x002\0", Place::File, "UTF-16");
        refused("", Place::File, "the file is empty");
        for text in ["\n\n", "# only a comment\n", "x y z\n", "0\n"] {
            refused(text, Place::File, "no points");
        }
        refused("a\u{7}b 1\n", Place::File, "1 lines of words");
        refused(format!("{}1 2 3\n", "so it goes on\n".repeat(101)), Place::Line(101), "still no row of numbers");
    }
}
