//! Algebraic tensor-product B-splines, equation (1).

use ndarray::{ArrayD, Dimension};
use thiserror::Error;

use crate::basis::Basis;
use crate::knot_vector::{KnotError, KnotVector};
use crate::local::{Place, contract, value_and_gradient, weights};
use crate::tensor::strides;

/// Why a spline could not be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SplineError {
    /// The coefficient array does not have one entry per product of basis functions.
    #[error("control coefficients of shape {found:?} do not fit knot vectors that carry {needed:?} basis functions")]
    Shape {
        /// Shape given.
        found: Vec<usize>,
        /// Shape that the knot vectors ask for.
        needed: Vec<usize>,
    },
    /// A control coefficient is NaN or infinite.
    #[error("control coefficient {0:?} is not a finite number")]
    NotFinite(Vec<usize>),
    /// New knots were refused.
    #[error(transparent)]
    Knots(#[from] KnotError),
}

/// Value, gradient and Hessian of a function at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet<const D: usize> {
    /// `f`.
    pub value: f64,
    /// `∇f`.
    pub gradient: [f64; D],
    /// `∇²f`, symmetric.
    pub hessian: [[f64; D]; D],
}

/// A tensor-product B-spline `f(x) = Σ c_rst M_r(x) N_s(y) O_t(z)` (equation 1) on the box of its knot vectors' domains.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline<const D: usize> {
    knots: [KnotVector; D],
    coefficients: ArrayD<f64>,
    shape: [usize; D],
}

impl<const D: usize> Spline<D> {
    /// Joins knot vectors and control coefficients (shape `m × n [× o]`).
    ///
    /// # Errors
    /// A shape that does not fit the knot vectors, or a coefficient that is not finite.
    pub fn new(knots: [KnotVector; D], coefficients: ArrayD<f64>) -> Result<Self, SplineError> {
        let shape = knots.each_ref().map(KnotVector::basis_count);
        if coefficients.shape() != shape {
            return Err(SplineError::Shape { found: coefficients.shape().to_vec(), needed: shape.to_vec() });
        }
        // Iterating without indices is many times faster.
        if !coefficients.iter().all(|c| c.is_finite()) {
            let bad = coefficients.indexed_iter().find(|(_, c)| !c.is_finite()).map(|(index, _)| index);
            return Err(SplineError::NotFinite(bad.map(|index| index.slice().to_vec()).unwrap_or_default()));
        }
        let coefficients =
            if coefficients.is_standard_layout() { coefficients } else { coefficients.as_standard_layout().to_owned() };
        Ok(Self { knots, coefficients, shape })
    }

    /// As [`Spline::new`] with the coefficients in C order, as the fits deliver them.
    ///
    /// # Errors
    /// As [`Spline::new`].
    pub fn from_flat(knots: [KnotVector; D], coefficients: Vec<f64>) -> Result<Self, SplineError> {
        let shape = knots.each_ref().map(KnotVector::basis_count).to_vec();
        let found = vec![coefficients.len()];
        let array = ArrayD::from_shape_vec(shape.clone(), coefficients)
            .map_err(|_| SplineError::Shape { found, needed: shape })?;
        Self::new(knots, array)
    }

    /// The knot vectors, one per axis.
    pub fn knots(&self) -> &[KnotVector; D] {
        &self.knots
    }

    /// Number of control coefficients along each axis.
    pub fn shape(&self) -> [usize; D] {
        self.shape
    }

    /// The control coefficients, shape `m × n [× o]`, in standard layout.
    pub fn coefficients(&self) -> &ArrayD<f64> {
        &self.coefficients
    }

    /// The control coefficients in C order: the vector **f** of the paper.
    pub fn as_flat(&self) -> &[f64] {
        self.coefficients.as_slice().unwrap_or_default()
    }

    /// The box `(lower corner, upper corner)` on which the spline is defined.
    pub fn domain(&self) -> ([f64; D], [f64; D]) {
        (self.knots.each_ref().map(|k| k.domain().0), self.knots.each_ref().map(|k| k.domain().1))
    }

    /// Whether a point lies in the box, its faces included.
    pub fn contains(&self, x: &[f64; D]) -> bool {
        let (lower, upper) = self.domain();
        (0..D).all(|axis| x[axis] >= lower[axis] && x[axis] <= upper[axis])
    }

    /// `f(x)`; NaN outside the box.
    pub fn value(&self, x: &[f64; D]) -> f64 {
        match self.basis(x, 0) {
            Some(basis) => self.partial(&basis, [0; D]),
            None => f64::NAN,
        }
    }

    /// `f(x)` and `∇f(x)`; all NaN outside the box.
    pub fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
        match self.basis(x, 1) {
            Some(basis) => value_and_gradient(self.as_flat(), &Place::new(&strides(&self.shape), &basis), &basis),
            None => (f64::NAN, [f64::NAN; D]),
        }
    }

    /// `f(x)`, `∇f(x)` and `∇²f(x)`; all NaN outside the box.
    pub fn jet(&self, x: &[f64; D]) -> Jet<D> {
        let Some(basis) = self.basis(x, 2) else {
            return Jet { value: f64::NAN, gradient: [f64::NAN; D], hessian: [[f64::NAN; D]; D] };
        };
        jet_at(self.as_flat(), &strides(&self.shape), &basis)
    }

    /// The same function times a factor.
    ///
    /// # Errors
    /// If a coefficient overflows.
    pub fn scaled(&self, factor: f64) -> Result<Self, SplineError> {
        Self::new(self.knots.clone(), &self.coefficients * factor)
    }

    /// The function plus a constant: the basis functions sum to 1, so that every coefficient grows by it.
    ///
    /// # Errors
    /// If a coefficient overflows, or the constant is not finite.
    pub fn plus_constant(&self, constant: f64) -> Result<Self, SplineError> {
        Self::new(self.knots.clone(), &self.coefficients + constant)
    }

    /// The function in other coordinates: `y = scale · x + shift`, and values times `scale`, so that a signed distance
    /// stays one.
    ///
    /// # Errors
    /// If the map makes knots coincide or overflow.
    pub fn mapped(&self, scale: f64, shift: [f64; D]) -> Result<Self, SplineError> {
        let mut knots = self.knots.clone();
        for (axis, knots) in knots.iter_mut().enumerate() {
            *knots = knots.mapped(scale, shift[axis])?;
        }
        Self::new(knots, &self.coefficients * scale)
    }

    fn basis(&self, x: &[f64; D], order: usize) -> Option<[Basis; D]> {
        let mut basis = [Basis::at(&self.knots[0], x[0], order)?; D];
        for axis in 1..D {
            basis[axis] = Basis::at(&self.knots[axis], x[axis], order)?;
        }
        Some(basis)
    }

    fn partial(&self, basis: &[Basis; D], order: [usize; D]) -> f64 {
        contract(self.as_flat(), &Place::new(&strides(&self.shape), basis), &weights(basis, order))
    }
}

/// Value, gradient and Hessian from coefficients with the given strides.
pub(crate) fn jet_at<const D: usize>(coefficients: &[f64], strides: &[usize; D], basis: &[Basis; D]) -> Jet<D> {
    let place = Place::new(strides, basis);
    let partial = |order: [usize; D]| contract(coefficients, &place, &weights(basis, order));
    let mut hessian = [[0.0; D]; D];
    for a in 0..D {
        for b in a..D {
            hessian[a][b] = partial(std::array::from_fn(|axis| usize::from(axis == a) + usize::from(axis == b)));
            hessian[b][a] = hessian[a][b];
        }
    }
    Jet {
        value: partial([0; D]),
        gradient: std::array::from_fn(|a| partial(std::array::from_fn(|axis| usize::from(axis == a)))),
        hessian,
    }
}
