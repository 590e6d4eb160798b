//! Where refinement is held at the initial shape: away from the points.
//!
//! Near the points the data speak. Away from them fairness alone would shape f, which knows nothing of inside and outside;
//! there the initial shape, a signed distance of the right sign, is the better guide.

use ndarray::ArrayD;

use crate::lattice::domain::{Domain, multi_index};
use crate::refinement::ramp::ramp;

/// The data alone speak within so many spacings (or cells, if those are larger) of them.
const REACH: f64 = 0.7;

/// Stiffness of every control coefficient on the lattice after `halvings`, in C order: zero near the points, full from
/// twice as far as that. `distance` is d on the nodes, `scale` the larger of spacing and cell. Full is `h^(D−4)`, at which
/// the anchor and the thin-plate energy of a cell weigh alike.
pub fn stiffness<const D: usize>(
    domain: &Domain<D>,
    halvings: u32,
    degree: usize,
    distance: &ArrayD<f64>,
    scale: f64,
) -> Vec<f64> {
    let cell = domain.spacing(halvings);
    let cells = domain.cells(halvings);
    let reach = REACH * scale;
    let full = cell.powi(D as i32 - 4);
    let shape = cells.map(|count| count + degree);
    let count: usize = shape.iter().product();
    (0..count)
        .map(|flat| {
            let index = multi_index(flat, &shape);
            // The node nearest to the middle of the basis function's support, within the box.
            let node: [usize; D] =
                std::array::from_fn(|axis| index[axis].saturating_sub((degree - 1) / 2).min(cells[axis]));
            full * ramp(distance[&node[..]], reach)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_free_at_the_points_and_stiff_away_from_them() {
        let domain = Domain::<2>::around(&[1.0, 1.0], 8);
        let cells = domain.cells(1);
        let nodes = domain.nodes(1);
        // The points lie on the line x = 0, a node.
        let distance = ArrayD::from_shape_fn(cells.map(|count| count + 1).to_vec(), |i| nodes[0][i[0]].abs());
        let stiffness = stiffness(&domain, 1, 3, &distance, 0.1);
        assert_eq!(stiffness.len(), (cells[0] + 3) * (cells[1] + 3));
        let full = domain.spacing(1).powi(-2);
        for (flat, k) in stiffness.iter().enumerate() {
            let row = flat / (cells[1] + 3);
            let d = nodes[0][row.saturating_sub(1).min(cells[0])].abs();
            match d {
                d if d <= 0.07 => assert_eq!(*k, 0.0),
                d if d >= 0.14 => assert_eq!(*k, full),
                _ => assert!(*k > 0.0 && *k < full),
            }
        }
    }
}
