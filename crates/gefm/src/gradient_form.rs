//! Gradients at the points, weighted by the areas of the points.

use zeroset_bspline::Collocation;

use crate::lanczos::dot;

/// `aᵢ ∇f(Pᵢ) / ‖∇f(Pᵢ)‖`: the area vectors of oriented points, by Gauss' theorem what winding numbers, volumes and J_1
/// are made of. Zero where the gradient vanishes, which has no direction.
///
/// One gradient and one area per point; the result is in the areas' unit.
pub fn area_vectors<const D: usize>(gradients: &[[f64; D]], areas: &[f64]) -> Vec<[f64; D]> {
    gradients
        .iter()
        .zip(areas)
        .map(|(g, area)| {
            let norm = dot(g, g).sqrt();
            g.map(|g| if norm > 0.0 { area * g / norm } else { 0.0 })
        })
        .collect()
}

/// `B f = Σ aᵢ Gᵢᵀ Gᵢ f`, with `Gᵢ f = ∇f(Pᵢ)`: the matrix of equation (8).
pub(crate) fn apply_b<const D: usize>(collocation: &Collocation<D>, areas: &[f64], f: &[f64]) -> Vec<f64> {
    let mut gradients = collocation.gradients(f);
    gradients.iter_mut().zip(areas).for_each(|(g, a)| *g = g.map(|g| g * a));
    let mut out = vec![0.0; f.len()];
    collocation.add_gradients_transposed(&gradients, &mut out);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::KnotVector;

    #[test]
    fn area_vectors_have_the_areas_as_lengths() {
        let vectors = area_vectors(&[[3.0, -4.0], [0.0, 0.0], [0.0, 2.0]], &[10.0, 1.0, 0.5]);
        assert_eq!(vectors, [[6.0, -8.0], [0.0, 0.0], [0.0, 0.5]]);
    }

    #[test]
    fn b_is_the_form_of_the_squared_gradients() {
        let knots = KnotVector::uniform(2, 0.0, 0.5, 3).unwrap();
        let points = [[0.1, 0.2], [0.7, 1.4], [1.2, 0.6]];
        let areas = [0.5, 2.0, 0.0];
        let collocation = Collocation::new(&[knots.clone(), knots], &points).unwrap();
        let f: Vec<f64> = (0..25).map(|i| f64::from(i * i % 7)).collect();
        let squares = collocation.gradients(&f);
        let expected: f64 = squares.iter().zip(&areas).map(|(g, a)| a * dot(g, g)).sum();
        let form = dot(&f, &apply_b(&collocation, &areas, &f));
        // Rounding only.
        assert!((form - expected).abs() < 1e-12 * expected, "{form} {expected}");
    }
}
