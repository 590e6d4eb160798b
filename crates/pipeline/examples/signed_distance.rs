//! A signed distance oracle: `cargo run --release -p zeroset --example signed_distance`.
//!
//! f itself has the right sign everywhere in its box, and near the surface it is close to the distance. Where the distance must be
//! right farther away too, look for the nearest place of the surface: first among the mesh's vertices, then along f.

use std::error::Error;
use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use zeroset::bspline::HierarchicalSpline;
use zeroset::{Options, extract_surface, reconstruct};
use zeroset_io::{Points, read_points};

struct Oracle {
    /// The function's coordinates are relative to this.
    origin: [f64; 3],
    f: HierarchicalSpline<3>,
    vertices: Vec<[f64; 3]>,
    tree: ImmutableKdTree<f64, 3>,
}

impl Oracle {
    fn new(points: &[[f64; 3]]) -> Result<Self, Box<dyn Error>> {
        let mut shape = reconstruct(points, &Options::default())?;
        let (mesh, _) = extract_surface(&mut shape)?;
        let (origin, f) = shape.in_data_units()?;
        let vertices: Vec<[f64; 3]> = mesh.vertices.iter().map(|v| minus(*v, origin)).collect();
        let tree = ImmutableKdTree::new_from_slice(&vertices)?;
        Ok(Self { origin, f, vertices, tree })
    }

    /// The distance from the surface, negative inside.
    fn distance(&self, x: [f64; 3]) -> f64 {
        let x = minus(x, self.origin);
        let nearest = self.tree.query(&x).nearest_n::<SquaredEuclidean<f64>>(NonZero::<usize>::MIN).execute();
        let mut foot = self.vertices[nearest[0].item as usize];
        // Each step slides along the tangent plane to below x, then back onto f = 0 by a Newton step.
        for _ in 0..6 {
            let (_, g) = self.f.value_and_gradient(&foot);
            let to_x = minus(x, foot);
            let off = dot(to_x, g) / dot(g, g);
            let below: [f64; 3] = std::array::from_fn(|k| foot[k] + to_x[k] - off * g[k]);
            let (value, g) = self.f.value_and_gradient(&below);
            let next: [f64; 3] = std::array::from_fn(|k| below[k] - value / dot(g, g) * g[k]);
            // Where the surface bends away the vertex was the better answer.
            if length(minus(x, next)) < length(to_x) {
                foot = next;
            } else {
                break;
            }
        }
        // Beyond its box f is not defined; that is outside.
        let inside = self.f.value(&x) < 0.0;
        length(minus(x, foot)) * if inside { -1.0 } else { 1.0 }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/points/double_torus.ply");
    let Points::Three(set) = read_points(fixture)? else { return Err("points in space are needed".into()) };
    let oracle = Oracle::new(&set.points)?;

    for x in [[0.0, 0.0, 0.0], [0.45, 0.45, 0.0], [1.2, 0.0, 0.0], [0.0, 0.0, 5.0]] {
        println!("{x:?}: {:+.5}", oracle.distance(x));
    }
    // The points themselves lie on the surface.
    let worst = set.points.iter().map(|p| oracle.distance(*p).abs()).fold(0.0, f64::max);
    println!("farthest of the {} points: {worst:.5}", set.points.len());
    Ok(())
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
