//! Fields as OpenEXR images of 32-bit floats.

use std::io::{self, Seek, Write};

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Layers, Text, WritableImage,
};
use ndarray::{ArrayView2, Axis, Ix2};

use crate::field::Field;

/// Writes one layer `f` (plane) or layers `z0000`, `z0001`, … (space), each with one channel `Y`, which viewers show as grey.
///
/// Image columns run along x, rows from the largest y down to the smallest, so that y points up on the screen. The layers'
/// attributes `origin` and `spacing` are the field's, as text of f64 numbers.
pub(crate) fn write(out: &mut (impl Write + Seek), field: &Field<'_>) -> io::Result<()> {
    let slices: Vec<(String, ArrayView2<'_, f64>)> = match field.values.view().into_dimensionality::<Ix2>() {
        Ok(plane) => vec![("f".into(), plane)],
        Err(_) => field
            .values
            .axis_iter(Axis(2))
            .enumerate()
            .map(|(k, slice)| Ok((format!("z{k:04}"), slice.into_dimensionality().map_err(io::Error::other)?)))
            .collect::<io::Result<_>>()?,
    };
    let size = (field.values.len_of(Axis(0)), field.values.len_of(Axis(1)));
    if size.0.max(size.1) > i32::MAX as usize {
        return Err(io::Error::other("an EXR image has at most 2³¹ − 1 columns and rows"));
    }
    let attributes = [("origin", field.origin), ("spacing", field.spacing)]
        .map(|(name, numbers)| (Text::from(name), AttributeValue::Text(Text::from(decimals(numbers).as_str()))));
    let mut layers = Layers::new();
    for (name, slice) in slices {
        let samples: Vec<f32> = slice.axis_iter(Axis(1)).rev().flatten().map(|value| *value as f32).collect();
        let channels = AnyChannels::sort([AnyChannel::new("Y", FlatSamples::F32(samples))].into_iter().collect());
        let mut layer = LayerAttributes::named(name.as_str());
        layer.other.extend(attributes.iter().cloned());
        layers.push(Layer::new(size, layer, Encoding::SMALL_LOSSLESS, channels));
    }
    let image = Image::from_layers(ImageAttributes::new(IntegerBounds::from_dimensions(size)), layers);
    image.write().to_buffered(out).map_err(io::Error::other)
}

fn decimals(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}
