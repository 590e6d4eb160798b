//! Extraction against scikit-image's Lewiner marching cubes, and against the trilinear interpolant itself.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use ndarray::{ArrayD, Axis};
use serde::Deserialize;
use zeroset::bspline::Spline;
use zeroset::isosurface::{LatticeSamples, Options, Report, TriMesh, surface};

use super::Check;
use super::archive::Archive;
use super::distances::{Grid, NAMES};

/// What scikit-image's mesh measures.
#[derive(Deserialize)]
struct Lewiner {
    area: f64,
    volume: f64,
    euler: i64,
}

pub fn check(golden: &Path) -> Result<Vec<Check>> {
    let root = golden.parent().and_then(Path::parent).context("golden data lie in fixtures/golden")?;
    let text = std::fs::read_to_string(golden.join("marching_cubes.json"))?;
    let numbers: BTreeMap<String, Lewiner> = serde_json::from_str(&text)?;
    let mut checks = Vec::new();
    for name in NAMES {
        let grid = Grid::read(root, name)?;
        let lewiner = numbers.get(name).with_context(|| format!("{name} in marching_cubes.json"))?;
        let (mesh, report) = extract(grid.axes(), -&grid.signed)?;
        let what = |quantity: &str| format!("{name}: {quantity} against scikit-image (Lewiner)");
        // The same zeros on the same edges; only the triangles between them differ, by less than the chord error.
        checks.push(Check::at_most(what("area, relative"), (mesh.area() / lewiner.area - 1.0).abs(), 2e-3));
        checks.push(Check::at_most(
            what("volume, relative"),
            (mesh.enclosed_volume() / lewiner.volume - 1.0).abs(),
            2e-3,
        ));
        let difference = (mesh.topology().euler_characteristic - lewiner.euler).abs() as f64;
        let cells = format!("Euler number, {} tunnels in {} cells", report.ambiguous, report.cells);
        checks.push(Check::at_most(what(&cells), difference, 0.0));
    }
    checks.extend(random_fields(golden)?);
    Ok(checks)
}

/// Where the two disagree on lattices full of ambiguous cells, the interpolant sampled finer decides.
fn random_fields(golden: &Path) -> Result<Vec<Check>> {
    let mut archive = Archive::open(&golden.join("random_fields.npz"))?;
    let fields: ArrayD<f64> = archive.array("fields")?;
    let (lewiner, sampled): (Vec<i64>, Vec<i64>) = (archive.list("lewiner")?, archive.list("sampled")?);
    let (mut ours, mut theirs, mut closed) = (0, 0, 0);
    for (k, field) in fields.axis_iter(Axis(0)).enumerate() {
        let axes = std::array::from_fn(|axis| (0..field.shape()[axis]).map(|i| i as f64).collect());
        let (mesh, _) = extract(axes, field.to_owned())?;
        let topology = mesh.topology();
        closed += usize::from(topology.closed);
        ours += usize::from(topology.euler_characteristic == sampled[k]);
        theirs += usize::from(lewiner[k] == sampled[k]);
        if topology.euler_characteristic != lewiner[k] {
            println!(
                "       random field {k}: Euler number {} here, {} by Lewiner, {} by sampling 32 times finer",
                topology.euler_characteristic, lewiner[k], sampled[k]
            );
        }
    }
    let count = lewiner.len();
    let share = |n: usize| n as f64 / count as f64;
    Ok(vec![
        Check::at_least("random fields: share of closed manifold meshes", share(closed), 1.0),
        // Sampled 32 times finer, with both connectivities agreeing: what is not equal is wrong.
        Check::at_least("random fields: share with the sampled interpolant's Euler number", share(ours), 1.0),
        Check::at_least(
            "random fields: the same share for us, less that for Lewiner's",
            share(ours) - share(theirs),
            0.0,
        ),
    ])
}

fn extract(axes: [Vec<f64>; 3], values: ArrayD<f64>) -> Result<(TriMesh, Report)> {
    let samples = LatticeSamples::new(axes, values)?;
    Ok(surface(&samples, None::<&Spline<3>>, &Options::default())?)
}
