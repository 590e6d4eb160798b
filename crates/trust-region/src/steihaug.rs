//! Truncated conjugate gradients for the trust-region sub-problem (Toint 1981, Steihaug 1983).

use zeroset_multigrid::StepNorm;

use crate::quadratic_model::Complement;
use crate::report::SubProblemEnd;
use crate::rows::dot;

/// A trial step.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub(crate) g: Vec<f64>,
    /// Length of `g` in the norm of the trust region.
    pub(crate) norm: f64,
    /// `Q(0) − Q(g)`.
    pub(crate) predicted_decrease: f64,
    pub(crate) cg_steps: usize,
    pub(crate) end: SubProblemEnd,
}

/// When to leave the conjugate gradients.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Truncation {
    pub(crate) radius: f64,
    pub(crate) most_steps: usize,
    pub(crate) tolerance: f64,
}

/// Lowers `Q(g) = bᵀg + ½ gᵀMg` over the complement and inside `gᵀPg ≤ radius²`, P being the preconditioner: along the
/// conjugate directions until the boundary, a direction of negative curvature, or the end of [`Truncation`].
///
/// The iterates grow in the norm of P (Steihaug 1983, theorem 2.1), so that the first to leave the ball ends it.
pub(crate) fn steihaug(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    gradient: &[f64],
    complement: &Complement,
    truncation: &Truncation,
) -> Step {
    let preconditioned = |r: &[f64]| {
        let mut z = precondition(r);
        complement.project(&mut z);
        z
    };
    let mut g = vec![0.0; gradient.len()];
    let mut r = gradient.to_vec();
    let z = preconditioned(&r);
    let mut rz = dot(&r, &z);
    let first = rz;
    let mut p: Vec<f64> = z.iter().map(|z| -z).collect();
    let mut norm = StepNorm::new(rz);
    let mut steps = 0;
    let mut end = SubProblemEnd::Truncated;
    if rz <= 0.0 || rz.is_nan() {
        end = SubProblemEnd::Interior;
    }
    while end == SubProblemEnd::Truncated && steps < truncation.most_steps {
        let mp = apply(&p);
        steps += 1;
        let curvature = dot(&p, &mp);
        let alpha = rz / curvature;
        // Written so that a curvature that is not a number counts as negative.
        let convex = curvature > 0.0;
        if !convex || norm.reaches(alpha, truncation.radius) {
            end = if convex { SubProblemEnd::Boundary } else { SubProblemEnd::NegativeCurvature };
            // Without a bound there is nothing to walk to: keep what there is.
            if truncation.radius.is_finite() {
                let tau = norm.cut(truncation.radius);
                advance(&mut g, &p, tau);
                advance(&mut r, &mp, tau);
            }
            break;
        }
        advance(&mut g, &p, alpha);
        advance(&mut r, &mp, alpha);
        norm.advance(alpha);
        let z = preconditioned(&r);
        let next = dot(&r, &z);
        // A preconditioner that is not positive, or rounding: no further direction can be trusted.
        if next <= 0.0 || next.is_nan() || next.sqrt() <= truncation.tolerance * first.sqrt() {
            end = SubProblemEnd::Interior;
            break;
        }
        let beta = next / rz;
        rz = next;
        norm.turn(beta, rz);
        p.iter_mut().zip(&z).for_each(|(p, z)| *p = beta * *p - z);
    }
    // r = b + M g, so that bᵀg + ½ gᵀMg = ½ gᵀ(b + r).
    let predicted_decrease = -0.5 * (dot(&g, gradient) + dot(&g, &r));
    Step { g, norm: norm.length(), predicted_decrease, cg_steps: steps, end }
}

fn advance(x: &mut [f64], p: &[f64], length: f64) {
    x.iter_mut().zip(p).for_each(|(x, p)| *x += length * p);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_radius_is_measured_in_the_norm_of_the_preconditioner(
            m in proptest::collection::vec(0.1..10.0f64, 6),
            p in proptest::collection::vec(0.1..10.0f64, 6),
            b in proptest::collection::vec(-1.0..1.0f64, 6),
            radius in 0.01..3.0f64,
        ) {
            let normal = vec![1.0; 6];
            let inverse = |r: &[f64]| -> Vec<f64> { r.iter().zip(&p).map(|(r, p)| r / p).collect() };
            let complement = Complement::new(&normal, inverse(&normal));
            let operator = |x: &[f64]| -> Vec<f64> { x.iter().zip(&m).map(|(x, m)| x * m).collect() };
            let truncation = Truncation { radius, most_steps: 100, tolerance: 1e-12 };
            let step = steihaug(operator, inverse, &b, &complement, &truncation);
            let norm = step.g.iter().zip(&p).map(|(g, p)| g * g * p).sum::<f64>().sqrt();
            // The recurrence against the norm itself: a few dozen products.
            prop_assert!((norm - step.norm).abs() < 1e-9 * (1.0 + norm));
            prop_assert!(norm <= radius * (1.0 + 1e-9));
            let decrease = -dot(&b, &step.g) - 0.5 * dot(&step.g, &operator(&step.g));
            prop_assert!((decrease - step.predicted_decrease).abs() < 1e-10 * (1.0 + decrease));
            prop_assert!(decrease >= 0.0);
            if step.end == SubProblemEnd::Interior {
                // M g + b is a multiple of the normal: all its entries are equal.
                let residual: Vec<f64> = operator(&step.g).iter().zip(&b).map(|(m, b)| m + b).collect();
                prop_assert!(residual.iter().all(|r| (r - residual[0]).abs() < 1e-8));
            }
        }
    }

    #[test]
    fn negative_curvature_leads_to_the_boundary() {
        let complement = Complement::new(&[0.0, 0.0, 1.0], vec![0.0, 0.0, 1.0]);
        let truncation = Truncation { radius: 2.0, most_steps: 10, tolerance: 1e-12 };
        let operator = |x: &[f64]| vec![-x[0], x[1], x[2]];
        let step = steihaug(operator, |r| r.to_vec(), &[1.0, 0.0, 5.0], &complement, &truncation);
        assert_eq!(step.end, SubProblemEnd::NegativeCurvature);
        assert!((step.g[0] + 2.0).abs() < 1e-14 && step.g[2].abs() < 1e-14);
        assert!((step.predicted_decrease - 4.0).abs() < 1e-13, "bᵀg = −2, ½ gᵀMg = −2");
    }
}
