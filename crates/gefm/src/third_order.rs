//! Fits with third derivatives as fairness, for points that are too few for second ones.

use zeroset_bspline::{DerivativeEnergy, KnotVector, Spline};
use zeroset_multigrid::NormalEquations;

use crate::error::GefmError;
use crate::ladder_options::LadderOptions;
use crate::pulled_points::{Found, PulledPoints};

/// The points on one lattice, where `A = Σ aᵢ qᵢqᵢᵀ + w H₃` is factored, H₃ the matrix of `∫‖∇³f‖²`.
///
/// What second derivatives keep from bending they keep from turning round within a wall: f has to rise and fall on less than the points'
/// spacing there, `2 y² − ⅛` across it. Of that third derivatives see nothing.
pub(crate) struct ThirdOrder<'a, const D: usize> {
    options: &'a LadderOptions<D>,
    points: PulledPoints<'a, D>,
    equations: NormalEquations<D>,
}

impl<'a, const D: usize> ThirdOrder<'a, D> {
    /// On the lattice of `knots`; the eigenvector is sought from unit pulls at the points along `directions`.
    ///
    /// # Errors
    /// If the degree is below 3, or a point lies outside the lattice.
    pub(crate) fn new(
        points: (&'a [[f64; D]], &'a [f64]),
        knots: &[KnotVector; D],
        directions: &[[f64; D]],
        options: &'a LadderOptions<D>,
    ) -> Result<Self, GefmError> {
        let equations = NormalEquations::new(&DerivativeEnergy::new(knots, 3)?);
        let points = PulledPoints::new(points, knots, directions, &options.cancel)?;
        Ok(Self { options, points, equations })
    }

    /// The fit from scratch with a smoothing length of `ratio` spacings.
    pub(crate) fn spectral(&self, ratio: f64) -> Found<D> {
        self.options.cancel.check()?;
        let (weight, (_, areas)) = (self.options.third_order_weight(ratio), self.points.weighted());
        let factor = self.equations.factor(&self.equations.weighted(self.points.collocation(), areas, weight)?)?;
        self.points.spectral(|right| factor.solve(right), &factor)
    }
}

/// The share of the points that have both signs of f among the corners of a cube two cells wide around them: where there are none a lattice
/// of such cells does not hold the part that they lie on.
pub(crate) fn held<const D: usize>(f: &Spline<D>, points: &[[f64; D]], cell: f64) -> f64 {
    let is_negative = |x: [f64; D]| f.value_and_gradient(&x).0 < 0.0;
    let corner = |p: &[f64; D], corner: usize| {
        std::array::from_fn(|axis| p[axis] + if corner >> axis & 1 == 1 { cell } else { -cell })
    };
    let has_both = |p: &&[f64; D]| {
        let negative = (0..1 << D).filter(|index| is_negative(corner(p, *index))).count();
        (1..1 << D).contains(&negative)
    };
    points.iter().filter(has_both).count() as f64 / points.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_hold_what_is_thicker_than_they_are() {
        // f = x² − ¼, negative between two planes one apart: each Greville abscissa's blossom.
        let knots = KnotVector::uniform(3, -2.0, 0.5, 8).unwrap();
        let square = |i: usize| {
            let (a, b) = (-2.0 + 0.5 * (i as f64 - 2.0), 0.5);
            (a * (a + b) + a * (a + 2.0 * b) + (a + b) * (a + 2.0 * b)) / 3.0 - 0.25
        };
        let coefficients = (0..11 * 11).map(|flat| square(flat / 11)).collect();
        let f = Spline::from_flat([knots.clone(), knots], coefficients).unwrap();
        assert!((f.value_and_gradient(&[0.8, 0.1]).0 - 0.39).abs() < 1e-12, "as computed by hand, but for rounding");
        let points = [[0.5, 0.0], [0.5, 0.3], [-0.5, -0.4], [0.5, 1.0]];
        assert_eq!((held(&f, &points, 0.9), held(&f, &points, 1.1)), (1.0, 0.0));
        assert_eq!(held(&f, &[[0.5, 0.0], [1.5, 0.0]], 0.3), 0.5);
    }
}
