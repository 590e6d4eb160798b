//! One lattice of the ladder: the normal equations there, and the fits that they give.

use zeroset_bspline::{KnotVector, Spline};
use zeroset_multigrid::{Multigrid, MultigridError};

use crate::error::GefmError;
use crate::ladder_options::LadderOptions;
use crate::normal_solver::Iterative;
use crate::pulled_points::{Found, PulledPoints, SPECTRAL};

/// The points on one lattice, with a smoothing length that may be changed.
pub(crate) struct Rung<'a, const D: usize> {
    options: &'a LadderOptions<D>,
    multigrid: Multigrid<D>,
    points: PulledPoints<'a, D>,
    /// Halvings of the base lattice.
    pub(crate) halvings: u32,
    ratio: f64,
}

impl<'a, const D: usize> Rung<'a, D> {
    /// The lattice after `halvings` of `base`, with a smoothing length of `ratio` spacings; the eigenvector is
    /// sought from unit pulls at the points along `directions`.
    ///
    /// # Errors
    /// If the normal equations cannot be set up, or a point lies outside the lattice.
    pub(crate) fn new(
        (points, areas): (&'a [[f64; D]], &'a [f64]),
        base: &[KnotVector; D],
        halvings: u32,
        ratio: f64,
        directions: &[[f64; D]],
        options: &'a LadderOptions<D>,
    ) -> Result<Self, GefmError> {
        let multigrid = Multigrid::new(base, halvings, points, areas, options.weight(ratio))?;
        let points = PulledPoints::new((points, areas), multigrid.knots(), directions, &options.cancel)?;
        Ok(Self { options, multigrid, points, halvings, ratio })
    }

    /// The next finer lattice, with a smoothing length and directions of its own.
    ///
    /// # Errors
    /// As [`Rung::new`].
    pub(crate) fn refined(mut self, ratio: f64, directions: &[[f64; D]]) -> Result<Self, GefmError> {
        self.set_ratio(ratio)?;
        let (points, areas) = self.points.weighted();
        let multigrid = self.multigrid.refined(points, areas)?;
        let points = self.points.on(multigrid.knots(), directions)?;
        Ok(Self { multigrid, points, halvings: self.halvings + 1, ..self })
    }

    /// The smoothing length, in spacings.
    pub(crate) fn ratio(&self) -> f64 {
        self.ratio
    }

    /// The lattice.
    pub(crate) fn knots(&self) -> &[KnotVector; D] {
        self.multigrid.knots()
    }

    /// Number of control coefficients.
    pub(crate) fn unknowns(&self) -> usize {
        self.multigrid.size()
    }

    /// Changes the smoothing length.
    ///
    /// # Errors
    /// If the normal equations cannot be solved with it.
    pub(crate) fn set_ratio(&mut self, ratio: f64) -> Result<(), GefmError> {
        if ratio != self.ratio {
            self.multigrid = self.multigrid.reweighted(self.options.weight(ratio))?;
            self.ratio = ratio;
        }
        Ok(())
    }

    /// The fit at p = 1 that starts from another one, on a lattice of no more `halvings`.
    pub(crate) fn continued(&self, start: &Spline<D>, halvings: u32) -> Found<D> {
        let mut start = start.clone();
        for _ in halvings..self.halvings {
            start = start.halved().map_err(MultigridError::from)?;
        }
        self.points.at_exponents(start.as_flat().to_vec(), &[1.0], &self.solver())
    }

    /// The fit to normals known from elsewhere: as they are, or with the continuation at p = 1 after it.
    pub(crate) fn oriented(&self, normals: &[[f64; D]], as_they_are: bool) -> Found<D> {
        self.options.cancel.check()?;
        let f = self.solver().solve_from_zero(&self.points.pulls(normals), self.options.tolerance);
        self.points.at_exponents(f, if as_they_are { &[] } else { &[1.0] }, &self.solver())
    }

    /// The fit from scratch.
    pub(crate) fn spectral(&self) -> Found<D> {
        let roughly = self.solver();
        self.points.spectral(|right| roughly.solve_from_zero(right, SPECTRAL), &self.solver())
    }

    fn solver(&self) -> Iterative<'_, D> {
        Iterative::new(&self.multigrid, self.options.tolerance)
    }
}
