//! The far field of a node: Taylor terms of order 0, 1 and 2 about its centre.

use crate::kernel::power;

/// Moments of the dipoles `nᵢ` at offsets `pᵢ` from a centre, as polynomials in `R`, the centre as seen from the query.
///
/// With `s = ‖R‖² + ε²` and `φ_k` from [`Moments::field`], the sum of `nᵢ·(R + pᵢ) / s(R + pᵢ)^(D/2)` is, up to third order,
///
/// ```text
/// φ₁ (N(R) + t) − φ₂ (Q(R) + ½ v·R) + ½ φ₃ O(R),
/// N(R) = Σ nᵢ·R,  Q(R) = Σ (nᵢ·R)(pᵢ·R),  O(R) = Σ (nᵢ·R)(pᵢ·R)²,
/// t = Σ nᵢ·pᵢ,    v = Σ 2 (nᵢ·pᵢ) pᵢ + ‖pᵢ‖² nᵢ.
/// ```
///
/// The polynomials keep one coefficient per monomial `i ≤ j (≤ k)`, in lexicographic order; in 2D only 3 and 4 are used.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments<const D: usize>
where
    [f64; D]: Sized,
{
    linear: Vector<D>,
    vector: Vector<D>,
    trace: f64,
    quadratic: [f64; 6],
    cubic: [f64; 10],
}

#[derive(Debug, Clone, Copy)]
struct Vector<const D: usize>([f64; D]);

impl<const D: usize> Default for Vector<D> {
    fn default() -> Self {
        Self([0.0; D])
    }
}
