//! Approximate inverses of the model's matrix.

use zeroset_bspline::KnotVector;
use zeroset_multigrid::{Factor, Multigrid, NormalEquations};

use crate::error::Error;
use crate::objective::Objective;
use crate::options::{Options, Preconditioner};
use crate::quadratic_model::QuadraticModel;
use crate::rows::dot;

/// Terms of the Chebyshev polynomial: one more than the products with the operator.
const CHEBYSHEV_TERMS: usize = 3;

/// The polynomial damps the part of the spectrum above `λ_max` over this.
const CHEBYSHEV_RATIO: f64 = 30.0;

/// Power iterations for `λ_max`, and what is added because they approach it from below.
const POWER_STEPS: usize = 10;
const POWER_MARGIN: f64 = 1.2;

/// What stays while the model changes.
#[derive(Debug)]
pub(crate) enum Kind<const D: usize> {
    Cholesky(NormalEquations<D>),
    /// The lattices that lead to that of the unknowns, and the points.
    Multigrid {
        coarse: [KnotVector; D],
        halvings: u32,
        points: Vec<[f64; D]>,
    },
    /// Diagonal of `H`.
    Chebyshev(Vec<f64>),
    /// Diagonal of `H`.
    Jacobi(Vec<f64>),
    None,
}

/// `P⁻¹` for one model.
#[derive(Debug)]
pub(crate) enum Inverse<const D: usize> {
    Cholesky(Factor),
    Multigrid(Multigrid<D>),
    Chebyshev { inverse_diagonal: Vec<f64>, largest: f64 },
    Jacobi { inverse_diagonal: Vec<f64> },
    None,
}

impl<const D: usize> Kind<D> {
    pub(crate) fn choose(knots: &[KnotVector; D], objective: &Objective<D>, options: &Options) -> Self {
        let energy = &objective.energy;
        let small = |knots: &[KnotVector; D]| count(knots) <= options.direct_limit;
        let nested = || {
            let (coarse, halvings) = coarsest(knots, options.direct_limit);
            let points = objective.fitted.points.clone();
            small(&coarse).then_some(Self::Multigrid { coarse, halvings, points })
        };
        let polynomial = || Self::Chebyshev(energy.diagonal());
        match options.preconditioner {
            Preconditioner::Automatic if small(knots) => Self::Cholesky(NormalEquations::new(energy)),
            // The V-cycle knows nothing of springs.
            Preconditioner::Automatic if !options.stiffness.is_empty() => polynomial(),
            Preconditioner::Cholesky => Self::Cholesky(NormalEquations::new(energy)),
            Preconditioner::Automatic | Preconditioner::Multigrid => nested().unwrap_or_else(polynomial),
            Preconditioner::Chebyshev => polynomial(),
            Preconditioner::Jacobi => Self::Jacobi(energy.diagonal()),
            Preconditioner::None => Self::None,
        }
    }

    pub(crate) fn invert(&self, model: &QuadraticModel<'_, D>) -> Result<Inverse<D>, Error> {
        Ok(match self {
            Self::Cholesky(equations) => Inverse::Cholesky(factor(equations, model)?),
            Self::Multigrid { coarse, halvings, points } => {
                let weights: Vec<f64> = model.jacobian.alpha.iter().map(|alpha| alpha * alpha).collect();
                Inverse::Multigrid(Multigrid::new(coarse, *halvings, points, &weights, model.weight)?)
            }
            Self::Chebyshev(energy) => {
                let inverse_diagonal = inverse(&model.diagonal(energy));
                let largest = largest_eigenvalue(model, &inverse_diagonal);
                Inverse::Chebyshev { inverse_diagonal, largest }
            }
            Self::Jacobi(energy) => Inverse::Jacobi { inverse_diagonal: inverse(&model.diagonal(energy)) },
            Self::None => Inverse::None,
        })
    }
}

/// Number of control coefficients.
fn count<const D: usize>(knots: &[KnotVector; D]) -> usize {
    knots.iter().map(KnotVector::basis_count).product()
}

/// The coarsest lattice whose cells are halved so often until they are these, or the first one that has few enough coefficients.
fn coarsest<const D: usize>(knots: &[KnotVector; D], few: usize) -> ([KnotVector; D], u32) {
    let (mut coarse, mut halvings) = (knots.clone(), 0);
    while count(&coarse) > few {
        let doubled = coarse.each_ref().map(KnotVector::doubled);
        if doubled.iter().any(Option::is_none) {
            break;
        }
        for (coarse, doubled) in coarse.iter_mut().zip(doubled) {
            *coarse = doubled.unwrap_or_else(|| coarse.clone());
        }
        halvings += 1;
    }
    (coarse, halvings)
}

/// Factors `JᵀJ + wH`. It is singular along `f` where `f` has no energy, as a plane does; then `Σ qᵢqᵢᵀ/‖∇f‖² + wH` of
/// equation (7) takes its place, which differs by the distances over the cell size.
fn factor<const D: usize>(equations: &NormalEquations<D>, model: &QuadraticModel<'_, D>) -> Result<Factor, Error> {
    let (collocation, alpha) = (model.jacobian.collocation(), &model.jacobian.alpha);
    let springs: Vec<f64> = model.anchor.stiffness().iter().map(|k| model.weight * k).collect();
    let factored = |beta: Option<&[[f64; D]]>| -> Result<Factor, Error> {
        let mut matrix = equations.rows(collocation, alpha, beta, model.weight)?;
        if !springs.is_empty() {
            matrix.add_diagonal(&springs);
        }
        Ok(equations.factor(&matrix)?)
    };
    factored(Some(&model.jacobian.beta)).or_else(|_| factored(None))
}

fn inverse(diagonal: &[f64]) -> Vec<f64> {
    // Every basis function has energy on some span, so that no entry is zero unless it underflows.
    diagonal.iter().map(|&d| if d > 0.0 { 1.0 / d } else { 1.0 }).collect()
}

/// Power iteration on the operator scaled by its diagonal, from fixed pseudo-random signs.
fn largest_eigenvalue<const D: usize>(model: &QuadraticModel<'_, D>, inverse_diagonal: &[f64]) -> f64 {
    let roots: Vec<f64> = inverse_diagonal.iter().map(|d| d.sqrt()).collect();
    let sign = |i: usize| if (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63 == 0 { 1.0 } else { -1.0 };
    let mut x: Vec<f64> = (0..roots.len()).map(sign).collect();
    let mut largest = 1.0;
    for _ in 0..POWER_STEPS {
        let norm = dot(&x, &x).sqrt();
        let scaled: Vec<f64> = x.iter().zip(&roots).map(|(x, d)| x / norm * d).collect();
        x = model.apply(&scaled);
        x.iter_mut().zip(&roots).for_each(|(x, d)| *x *= d);
        largest = dot(&x, &x).sqrt().max(f64::MIN_POSITIVE);
    }
    POWER_MARGIN * largest
}

impl<const D: usize> Inverse<D> {
    /// `P⁻¹ r`.
    pub(crate) fn apply(&self, model: &QuadraticModel<'_, D>, r: &[f64]) -> Vec<f64> {
        match self {
            Self::None => r.to_vec(),
            Self::Jacobi { inverse_diagonal } => r.iter().zip(inverse_diagonal).map(|(r, d)| r * d).collect(),
            Self::Cholesky(factor) => {
                // The factor is of half of M.
                let mut z = factor.solve(r);
                z.iter_mut().for_each(|z| *z *= 0.5);
                z
            }
            Self::Multigrid(solver) => {
                // As above, of `Σ qᵢqᵢᵀ/‖∇f‖² + wH`.
                let mut z = vec![0.0; r.len()];
                solver.precondition(r, &mut z);
                z.iter_mut().for_each(|z| *z *= 0.5);
                z
            }
            Self::Chebyshev { inverse_diagonal, largest } => chebyshev(model, r, inverse_diagonal, *largest),
        }
    }
}

/// The Chebyshev semi-iteration from zero for `[λ_max / ratio, λ_max]` (Saad 2003, algorithm 12.1): a fixed polynomial in
/// the scaled operator, positive on its spectrum.
fn chebyshev<const D: usize>(
    model: &QuadraticModel<'_, D>,
    r: &[f64],
    inverse_diagonal: &[f64],
    largest: f64,
) -> Vec<f64> {
    let smallest = largest / CHEBYSHEV_RATIO;
    let (centre, half) = (0.5 * (largest + smallest), 0.5 * (largest - smallest));
    let sigma = centre / half;
    let mut rho = 1.0 / sigma;
    let mut d: Vec<f64> = r.iter().zip(inverse_diagonal).map(|(r, w)| r * w / centre).collect();
    let mut z = d.clone();
    for _ in 1..CHEBYSHEV_TERMS {
        let applied = model.apply(&z);
        let next = 1.0 / (2.0 * sigma - rho);
        for i in 0..z.len() {
            d[i] = next * rho * d[i] + 2.0 * next / half * inverse_diagonal[i] * (r[i] - applied[i]);
        }
        z.iter_mut().zip(&d).for_each(|(z, d)| *z += d);
        rho = next;
    }
    z
}
