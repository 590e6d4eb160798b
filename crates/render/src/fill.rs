//! Filled polygons, row by row.

use crate::canvas::Band;
use crate::colour::Light;

/// The sides of closed curves, in samples.
pub(crate) struct Edges(Vec<[[f64; 2]; 2]>);

impl Edges {
    pub(crate) fn new(loops: impl Iterator<Item = impl Iterator<Item = [f64; 2]>>) -> Self {
        let mut edges = Vec::new();
        for cycle in loops {
            let corners: Vec<[f64; 2]> = cycle.collect();
            edges.extend(corners.iter().zip(corners.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]));
        }
        Self(edges)
    }

    /// Colours the samples inside, by the even-odd rule.
    pub(crate) fn fill(&self, band: &mut Band, colour: Light) {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); band.bottom - band.top];
        for [a, b] in &self.0 {
            let (upper, lower) = if a[1] < b[1] { (a, b) } else { (b, a) };
            // A row whose centre is at the upper end is crossed, one at the lower end is not: so corners count once.
            let (rows, _) = band.clip([0.0, 0.0], [upper[1], lower[1]]);
            for row in rows {
                let y = row as f64 + 0.5;
                if y < lower[1] {
                    let t = (y - upper[1]) / (lower[1] - upper[1]);
                    crossings[row - band.top].push(upper[0] + t * (lower[0] - upper[0]));
                }
            }
        }
        for (row, mut found) in crossings.into_iter().enumerate() {
            found.sort_unstable_by(f64::total_cmp);
            for pair in found.chunks_exact(2) {
                let (_, columns) = band.clip([pair[0], pair[1]], [0.0, 0.0]);
                let first = band.index(band.top + row, 0);
                band.light[first + columns.start..first + columns.end.max(columns.start)].fill(colour);
            }
        }
    }
}
