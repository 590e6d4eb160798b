//! Points as columns of text: `.xyz .xy .txt .csv .asc .pts`.

use crate::columns::Columns;
use crate::points::{Dimension, Points, Rows};
use crate::read_error::{Malformed, quoted};

/// Reads rows of 2 (x y), 3 (x y z) or 6 (x y z nx ny nz) numbers, or the columns that a header line names.
pub(crate) fn parse(bytes: &[u8]) -> Result<Points, Malformed> {
    let text = utf8(bytes)?;
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.find('#').map_or(line, |at| &line[..at]).trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with("//"))
        .peekable();

    let mut fields = Vec::new();
    let mut header = None;
    let mut announced = None;
    if let Some(&(number, line)) = lines.peek() {
        let at = |problem: String| Malformed::line(number, problem);
        split(line, &mut fields).map_err(at)?;
        if fields.iter().all(|f| is_word(unquoted(f))) {
            header = named(&fields).map_err(at)?.map(|columns| (columns, fields.len()));
            lines.next();
        } else if let [count] = fields[..] {
            // The PTS format opens with the number of points on a line of its own.
            announced = count.parse::<u64>().ok();
            if announced.is_some() {
                lines.next();
            }
        }
    }

    let mut table: Option<(Columns, usize, Rows)> = None;
    let mut values = Vec::new();
    for (number, line) in lines {
        let at = |problem: String| Malformed::line(number, problem);
        split(line, &mut fields).map_err(at)?;
        let (columns, width, rows) = match &mut table {
            Some(known) => known,
            None => {
                let (columns, width) = match header.take() {
                    Some(named) => named,
                    None => (positional(fields.len()).map_err(at)?, fields.len()),
                };
                let rows = Rows::new(columns.dimension, columns.with_normals);
                table.insert((columns, width, rows))
            }
        };
        if fields.len() != *width {
            return Err(at(format!("{} columns, but the rows before have {width}", fields.len())));
        }
        values.clear();
        for &slot in &columns.slots {
            let field = unquoted(fields[slot]);
            values.push(field.parse::<f64>().map_err(|_| at(not_a_number(field, line)))?);
        }
        rows.push(&values).map_err(at)?;
    }
    let (.., rows) = table.ok_or_else(|| Malformed::file("the file has no points"))?;
    match announced {
        Some(count) if count != rows.len() as u64 => Err(Malformed::file(format!(
            "the first line announces {count} points, but {} follow: the file is cut short, or its first line is not a count",
            rows.len()
        ))),
        _ => rows.finish(),
    }
}

fn utf8(bytes: &[u8]) -> Result<&str, Malformed> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err(Malformed::file("the text is UTF-16; save it as UTF-8"));
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|b| **b == b'\n').count();
        Malformed::line(
            line,
            "this is not UTF-8 text; save the file as UTF-8 (or is it a binary file with a wrong extension?)",
        )
    })
}

/// Splits at commas and semicolons, then at blanks: every comma or semicolon ends a field, blanks only separate.
fn split<'a>(line: &'a str, fields: &mut Vec<&'a str>) -> Result<(), String> {
    fields.clear();
    if has_decimal_commas(line) {
        return Err(format!(
            "{} looks as if it had decimal commas; write decimal points, or one kind of separator",
            quoted(line)
        ));
    }
    // One separator may end the row.
    let line = line.strip_suffix([',', ';']).unwrap_or(line);
    for piece in line.split([',', ';']) {
        let before = fields.len();
        fields.extend(piece.split_whitespace());
        if fields.len() == before {
            return Err(format!("an empty field in {}", quoted(line)));
        }
    }
    Ok(())
}

/// `1,5;2,5` and `1,5 2,5` would silently read as four columns: commas between digits, no point anywhere, and another
/// separator beside them.
fn has_decimal_commas(line: &str) -> bool {
    let bytes = line.as_bytes();
    let comma_between_digits = bytes.windows(3).any(|w| w[1] == b',' && w[0].is_ascii_digit() && w[2].is_ascii_digit());
    let other_separator =
        line.contains(';') || bytes.windows(2).any(|w| w[0].is_ascii_digit() && (w[1] == b' ' || w[1] == b'\t'));
    comma_between_digits && other_separator && !line.contains('.')
}

fn unquoted(field: &str) -> &str {
    field.strip_prefix('"').and_then(|f| f.strip_suffix('"')).unwrap_or(field)
}

/// Whether a field of the first line may be the name of a column: `1.0.0` is a number gone wrong, and `nan` a value.
fn is_word(field: &str) -> bool {
    !field.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) && field.parse::<f64>().is_err()
}

fn not_a_number(field: &str, line: &str) -> String {
    format!("{} is not a number (in {})", quoted(field), quoted(line))
}

/// Columns by their number alone.
fn positional(count: usize) -> Result<Columns, String> {
    let (dimension, with_normals) = match count {
        2 => (Dimension::Two, false),
        3 => (Dimension::Three, false),
        6 => (Dimension::Three, true),
        _ => {
            return Err(format!(
                "{count} column{}; 2 (x y), 3 (x y z) or 6 (x y z nx ny nz) are read, or any number under a header line that \
                 names x, y[, z]",
                if count == 1 { "" } else { "s" }
            ));
        }
    };
    Ok(Columns { slots: (0..count).collect(), dimension, with_normals })
}

/// Columns by the words of a header line; `None` where it does not name x and y.
fn named(words: &[&str]) -> Result<Option<Columns>, String> {
    Columns::named(|name| {
        let mut hits = words.iter().enumerate().filter(|(_, w)| unquoted(w).eq_ignore_ascii_case(name));
        match (hits.next(), hits.next()) {
            (_, Some(_)) => Err(format!("two columns are named {name}")),
            (hit, None) => Ok(hit.map(|(position, _)| position)),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::PointSet;
    use crate::read_error::Place;

    fn plane(text: &str) -> PointSet<2> {
        match parse(text.as_bytes()) {
            Ok(Points::Two(set)) => set,
            other => panic!("{text:?} gave {other:?}"),
        }
    }

    fn space(text: &str) -> PointSet<3> {
        match parse(text.as_bytes()) {
            Ok(Points::Three(set)) => set,
            other => panic!("{text:?} gave {other:?}"),
        }
    }

    fn refused(text: impl AsRef<[u8]>, place: Place, part: &str) {
        let error = parse(text.as_ref()).unwrap_err();
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
    fn a_leading_count_is_checked() {
        assert_eq!(space("2\n0 0 0\n1 2 3\n").points.len(), 2);
        refused("3\n0 0 0\n1 2 3\n", Place::File, "announces 3 points, but 2 follow");
    }

    #[test]
    fn rows_that_do_not_fit_are_named_by_line() {
        refused("# c\n\n0 0 0 1\n", Place::Line(3), "4 columns; 2 (x y), 3 (x y z) or 6");
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
        refused("0 0\n1,5;2,5\n", Place::Line(2), "decimal commas");
        refused("1,5 2,5 3,5\n", Place::Line(1), "decimal commas");
    }

    #[test]
    fn what_is_no_text_or_has_no_points_is_said_so() {
        refused(b"0 0\n1 1\n\xff\xfe 2\n", Place::Line(3), "not UTF-8");
        refused(b"\xff\xfe1\0 \x002\0", Place::File, "UTF-16");
        for text in ["", "\n\n", "# only a comment\n", "x y z\n", "0\n"] {
            refused(text, Place::File, "no points");
        }
        refused("a\u{7}b 1\n", Place::Line(1), "\"a\\u{7}b\" is not a number");
    }
}
