//! How wide the cells are: of the lattice on which topology is decided, and of those after it.

use crate::lattice::domain::Domain;
use crate::options::Options;
use crate::points::frame::Frame;
use crate::points::spacing::Spacing;

/// The dense lattice in the plane has no more cells along the longest side than there are points, or than so many.
const CHEAP_CELLS: usize = 128;
/// In space it has no more cubic coefficients than so many times the number of points.
const MOST_COEFFICIENTS: f64 = 450.0;

/// Cells along the longest side of the lattice on which topology is decided. In 2D, where it costs next to nothing, the cells
/// follow the spacing of the points, so that narrow gaps stay open; no curve of evenly spaced points wants more than a quarter as many
/// as it has points, but clusters would. In 3D a direct factorisation sets the limit.
pub fn coarse_cells<const D: usize>(spacing: &Spacing) -> usize {
    let mut cells = if D == 2 { 24 } else { 16 };
    while D == 2 && cells < (spacing.local.len() / 4).min(96) && 0.5 / cells as f64 >= 1.5 * spacing.typical {
        cells *= 2;
    }
    cells
}

/// The box, the halvings from its coarsest lattice to that of the initial shape, and how many levels above that are wanted
/// at the typical spacing, if that is not for the spacing to say.
pub struct Lattices<const D: usize> {
    pub domain: Domain<D>,
    pub halvings: u32,
    pub levels: Option<u32>,
}

impl<const D: usize> Lattices<D> {
    /// For points with a spacing, with a margin round the frame.
    pub fn of(frame: &Frame<D>, spacing: &Spacing, margin: f64, options: &Options) -> Self {
        let coarse = coarse_cells::<D>(spacing);
        // On one dense lattice no finer than 64 cells in 3D, for its cost grows with the cube.
        let most = if D == 2 { 4 } else { 2 };
        match options.resolution {
            Some(cells) => {
                // As many halvings as leave a coarse lattice that topology can be decided on.
                let all = (cells / coarse).max(1).ilog2();
                let halvings = if options.degree == 3 { all.min(most) } else { all };
                let domain = Domain::with_margin(&frame.sides, cells.div_ceil(1 << all), margin);
                Self { domain, halvings, levels: Some(all - halvings) }
            }
            None => {
                let domain = Domain::with_margin(&frame.sides, coarse, margin);
                // Cells of about the spacing, in 3D of a third of it, where sparse points leave gaps.
                let finer = if D == 2 { 0.0 } else { 1.5 };
                let wanted = ((domain.spacing / spacing.typical).log2() + finer).round();
                // Round a closed curve of evenly spaced points less than one cell of their spacing per point fits along a side; in
                // clusters far apart millions would. In space cells far narrower than the spacing leave sheets between the points.
                let points = spacing.local.len();
                let few = if D == 2 {
                    (points.max(CHEAP_CELLS) / coarse).max(2).ilog2()
                } else {
                    let fit = |halvings: &u32| domain.coefficients(3, *halvings) <= MOST_COEFFICIENTS * points as f64;
                    (0..=most).rev().find(fit).unwrap_or(0)
                };
                let halvings = (wanted.max(1.0) as u32).min(few).min(most);
                Self { domain, halvings, levels: None }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_far_apart_make_no_huge_lattice() {
        // Eight points on a ring of radius 1e-3 in each corner of a square: the six next to one lie in its own ring.
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let near = |[x, y]: [f64; 2], i: usize| {
            let (s, c) = (i as f64 / 8.0 * std::f64::consts::TAU).sin_cos();
            [x + 1e-3 * c, y + 1e-3 * s]
        };
        let clusters: Vec<[f64; 2]> = corners.iter().flat_map(|corner| (0..8).map(|i| near(*corner, i))).collect();
        let cells = |points: &[[f64; 2]]| {
            let (frame, distinct) = Frame::of(points).unwrap();
            let Lattices { domain, halvings, .. } =
                Lattices::of(&frame, &Spacing::of(&distinct), 0.1, &Options::default());
            (domain.spacing(halvings).recip().round(), Spacing::of(&distinct).typical)
        };
        let (found, spacing) = cells(&clusters);
        assert!(found <= 128.0 && found < 0.1 / spacing, "{found} cells, {spacing}");
        // Round a circle the cells are about as wide as the spacing all the same.
        for count in [40, 200, 1000] {
            let circle: Vec<[f64; 2]> = (0..count)
                .map(|i| (f64::from(i) / f64::from(count) * std::f64::consts::TAU).sin_cos())
                .map(|(s, c)| [c, s])
                .collect();
            let (found, spacing) = cells(&circle);
            assert!((0.6..1.5).contains(&(found * spacing)) || found == 48.0, "{count}: {found} cells, {spacing}");
        }
    }
}
