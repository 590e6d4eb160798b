//! Centres of the voxels that a mesh passes through, as segmented volumes and octrees leave them.

use std::collections::BTreeSet;

use zeroset_tests::Random;

use super::lines::direction;
use super::surface::{Surface, length, normal};

/// Points of the mesh for each voxel: one that it cuts less than a fiftieth of an edge off is missed by them now and then.
const TRIES: usize = 50;

/// About `count` points, one for each cube of a lattice in which the surface is; the lattice is turned any way.
pub fn points(surface: &Surface, count: usize, random: &mut Random) -> Vec<[f64; 3]> {
    // A plane with unit normal n passes through |n₁| + |n₂| + |n₃| cubes per area of a side: on average 3/2.
    let side = (1.5 * surface.area() / count as f64).sqrt();
    let axes = frame(random);
    let shift: [f64; 3] = std::array::from_fn(|_| random.uniform());
    let along = |point: &[f64; 3], axis: &[f64; 3]| (0..3).map(|k| point[k] * axis[k]).sum::<f64>() / side;
    let voxel_of = |point: [f64; 3]| std::array::from_fn(|k| (along(&point, &axes[k]) + shift[k]).floor() as i64);
    let voxels: BTreeSet<[i64; 3]> = (0..TRIES * count).map(|_| voxel_of(surface.point(random, 0.0))).collect();
    let centre = |voxel: [i64; 3]| {
        let places: [f64; 3] = std::array::from_fn(|k| (voxel[k] as f64 + 0.5 - shift[k]) * side);
        std::array::from_fn(|axis| (0..3).map(|k| places[k] * axes[k][axis]).sum())
    };
    voxels.into_iter().map(centre).collect()
}

/// Three directions at right angles.
fn frame(random: &mut Random) -> [[f64; 3]; 3] {
    let first = direction(random);
    let across = normal(&[[0.0; 3], first, direction(random)]);
    let second = across.map(|x| x / length(&across));
    [first, second, normal(&[[0.0; 3], first, second])]
}
