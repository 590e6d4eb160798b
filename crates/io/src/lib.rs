//! Reading points; writing meshes, curves, splines and fields
