//! The `v` lines of a Wavefront OBJ file.

use crate::lines::lines;
use crate::points::{Dimension, Points, Rows};
use crate::read_error::{Malformed, quoted};

/// Reads `v x y z` lines; a weight or colours after them and all other lines are left alone.
pub(crate) fn parse(bytes: &[u8]) -> Result<Points, Malformed> {
    // Names and comments may be in any encoding; numbers are ASCII in all of them.
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes));
    let mut rows = Rows::new(Dimension::Three, false);
    let mut values = Vec::new();
    for (number, line) in lines(&text) {
        let mut fields = line.split_whitespace();
        if fields.next() != Some("v") {
            continue;
        }
        let at = |problem: String| Malformed::line(number, problem);
        values.clear();
        for field in fields.take(3) {
            values.push(field.parse::<f64>().map_err(|_| at(format!("{} is not a number", quoted(field))))?);
        }
        rows.push(&values).map_err(at)?;
    }
    rows.finish()
}
