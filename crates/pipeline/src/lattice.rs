//! The box around the points and its lattices, nested and as fine as the points ask for.

pub(crate) mod cell_widths;
pub(crate) mod domain;
