//! What every mesh must be, on random samples and on known surfaces.

use ndarray::ArrayD;
use proptest::prelude::*;
use zeroset_isosurface::{Error, ImplicitFunction, LatticeSamples, Options, Report, TriMesh, surface};

/// A function given by a closure, its gradient by central differences.
struct Function<F>(F);

impl<F: Fn([f64; 3]) -> f64 + Sync> ImplicitFunction<3> for Function<F> {
    fn value_and_gradient(&self, x: &[f64; 3]) -> (f64, [f64; 3]) {
        let step = 1e-6;
        let moved = |axis: usize, by: f64| {
            let mut y = *x;
            y[axis] += by;
            (self.0)(y)
        };
        let gradient = std::array::from_fn(|axis| (moved(axis, step) - moved(axis, -step)) / (2.0 * step));
        ((self.0)(*x), gradient)
    }
}

fn axes(count: usize, half: f64) -> [Vec<f64>; 3] {
    let axis: Vec<f64> = (0..count).map(|i| -half + 2.0 * half * i as f64 / (count - 1) as f64).collect();
    [axis.clone(), axis.clone(), axis]
}

fn extract(count: usize, half: f64, f: impl Fn([f64; 3]) -> f64 + Sync) -> TriMesh {
    let function = Function(f);
    let samples = LatticeSamples::of(axes(count, half), &function).unwrap();
    surface(&samples, Some(&function), &Options::default()).unwrap().0
}

fn torus(x: [f64; 3], big: f64, small: f64) -> f64 {
    (x[0].hypot(x[1]) - big).hypot(x[2]) - small
}

#[test]
fn a_sphere_has_its_area_and_volume() {
    let pi = std::f64::consts::PI;
    let errors = [17, 33, 65].map(|count| {
        let mesh = extract(count, 1.4, |x| x.iter().map(|x| x * x).sum::<f64>() - 1.0);
        let topology = mesh.topology();
        assert!(topology.closed);
        assert_eq!((topology.components, topology.genus, topology.euler_characteristic), (1, 0, 2));
        [mesh.enclosed_volume() / (4.0 / 3.0 * pi) - 1.0, mesh.area() / (4.0 * pi) - 1.0]
    });
    for quantity in 0..2 {
        // Inscribed, so too small; second order, so a quarter for half the cell: 3.5 leaves room for where the cuts fall.
        assert!(errors.iter().all(|error| error[quantity] < 0.0));
        assert!((0..2).all(|k| errors[k][quantity] < 3.5 * errors[k + 1][quantity]), "{errors:?}");
    }
    assert!(errors[2][0] > -2e-3 && errors[2][1] > -2e-3, "{errors:?}");
}

#[test]
fn a_double_torus_has_genus_two() {
    // A thickened lemniscate.
    let f = |x: [f64; 3]| {
        let plane = x[0] * x[0] * (1.0 - x[0] * x[0]) - x[1] * x[1];
        plane * plane + x[2] * x[2] - 0.012
    };
    for count in [40, 71] {
        let topology = extract(count, 1.23, f).topology();
        assert!(topology.closed);
        assert_eq!((topology.components, topology.genus, topology.euler_characteristic), (1, 2, -2));
    }
}

#[test]
fn axes_may_be_uneven() {
    let stretch = |x: &f64| x.signum() * x.abs().powf(1.5);
    let axes = axes(33, 1.2).map(|axis| axis.iter().map(stretch).collect());
    let function = Function(|x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>() - 1.0);
    let samples = LatticeSamples::of(axes, &function).unwrap();
    let (mesh, report) = surface(&samples, Some(&function), &Options::default()).unwrap();
    assert!(mesh.topology().closed && report.unreached == 0 && report.capped == 0);
    // Cells of up to 0.12 a side: relative error of a chord surface up to 0.12² / 4.
    assert!((mesh.enclosed_volume() / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 4e-3);
}

#[test]
fn a_torus_has_its_area_volume_and_genus() {
    let pi = std::f64::consts::PI;
    let mut errors = Vec::new();
    for count in [25, 49] {
        let mesh = extract(count, 1.33, |x| torus(x, 0.8, 0.35));
        let topology = mesh.topology();
        assert!(topology.closed, "{topology:?}");
        assert_eq!((topology.components, topology.genus), (1, 1));
        let volume = 2.0 * pi * pi * 0.8 * 0.35 * 0.35;
        errors.push((mesh.enclosed_volume() / volume - 1.0).abs());
        assert!((mesh.area() / (4.0 * pi * pi * 0.8 * 0.35) - 1.0).abs() < 0.03);
        for (vertex, normal) in mesh.vertices.iter().zip(&mesh.normals) {
            // Newton to rounding; central differences of step 1e-6 know the slope to 1e-10.
            assert!(torus(*vertex, 0.8, 0.35).abs() < 1e-9);
            let ring = vertex[0].hypot(vertex[1]);
            let outward = [0, 1].map(|k| (ring - 0.8) * vertex[k] / ring);
            let along = outward[0] * normal[0] + outward[1] * normal[1] + vertex[2] * normal[2];
            assert!((along / 0.35 - 1.0).abs() < 1e-6);
        }
    }
    // Vertices on the surface, flat triangles between: second order, so a quarter for half the cell; 3 leaves room.
    assert!(errors[0] > 3.0 * errors[1] && errors[1] < 0.02, "{errors:?}");
}

#[test]
fn two_linked_tori_are_two_components() {
    let f = |x: [f64; 3]| torus(x, 0.8, 0.2).min(torus([x[0] - 0.8, x[2], x[1]], 0.8, 0.2));
    let topology = extract(61, 2.05, f).topology();
    assert!(topology.closed);
    assert_eq!((topology.components, topology.genus, topology.euler_characteristic), (2, 2, 0));
}

#[test]
fn what_leaves_the_lattice_is_capped() {
    let function = Function(|x: [f64; 3]| x[0].hypot(x[1]) - 0.5);
    let samples = LatticeSamples::of(axes(21, 1.0), &function).unwrap();
    let (mesh, report) = surface(&samples, Some(&function), &Options::default()).unwrap();
    let topology = mesh.topology();
    assert!(topology.closed && report.capped > 0 && report.unreached == 0);
    assert_eq!((topology.components, topology.genus), (1, 0));
    // Caps face along z, though ∇f does not.
    let cap = |v: &[f64; 3]| v[2].abs() > 1.0 && v[0].hypot(v[1]) < 0.3;
    let normals = mesh.vertices.iter().zip(&mesh.normals).filter(|(vertex, _)| cap(vertex));
    assert!(normals.clone().count() > 0 && normals.into_iter().all(|(vertex, n)| n[2] * vertex[2].signum() > 0.99));
    // A cylinder of height 2; chords of a cell of 0.1: relative error up to (0.1 / 0.5)² / 6.
    assert!((mesh.enclosed_volume() - std::f64::consts::PI * 0.5).abs() < 0.02);
}

#[test]
fn the_bytes_do_not_depend_on_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| extract(40, 1.33, |x| torus(x, 0.8, 0.35)))
    };
    // Noise has caps, tunnels and new vertices in its cells.
    let mut random = random();
    let noise: Vec<f64> = (0..20 * 20 * 20).map(|_| random()).collect();
    let run_noise = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| mesh_of(&noise, 20).unwrap())
    };
    let (one, one_noise) = (run(1), run_noise(1));
    assert!(one_noise.1.ambiguous > 0);
    for threads in [2, 3, 8] {
        assert!(run(threads) == one && run_noise(threads) == one_noise, "{threads} threads");
    }
}

#[test]
fn one_sign_is_an_error() {
    let samples = LatticeSamples::new(axes(3, 1.0), ArrayD::ones(vec![3, 3, 3])).unwrap();
    let none = None::<&Function<fn([f64; 3]) -> f64>>;
    assert_eq!(surface(&samples, none, &Options::default()).unwrap_err(), Error::Empty);
    let mut bad = ArrayD::ones(vec![3, 3, 3]);
    bad[[1, 0, 2].as_slice()] = f64::INFINITY;
    assert_eq!(LatticeSamples::new(axes(3, 1.0), bad).unwrap_err(), Error::NotFinite(vec![1, 0, 2]));
}

#[test]
fn samples_that_do_not_fit_are_refused() {
    let of = |x: Vec<f64>| LatticeSamples::new([x, vec![0.0, 1.0]], ArrayD::ones(vec![3, 2])).unwrap_err();
    assert_eq!(of(vec![0.0, 1.0]), Error::Shape { values: vec![3, 2], axes: vec![2, 2] });
    assert_eq!(of(vec![0.0, 1.0, 1.0]), Error::Axis { axis: 0, index: 2 });
    assert_eq!(of(vec![0.0, f64::NAN, 1.0]), Error::Axis { axis: 0, index: 1 });
    assert_eq!(of(vec![-1e308, 0.0, 1e308]), Error::Extent { axis: 0 });
    let single = LatticeSamples::new([vec![0.0], vec![0.0, 1.0]], ArrayD::ones(vec![1, 2])).unwrap_err();
    assert_eq!(single, Error::Shape { values: vec![1, 2], axes: vec![1, 2] });
}

/// Euler characteristic of {f < 0} for the trilinear interpolant of values on a cube of `n` nodes a side, by counting the
/// nodes, edges, squares and cubes of a lattice `fine` times finer that lie inside with all their corners.
fn sampled_euler(values: &[f64], n: usize, fine: usize) -> i64 {
    let m = (n - 1) * fine + 1;
    let inside: Vec<bool> = refined(values, n, fine).into_iter().map(|value| value < 0.0).collect();
    let mut euler = 0;
    for i in 0..m {
        for j in 0..m {
            for k in 0..m {
                // The cells of every dimension whose lowest corner this node is: a step or none along each axis.
                for extent in 0..8usize {
                    let reach = [extent & 1, extent >> 1 & 1, extent >> 2];
                    if i + reach[0] >= m || j + reach[1] >= m || k + reach[2] >= m {
                        continue;
                    }
                    let all = (0..8usize)
                        .filter(|c| c & !extent == 0)
                        .all(|c| inside[((i + (c & 1)) * m + j + (c >> 1 & 1)) * m + k + (c >> 2)]);
                    if all {
                        euler += if extent.count_ones() % 2 == 0 { 1 } else { -1 };
                    }
                }
            }
        }
    }
    euler
}

/// Random values inside a layer of positive ones, as the extraction itself pads them.
fn padded(values: &[f64], inner: usize) -> Vec<f64> {
    let n = inner + 2;
    let outside = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
    (0..n * n * n)
        .map(|f| [f / (n * n), f / n % n, f % n])
        .map(|[i, j, k]| {
            let within = [i, j, k].iter().all(|&i| i > 0 && i <= inner);
            if within { values[((i - 1) * inner + j - 1) * inner + k - 1] } else { outside }
        })
        .collect()
}

fn mesh_of(values: &[f64], inner: usize) -> Option<(TriMesh, Report)> {
    let array = ArrayD::from_shape_vec(vec![inner; 3], values.to_vec()).unwrap();
    let samples = LatticeSamples::new(axes(inner, 1.0), array).unwrap();
    let none = None::<&Function<fn([f64; 3]) -> f64>>;
    surface(&samples, none, &Options::default()).ok()
}

/// The trilinear interpolant of values on a cube of `n` nodes a side, on the nodes of cells `parts` times smaller.
fn refined(values: &[f64], n: usize, parts: usize) -> Vec<f64> {
    let m = (n - 1) * parts + 1;
    let split = |i: usize| {
        let cell = (i / parts).min(n - 2);
        (cell, (i - cell * parts) as f64 / parts as f64)
    };
    (0..m * m * m)
        .map(|f| [split(f / (m * m)), split(f / m % m), split(f % m)])
        .map(|[(a, u), (b, v), (c, w)]| {
            let pick = |bit: usize, t: f64| if bit == 1 { t } else { 1.0 - t };
            let corner = |[i, j, k]: [usize; 3]| {
                pick(i, u) * pick(j, v) * pick(k, w) * values[((a + i) * n + b + j) * n + c + k]
            };
            (0..8).map(|corners| corner([corners & 1, corners >> 1 & 1, corners >> 2])).sum()
        })
        .collect()
}

/// Numbers in [−1, 1).
fn random() -> impl FnMut() -> f64 {
    let mut state = 7u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }
}

proptest! {
    #[test]
    fn random_samples_give_closed_oriented_manifolds(values in proptest::collection::vec(-1.0..1.0f64, 125)) {
        let Some((mesh, report)) = mesh_of(&values, 5) else { return Ok(()) };
        let topology = mesh.topology();
        prop_assert!(topology.closed, "{topology:?}");
        prop_assert!(mesh.enclosed_volume() > 0.0);
        prop_assert_eq!(report.unclear, 0);
    }

    #[test]
    fn refinement_changes_neither_euler_number_nor_components(
        values in proptest::collection::vec(-1.0..1.0f64, 64),
        parts in 2usize..=3,
    ) {
        let Some((coarse, _)) = mesh_of(&values, 4) else { return Ok(()) };
        let (fine, _) = mesh_of(&refined(&values, 4, parts), 3 * parts + 1).unwrap();
        let (coarse, fine) = (coarse.topology(), fine.topology());
        prop_assert!(fine.closed);
        prop_assert_eq!(coarse.euler_characteristic, fine.euler_characteristic);
        prop_assert_eq!(coarse.components, fine.components);
    }

    #[test]
    fn values_of_exactly_zero_do_no_harm(values in proptest::collection::vec(-2i8..=2, 64)) {
        let values: Vec<f64> = values.into_iter().map(f64::from).collect();
        let Some((mesh, _)) = mesh_of(&values, 4) else { return Ok(()) };
        prop_assert!(mesh.topology().closed);
    }
}

#[test]
fn the_euler_number_is_that_of_the_trilinear_interpolant() {
    let mut random = random();
    let (mut compared, mut tunnels) = (0, 0);
    for _ in 0..60 {
        let values: Vec<f64> = (0..64).map(|_| random()).collect();
        let fields = padded(&values, 4);
        let (coarse, fine) = (sampled_euler(&fields, 6, 8), sampled_euler(&fields, 6, 20));
        // Where two samplings disagree, a neck is thinner than a step: they are no reference then.
        if coarse != fine {
            continue;
        }
        let (mesh, _) = mesh_of(&values, 4).unwrap();
        assert_eq!(mesh.topology().euler_characteristic, 2 * fine, "a closed surface has twice its inside's number");
        compared += 1;
        tunnels += usize::from(fine < 1);
    }
    assert!(compared >= 20 && tunnels > 0, "{compared} fields compared, {tunnels} of them with handles");
}

#[test]
fn triangles_face_outward_even_where_the_surface_meets_nodes() {
    // Spacing 0.1: nodes on the axes lie on the unit sphere, to rounding.
    let function = Function(|x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>() - 1.0);
    let samples = LatticeSamples::of(axes(33, 1.6), &function).unwrap();
    let (mesh, report) = surface(&samples, Some(&function), &Options::default()).unwrap();
    assert!(mesh.topology().closed && report.unreached == 0);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let normal: [f64; 3] = std::array::from_fn(|k| {
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            (b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l])
        });
        let along = |v: [f64; 3]| (0..3).map(|k| normal[k] * v[k]).sum::<f64>();
        // Chords of a cell, 0.1, on a radius of 1 tilt by 0.1 or so.
        assert!(along(a) > 0.9 * along(normal).sqrt());
    }
}
