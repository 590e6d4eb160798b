//! Polylines and what can be said about them.

use serde::Serialize;

/// Polylines with the inside on their left.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curves {
    /// One list of vertices per closed polyline; the last is joined to the first, which is not repeated.
    pub loops: Vec<Vec<[f64; 2]>>,
    /// One list of vertices per open polyline: what [`Curves::clipped`] leaves of loops.
    pub paths: Vec<Vec<[f64; 2]>>,
}

/// The topology of curves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct CurveTopology {
    /// Closed loops.
    pub loops: usize,
    /// Loops that run counter-clockwise: the outer rims of parts.
    pub parts: usize,
    /// Loops that run clockwise: the rims of holes.
    pub holes: usize,
    /// Enclosed area, the holes taken off.
    pub area: f64,
    /// Open polylines.
    pub paths: usize,
    /// Total length, open polylines included.
    pub length: f64,
}

impl Curves {
    /// Counts loops and holes, and measures them.
    pub fn topology(&self) -> CurveTopology {
        let areas: Vec<f64> = self.loops.iter().map(|cycle| signed_area(cycle)).collect();
        let holes = areas.iter().filter(|&&area| area < 0.0).count();
        CurveTopology {
            loops: self.loops.len(),
            parts: self.loops.len() - holes,
            holes,
            area: areas.iter().sum(),
            paths: self.paths.len(),
            length: self.loops.iter().map(|cycle| length(sides(cycle))).sum::<f64>()
                + self.paths.iter().map(|path| length(path.iter().zip(path.iter().skip(1)))).sum::<f64>(),
        }
    }
}

fn sides(cycle: &[[f64; 2]]) -> impl Iterator<Item = (&[f64; 2], &[f64; 2])> {
    cycle.iter().zip(cycle.iter().cycle().skip(1))
}

/// Positive for counter-clockwise loops (Gauss).
fn signed_area(cycle: &[[f64; 2]]) -> f64 {
    let Some(o) = cycle.first() else { return 0.0 };
    0.5 * sides(cycle).map(|(a, b)| (a[0] - o[0]) * (b[1] - o[1]) - (b[0] - o[0]) * (a[1] - o[1])).sum::<f64>()
}

fn length<'a>(sides: impl Iterator<Item = (&'a [f64; 2], &'a [f64; 2])>) -> f64 {
    sides.map(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1])).sum()
}
