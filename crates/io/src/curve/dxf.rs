//! Curves as DXF, in the ascii form of AutoCAD release 12, which every CAD program reads.

use std::io::{self, Write};

use crate::axis_by_axis::axis_by_axis;
use crate::curve::Curves;

const LAYER: &str = "ZEROSET";

/// Writes each curve as a POLYLINE on one layer.
pub(crate) fn write(out: &mut impl Write, curves: &Curves<'_>) -> io::Result<()> {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for vertex in curves.vertices() {
        (low, high) = (axis_by_axis(low, *vertex, f64::min), axis_by_axis(high, *vertex, f64::max));
    }
    section(out, "HEADER")?;
    group(out, 9, "$ACADVER")?;
    group(out, 1, "AC1009")?;
    if low[0] <= high[0] {
        for (name, corner) in [("$EXTMIN", low), ("$EXTMAX", high)] {
            group(out, 9, name)?;
            place(out, corner)?;
        }
    }
    group(out, 0, "ENDSEC")?;
    section(out, "ENTITIES")?;
    let all = curves.curves.iter().map(|c| (c, "1")).chain(curves.paths.iter().map(|p| (p, "0")));
    for (curve, closed) in all.filter(|(curve, _)| !curve.is_empty()) {
        group(out, 0, "POLYLINE")?;
        group(out, 8, LAYER)?;
        // Vertices follow.
        group(out, 66, "1")?;
        place(out, [0.0; 2])?;
        // Closed or not.
        group(out, 70, closed)?;
        for vertex in curve {
            group(out, 0, "VERTEX")?;
            group(out, 8, LAYER)?;
            place(out, *vertex)?;
        }
        group(out, 0, "SEQEND")?;
        group(out, 8, LAYER)?;
    }
    group(out, 0, "ENDSEC")?;
    group(out, 0, "EOF")
}

fn section(out: &mut impl Write, name: &str) -> io::Result<()> {
    group(out, 0, "SECTION")?;
    group(out, 2, name)
}

fn place(out: &mut impl Write, [x, y]: [f64; 2]) -> io::Result<()> {
    group(out, 10, &format!("{x:?}"))?;
    group(out, 20, &format!("{y:?}"))?;
    group(out, 30, "0.0")
}

/// A group code, right-aligned in three columns as usual, and its value.
fn group(out: &mut impl Write, code: u32, value: &str) -> io::Result<()> {
    writeln!(out, "{code:3}\n{value}")
}
