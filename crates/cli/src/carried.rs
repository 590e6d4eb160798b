//! What the points hand on to the vertices of the mesh.

use zeroset::SamplesAround;
use zeroset_io::{Attribute, PointSet, colour_columns, colour_range};

/// Per vertex; all empty for a mesh without points.
#[derive(Default)]
pub struct Carried {
    /// Distance from the nearest point, in the unit of the points.
    pub support: Vec<f64>,
    /// The points' attributes: means for colours and floating point, the nearest point's for other integers.
    pub attributes: Vec<Attribute>,
    /// Red, green, blue as bytes, for formats that know colours alone; empty where the points have none.
    pub colours: Vec<[u8; 3]>,
}

impl Carried {
    pub fn new(set: &PointSet<3>, vertices: &[[f64; 3]]) -> Self {
        let around = match set.attributes.is_empty() {
            true => SamplesAround::nearest_only(&set.points, vertices),
            false => SamplesAround::new(&set.points, vertices),
        };
        let colours = colour_columns(&set.attributes);
        let attributes: Vec<Attribute> = set
            .attributes
            .iter()
            .enumerate()
            .map(|(column, attribute)| {
                let mean = !attribute.kind.is_integer() || colours.is_some_and(|columns| columns.contains(&column));
                let values = &attribute.values;
                let values = if mean { around.mean(values) } else { around.nearest(values) };
                Attribute { values, ..attribute.clone() }
            })
            .collect();
        let colours = colours.map_or_else(Vec::new, |columns| {
            let full = colour_range(&set.attributes, columns);
            let byte = |v: f64| (255.0 * v / full).round() as u8;
            let value = |column: usize, v: usize| attributes.get(column).and_then(|a| a.values.get(v)).copied();
            (0..vertices.len()).map(|v| columns.map(|column| value(column, v).map_or(0, byte))).collect()
        });
        Self { support: around.distances(), attributes, colours }
    }
}
