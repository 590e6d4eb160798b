//! Which boxes of points are far enough from a box of queries.

use crate::direct_sum::sphere;
use crate::multi_index::ORDER;
use crate::multipole::Source;
use crate::partition::{Partition, bounds};

/// Centre and radius of a ball around the points of a box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ball<const D: usize> {
    pub centre: [f64; D],
    pub radius: f64,
}

/// The balls of all boxes, in preorder: centres of bounding boxes, which do not depend on the order of the points.
pub(crate) fn balls<const D: usize>(partition: &Partition<D>) -> Vec<Ball<D>> {
    let ball = |points: &[[f64; D]]| {
        let [low, high] = bounds(points);
        let centre = std::array::from_fn(|k| low[k] + 0.5 * (high[k] - low[k]));
        let square = |p: &[f64; D]| (0..D).map(|k| (p[k] - centre[k]) * (p[k] - centre[k])).sum::<f64>();
        Ball { centre, radius: points.iter().map(square).fold(0.0, f64::max).sqrt() }
    };
    partition.parts.iter().map(|part| ball(&partition.points[part.run()])).collect()
}

/// Boxes are opened from nearer than radius / `STEEPEST`, whatever they weigh, for the bound on the error grows beyond all
/// measure towards 1.
const STEEPEST: f64 = 0.5;

/// Each far box may err by this part of the tolerance at most. Nearly all err by far less, and the errors of the hundreds of
/// boxes that a query sees have all signs: the worst sums that tests and bench find are below a seventh of the tolerance.
const SHARE: f64 = 0.125;

/// When a box is far: `radius² ≤ STEEPEST² ρ²` and `weight ≤ ρ^{p+2}` (3D), `ρ^{p+1}` (2D), where `ρ² = d² + ε²` and d is the
/// distance of its centre from the queries.
///
/// For terms up to order p of the potential, with `θ = r/ρ` and `A = Σ ‖aᵢ nᵢ‖`, what is left out is at most
/// `A θ^p (p + 1 − pθ) / (1 − θ)² / (4π ρ²)` in 3D and `A θ^p / (1 − θ) / (2π ρ)` in 2D: along a line the potential is the
/// generating function of Legendre (Chebyshev) polynomials, ε being one more coordinate, and a symmetric multilinear form is
/// nowhere larger than on its diagonal. The factor with θ is taken at its largest, at `STEEPEST`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Opening {
    pub radius_square: f64,
    pub weight: f64,
}

/// The criteria of all boxes, in preorder.
pub(crate) fn openings<const D: usize>(
    partition: &Partition<D>,
    balls: &[Ball<D>],
    sources: &[Source<D>],
    tolerance: f64,
) -> Vec<Opening> {
    let norm = |[_, area]: &Source<D>| area.iter().map(|x| x * x).sum::<f64>().sqrt();
    let parts = &partition.parts;
    let mut areas = vec![0.0; parts.len()];
    for (index, part) in parts.iter().enumerate().rev() {
        areas[index] = if part.is_leaf(index) {
            sources[part.run()].iter().map(norm).sum()
        } else {
            areas[index + 1] + areas[parts[index + 1].skip as usize]
        };
    }
    let p = ORDER as f64;
    let left_out =
        if D == 2 { 1.0 / (1.0 - STEEPEST) } else { (p + 1.0 - p * STEEPEST) / ((1.0 - STEEPEST) * (1.0 - STEEPEST)) };
    let factor = left_out / (sphere::<D>() * SHARE * tolerance);
    let opening = |(ball, area): (&Ball<D>, f64)| {
        let square = ball.radius * ball.radius;
        Opening { radius_square: square, weight: factor * area * square * square }
    };
    balls.iter().zip(areas).map(opening).collect()
}

impl Opening {
    /// Whether the box is far from queries at a squared distance of `square − ε²` and more from its centre.
    pub fn is_far<const D: usize>(&self, square: f64) -> bool {
        const { assert!(ORDER == 4) }
        let power = square * square * if D == 2 { square.sqrt() } else { square };
        self.radius_square <= STEEPEST * STEEPEST * square && self.weight <= power && square > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::{BATCH, Batch};
    use crate::direct_sum::direct_sum;
    use crate::multi_index::Tables;
    use crate::multipole::fields;
    use proptest::prelude::*;
    use pulp::Arch;

    /// One box of sources, seen from `distance` radii.
    fn one_box<const D: usize>(sources: &[Source<D>], regular: f64, side: [f64; D], distance: f64) -> (f64, f64, f64) {
        let points: Vec<[f64; D]> = sources.iter().map(|s| s[0]).collect();
        let partition = Partition::new(&points, 32);
        let balls = balls(&partition);
        let ordered: Vec<Source<D>> = partition.order.iter().map(|&i| sources[i as usize]).collect();
        let tables = Tables::new::<D>();
        let field = fields(&tables, &partition, &balls, &ordered);
        let length = side.iter().map(|x| x * x).sum::<f64>().sqrt();
        let x: [f64; D] = std::array::from_fn(|k| balls[0].centre[k] + distance * balls[0].radius * side[k] / length);
        let queries: [[f64; BATCH]; D] = std::array::from_fn(|k| [x[k]; BATCH]);
        let far = [(balls[0].centre, &field[..tables.coefficients])];
        let batch = Batch { count: 8, queries: &queries, regular, far: &far, near: &[] };
        let value = Arch::new().dispatch(batch)[0];
        let rho = ((distance * balls[0].radius).powi(2) + regular).sqrt();
        let (theta, area) = (balls[0].radius / rho, sources.iter().map(|s| norm(&s[1])).sum::<f64>());
        let bound = if D == 2 {
            area * theta.powi(4) / (1.0 - theta) / rho
        } else {
            area * theta.powi(4) * (5.0 - 4.0 * theta) / ((1.0 - theta) * (1.0 - theta)) / (rho * rho)
        };
        (value, direct_sum(&ordered, regular, &x), bound)
    }

    fn norm<const D: usize>(v: &[f64; D]) -> f64 {
        v.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    fn sources<const D: usize>() -> impl Strategy<Value = Vec<Source<D>>> {
        let vector = || proptest::array::uniform::<_, D>(-1.0..1.0f64);
        prop::collection::vec((vector(), vector()).prop_map(|(p, a)| [p, a]), 2..60)
    }

    fn check<const D: usize>(sources: &[Source<D>], regular: f64, side: [f64; D], distance: f64) {
        if norm(&side) > 0.1 {
            let (value, direct, bound) = one_box(sources, regular, side, distance);
            // The bound is a theorem; 1e-13 for rounding.
            assert!((value - direct).abs() <= bound + 1e-13, "{value} instead of {direct}, bound {bound}");
        }
    }

    proptest! {
        #[test]
        fn error_of_a_box_is_bounded_in_3d(
            s in sources::<3>(), r in 0.0..4.0f64, side in proptest::array::uniform3(-1.0..1.0), d in 1.2..30.0f64,
        ) {
            check(&s, r, side, d);
        }

        #[test]
        fn error_of_a_box_is_bounded_in_2d(
            s in sources::<2>(), r in 0.0..4.0f64, side in proptest::array::uniform2(-1.0..1.0), d in 1.2..30.0f64,
        ) {
            check(&s, r, side, d);
        }
    }

    #[test]
    fn no_box_is_far_within_twice_its_radius_whatever_it_weighs() {
        let light = Opening { radius_square: 1.0, weight: 0.0 };
        assert!(!light.is_far::<2>(3.99) && light.is_far::<2>(4.01));
        assert!(!light.is_far::<3>(3.99) && light.is_far::<3>(4.01));
    }

    #[test]
    fn expansion_has_all_terms_up_to_the_order() {
        let golden = |i: usize, s: f64| (0.618 * s * i as f64).fract() - 0.5;
        let sources: Vec<Source<3>> = (0..40)
            .map(|i| [[golden(i, 1.0), golden(i, 1.7), golden(i, 2.9)], [golden(i, 3.1), golden(i, 0.7), 0.3]])
            .collect();
        for regular in [0.0, 0.5] {
            let error = |distance| {
                let (value, direct, _) = one_box(&sources, regular, [1.0, 0.6, -0.3], distance);
                (value - direct).abs()
            };
            // What is left out falls with the sixth power of the distance (64); a missing term would with the fifth (32).
            let ratio = error(20.0) / error(40.0);
            assert!((50.0..80.0).contains(&ratio), "{ratio}");
        }
    }
}
