//! How the zero set hangs together: the sides of cells and nodes, where two functions differ in it, and where it hangs on little.

pub(crate) mod cell_sides;
pub(crate) mod floods;
pub(crate) mod fragile;
pub(crate) mod neighbours;
pub(crate) mod node_graph;
pub(crate) mod node_parts;
pub(crate) mod shallow;
pub(crate) mod simplified;
pub(crate) mod strays;
pub(crate) mod topology_changes;
