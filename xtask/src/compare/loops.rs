//! The true loops of an outline, each running so that the inside is on its left.
//!
//! The evaluator asks for the side at the points themselves. It takes the truth's normals to the right of each loop's run and turns those that
//! show inwards round, but only at points from which both sides are in reach: for noisy ones the loops have to run the right way.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use ndarray::Array2;
use serde_json::json;

type Loop = Vec<[f64; 2]>;

/// Writes the loops of a truth, a `.npy` of rows `x, y, loop`, into another file, outer ones counter-clockwise and holes clockwise.
pub fn write_oriented(truth: &Path, path: &Path) -> Result<()> {
    let rows: Array2<f64> = ndarray_npy::read_npy(truth).with_context(|| truth.display().to_string())?;
    if rows.ncols() != 3 {
        bail!("{}: three columns are needed, x, y and the number of the loop", truth.display());
    }
    let mut loops: Vec<(f64, Loop)> = Vec::new();
    for row in rows.rows() {
        let place = [row[0], row[1]];
        match loops.iter_mut().find(|(number, _)| *number == row[2]) {
            Some((_, places)) => places.push(place),
            None => loops.push((row[2], vec![place])),
        }
    }
    let curves = turned(loops.into_iter().map(|(_, places)| places).collect());
    fs::write(path, json!({ "curves": curves }).to_string()).with_context(|| path.display().to_string())
}

/// The loops with the inside on their left, by how many others each lies in.
fn turned(loops: Vec<Loop>) -> Vec<Loop> {
    let is_hole = |index: usize| {
        let others = loops.iter().enumerate().filter(|(other, _)| *other != index);
        others.filter(|(_, other)| encloses(other, &loops[index][0])).count() % 2 == 1
    };
    let clockwise: Vec<bool> = (0..loops.len()).map(is_hole).collect();
    let turn = |(mut places, clockwise): (Loop, bool)| {
        if (twice_area(&places) < 0.0) != clockwise {
            places.reverse();
        }
        places
    };
    loops.into_iter().zip(clockwise).map(turn).collect()
}

fn edges(places: &Loop) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
    places.iter().copied().zip(places.iter().copied().cycle().skip(1))
}

/// Positive for counter-clockwise loops.
fn twice_area(places: &Loop) -> f64 {
    edges(places).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// By the edges that a ray to the right crosses.
fn encloses(places: &Loop, point: &[f64; 2]) -> bool {
    let crosses = |(a, b): &([f64; 2], [f64; 2])| {
        (a[1] > point[1]) != (b[1] > point[1]) && point[0] < a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    };
    edges(places).filter(crosses).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(half: f64, clockwise: bool) -> Loop {
        let mut places = vec![[-half, -half], [half, -half], [half, half], [-half, half]];
        if clockwise {
            places.reverse();
        }
        places
    }

    #[test]
    fn the_inside_is_on_the_left() {
        // An outline, a hole in it and an island in that, in all directions and orders.
        for directions in 0..8 {
            let halves = [3.0, 1.0, 2.0];
            let loops = (0..3).map(|k| square(halves[k], directions >> k & 1 == 1)).collect();
            let found: Vec<f64> = turned(loops).iter().map(twice_area).collect();
            assert_eq!(found, [72.0, 8.0, -32.0], "{directions}");
        }
    }

    #[test]
    fn loops_are_read_and_written() {
        let folder = tempfile::tempdir().unwrap();
        let truth = folder.path().join("gt.npy");
        let rows: Vec<f64> = square(3.0, true)
            .iter()
            .map(|p| [p[0], p[1], 4.0])
            .chain(square(1.0, false).iter().map(|p| [p[0], p[1], 0.0]))
            .flatten()
            .collect();
        ndarray_npy::write_npy(&truth, &Array2::from_shape_vec((8, 3), rows).unwrap()).unwrap();
        let path = folder.path().join("loops.json");
        write_oriented(&truth, &path).unwrap();
        let written = fs::read_to_string(&path).unwrap();
        let value: serde_json::Value = serde_json::from_str(&written).unwrap();
        let curves: Vec<Loop> = serde_json::from_value(value["curves"].clone()).unwrap();
        assert_eq!(curves.iter().map(twice_area).collect::<Vec<_>>(), [72.0, -8.0]);

        ndarray_npy::write_npy(&truth, &Array2::<f64>::zeros((4, 2))).unwrap();
        assert!(format!("{:#}", write_oriented(&truth, &path).unwrap_err()).contains("three columns"));
    }
}
