//! One row of a text table: its fields, and the numbers in them.

use crate::read_error::quoted;

/// A row of more fields is refused, so that a file of nothing but blanks and digits takes no more memory than others.
const MOST_FIELDS: usize = 1000;

/// Splits at commas and semicolons, and at blanks between numbers: every comma or semicolon ends a field, which may be empty,
/// blanks only separate. Where commas can only be decimal ones (`1,5;2,5`), they stay in the fields.
pub(crate) fn split<'a>(line: &'a str, fields: &mut Vec<&'a str>) -> Result<(), String> {
    fields.clear();
    let line = line.trim();
    if has_commas_inside_numbers(line) {
        return split_decimal_commas(line, fields);
    }
    for piece in line.split([',', ';']) {
        if has_blanks_between_numbers(piece) || piece.len() == line.len() {
            fields.extend(piece.split_whitespace().take(MOST_FIELDS + 1));
        } else {
            fields.push(piece.trim());
        }
        if fields.len() > MOST_FIELDS {
            return Err(format!("more than {MOST_FIELDS} columns"));
        }
    }
    Ok(())
}

/// Commas between digits beside another separator: `1,5;2,5` and `1,234.5 2,345.6` would silently read as four columns.
fn has_commas_inside_numbers(line: &str) -> bool {
    let mut triples = line.as_bytes().windows(3);
    let between_digits = triples.any(|triple| matches!(triple, [b'0'..=b'9', b',', b'0'..=b'9']));
    between_digits && (line.contains(';') || line.split(',').any(has_blanks_between_numbers))
}

fn has_blanks_between_numbers(piece: &str) -> bool {
    let mut fields = piece.split_whitespace().map(|f| f.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)));
    let first = fields.next();
    let second = fields.next();
    first == Some(true) && second == Some(true) && fields.all(|numeric| numeric)
}

/// Semicolons or tabs between the fields, one comma at most in each and no point in any leave one meaning; blanks do not, since
/// `1,2 3` may be two numbers or three.
fn split_decimal_commas<'a>(line: &'a str, fields: &mut Vec<&'a str>) -> Result<(), String> {
    let clear = line.contains([';', '\t']) && !line.contains('.') && line.matches([';', '\t']).count() < MOST_FIELDS;
    fields.extend(line.split([';', '\t']).map(str::trim).take(MOST_FIELDS));
    if clear && fields.iter().all(|f| f.matches(',').count() <= 1 && !f.contains(char::is_whitespace)) {
        return Ok(());
    }
    Err(format!(
        "{}: are these commas decimal ones, or do they separate? Write decimal points and one kind of separator",
        quoted(line)
    ))
}

/// The number in a field: with decimal point or comma, an exponent behind e or (Fortran) d, in quotation marks or not.
pub(crate) fn number(field: &str) -> Option<f64> {
    let field = unquoted(field);
    field.parse().ok().or_else(|| {
        let is_number = |c: char| c.is_ascii_digit() || "+-.,eEdD".contains(c);
        if field.len() > 64 || !field.chars().all(is_number) {
            return None;
        }
        field.replace(',', ".").replace(['d', 'D'], "e").parse().ok()
    })
}

pub(crate) fn unquoted(field: &str) -> &str {
    field.strip_prefix('"').and_then(|f| f.strip_suffix('"')).unwrap_or(field)
}

/// Whether a field may be the name of a column: `1.0.0` is a number gone wrong, and `nan` a value.
pub(crate) fn is_word(field: &str) -> bool {
    let field = unquoted(field);
    !field.is_empty()
        && !field.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
        && field.parse::<f64>().is_err()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn fields(line: &str) -> Vec<&str> {
        let mut fields = Vec::new();
        split(line, &mut fields).unwrap();
        fields
    }

    #[test]
    fn separators_end_fields_and_blanks_part_numbers_only() {
        assert_eq!(fields(" 1  -2.5\t.5 "), ["1", "-2.5", ".5"]);
        assert_eq!(fields("1.5;-2 2.5"), ["1.5", "-2", "2.5"]);
        assert_eq!(fields("1.0,2.0 , 3.0,,two words"), ["1.0", "2.0", "3.0", "", "two words"]);
        assert_eq!(fields("1,5;2,5"), ["1,5", "2,5"]);
        assert_eq!(fields("1,5\t2;3"), ["1,5", "2", "3"]);
        for unclear in ["1,5 2,5 3,5", "1,234.5 2,345.6", "1,234.5;2,345.6", "1,2,3;4"] {
            assert!(split(unclear, &mut Vec::new()).unwrap_err().contains("decimal"), "{unclear}");
        }
    }

    #[test]
    fn rows_of_very_many_fields_are_refused() {
        for long in ["1 ", ",", "1,2;", "1 2,", "1,5;"].map(|row| row.repeat(10_000)) {
            assert!(split(&long, &mut Vec::new()).is_err());
        }
    }

    #[test]
    fn numbers_have_many_forms() {
        for (field, value) in
            [("1.", 1.0), (".5", 0.5), ("+2e-1", 0.2), ("\"3\"", 3.0), ("1,5", 1.5), ("1.5D+02", 150.0), ("-1d0", -1.0)]
        {
            assert_eq!(number(field), Some(value), "{field}");
        }
        for field in ["", "one", "1.0.0", "1,2,3", "0x10", "1_000", "dead"] {
            assert_eq!(number(field), None, "{field}");
        }
    }
}
