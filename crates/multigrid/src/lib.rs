//! The normal operator of a B-spline fit to weighted points with fairness, and its solvers
