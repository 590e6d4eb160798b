//! The global sign.

use zeroset_bspline::Collocation;

/// `Σ aᵢ nᵢ · (Pᵢ − c)` with `n = ∇f / ‖∇f‖`: `D` times the enclosed volume by Gauss' theorem, so positive when the
/// gradients point outward. (Area weights with mean 1: in units of the mean area.)
pub(crate) fn enclosed_volume<const D: usize>(
    collocation: &Collocation<D>,
    points: &[[f64; D]],
    areas: &[f64],
    f: &[f64],
) -> f64 {
    let total: f64 = areas.iter().sum();
    let centre: [f64; D] =
        std::array::from_fn(|axis| points.iter().zip(areas).map(|(p, a)| a * p[axis]).sum::<f64>() / total);
    collocation
        .gradients(f)
        .iter()
        .zip(points.iter().zip(areas))
        .map(|(g, (p, a))| {
            let norm = g.iter().map(|g| g * g).sum::<f64>().sqrt();
            let along: f64 = (0..D).map(|axis| g[axis] * (p[axis] - centre[axis])).sum();
            if norm > 0.0 { a * along / norm } else { 0.0 }
        })
        .sum()
}
