//! Points, before any function is fitted to them: their frame, how densely they lie, which of them are left out.

pub(crate) mod far_off;
pub(crate) mod frame;
pub(crate) mod heavy_tails;
pub(crate) mod isolated;
pub(crate) mod kd_tree;
pub(crate) mod known_normals;
pub(crate) mod left_out;
pub(crate) mod lines;
pub(crate) mod repetitions;
pub(crate) mod roundness;
pub(crate) mod rows;
pub(crate) mod spacing;
pub(crate) mod support;
pub(crate) mod thinning;
