//! Generalized eigenvector fitting: a B-spline whose sign tells inside from outside, from points without normals
