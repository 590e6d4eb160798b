//! Fixtures in the frame, and the stages of the road one by one.

use std::path::Path;

use anyhow::{Context, Result, bail};
use ndarray::ArrayD;
use zeroset::bspline::{KnotVector, Spline};
use zeroset::eikonal_sweep::{self, Lattice, Method};
use zeroset::{Domain, Frame, Spacing, gefm, lsq_init};
use zeroset_io::Points;

/// A point set in its frame.
pub struct Case<const D: usize> {
    pub points: Vec<[f64; D]>,
    pub frame: Frame<D>,
    pub spacing: Spacing,
}

impl<const D: usize> Case<D> {
    pub fn new(points: &[[f64; D]]) -> Result<Self> {
        let (frame, points) = Frame::of(points)?;
        Ok(Self { spacing: Spacing::of(&points), points, frame })
    }

    /// The box and coarse lattice of the default road.
    pub fn domain(&self) -> Domain<D> {
        Domain::around(&self.frame.sides, zeroset::coarse_cells::<D>(&self.spacing))
    }

    /// Smoothing length and density of the default road.
    pub fn gefm_options(&self, domain: &Domain<D>, settings: gefm::Options) -> gefm::Options {
        let smoothing_length = (0.4 * self.spacing.typical).max(0.1 * domain.spacing);
        gefm::Options { smoothing_length, density: self.spacing.density, ..settings }
    }

    /// Equations (14) and (15): the initial shape from the sign of f̂.
    pub fn synthesized(&self, f_hat: &Spline<D>, domain: &Domain<D>, halvings: u32) -> Result<Spline<D>> {
        let nodes = domain.nodes(halvings);
        let cell = domain.spacing(halvings);
        let lattice = Lattice::new(domain.lower, cell, domain.cells(halvings).map(|cells| cells + 1))?;
        let distance = eikonal_sweep::distance(&self.points, &lattice, &eikonal_sweep::Options::default())?;
        let reach = 1.5 * cell.max(self.spacing.typical) + cell;
        let field = zeroset::sign_field(f_hat, &self.points, &self.spacing, domain, halvings, &distance.values, 1.0)?;
        let (phi, _) = zeroset::synthesize(&field, &distance.values, reach);
        self.least_squares(&phi, &nodes, &domain.knots(3, halvings)?, cell)
    }

    /// Equation (15) for given values on the nodes.
    pub fn least_squares(
        &self,
        phi: &ArrayD<f64>,
        nodes: &[Vec<f64>; D],
        knots: &[KnotVector; D],
        cell: f64,
    ) -> Result<Spline<D>> {
        let fairness = lsq_init::Fairness::Length(0.5 * cell);
        let options = lsq_init::Options { fairness, ..lsq_init::Options::default() };
        Ok(lsq_init::fit(phi.view(), nodes, knots, &options)?.0)
    }

    /// The distance with the paper's scheme on a lattice of `shape` nodes that just holds the points with a margin.
    pub fn paper_lattice(&self, shape: [usize; D]) -> Result<Lattice<D>> {
        // Cubic cells: the axis that needs the largest ones decides.
        let spacing = (0..D).map(|axis| self.frame.sides[axis] / (shape[axis] as f64 - 3.0)).fold(0.0, f64::max);
        let origin = std::array::from_fn(|axis| -0.5 * spacing * (shape[axis] as f64 - 1.0));
        Ok(Lattice::new(origin, spacing, shape)?)
    }

    pub fn godunov(&self, lattice: &Lattice<D>) -> Result<ArrayD<f64>> {
        let options = eikonal_sweep::Options { method: Method::Godunov, ..eikonal_sweep::Options::default() };
        Ok(eikonal_sweep::distance(&self.points, lattice, &options)?.values)
    }
}

pub fn curve(root: &Path, name: &str) -> Result<Case<2>> {
    match read(root, name)? {
        Points::Two(set) => Case::new(&set.points),
        Points::Three(_) => bail!("{name} is not a plane outline"),
    }
}

pub fn surface(root: &Path, name: &str) -> Result<Case<3>> {
    match read(root, name)? {
        Points::Three(set) => Case::new(&set.points),
        Points::Two(_) => bail!("{name} has no third coordinate"),
    }
}

fn read(root: &Path, name: &str) -> Result<Points> {
    zeroset_io::read_points(root.join("fixtures/points").join(name)).with_context(|| format!("fixture {name}"))
}
