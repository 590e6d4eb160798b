//! The box lattice: cubic cells of side h, values at the nodes.

/// Largest coordinate of a node: differences of coordinates, and lengths, stay finite.
pub(crate) const MAX_COORDINATE: f64 = 1e300;

/// A box of nodes, `spacing` apart on every axis, starting at `origin`. Its cells are cubes.
///
/// Axis order is x, y\[, z\]; arrays over the nodes have the shape [`Lattice::shape`] in C order (last axis fastest).
/// `D` is 2 or 3; anything else does not compile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice<const D: usize> {
    origin: [f64; D],
    spacing: f64,
    shape: [usize; D],
}

/// Why a lattice was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LatticeError {
    /// A coordinate of the first node is NaN or infinite.
    #[error("the lattice's origin has the coordinate {value} on axis {axis}; it must be finite")]
    Origin {
        /// Axis, 0 for x.
        axis: usize,
        /// The coordinate as given.
        value: f64,
    },
    /// The spacing is not a positive, finite number.
    #[error("the lattice's spacing is {spacing}; it must be positive and finite")]
    Spacing {
        /// The spacing as given.
        spacing: f64,
    },
    /// An axis has fewer than two nodes, so no cell.
    #[error("the lattice has {nodes} node(s) on axis {axis}; it needs at least 2")]
    Shape {
        /// Axis, 0 for x.
        axis: usize,
        /// Number of nodes as given.
        nodes: usize,
    },
    /// More nodes than [`Lattice::MAX_NODES`], possibly more than can be counted.
    #[error("a lattice of {shape:?} nodes is more than the {max} that fit; use a larger spacing")]
    TooManyNodes {
        /// Nodes per axis; a missing third axis is 1.
        shape: [usize; 3],
        /// [`Lattice::MAX_NODES`].
        max: usize,
    },
    /// The spacing is lost beside the coordinates: neighbouring nodes would coincide; or a coordinate
    /// exceeds 1e300.
    #[error(
        "the lattice's nodes on axis {axis} cannot be told apart in f64 (origin {origin}, spacing {spacing}); \
         move the data near zero or use a larger spacing"
    )]
    Unresolved {
        /// Axis, 0 for x.
        axis: usize,
        /// Coordinate of the first node.
        origin: f64,
        /// The spacing as given.
        spacing: f64,
    },
}

impl<const D: usize> Lattice<D> {
    /// The largest number of nodes: 2³⁰, that is 1024³, or 8 GiB for each array of values.
    pub const MAX_NODES: usize = 1 << 30;

    /// The lattice whose first node is `origin`, with `shape` nodes per axis, `spacing` (frame unit) apart.
    ///
    /// # Errors
    /// A coordinate or the spacing is not finite, the spacing is not positive or too small to tell
    /// nodes apart at these coordinates, an axis has fewer than 2 nodes, or there are more than
    /// [`Self::MAX_NODES`] in all.
    pub fn new(origin: [f64; D], spacing: f64, shape: [usize; D]) -> Result<Self, LatticeError> {
        const { assert!(D == 2 || D == 3, "a lattice has 2 or 3 axes") };
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(LatticeError::Spacing { spacing });
        }
        let mut nodes = 1_usize;
        for axis in 0..D {
            if !origin[axis].is_finite() {
                return Err(LatticeError::Origin { axis, value: origin[axis] });
            }
            if shape[axis] < 2 {
                return Err(LatticeError::Shape { axis, nodes: shape[axis] });
            }
            nodes = nodes.saturating_mul(shape[axis]);
        }
        if nodes > Self::MAX_NODES {
            let mut padded = [1; 3];
            padded[..D].copy_from_slice(&shape);
            return Err(LatticeError::TooManyNodes { shape: padded, max: Self::MAX_NODES });
        }
        for axis in 0..D {
            let first = origin[axis];
            let last = first + (shape[axis] - 1) as f64 * spacing;
            // Both ends: the axis may run from far below zero to near it.
            let apart = first + spacing > first && last - spacing < last;
            let in_range = first.abs() <= MAX_COORDINATE && last.abs() <= MAX_COORDINATE;
            if !(in_range && apart) {
                return Err(LatticeError::Unresolved { axis, origin: first, spacing });
            }
        }
        Ok(Self { origin, spacing, shape })
    }

    /// Position of the first node, frame unit.
    pub fn origin(&self) -> [f64; D] {
        self.origin
    }

    /// Distance h between neighbouring nodes, frame unit.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Nodes per axis.
    pub fn shape(&self) -> [usize; D] {
        self.shape
    }

    /// Number of nodes in all.
    pub fn node_count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Position of a node, frame unit: `origin + spacing · index`. Indices beyond the box give positions beyond it.
    pub fn node(&self, index: [usize; D]) -> [f64; D] {
        std::array::from_fn(|axis| self.origin[axis] + self.spacing * index[axis] as f64)
    }

    /// A point in lattice units: node `index` has the integer coordinates `index`.
    pub(crate) fn to_lattice_units(self, point: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|axis| (point[axis] - self.origin[axis]) / self.spacing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_where_the_definition_says() {
        let lattice = Lattice::new([-1.0, 2.0, 0.5], 0.25, [71, 71, 13]).unwrap();
        assert_eq!(lattice.node([0, 0, 0]), [-1.0, 2.0, 0.5]);
        assert_eq!(lattice.node([70, 1, 12]), [16.5, 2.25, 3.5]);
        assert_eq!(lattice.node_count(), 71 * 71 * 13);
    }

    #[test]
    fn each_fault_has_its_own_answer() {
        let refused = |origin, spacing, shape| Lattice::<2>::new(origin, spacing, shape).unwrap_err();
        for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(refused([0.0; 2], spacing, [4, 4]), LatticeError::Spacing { .. }));
        }
        for bad in [f64::NAN, f64::NEG_INFINITY] {
            assert!(matches!(refused([0.0, bad], 1.0, [4, 4]), LatticeError::Origin { axis: 1, .. }));
        }
        for nodes in [0, 1] {
            assert_eq!(refused([0.0; 2], 1.0, [nodes, 4]), LatticeError::Shape { axis: 0, nodes });
        }
        for nodes in [1 << 20, usize::MAX] {
            assert!(matches!(refused([0.0; 2], 1.0, [nodes; 2]), LatticeError::TooManyNodes { .. }));
        }
        // 1e-9 at 5e8 is below the spacing of f64 there (6e-8).
        assert!(matches!(refused([0.0, 5e8], 1e-9, [4, 4]), LatticeError::Unresolved { axis: 1, .. }));
        assert!(matches!(refused([1e308, 0.0], 1e308, [4, 4]), LatticeError::Unresolved { axis: 0, .. }));
    }
}
