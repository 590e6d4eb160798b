//! The tree code against the direct sum, on fixed clouds.

use std::f64::consts::{PI, TAU};

use zeroset_winding::{Options, Tree, WindingError};

/// What the crate promises with the default tolerance.
const TOLERANCE: f64 = 1e-3;

/// Numbers in 0 to 1 from a fixed seed (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction<const D: usize>(&mut self) -> [f64; D] {
        loop {
            let v: [f64; D] = std::array::from_fn(|_| 2.0 * self.next() - 1.0);
            let square = v.iter().map(|x| x * x).sum::<f64>();
            if (1e-2..1.0).contains(&square) {
                return v.map(|x| x / square.sqrt());
            }
        }
    }
}

/// Oriented points with their mean spacing.
#[derive(Clone)]
struct Cloud<const D: usize> {
    points: Vec<[f64; D]>,
    area_vectors: Vec<[f64; D]>,
    spacing: f64,
}

fn along<const D: usize>(p: &[f64; D], step: f64, n: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| p[k] + step * n[k])
}

fn norm<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl<const D: usize> Cloud<D> {
    /// The same points with directions by chance, areas kept.
    fn disoriented(&self) -> Self {
        let mut random = Random(7);
        let area_vectors = self.area_vectors.iter().map(|a| random.direction().map(|x| x * norm(a))).collect();
        Self { area_vectors, ..self.clone() }
    }

    /// At the points, beside them from closest to several spacings on both sides, between, and far away.
    fn queries(&self) -> Vec<[f64; D]> {
        let mut random = Random(3);
        let mut queries = Vec::new();
        for (p, a) in self.points.iter().zip(&self.area_vectors) {
            let n = a.map(|x| x / norm(a).max(1e-300));
            let sides = [0.0, 1e-9, 0.1, -0.5, 1.0, -1.0, 3.0, -10.0];
            queries.push(along(p, self.spacing * sides[(random.next() * 8.0) as usize], &n));
        }
        queries.extend((0..200).map(|_| std::array::from_fn(|_| 4.0 * random.next() - 2.0)));
        queries.extend([[0.0; D], [30.0; D], [-1e9; D], [1e40; D]]);
        queries
    }

    fn check(&self, name: &str) -> Result<(), WindingError> {
        for regularisation in [0.0, self.spacing] {
            let tree = Tree::new(&self.points, Options { regularisation, ..Options::default() })?;
            let winding = tree.with_normals(&self.area_vectors)?;
            let queries = self.queries();
            let (fast, direct) = (winding.evaluate(&queries)?, winding.evaluate_direct(&queries)?);
            for (i, (f, d)) in fast.iter().zip(&direct).enumerate() {
                // Next to a point without regularisation W is huge, and both sums round.
                let rounding = 1e-10 * d.abs();
                let error = (f - d).abs() - rounding;
                assert!(error <= TOLERANCE, "{name}, ε {regularisation}: {f} instead of {d} at {:?}", queries[i]);
                if i % 97 == 0 {
                    assert!((winding.at(&queries[i])? - d).abs() - rounding <= TOLERANCE, "{name}: alone at {i}");
                }
            }
        }
        Ok(())
    }
}

/// A sphere with bumps; `uneven` crowds the points towards one pole.
fn sphere(count: usize, uneven: f64) -> Cloud<3> {
    let mut cloud = Cloud { points: vec![], area_vectors: vec![], spacing: (4.0 * PI / count as f64).sqrt() };
    for i in 0..count {
        let t = (i as f64 + 0.5) / count as f64;
        let (z, phi) = (2.0 * t.powf(uneven) - 1.0, PI * (3.0 - 5f64.sqrt()) * i as f64);
        let w = (1.0 - z * z).sqrt();
        let n = [w * phi.cos(), w * phi.sin(), z];
        // Without the bumps in the areas and normals: they are oriented points as others are.
        let area = 2.0 * TAU / count as f64 * uneven * t.powf(uneven - 1.0);
        cloud.points.push(n.map(|x| x * (1.0 + 0.1 * (5.0 * z).sin() * (4.0 * phi).sin())));
        cloud.area_vectors.push(n.map(|x| area * x));
    }
    cloud
}

/// A flower; `uneven` crowds the points towards one end of the parameter.
fn flower(count: usize, uneven: f64) -> Cloud<2> {
    let mut cloud = Cloud { points: vec![], area_vectors: vec![], spacing: TAU / count as f64 };
    for i in 0..count {
        let t = (i as f64 + 0.5) / count as f64;
        let angle = TAU * t.powf(uneven);
        let (r, slope) = (1.0 + 0.3 * (5.0 * angle).cos(), -1.5 * (5.0 * angle).sin());
        let step = TAU / count as f64 * uneven * t.powf(uneven - 1.0);
        cloud.points.push([r * angle.cos(), r * angle.sin()]);
        cloud
            .area_vectors
            .push([step * (slope * angle.sin() + r * angle.cos()), step * (-slope * angle.cos() + r * angle.sin())]);
    }
    cloud
}

/// A square plate in a coordinate plane, all normals alike: errors of boxes have no reason to cancel.
fn plate(side: usize) -> Cloud<3> {
    let h = 1.0 / side as f64;
    let points: Vec<[f64; 3]> =
        (0..side * side).map(|i| [h * (i / side) as f64 - 0.5, 0.25, h * (i % side) as f64 - 0.5]).collect();
    Cloud { area_vectors: vec![[0.0, h * h, 0.0]; points.len()], points, spacing: h }
}

#[test]
fn closed_surfaces() -> Result<(), WindingError> {
    for (name, cloud) in [("even", sphere(2000, 1.0)), ("uneven", sphere(2000, 3.0)), ("crowded", sphere(2000, 8.0))] {
        cloud.check(name)?;
        cloud.disoriented().check(&format!("{name}, disoriented"))?;
    }
    Ok(())
}

#[test]
fn closed_curves() -> Result<(), WindingError> {
    for (name, cloud) in [("even", flower(2000, 1.0)), ("uneven", flower(2000, 3.0)), ("crowded", flower(2000, 8.0))] {
        cloud.check(name)?;
        cloud.disoriented().check(&format!("{name}, disoriented"))?;
    }
    Ok(())
}

#[test]
fn coplanar_and_collinear_points() -> Result<(), WindingError> {
    plate(60).check("plate")?;
    plate(60).disoriented().check("plate, disoriented")?;
    let h = 1e-3;
    let points: Vec<[f64; 2]> = (0..2500).map(|i| [h * f64::from(i) - 1.25, 0.0]).collect();
    let line = Cloud { area_vectors: vec![[0.0, h]; points.len()], points, spacing: h };
    line.check("line")?;
    line.disoriented().check("line, disoriented")?;
    let points: Vec<[f64; 3]> = (0..2500).map(|i| [0.0, h * f64::from(i) - 1.25, 0.5]).collect();
    let wire = Cloud { area_vectors: vec![[h * 0.1, 0.0, 0.0]; points.len()], points, spacing: h };
    wire.check("wire")
}

#[test]
fn equal_points() -> Result<(), WindingError> {
    let one = Cloud { points: vec![[0.1, 0.2, 0.3]], area_vectors: vec![[0.0, 1e-3, 0.0]], spacing: 0.1 };
    one.check("one")?;
    let mut many = sphere(500, 1.0);
    many.points.extend([[0.3, -0.4, 0.5]; 3000]);
    many.area_vectors.extend([[1e-5, 2e-5, -3e-5]; 3000]);
    many.check("3000 equal points among others")?;
    many.disoriented().check("3000 equal points among others, disoriented")
}

#[test]
fn area_vectors_much_too_large() -> Result<(), WindingError> {
    // Unit normals without areas: W is of the order of thousands, and its absolute error is kept all the same.
    let mut random = Random(11);
    let points: Vec<[f64; 3]> = (0..2000).map(|_| random.direction()).collect();
    let area_vectors = points.iter().map(|_| random.direction()).collect();
    Cloud { points, area_vectors, spacing: 0.05 }.check("unit normals")?;
    let points: Vec<[f64; 2]> = (0..2000).map(|_| random.direction()).collect();
    let area_vectors = points.iter().map(|_| random.direction()).collect();
    Cloud { points, area_vectors, spacing: 0.003 }.check("unit normals in 2D")
}

#[test]
fn all_terms_of_one_sign() -> Result<(), WindingError> {
    // Directions away from one place: there no term cancels another, W is the largest that these areas allow.
    let place = [0.2, 0.9, -0.1];
    let mut random = Random(5);
    let mut cloud = sphere(20_000, 1.0);
    for point in cloud.points.iter_mut().step_by(2) {
        // Half of them scattered in the inside.
        let shrunk = random.next().cbrt();
        *point = point.map(|x| x * shrunk);
    }
    for (point, area) in cloud.points.iter().zip(&mut cloud.area_vectors) {
        let away = along(point, -1.0, &place);
        *area = away.map(|x| x * norm(area) / norm(&away));
    }
    let queries: Vec<[f64; 3]> = (0..64).map(|_| along(&place, 0.01 * random.next(), &random.direction())).collect();
    let tree = Tree::new(&cloud.points, Options { regularisation: cloud.spacing, ..Options::default() })?;
    let winding = tree.with_normals(&cloud.area_vectors)?;
    let (fast, direct) = (winding.evaluate(&queries)?, winding.evaluate_direct(&queries)?);
    for (f, d) in fast.iter().zip(&direct) {
        assert!((f - d).abs() <= TOLERANCE && *d > 1.0, "{f} instead of {d}");
    }
    Ok(())
}
