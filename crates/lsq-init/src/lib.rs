//! Least-squares B-spline through values on a lattice, with thin-plate fairness
