//! Distance to a point set on a lattice: Godunov fast sweeping, closest-point sweeping, exact
