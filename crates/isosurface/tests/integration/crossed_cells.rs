//! An extraction from the cells that bounds do not rule out is the extraction from the whole lattice.

use std::sync::Arc;

use ndarray::ArrayD;
use proptest::prelude::*;
use zeroset_bspline::{BandError, CellBand, HierarchicalSpline, KnotVector, Spline};
use zeroset_isosurface::{
    Curves, Error, LatticeSamples, Options, Report, TriMesh, curve, curve_of, graded_surface_of, surface, surface_of,
};

/// Numbers between −1 and 1 that look random.
fn scattered(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

/// A spline whose coefficients are random numbers, moved towards the outside or the inside.
fn random<const D: usize>(
    cells: [usize; D],
    shift: f64,
    seed: u64,
    points: &[([f64; D], u8)],
) -> HierarchicalSpline<D> {
    let knots = cells.map(|n| KnotVector::uniform(3, 0.0, 1.0 / n as f64, n).unwrap());
    let count = knots.iter().map(KnotVector::basis_count).product();
    let coefficients = scattered(count, seed).into_iter().map(|c| c + shift).collect();
    let (points, levels): (Vec<_>, Vec<_>) = points.iter().copied().unzip();
    let band = CellBand::new(&knots, &points, &levels, [3, 3]).unwrap();
    let mut spline = HierarchicalSpline::new(Spline::from_flat(knots, coefficients).unwrap()).unwrap();
    for (level, active) in (1u64..).zip(band.active()) {
        spline.push_level(Arc::clone(active)).unwrap();
        spline.correct_finest(scattered(active.len(), seed + level)).unwrap();
    }
    spline
}

/// The nodes of the dense lattice with its cells halved.
fn axes<const D: usize>(spline: &HierarchicalSpline<D>, halvings: usize) -> [Vec<f64>; D] {
    spline.root().knots().each_ref().map(|knots| {
        let mut nodes: Vec<f64> = knots.cells().map(|(_, start, _)| start).collect();
        nodes.push(knots.domain().1);
        for _ in 0..halvings {
            let end = nodes.last().copied();
            nodes = nodes.windows(2).flat_map(|w| [w[0], w[0] + 0.5 * (w[1] - w[0])]).chain(end).collect();
        }
        nodes
    })
}

type Found<T> = Result<(T, Report), Error>;

fn surfaces(spline: &HierarchicalSpline<3>, halvings: usize) -> (Found<TriMesh>, Found<TriMesh>) {
    let options = Options::default();
    let dense = LatticeSamples::of(axes(spline, halvings), spline).unwrap();
    (surface_of(spline, halvings as u32, &options), surface(&dense, Some(spline), &options))
}

fn close<const D: usize>(a: &[f64; D], b: &[f64; D]) -> bool {
    // Newton's method squares an error of 1e-9 of a cell: what remains is rounding of values near 1 over slopes that may be
    // small.
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
}

/// The same mesh from both, and closed.
fn check_surface(spline: &HierarchicalSpline<3>, halvings: usize) -> Result<Option<TriMesh>, TestCaseError> {
    let (sparse, dense) = surfaces(spline, halvings);
    let ((sparse, found), (dense, all)) = match (sparse, dense) {
        (Ok(sparse), Ok(dense)) => (sparse, dense),
        (sparse, dense) => {
            prop_assert_eq!(sparse.unwrap_err(), dense.unwrap_err());
            return Ok(None);
        }
    };
    prop_assert_eq!(found, all);
    prop_assert!(sparse.triangles == dense.triangles);
    prop_assert_eq!(sparse.vertices.len(), dense.vertices.len());
    prop_assert!(sparse.vertices.iter().zip(&dense.vertices).all(|(a, b)| close(a, b)));
    let topology = sparse.topology();
    prop_assert!(topology.closed, "{:?}", topology);
    Ok(Some(sparse))
}

fn check_curve(spline: &HierarchicalSpline<2>, halvings: usize) -> Result<Option<Curves>, TestCaseError> {
    let options = Options::default();
    let dense = LatticeSamples::of(axes(spline, halvings), spline).unwrap();
    let (sparse, dense) = (curve_of(spline, halvings as u32, &options), curve(&dense, Some(spline), &options));
    let ((sparse, found), (dense, all)) = match (sparse, dense) {
        (Ok(sparse), Ok(dense)) => (sparse, dense),
        (sparse, dense) => {
            prop_assert_eq!(sparse.unwrap_err(), dense.unwrap_err());
            return Ok(None);
        }
    };
    prop_assert_eq!(found, all);
    prop_assert_eq!(sparse.loops.len(), dense.loops.len());
    for (a, b) in sparse.loops.iter().zip(&dense.loops) {
        prop_assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| close(a, b)));
    }
    Ok(Some(sparse))
}

fn points<const D: usize>(count: usize) -> impl Strategy<Value = Vec<([f64; D], u8)>> {
    let coordinates = proptest::collection::vec(0.0..1.0f64, D);
    let point = coordinates.prop_map(|x| std::array::from_fn(|axis| x[axis]));
    proptest::collection::vec((point, 0u8..=2), 0..count)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn surfaces_are_those_of_the_whole_lattice(
        points in points::<3>(4), shift in -0.4..0.4f64, seed in 0u64..1000, more in 0usize..2,
    ) {
        let spline = random([7, 5, 6], shift, seed, &points);
        let halvings = (spline.levels().len() + more).min(2);
        check_surface(&spline, halvings)?;
    }

    #[test]
    fn curves_are_those_of_the_whole_lattice(
        points in points::<2>(6), shift in -0.4..0.4f64, seed in 0u64..1000, more in 0usize..3,
    ) {
        let spline = random([13, 9], shift, seed, &points);
        check_curve(&spline, spline.levels().len() + more)?;
    }

    #[test]
    fn zeros_on_nodes_and_strong_contrasts_leave_no_hole(
        points in points::<3>(5), seed in 0u64..1000, contrast in 0usize..3,
    ) {
        // Coefficients of −1, 0 and 1, and corrections that are as large or far larger: zeros fall on nodes or next to them.
        let mut spline = random([6, 7, 5], 0.0, seed, &points);
        let rounded = |c: &f64| (1.5 * c).round();
        let root = spline.root().as_flat().iter().map(rounded).collect();
        let root = Spline::from_flat(spline.root().knots().clone(), root).unwrap();
        let factor = [1.0, 1e9, 1e-9][contrast];
        let corrections = |c: &[f64]| c.iter().map(|c| factor * rounded(c)).collect();
        let levels = spline.levels().iter().map(|level| (Arc::clone(level.active()), corrections(level.corrections())));
        spline = HierarchicalSpline::with_levels(root, levels.collect::<Vec<_>>()).unwrap();
        let (mesh, _) = surface_of(&spline, 1, &Options::default()).unwrap();
        prop_assert!(mesh.topology().closed);
    }

    #[test]
    fn splines_without_levels_may_be_any(degree in 1usize..=5, seed in 0u64..1000, halvings in 0usize..3, clamped: bool) {
        let axis = |n: usize| {
            if clamped {
                let ends: Vec<f64> = (0..=n).map(|i| (i as f64 / n as f64).powf(1.3)).collect();
                KnotVector::clamped(degree, &ends).unwrap()
            } else {
                KnotVector::uniform(degree, 0.0, 1.0 / n as f64, n).unwrap()
            }
        };
        let plane = [axis(9), axis(12)];
        let coefficients = scattered(plane.iter().map(KnotVector::basis_count).product(), seed);
        check_curve(&HierarchicalSpline::new(Spline::from_flat(plane, coefficients).unwrap()).unwrap(), halvings)?;
        let space = [axis(5), axis(4), axis(6)];
        let coefficients = scattered(space.iter().map(KnotVector::basis_count).product(), seed);
        check_surface(&HierarchicalSpline::new(Spline::from_flat(space, coefficients).unwrap()).unwrap(), halvings)?;
    }
}

/// A spline of random numbers, rounded to so many steps if any, with small cells around some points, that is positive at the box's faces.
fn walled(
    cells: [usize; 3],
    shift: f64,
    seed: u64,
    points: &[([f64; 3], u8)],
    steps: Option<f64>,
) -> HierarchicalSpline<3> {
    let spline = random(cells, shift, seed, points);
    let rounded = |c: f64| steps.map_or(c, |steps| (steps * c).round());
    let shape = spline.root().shape();
    let wall = |flat: usize| {
        let k = [flat / shape[2] / shape[1], flat / shape[2] % shape[1], flat % shape[2]];
        (0..3).any(|a| k[a] < 4 || k[a] + 4 >= shape[a])
    };
    let root = spline.root().as_flat().iter().enumerate().map(|(flat, c)| if wall(flat) { 30.0 } else { rounded(*c) });
    let root = Spline::from_flat(spline.root().knots().clone(), root.collect()).unwrap();
    let levels = spline.levels().iter().map(|level| {
        let corrections = level.corrections().iter().map(|c| 0.5 * rounded(*c)).collect();
        (Arc::clone(level.active()), corrections)
    });
    HierarchicalSpline::with_levels(root, levels.collect::<Vec<_>>()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn cells_of_several_sizes_leave_no_hole(
        inner in proptest::collection::vec((proptest::array::uniform3(0.3..0.7f64), 1u8..=4), 1..4),
        shift in -0.4..0.4f64, seed in 0u64..1000, steps in 0usize..3, more in 0u32..2,
    ) {
        let steps = [None, Some(1.5), Some(4.0)][steps];
        let spline = walled([13, 12, 14], shift, seed, &inner, steps);
        let halvings = spline.levels().len() as u32 + more;
        let (mesh, report) = match graded_surface_of(&spline, 0..=halvings, &Options::default()) {
            Ok(found) => found,
            Err(error) => { prop_assert_eq!(error, Error::Empty); return Ok(()) }
        };
        let topology = mesh.topology();
        prop_assert!(topology.closed, "{:?}", topology);
        prop_assert_eq!(report.capped, 0);
    }
}

/// |x|² − r² on [−1, 1]³ as a uniform spline: products of the blossom of x² at each basis function's inner knots.
fn sphere(degree: usize, cells: usize, radius: f64) -> Spline<3> {
    let knots = KnotVector::uniform(degree, -1.0, 2.0 / cells as f64, cells).unwrap();
    let square = |r: usize| {
        let t = &knots.knots()[r + 1..=r + degree];
        let pairs = (0..degree).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.map(|(i, j)| t[i] * t[j]).sum::<f64>() / (degree * (degree - 1) / 2) as f64
    };
    let shape = vec![knots.basis_count(); 3];
    let coefficients = ArrayD::from_shape_fn(shape, |i| square(i[0]) + square(i[1]) + square(i[2]) - radius * radius);
    Spline::new([knots.clone(), knots.clone(), knots], coefficients).unwrap()
}

fn is_a_sphere(mesh: &TriMesh, radius: f64, cell: f64) {
    let topology = mesh.topology();
    assert!(topology.closed && topology.components == 1 && topology.genus == 0, "{topology:?}");
    for (vertex, normal) in mesh.vertices.iter().zip(&mesh.normals) {
        let length = vertex.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Newton to rounding.
        assert!((length - radius).abs() < 1e-13);
        assert!((0..3).all(|a| (normal[a] - vertex[a] / length).abs() < 1e-12));
    }
    let volume = mesh.enclosed_volume() / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
    // Triangles with sides up to a cell's diagonal, 1.7 cells, lie up to 1.7² / 6 · cell² / radius below the sphere.
    assert!(volume < 1.0 && 1.0 - volume < 1.5 * (cell / radius).powi(2), "{volume}");
}

#[test]
fn a_sphere_with_levels_on_a_part_of_it() {
    let root = sphere(3, 9, 0.8);
    let points = [[0.8, 0.0, 0.0], [0.0, 0.57, 0.56], [-0.5, -0.5, 0.3]];
    let band = CellBand::new(root.knots(), &points, &[3, 2, 1], [3, 3]).unwrap();
    let mut spline = HierarchicalSpline::new(root).unwrap();
    for active in band.active() {
        spline.push_level(Arc::clone(active)).unwrap();
    }
    for halvings in [3, 4] {
        let (mesh, report) = surface_of(&spline, halvings, &Options::default()).unwrap();
        is_a_sphere(&mesh, 0.8, 2.0 / 9.0 / f64::from(1 << halvings));
        assert_eq!((report.capped, report.unreached), (0, 0));
    }
    for halvings in [3, 4] {
        let (mesh, report) = graded_surface_of(&spline, 0..=halvings, &Options::default()).unwrap();
        // Where it has no levels the dense lattice's cells are halved.
        is_a_sphere(&mesh, 0.8, 1.0 / 9.0);
        let (_, all) = surface_of(&spline, halvings, &Options::default()).unwrap();
        assert!(2 * report.cells < all.cells, "{} of {}", report.cells, all.cells);
        assert_eq!((report.capped, report.unreached), (0, 0));
        // No larger ones where none are wanted, and of one size the same as ever.
        let same = graded_surface_of(&spline, halvings..=halvings, &Options::default());
        assert!(same == surface_of(&spline, halvings, &Options::default()));
    }
    // Never coarser than the finest level.
    assert!(surface_of(&spline, 0, &Options::default()) == surface_of(&spline, 3, &Options::default()));
}

#[test]
fn spheres_of_other_degrees() {
    for degree in [2, 5] {
        let spline = HierarchicalSpline::new(sphere(degree, 12, 0.7)).unwrap();
        let (mesh, _) = surface_of(&spline, 2, &Options::default()).unwrap();
        is_a_sphere(&mesh, 0.7, 2.0 / 48.0);
    }
}

#[test]
fn only_cells_near_the_zero_set_are_kept() {
    let spline = HierarchicalSpline::new(sphere(3, 16, 0.8)).unwrap();
    let counts = [2, 3, 4].map(|halvings| spline.crossed_cells(halvings).unwrap().cells.len());
    // Area: four times as many for half the side. At 256 cells a sphere of radius 102 passes through about 1.5 · 4π · 102².
    assert!((counts[2] as f64 / counts[1] as f64 - 4.0).abs() < 0.3, "{counts:?}");
    assert!(counts[2] < 900_000, "{counts:?}");
}

#[test]
fn the_inside_of_a_full_box_is_capped_at_the_cost_of_its_faces() {
    let knots = KnotVector::uniform(3, 0.0, 1.0, 8).unwrap();
    let root = Spline::from_flat([knots.clone(), knots.clone(), knots], vec![-1.0; 11 * 11 * 11]).unwrap();
    let spline = HierarchicalSpline::new(root).unwrap();
    assert_eq!(spline.crossed_cells(2).unwrap().cells.len(), 32 * 32 * 32 - 30 * 30 * 30);
    let mesh = check_surface(&spline, 2).unwrap().unwrap();
    // Caps lie a thousandth of a cell of ¼ outside, less at the edges.
    assert!((mesh.enclosed_volume() - 512.0).abs() < 0.2);
    let outside = HierarchicalSpline::new(spline.root().scaled(-1.0).unwrap()).unwrap();
    assert_eq!(surface_of(&outside, 2, &Options::default()).unwrap_err(), Error::Empty);
}

#[test]
fn the_bytes_do_not_depend_on_threads() {
    let points: Vec<([f64; 3], u8)> =
        scattered(30, 5).chunks_exact(3).map(|u| ([0, 1, 2].map(|a| 0.5 + 0.5 * u[a]), 2)).collect();
    let spline = random([8, 9, 7], 0.0, 6, &points);
    // Noise: of degree 1, f at the nodes is what the coefficients are.
    let knots = KnotVector::uniform(1, 0.0, 1.0, 15).unwrap();
    let noise = Spline::from_flat([knots.clone(), knots.clone(), knots], scattered(16 * 16 * 16, 8)).unwrap();
    for (spline, halvings) in [(spline, 2), (HierarchicalSpline::new(noise).unwrap(), 0)] {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let extract = || surface_of(&spline, halvings, &Options::default()).unwrap();
            pool.install(|| (spline.crossed_cells(halvings).unwrap(), extract()))
        };
        let one = run(1);
        let report = one.1.1;
        assert!(report.cells > 1000 && report.capped > 0 && (halvings > 0 || report.ambiguous > 0));
        assert!(run(3) == one);
    }
}

#[test]
fn the_bytes_do_not_depend_on_threads_with_cells_of_several_sizes() {
    let inner = [([0.4, 0.5, 0.6], 4), ([0.6, 0.4, 0.5], 3)];
    let spline = walled([13, 12, 14], 0.0, 6, &inner, None);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| graded_surface_of(&spline, 0..=4, &Options::default()).unwrap())
    };
    assert!(run(1) == run(3));
}

#[test]
fn too_many_halvings_are_refused() {
    let spline = HierarchicalSpline::new(sphere(3, 8, 0.8)).unwrap();
    let error = surface_of(&spline, 40, &Options::default()).unwrap_err();
    assert_eq!(error, Error::TooFine(BandError::TooFine(12)));
}
