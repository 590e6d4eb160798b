//! The faults: one changed place each, of the kind that slips into numerical code.

/// A fault to plant.
pub struct Fault {
    /// The crate whose tests must fail, by its folder in `crates/`.
    pub folder: &'static str,
    /// File in the crate's `src/`.
    pub file: &'static str,
    /// What stands there exactly once.
    pub right: &'static str,
    /// What is put in its place.
    pub wrong: &'static str,
}

const fn fault(folder: &'static str, file: &'static str, right: &'static str, wrong: &'static str) -> Fault {
    Fault { folder, file, right, wrong }
}

/// All faults, by crate.
pub const FAULTS: &[Fault] = &[
    fault("bspline", "basis.rs", "carried = left[j - r] * share;", "carried = left[j - r] * share * 1.0001;"),
    fault("bspline", "basis.rs", "factor *= (degree + 1 - k) as f64;", "factor *= (degree + 2 - k) as f64;"),
    fault("bspline", "basis.rs", "a[next][k] = -a[current][k - 1]", "a[next][k] = a[current][k - 1]"),
    fault("bspline", "two_scale.rs", "0.125 * (low + high) + 0.75 * middle", "0.25 * (low + high) + 0.5 * middle"),
    fault(
        "bspline",
        "gauss_legendre.rs",
        "2.0 / ((1.0 - x * x) * slope * slope)",
        "2.0 / ((1.0 + x * x) * slope * slope)",
    ),
    fault("bspline", "bounds.rs", "(least.min(*c), most.max(*c))", "(least.min(*c), most.min(*c))"),
    fault("bspline", "edge_cubic.rs", "b + t * (2.0 * c + t * (3.0 * d))", "b + t * (2.0 * c + t * (2.0 * d))"),
    fault("bspline", "energy.rs", "(BINOMIAL[k][a] * g, partial(first + t, k - a))", "(*g, partial(first + t, k - a))"),
    fault("bspline", "tensor.rs", "*o += a * v;", "*o = a * v;"),
    fault("bspline", "knot_vector.rs", "inner.partition_point(|&t| t <= x)", "inner.partition_point(|&t| t < x)"),
    fault(
        "eikonal-sweep",
        "local_solution.rs",
        "simd.greater_than_or_equal_f64s(to_b, one)",
        "simd.greater_than_or_equal_f64s(to_b, simd.splat_f64s(0.5))",
    ),
    fault("eikonal-sweep", "local_solution.rs", "simd.sub_f64s(two, square_b)", "simd.add_f64s(two, square_b)"),
    fault(
        "eikonal-sweep",
        "local_solution.rs",
        "simd.add_f64s(simd.mul_f64s(three, left), simd.mul_f64s(sum, sum))",
        "simd.mul_f64s(three, left)",
    ),
    fault("eikonal-sweep", "rows.rs", "simd.min_f64s(before[l], load::<S>(&next[l + 1..]))", "before[l]"),
    fault("eikonal-sweep", "godunov.rs", "let exact = (radius as f64).powi(2);", "let exact = radius as f64;"),
    fault(
        "winding",
        "opening.rs",
        "self.radius_square <= STEEPEST * STEEPEST * square",
        "self.radius_square <= 4.0 * square",
    ),
    fault(
        "winding",
        "multipole.rs",
        "moments[term.target] += area[term.second] * monomials[term.first];",
        "moments[term.target] -= area[term.second] * monomials[term.first];",
    ),
    fault("winding", "multipole.rs", "point[k] - centre[k]", "centre[k] - point[k]"),
    fault(
        "winding",
        "opening.rs",
        "points.iter().map(square).fold(0.0, f64::max).sqrt()",
        "points.iter().map(square).fold(0.0, f64::max)",
    ),
    fault(
        "winding",
        "tree.rs",
        "self.options.regularisation * self.options.regularisation",
        "self.options.regularisation",
    ),
    fault("isosurface", "root.rs", "values[0] / (values[0] - values[1])", "values[0] / (values[0] + values[1])"),
    fault("isosurface", "root.rs", "if value < 0.0 {", "if value > 0.0 {"),
    fault("isosurface", "interior.rs", "let q2 = a.1 * c.1 - b.1 * d.1;", "let q2 = a.1 * c.1 + b.1 * d.1;"),
    fault("isosurface", "interior.rs", "let t = -0.5 * q1 / q2;", "let t = -q1 / q2;"),
    fault("isosurface", "cell.rs", "if v[0] >= 0.0 { first > second } else { second > first }", "first > second"),
    fault("isosurface", "cell.rs", "if ahead { leave + step } else { leave + 4 - step }", "leave + step"),
    fault(
        "isosurface",
        "mesh.rs",
        "components as i64 - (euler_characteristic + boundary_loops as i64).div_euclid(2)",
        "components as i64 - euler_characteristic.div_euclid(2)",
    ),
    fault("isosurface", "regions.rs", "let conormal = cross(across, &along);", "let conormal = cross(&along, across);"),
    fault("isosurface", "regions.rs", "leaf == 1 && sum >= least", "leaf == 1"),
    fault("multigrid", "conjugate_gradients.rs", "square / before, &z", "before / square, &z"),
    fault(
        "multigrid",
        "step_norm.rs",
        "self.xx + 2.0 * alpha * self.xp + alpha * alpha * self.pp",
        "self.xx + alpha * self.xp + alpha * alpha * self.pp",
    ),
    fault("multigrid", "smoother.rs", "diagonal.iter().map(|d| 1.0 / d.sqrt())", "diagonal.iter().map(|d| 1.0 / d)"),
    fault("multigrid", "stiff_points.rs", "x[at] - a * (before + after)", "x[at] + a * (before + after)"),
    fault("multigrid", "separable_energy.rs", "s * e0 + 2.0 * k * e1 + m * e2", "s * e0 + k * e1 + m * e2"),
    fault(
        "multigrid",
        "transfer.rs",
        "let counts = |e: &f64| e.abs() > 1e-15;",
        "let counts = |e: &f64| e.abs() > 0.2;",
    ),
    fault("multigrid", "smoother.rs", "0.5 * (upper + lower)", "0.5 * (upper - lower)"),
    fault(
        "lsq-init",
        "fit.rs",
        "let right = right_side(&sampling.each_ref().map(Banded::transposed), phi);",
        "let mut right = right_side(&sampling.each_ref().map(Banded::transposed), phi);\n    right[0] *= 1.01;",
    ),
    fault("lsq-init", "fit.rs", "if residual.is_nan() || residual > options.tolerance {", "if residual.is_nan() {"),
    fault(
        "lsq-init",
        "fit.rs",
        "let determined = |axis: usize| match weight > 0.0 {",
        "let determined = |axis: usize| match weight >= 0.0 {",
    ),
    fault("gefm", "tridiagonal.rs", "diagonal[i] + reach(i)", "diagonal[i] + 0.1 * reach(i)"),
    fault("gefm", "tridiagonal.rs", "vector[i] += factor * vector[i - 1];", "vector[i] -= factor * vector[i - 1];"),
    fault("gefm", "lanczos.rs", "let share = dot(&next_image, v);", "let share = 0.9 * dot(&next_image, v);"),
    fault(
        "trust-region",
        "sampson.rs",
        "if state.floored[i] { 0.0 } else { -state.residuals[i] / state.norms[i].powi(2) }",
        "if state.floored[i] { 0.0 } else { state.residuals[i] / state.norms[i].powi(2) }",
    ),
    fault(
        "trust-region",
        "quadratic_model.rs",
        "gradient.iter_mut().for_each(|b| *b *= 2.0);",
        "gradient.iter_mut().for_each(|b| *b *= 1.0);",
    ),
    fault("trust-region", "quadratic_model.rs", "*z -= across * d", "*z += across * d"),
    fault(
        "trust-region",
        "iteration.rs",
        "pub(crate) const ACCEPT: f64 = 0.1;",
        "pub(crate) const ACCEPT: f64 = -10.0;",
    ),
    fault("pipeline", "phi/crossings.rs", "a / (a - b)", "a / (a + b)"),
    fault(
        "pipeline",
        "lattice/domain.rs",
        "2 * (0.5 * side / spacing + margin).ceil() as usize",
        "(side / spacing + margin).ceil() as usize",
    ),
    fault("gefm", "ladder.rs", "> LEFT * self.heard.len()", "> 2.0 * self.heard.len()"),
    fault("gefm", "ladder.rs", "known.ratio < ratio", "known.ratio > ratio"),
    fault("gefm", "ladder.rs", "score >= doubtful && other", "other"),
    fault("gefm", "pieces.rs", "is_turned[piece] ^= true;", ""),
    fault("gefm", "pieces.rs", "STAY.min(count / 3)", "0"),
    fault("pipeline", "trust/gaps/curve.rs", "parts.iter().all(", "parts.iter().any("),
    fault("pipeline", "topology/shallow.rs", "self.still_joined(&keys, !inside, parts)", "true"),
    fault("pipeline", "topology/neighbours.rs", "dimension % 2 == 0", "dimension % 2 == 1"),
    fault("trust-region", "within_bounds.rs", "*b = -*b - e", "*b = e - *b"),
    fault("pipeline", "refinement/mistakes.rs", "Some(is_off) => is_off &&", "Some(is_off) => !is_off &&"),
    fault("pipeline", "points/thinning.rs", "left_out[index] = false;", "left_out[index] = index % 2 == 0;"),
    fault("pipeline", "sides/averaging.rs", "(spacing * depth / LEFT).sqrt()", "spacing * depth / LEFT"),
    fault("gefm", "patches.rs", "cosine < OPPOSED", "cosine > OPPOSED"),
    fault("gefm", "noise.rs", "median / MEDIAN_DIFFERENCE", "median * MEDIAN_DIFFERENCE"),
    fault(
        "pipeline",
        "points/frame.rs",
        "point[axis] / self.scale + self.origin[axis]",
        "point[axis] / self.scale - self.origin[axis]",
    ),
    fault(
        "pipeline",
        "points/support.rs",
        "remoteness: distance / (FARTHEST * self.local[sample])",
        "remoteness: distance / self.local[sample]",
    ),
    fault("pipeline", "points/far_off.rs", "sorted[i + 1] / GAP > sorted[i]", "sorted[i + 1] > sorted[i]"),
    fault("pipeline", "trust/one_sided.rs", "&& in_plane(&normals[i])", ""),
];
