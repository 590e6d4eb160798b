//! What files say of each point beside its place: colours, intensities, labels.

/// The type of the numbers of an attribute, as PLY has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NumberKind {
    /// Signed, 8 bits.
    I8,
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 32 bits.
    U32,
    /// Floating point, 32 bits.
    F32,
    /// Floating point, 64 bits.
    F64,
}

impl NumberKind {
    /// Whether values between two others have no meaning: labels and counts.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// One number per point, under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// As in the file; no two of a point set are alike, upper and lower case being the same.
    pub name: String,
    /// The type that the numbers had, and are to be written with.
    pub kind: NumberKind,
    /// In the order of the points, all finite.
    pub values: Vec<f64>,
}

/// The names of colours, of which there are three or none.
const COLOURS: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]];

/// Where the colours are among the attributes, if there are any: red, green, blue.
pub fn colour_columns(attributes: &[Attribute]) -> Option<[usize; 3]> {
    COLOURS.iter().find_map(|names| {
        let found = names.map(|name| attributes.iter().position(|a| a.name.eq_ignore_ascii_case(name)));
        match found {
            [Some(red), Some(green), Some(blue)] => Some([red, green, blue]),
            _ => None,
        }
    })
}

/// The number that stands for full light: 1 in floating point where nothing is above it, else 255, or 65 535 in 16 bits where something
/// is above 255.
pub fn colour_range(attributes: &[Attribute], columns: [usize; 3]) -> f64 {
    let columns = || columns.iter().filter_map(|c| attributes.get(*c));
    let largest = columns().flat_map(|a| &a.values).copied().fold(0.0, f64::max);
    match columns().all(|a| !a.kind.is_integer()) {
        true if largest <= 1.0 => 1.0,
        _ if largest <= 255.0 => 255.0,
        _ => 65_535.0,
    }
}

/// A coordinate or a component of a normal, which is no attribute.
pub(crate) fn is_geometry(name: &str) -> bool {
    ["x", "y", "z", "nx", "ny", "nz"].iter().any(|known| name.eq_ignore_ascii_case(known))
}
