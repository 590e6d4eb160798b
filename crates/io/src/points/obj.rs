//! The `v` lines of a Wavefront OBJ file.

use crate::points::lines::Lines;
use crate::points::source::Source;
use crate::points::{Dimension, Points, Rows};
use crate::read_error::{Malformed, quoted};

/// Reads `v x y z` lines; a weight or colours after them and all other lines are left alone.
pub(crate) fn read(source: &mut Source) -> Result<Points, Malformed> {
    let mut rows = Rows::new(Dimension::Three, false);
    let mut values = Vec::new();
    let mut lines = Lines::new(source)?;
    while lines.advance()? {
        let text = lines.text();
        let mut fields = text.split_whitespace();
        if fields.next() != Some("v") {
            continue;
        }
        let at = |problem: String| Malformed::line(lines.number(), problem);
        values.clear();
        for field in fields.take(3) {
            values.push(field.parse::<f64>().map_err(|_| at(format!("{} is not a number", quoted(field))))?);
        }
        rows.push(&values).map_err(at)?;
    }
    rows.finish()
}
