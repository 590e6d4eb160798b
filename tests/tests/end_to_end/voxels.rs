//! Centres of the voxels that a surface passes through, as segmented volumes and octrees leave them.

use zeroset::{Options, extract_surface, reconstruct};

const SIDE: f64 = 0.06;
const SMALL: f64 = 0.3;

/// Signed distance from a torus with large radius 1 whose axis is along no edge of the voxels.
fn distance(p: &[f64; 3]) -> f64 {
    let axis = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    let height = (0..3).map(|k| axis[k] * p[k]).sum::<f64>();
    let across = (0..3).map(|k| (p[k] - height * axis[k]).powi(2)).sum::<f64>().sqrt();
    (across - 1.0).hypot(height) - SMALL
}

/// Cubes with corners on both sides.
fn voxels() -> Vec<[f64; 3]> {
    let cells = (2.8 / SIDE) as usize;
    let place = |flat: usize, shift: f64| {
        [flat / (cells * cells), flat / cells % cells, flat % cells].map(|i| (i as f64 + shift) * SIDE - 1.4)
    };
    let is_inside = |flat: usize, corner: usize| {
        let low = place(flat, 0.0);
        distance(&std::array::from_fn(|k| low[k] + SIDE * ((corner >> k) & 1) as f64)) < 0.0
    };
    (0..cells.pow(3))
        .filter(|flat| (1..8).any(|corner| is_inside(*flat, corner) != is_inside(*flat, 0)))
        .map(|flat| place(flat, 0.5))
        .collect()
}

#[test]
fn the_surface_runs_amid_the_voxels() {
    let points = voxels();
    let mut result = reconstruct(&points, &Options::default()).unwrap();
    let (mesh, topology) = extract_surface(&mut result).unwrap();
    let report = &result.report;
    let error = (mesh.vertices.iter().map(|v| distance(v).powi(2)).sum::<f64>() / mesh.vertices.len() as f64).sqrt();
    assert!(topology.closed && topology.components == 1 && topology.genus == 1, "{topology:?}");
    assert!(report.warnings.is_empty() && report.doubt.is_none(), "{:?} {:?}", report.warnings, report.doubt);
    // Even over a layer as thick as the plane's normal is long in the sum of its coordinates, which is 1 to √3: 0.29 to 0.5 of a side. What
    // voxels differ by from their neighbours would make it 0.87.
    assert!((0.29..0.55).contains(&(report.input.noise / SIDE)), "{}", report.input.noise / SIDE);
    // 0.054; smoothed for twice the noise, 0.135.
    assert!(error < 0.08 * SIDE, "{}", error / SIDE);
}
