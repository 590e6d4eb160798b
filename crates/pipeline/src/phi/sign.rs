//! Sign synthesis, equation (14): `φ(X) = sign[f̂(X)] · d(X)` on the nodes of a lattice.

use ndarray::ArrayD;
use serde::Serialize;

use crate::phi::sign_field::SignField;
use crate::topology::node_graph::NodeGraph;

/// What sign synthesis changed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct SignReport {
    /// Regions of one sign on the lattice before cleaning.
    pub regions_found: usize,
    /// Regions whose boundary no data support, and which were given to their surroundings.
    pub regions_removed: usize,
    /// Nodes in them.
    pub nodes_flipped: usize,
    /// Nodes on the faces of the box that were inside and were made outside.
    pub nodes_clipped: usize,
    /// Nodes in holes of the data, where a third-order fit has a say: [`synthesize`] knows of none.
    pub nodes_filled: usize,
    /// Share of the lattice edges across the zero set that have data nearby, after cleaning and filling: [`synthesize`] leaves it 0.
    pub supported: f64,
}

/// `φ = sign[f̂] · d` with the sign cleaned: minimising fairness lets f̂ curl up far from the data, and the sheets that
/// this makes must go. A region of one sign stays if data lie along at least half of its boundary, or if winding numbers
/// have the same sign at most of its nodes and some data lie along it; the faces of the box count as outside. `reach` is
/// the distance within which data support a boundary.
///
/// All arrays hold one value per lattice node, axis order x, y\[, z\]; `distance` is `d`.
pub fn synthesize(field: &SignField, distance: &ArrayD<f64>, reach: f64) -> (ArrayD<f64>, SignReport) {
    let mut regions = Regions::new(field, distance, reach);
    let mut report = SignReport::default();
    let mut measured = regions.measure();
    report.regions_found = measured.len();
    // Each round removes a region, so there are no more rounds than regions.
    loop {
        let elsewhere = measured.iter().any(|r| r.supported > 0);
        // The smallest first: what is left around it then counts as one boundary.
        let stray = measured.iter().filter(|r| r.stray(elsewhere)).min_by_key(|r| (r.size, r.start));
        let Some(stray) = stray else { break };
        if stray.size * 2 > regions.inside.len() {
            // Nothing supports even the largest region: there is no surface here, and flipping would only swap sides.
            break;
        }
        report.regions_removed += 1;
        report.nodes_flipped += stray.size;
        regions.flip(stray.start);
        measured = regions.measure();
    }
    report.nodes_clipped = regions.clip();
    let mut phi = distance.clone();
    for (value, &inside) in phi.iter_mut().zip(&regions.inside) {
        if inside {
            *value = -*value;
        }
    }
    (phi, report)
}

/// The lattice split into connected regions of one sign (neighbours along the axes).
struct Regions {
    graph: NodeGraph,
    inside: Vec<bool>,
    near: Vec<bool>,
    /// Whether winding numbers are those of the inside.
    wound: Vec<bool>,
}

struct Region {
    start: usize,
    size: usize,
    /// Lattice edges to the other sign.
    boundary: usize,
    /// Those of them with data within reach of both ends.
    supported: usize,
    /// Nodes at which winding numbers have the region's sign.
    agreed: usize,
}

impl Region {
    /// Whether it is to go, where data lie along boundaries `elsewhere`.
    fn stray(&self, elsewhere: bool) -> bool {
        let beside_no_data = elsewhere && self.supported == 0;
        2 * self.supported < self.boundary && (beside_no_data || 2 * self.agreed < self.size)
    }
}

impl Regions {
    fn new(field: &SignField, distance: &ArrayD<f64>, reach: f64) -> Self {
        Self {
            inside: field.value.iter().map(|&f| f < 0.0).collect(),
            wound: field.winding.iter().map(|&w| w < 0.0).collect(),
            near: distance.iter().map(|&d| d <= reach).collect(),
            graph: NodeGraph::new(distance.shape()),
        }
    }

    /// Visits a region; returns its nodes.
    fn flood(&self, start: usize, visited: &mut [bool]) -> Vec<usize> {
        let next = |node| self.graph.neighbours(node).flatten().filter(|next| self.inside[*next] == self.inside[start]);
        NodeGraph::flood(start, next, |node| !std::mem::replace(&mut visited[node], true))
    }

    fn measure(&self) -> Vec<Region> {
        let mut visited = vec![false; self.inside.len()];
        let mut regions = Vec::new();
        for start in 0..self.inside.len() {
            if visited[start] {
                continue;
            }
            let nodes = self.flood(start, &mut visited);
            let mut region = Region { start, size: nodes.len(), boundary: 0, supported: 0, agreed: 0 };
            for &node in &nodes {
                region.agreed += usize::from(self.wound[node] == self.inside[node]);
                for neighbour in self.graph.neighbours(node) {
                    let (crosses, supported) = match neighbour {
                        Some(other) => (self.inside[other] != self.inside[node], self.near[node] && self.near[other]),
                        None => (self.inside[node], false),
                    };
                    region.boundary += usize::from(crosses);
                    region.supported += usize::from(crosses && supported);
                }
            }
            regions.push(region);
        }
        regions
    }

    fn flip(&mut self, start: usize) {
        let nodes = self.flood(start, &mut vec![false; self.inside.len()]);
        for node in nodes {
            self.inside[node] = !self.inside[node];
        }
    }

    /// Puts every node on the faces of the box outside.
    fn clip(&mut self) -> usize {
        let faces: Vec<usize> = (0..self.inside.len())
            .filter(|&node| self.inside[node] && self.graph.neighbours(node).any(|neighbour| neighbour.is_none()))
            .collect();
        for &node in &faces {
            self.inside[node] = false;
        }
        faces.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of radius 6 in a 31 × 31 lattice, with its exact distance.
    fn disc(extra: impl Fn(f64, f64) -> bool) -> (SignField, ArrayD<f64>) {
        let radius = |i: &ndarray::IxDyn| (i[0] as f64 - 15.0).hypot(i[1] as f64 - 15.0);
        let distance = ArrayD::from_shape_fn(vec![31, 31], |i| (radius(&i) - 6.0).abs());
        let winding = ArrayD::from_shape_fn(vec![31, 31], |i| radius(&i) - 6.0);
        let value = ArrayD::from_shape_fn(vec![31, 31], |i| {
            let flipped = extra(i[0] as f64 - 15.0, i[1] as f64 - 15.0);
            if flipped { -winding[&i] } else { winding[&i] }
        });
        (SignField { value, winding }, distance)
    }

    fn inside(phi: &ArrayD<f64>) -> usize {
        phi.iter().filter(|&&v| v < 0.0).count()
    }

    #[test]
    fn a_clean_sign_stays() {
        let (field, distance) = disc(|_, _| false);
        let (phi, report) = synthesize(&field, &distance, 1.5);
        assert_eq!(phi, field.value);
        assert_eq!((report.regions_found, report.regions_removed, report.nodes_clipped), (2, 0, 0));
    }

    #[test]
    fn stray_regions_go_inside_outside_and_at_the_faces() {
        let (field, distance) = disc(|x, y| x.hypot(y) < 2.5 || (x - 11.0).hypot(y) < 2.2 || x < -12.0 || x + y > 24.0);
        assert!(inside(&field.value) > inside(&disc(|_, _| false).0.value));
        let (phi, report) = synthesize(&field, &distance, 1.5);
        assert_eq!(phi, disc(|_, _| false).0.value);
        assert_eq!(report.regions_removed, 4);
    }

    #[test]
    fn an_inside_that_winding_numbers_confirm_needs_no_support() {
        let (mut field, distance) = disc(|_, _| false);
        assert_eq!(inside(&synthesize(&field, &distance, -1.0).0), inside(&field.value));
        field.winding.fill(1.0);
        assert_eq!(inside(&synthesize(&field, &distance, -1.0).0), 0);
    }

    #[test]
    fn a_region_that_no_data_touch_goes_though_winding_numbers_confirm_it() {
        // As where a hole is filled in another way than winding numbers would have it.
        let (mut field, distance) = disc(|x, y| x.hypot(y) < 2.5 || (x - 11.0).hypot(y) < 2.2);
        field.winding = field.value.clone();
        let (phi, report) = synthesize(&field, &distance, 1.5);
        assert_eq!(phi, disc(|_, _| false).0.value);
        assert_eq!(report.regions_removed, 2);
    }

    #[test]
    fn without_any_support_nothing_runs_away() {
        let (mut field, distance) = disc(|_, _| false);
        field.winding.fill(-1.0);
        assert_eq!(synthesize(&field, &distance, -1.0).0, field.value);
    }
}
