//! Curves as rows of text.

use std::io::{self, Write};

use crate::curve::Curves;

/// Writes a header line and a row for each vertex; the number of the curve comes first, and the first vertex is not repeated.
/// Closed curves come first.
pub(crate) fn write(out: &mut impl Write, curves: &Curves<'_>) -> io::Result<()> {
    writeln!(out, "curve,x,y")?;
    for (index, curve) in curves.curves.iter().chain(curves.paths).enumerate() {
        for [x, y] in curve {
            writeln!(out, "{index},{x:?},{y:?}")?;
        }
    }
    Ok(())
}
