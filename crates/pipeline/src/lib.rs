//! Raw points in, a smooth implicit B-spline curve or surface out: no normals needed
