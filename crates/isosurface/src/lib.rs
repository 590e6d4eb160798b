//! The zero set of a B-spline as a closed manifold mesh or closed polylines
