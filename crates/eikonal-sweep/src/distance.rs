//! The one entrance: options in, distance and report out.

use ndarray::{ArrayD, IxDyn};

use crate::closest_point::closest_point;
use crate::exact::exact;
use crate::ghost::Ghosted;
use crate::godunov::godunov;
use crate::lattice::{Lattice, MAX_COORDINATE};
use crate::near_field::near_field;

/// How the distance is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The paper's fast sweeping method, eqs. 12 and 13: first order in h.
    Godunov,
    /// The same sweeps carrying the nearest sample's index. The default.
    #[default]
    ClosestPoint,
    /// A kd-tree query at each node, in parallel.
    Exact,
}

/// What to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// The method. Default: [`Method::ClosestPoint`].
    pub method: Method,
    /// Rounds of 2^D sweeps, at least 1. Default: 1, as in the paper. Sweeping stops early when a sweep changes
    /// nothing. [`Method::Exact`] ignores it.
    pub rounds: usize,
    /// Radius in cells, at least 1, of the start values: a node with a point less than `exact_radius`·h away
    /// starts with its exact distance. Default: 2, a point's own cell and a ring of cells around it. The start takes
    /// (2·`exact_radius`)^D distances per point. Godunov's scheme is of order h only if `exact_radius`·h is kept while h
    /// falls; for a constant `exact_radius` it is of order h·log(1/h) around single points.
    /// [`Method::Exact`] ignores it.
    pub exact_radius: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { method: Method::default(), rounds: 1, exact_radius: 2 }
    }
}

/// The distance from a cloud of points to the nodes of a lattice.
#[derive(Clone, Debug)]
pub struct Distance {
    /// Distance to the nearest point at each node, frame unit, ≥ 0 and finite. Shape of the lattice, C order.
    pub values: ArrayD<f64>,
    /// Index of the sample that `values` is the distance to; `None` for [`Method::Godunov`], which knows
    /// no samples. Shape of the lattice, C order.
    pub nearest: Option<ArrayD<u32>>,
    /// What was done.
    pub report: Report,
}

/// What [`distance`] did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Sweeps over the whole lattice; 0 for [`Method::Exact`].
    pub sweeps: usize,
    /// Largest decrease of a value in the last sweep, frame unit.
    pub last_change: f64,
    /// Whether the result is proven to be a fixed point of the sweeps: the last one changed nothing. Often `false` after
    /// one round although nothing more would change, since the proof takes one more sweep. Always `true` for
    /// [`Method::Exact`].
    pub converged: bool,
}

/// Why no distance could be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The cloud is empty.
    #[error("there are no points to measure the distance to")]
    NoPoints,
    /// More points than a `u32` index can name.
    #[error("{count} points are more than the {max} that can be indexed; thin the cloud")]
    TooManyPoints {
        /// Number of points given.
        count: usize,
        /// The most that are allowed.
        max: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {index} has the coordinate {value} on axis {axis}; remove it")]
    NotFinite {
        /// Index of the point.
        index: usize,
        /// Axis, 0 for x.
        axis: usize,
        /// The coordinate as given.
        value: f64,
    },
    /// A point is so far away (1e150 cells, or 1e300 frame units) that its squared distance overflows.
    #[error("point {index} is too far from the lattice for its squared distance to be represented; remove it")]
    TooFar {
        /// Index of the point.
        index: usize,
    },
    /// [`Options::rounds`] is 0.
    #[error("0 rounds of sweeps were asked for; at least 1 is needed")]
    NoRounds,
    /// [`Options::exact_radius`] is 0.
    #[error("the start values were given a radius of 0 cells; at least 1 is needed")]
    NoRadius,
    /// The kd-tree refused distinct, finite points.
    #[error("the kd-tree could not be built: {0}")]
    Tree(String),
}

/// Most points that can be told apart by the index, one value being kept for "none yet".
const MAX_POINTS: usize = u32::MAX as usize;

/// Most cells between a point and the lattice's origin: its square, summed over the axes, is finite.
const MAX_CELLS: f64 = 1e150;

/// Unsigned distance from `points` (`N × D`, frame unit) to every node of `lattice`.
///
/// Near the points every method is exact: see the crate's first page for which nodes those are.
///
/// Points may lie outside the box. [`Method::Exact`] is exact for them too. For the sweeps such a point starts at
/// the boundary nodes closest to it, with its true distance, and travels inwards from there:
/// [`Method::ClosestPoint`] then finds it as it finds any other (alone it is exact at every node), while
/// [`Method::Godunov`] knows only the values at those nodes and overestimates elsewhere. Give the sweeps a
/// box that holds the points.
///
/// # Errors
/// No points or too many, a coordinate that is not finite, a point absurdly far away, or an option that is 0.
pub fn distance<const D: usize>(
    points: &[[f64; D]],
    lattice: &Lattice<D>,
    options: &Options,
) -> Result<Distance, Error> {
    if options.rounds == 0 {
        return Err(Error::NoRounds);
    }
    if options.exact_radius == 0 {
        return Err(Error::NoRadius);
    }
    let points = in_lattice_units(points, lattice)?;
    let h = lattice.spacing();
    let ghosted = Ghosted::new(lattice.shape());
    let to_frame = |squared: f64| squared.sqrt() * h;
    // On a thread of the pool, which would otherwise be woken for each of many short tasks.
    let (values, nearest, swept) = rayon::scope(|_| match options.method {
        Method::Godunov => {
            let near = near_field(&ghosted, &points, options.exact_radius);
            let (u, swept) = godunov(&ghosted, near, options.exact_radius, options.rounds);
            Ok((ghosted.strip(&u, |u| u * h), None, Some(swept)))
        }
        Method::ClosestPoint => {
            let near = near_field(&ghosted, &points, options.exact_radius);
            let (near, swept) = closest_point(&ghosted, &points, near, options.rounds);
            let values = ghosted.strip(&near.squared, to_frame);
            let nearest = ghosted.strip(&near.nearest, |index| index);
            Ok((values, Some(nearest), Some(swept)))
        }
        Method::Exact => {
            let (squared, nearest) = exact(lattice.shape(), &points)?;
            Ok((squared.into_iter().map(to_frame).collect(), Some(nearest), None))
        }
    })?;
    debug_assert!(values.iter().all(|d| d.is_finite() && *d >= 0.0), "every node is reached");
    let shape = lattice.shape();
    let report = Report {
        sweeps: swept.as_ref().map_or(0, |swept| swept.sweeps),
        last_change: swept.as_ref().map_or(0.0, |swept| swept.last_change * h),
        converged: swept.as_ref().is_none_or(|swept| swept.last_change == 0.0),
    };
    Ok(Distance {
        values: on_lattice(&shape, values),
        nearest: nearest.map(|nearest| on_lattice(&shape, nearest)),
        report,
    })
}

#[expect(clippy::expect_used, reason = "every method fills the lattice, one value per node")]
fn on_lattice<T>(shape: &[usize], values: Vec<T>) -> ArrayD<T> {
    ArrayD::from_shape_vec(IxDyn(shape), values).expect("one value per node of the lattice")
}

/// The points in lattice units, checked.
fn in_lattice_units<const D: usize>(points: &[[f64; D]], lattice: &Lattice<D>) -> Result<Vec<[f64; D]>, Error> {
    if points.is_empty() {
        return Err(Error::NoPoints);
    }
    if points.len() > MAX_POINTS {
        return Err(Error::TooManyPoints { count: points.len(), max: MAX_POINTS });
    }
    let h = lattice.spacing();
    let convert = |(index, point): (usize, &[f64; D])| {
        if let Some(axis) = point.iter().position(|value| !value.is_finite()) {
            return Err(Error::NotFinite { index, axis, value: point[axis] });
        }
        let point = lattice.to_lattice_units(point);
        let too_far = |cells: &f64| cells.abs() > MAX_CELLS || cells.abs() * h > MAX_COORDINATE;
        if point.iter().any(too_far) {
            return Err(Error::TooFar { index });
        }
        Ok(point)
    };
    points.iter().enumerate().map(convert).collect()
}
