//! Points as columns of text: `.xyz .xy .txt .csv .asc .pts`.

use crate::points::{Dimension, Points, Rows};
use crate::read_error::{Malformed, quoted};

/// Which columns hold what: `slots[k]` is the column of the k-th entry of `x y [z] [nx ny [nz]]`.
struct Columns {
    count: usize,
    slots: Vec<usize>,
    dimension: Dimension,
    with_normals: bool,
}

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
    let mut columns = None;
    let mut announced = None;
    if let Some(&(number, line)) = lines.peek() {
        split(line, &mut fields).map_err(|problem| Malformed::line(number, problem))?;
        if fields.iter().all(|f| unquoted(f).parse::<f64>().is_err()) {
            columns = Columns::named(&fields).map_err(|problem| Malformed::line(number, problem))?;
            lines.next();
        } else if let [count] = fields[..] {
            // The PTS format opens with the number of points on a line of its own.
            announced = count.parse::<u64>().ok();
            if announced.is_some() {
                lines.next();
            }
        }
    }

    let mut rows: Option<(Columns, Rows)> = None;
    let mut values = Vec::new();
    for (number, line) in lines {
        let at = |problem: String| Malformed::line(number, problem);
        split(line, &mut fields).map_err(at)?;
        let (columns, rows) = match &mut rows {
            Some(known) => known,
            None => {
                let columns = match columns.take() {
                    Some(named) => named,
                    None => Columns::positional(fields.len()).map_err(at)?,
                };
                let empty = Rows::new(columns.dimension, columns.with_normals);
                rows.insert((columns, empty))
            }
        };
        if fields.len() != columns.count {
            return Err(at(format!("{} columns, but the rows before have {}", fields.len(), columns.count)));
        }
        values.clear();
        for &slot in &columns.slots {
            let field = unquoted(fields[slot]);
            values.push(field.parse::<f64>().map_err(|_| at(not_a_number(field, line)))?);
        }
        rows.push(&values).map_err(at)?;
    }
    let (_, rows) = rows.ok_or_else(|| Malformed::file("the file has no points"))?;
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

fn not_a_number(field: &str, line: &str) -> String {
    format!("{} is not a number (in {})", quoted(field), quoted(line))
}

impl Columns {
    /// Columns by their number alone.
    fn positional(count: usize) -> Result<Self, String> {
        let (dimension, with_normals) = match count {
            2 => (Dimension::Two, false),
            3 => (Dimension::Three, false),
            6 => (Dimension::Three, true),
            _ => {
                return Err(format!(
                    "{count} column{}; 2 (x y), 3 (x y z) or 6 (x y z nx ny nz) are read, or any number under a header line \
                     that names x, y[, z]",
                    if count == 1 { "" } else { "s" }
                ));
            }
        };
        Ok(Self { count, slots: (0..count).collect(), dimension, with_normals })
    }

    /// Columns by the words of a header line; `None` where it does not name x and y.
    fn named(words: &[&str]) -> Result<Option<Self>, String> {
        let find = |name: &str| -> Result<Option<usize>, String> {
            let mut hits =
                words.iter().enumerate().filter(|(_, w)| unquoted(w).eq_ignore_ascii_case(name)).map(|(i, _)| i);
            match (hits.next(), hits.next()) {
                (_, Some(_)) => Err(format!("two columns are named {name}")),
                (hit, None) => Ok(hit),
            }
        };
        let (Some(x), Some(y)) = (find("x")?, find("y")?) else {
            return Ok(None);
        };
        let (mut slots, mut normals, mut dimension) = (vec![x, y], vec![find("nx")?, find("ny")?], Dimension::Two);
        if let Some(z) = find("z")? {
            slots.push(z);
            normals.push(find("nz")?);
            dimension = Dimension::Three;
        }
        let with_normals = match normals.into_iter().collect::<Option<Vec<_>>>() {
            Some(columns) => {
                slots.extend(columns);
                true
            }
            None => false,
        };
        Ok(Some(Self { count: words.len(), slots, dimension, with_normals }))
    }
}
