//! Fields as VTK ImageData, the XML form with raw data behind it.

use std::io::{self, Write};

use crate::field::Field;

/// Writes the values as the point data `f`, f64, and the confidence, if there is one. The plane is one layer at z = 0.
pub(crate) fn write(out: &mut impl Write, field: &Field<'_>) -> io::Result<()> {
    let number = |numbers: &[f64], axis: usize, otherwise: f64| numbers.get(axis).copied().unwrap_or(otherwise);
    let triple = |of: &dyn Fn(usize) -> f64| format!("{:?} {:?} {:?}", of(0), of(1), of(2));
    let last = |axis: usize| field.values.shape().get(axis).map_or(0, |nodes| nodes - 1);
    let extent = format!("0 {} 0 {} 0 {}", last(0), last(1), last(2));
    let origin = triple(&|axis| number(field.origin, axis, 0.0));
    let spacing = triple(&|axis| number(field.spacing, axis, 1.0));
    let bytes = 8 * field.values.len() as u64;
    let second = field.confidence.as_ref().map_or_else(String::new, |_| {
        let offset = bytes + 8;
        format!(r#"<DataArray type="Float64" Name="confidence" format="appended" offset="{offset}"/>"#) + "\n"
    });
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<ImageData WholeExtent="{extent}" Origin="{origin}" Spacing="{spacing}">
<Piece Extent="{extent}">
<PointData Scalars="f">
<DataArray type="Float64" Name="f" format="appended" offset="0"/>
{second}</PointData>
</Piece>
</ImageData>
<AppendedData encoding="raw">
_"#
    )?;
    for values in std::iter::once(&field.values).chain(&field.confidence) {
        out.write_all(&bytes.to_le_bytes())?;
        // VTK has x fastest: the values of the transposed view in C order.
        for value in values.t() {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    write!(out, "\n</AppendedData>\n</VTKFile>\n")
}
