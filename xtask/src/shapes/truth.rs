//! The true boundary of a solid.

use ndarray::ArrayD;
use rayon::prelude::*;
use zeroset::isosurface::LatticeSamples;

use super::dimension::{Dimension, Topology};
use super::solid::{Solid, norm, sub};

/// Shapes are looked for within so much of the origin along each axis.
const REACH: f64 = 4.0;
/// The box around a shape is found on cells of its size by 2 to this.
const HALVINGS: u32 = 7;
/// Cells of outside around the box.
const MARGIN: usize = 2;
/// Nodes along the sides of blocks that are looked at as one where no boundary is near.
const BLOCK: usize = 6;

/// A solid with its boundary on a fine lattice.
pub struct Truth<const D: usize>
where
    [f64; D]: Dimension<D>,
{
    /// What it is the boundary of.
    pub solid: Solid<D>,
    /// As polylines or a mesh; its vertices are near f = 0.
    pub boundary: <[f64; D] as Dimension<D>>::Boundary,
    pub topology: Topology,
    /// Lowest and highest coordinate along each axis, or a little beyond.
    pub bounds: [[f64; 2]; D],
}

impl<const D: usize> Truth<D>
where
    [f64; D]: Dimension<D>,
{
    /// The boundary on a lattice of so many cells along its longest side, if three quarters of them show the same parts.
    pub fn of(solid: Solid<D>, cells: usize) -> Option<Self> {
        let bounds = bounds(&solid)?;
        let march = |cells| <[f64; D]>::march(&samples(&solid, &bounds, cells)?).ok();
        let topology = <[f64; D]>::topology(&march(3 * cells / 4)?);
        let boundary = march(cells)?;
        (topology == <[f64; D]>::topology(&boundary)).then_some(Self { solid, boundary, topology, bounds })
    }

    /// Of the box around it.
    pub fn diagonal(&self) -> f64 {
        norm(&self.bounds.map(|[low, high]| high - low))
    }
}

/// The box around f = 0, if that is not empty and within reach.
fn bounds<const D: usize>(solid: &Solid<D>) -> Option<[[f64; 2]; D]> {
    let (mut centres, mut half) = (vec![[0.0; D]], REACH);
    for _ in 0..HALVINGS {
        half *= 0.5;
        let children = centres.iter().flat_map(|centre| {
            (0..1 << D).map(move |child| {
                std::array::from_fn(|axis| centre[axis] + if child >> axis & 1 == 0 { -half } else { half })
            })
        });
        centres = children.filter(|centre| solid.value(centre).abs() <= half * (D as f64).sqrt()).collect();
    }
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; D];
    for centre in &centres {
        for (bound, at) in bounds.iter_mut().zip(centre) {
            *bound = [bound[0].min(at - half), bound[1].max(at + half)];
        }
    }
    bounds.iter().all(|[low, high]| *low > -REACH && *high < REACH).then_some(bounds).filter(|_| !centres.is_empty())
}

/// f on a lattice with a margin around the box. Away from the boundary it has the right sign and no more.
fn samples<const D: usize>(solid: &Solid<D>, bounds: &[[f64; 2]; D], cells: usize) -> Option<LatticeSamples<D>> {
    let side = bounds.iter().map(|[low, high]| high - low).fold(0.0, f64::max) / cells as f64;
    let axes = bounds.map(|[low, high]| {
        let nodes = ((high - low) / side).ceil() as usize + 1 + 2 * MARGIN;
        (0..nodes).map(|i| low + (i as f64 - MARGIN as f64) * side).collect::<Vec<f64>>()
    });
    let nodes = axes.each_ref().map(Vec::len);
    let blocks = nodes.map(|nodes| nodes.div_ceil(BLOCK));
    // From a block's middle to its farthest node; cells of nodes beyond a cell's diagonal are not cut.
    let clear = side * (D as f64).sqrt() * (0.5 * (BLOCK - 1) as f64 + 1.0);
    let one_sign: Vec<Option<f64>> = (0..blocks.iter().product())
        .into_par_iter()
        .map(|flat| {
            let block = unravelled(flat, &blocks);
            let middle = std::array::from_fn(|k| {
                axes[k][0] + side * (BLOCK * block[k]) as f64 + 0.5 * side * (BLOCK - 1) as f64
            });
            Some(solid.value(&middle)).filter(|value| value.abs() > clear)
        })
        .collect();
    let values: Vec<f64> = (0..nodes.iter().product())
        .into_par_iter()
        .map(|flat| {
            let node = unravelled(flat, &nodes);
            let block = (0..D).fold(0, |flat, axis| flat * blocks[axis] + node[axis] / BLOCK);
            one_sign[block].unwrap_or_else(|| solid.value(&std::array::from_fn(|axis| axes[axis][node[axis]])))
        })
        .collect();
    LatticeSamples::new(axes, ArrayD::from_shape_vec(nodes.to_vec(), values).ok()?).ok()
}

/// The last axis runs fastest.
fn unravelled<const D: usize>(mut flat: usize, shape: &[usize; D]) -> [usize; D] {
    let mut index = [0; D];
    for axis in (0..D).rev() {
        index[axis] = flat % shape[axis];
        flat /= shape[axis];
    }
    index
}

/// Length of a segment, or area of a triangle.
pub fn extent<const D: usize>(simplex: &[[f64; D]; D]) -> f64 {
    let mut edges: Vec<[f64; D]> = simplex[1..].iter().map(|corner| sub(corner, &simplex[0])).collect();
    let mut extent = 1.0;
    for first in 0..edges.len() {
        let (done, rest) = edges.split_at_mut(first + 1);
        let edge = &done[first];
        let square = edge.iter().map(|c| c * c).sum::<f64>();
        extent *= square.sqrt() / (first + 1) as f64;
        for other in rest {
            let along = (0..D).map(|k| other[k] * edge[k]).sum::<f64>() / square.max(f64::MIN_POSITIVE);
            (0..D).for_each(|k| other[k] -= along * edge[k]);
        }
    }
    extent
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_tests::Random;

    fn parts<const D: usize>(solid: Solid<D>, cells: usize) -> (usize, Option<i64>)
    where
        [f64; D]: Dimension<D>,
    {
        let truth = Truth::of(solid.turned(&mut Random(5)), cells).unwrap();
        assert!(truth.topology.closed);
        (truth.topology.parts, truth.topology.genus)
    }

    #[test]
    fn parts_of_known_shapes() {
        assert_eq!(parts(Solid::torus(1.0, 0.3), 40), (1, Some(1)));
        assert_eq!(parts(Solid::ball([0.0; 3], 1.0).shell(0.3), 40), (2, Some(0)));
        let holes = [-0.6, 0.0, 0.6].map(|x| Solid::ball([x, 0.0], 0.2));
        let plate = Solid::cuboid([1.0, 0.5]).without(Solid::union(holes.to_vec()));
        assert_eq!(parts(plate.clone().extruded(0.15), 50), (1, Some(3)));
        assert_eq!(parts(plate, 60), (4, None));
    }

    #[test]
    fn what_is_too_thin_for_the_lattice_is_no_truth() {
        assert!(Truth::of(Solid::ball([0.0; 2], 1.0).shell(1e-3), 100).is_none());
        assert!(Truth::of(Solid::ball([0.0; 2], 9.0), 100).is_none(), "out of reach");
        assert!(Truth::of(Solid::ball([0.0; 2], -1.0), 100).is_none(), "nothing");
    }

    #[test]
    fn the_box_and_the_extent_are_the_shapes() {
        let truth = Truth::of(Solid::ball([0.5, -0.25, 0.0], 1.0), 60).unwrap();
        for ([low, high], middle) in truth.bounds.iter().zip([0.5, -0.25, 0.0]) {
            // Cells of 8 / 2^7, and |f| may miss it by half their diagonal.
            assert!((0.0..0.1).contains(&(middle - 1.0 - low)) && (0.0..0.1).contains(&(high - middle - 1.0)));
        }
        let area: f64 = <[f64; 3]>::simplices(&truth.boundary).iter().map(extent).sum();
        // Chords of a cell of 1/30.
        assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3);
    }
}
