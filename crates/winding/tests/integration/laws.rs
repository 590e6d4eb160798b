//! What must hold to the last bit, whatever the input.

use proptest::prelude::*;
use zeroset_winding::{LARGEST, Options, Tree, WindingError};

type Arrays<const D: usize> = Vec<[f64; D]>;

fn vectors<const D: usize>(most: usize) -> impl Strategy<Value = Arrays<D>> {
    // On a coarse lattice now and then: equal, collinear and coplanar points.
    let fine = prop::collection::vec(prop::array::uniform::<_, D>(-1.0..1.0f64), 0..most);
    let coarse = prop::collection::vec(prop::array::uniform::<_, D>((-3..4).prop_map(f64::from)), 0..most);
    prop_oneof![fine, coarse]
}

/// Points, as many area vectors, queries of which some are points.
fn cases<const D: usize>() -> impl Strategy<Value = (Arrays<D>, Arrays<D>, Arrays<D>)> {
    (vectors::<D>(700), prop::array::uniform::<_, D>(-1.0..1.0f64), vectors::<D>(100)).prop_map(
        |(points, seed, mut queries)| {
            let areas = (0..points.len())
                .map(|i| seed.map(|s| ((s + 1.1) * 1000.0 * (i + 1) as f64).sin() / points.len() as f64))
                .collect();
            queries.extend(points.iter().step_by(7));
            (points, areas, queries)
        },
    )
}

fn evaluate<const D: usize>(
    points: &[[f64; D]],
    areas: &[[f64; D]],
    queries: &[[f64; D]],
    regularisation: f64,
) -> Vec<f64> {
    let options = Options { regularisation, ..Options::default() };
    let tree = Tree::new(points, options).expect("in range");
    tree.with_normals(areas).expect("in range").evaluate(queries).expect("in range")
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

fn agrees<const D: usize>(points: &[[f64; D]], areas: &[[f64; D]], queries: &[[f64; D]], regularisation: f64) {
    let tree = Tree::new(points, Options { regularisation, ..Options::default() }).expect("in range");
    let winding = tree.with_normals(areas).expect("in range");
    let (fast, direct) =
        (winding.evaluate(queries).expect("in range"), winding.evaluate_direct(queries).expect("in range"));
    for (f, d) in fast.iter().zip(&direct) {
        // The promise, and rounding where a query is next to a point.
        assert!((f - d).abs() <= 1e-3 + 1e-10 * d.abs(), "{f} instead of {d}");
    }
}

fn scales<const D: usize>(points: &[[f64; D]], areas: &[[f64; D]], queries: &[[f64; D]], power: i32) {
    let scaled = |vectors: &[[f64; D]], power: i32| -> Arrays<D> {
        vectors.iter().map(|v| v.map(|x| x * 2f64.powi(power))).collect()
    };
    let expected = evaluate(points, areas, queries, 0.125);
    let found = evaluate(
        &scaled(points, power),
        &scaled(areas, power * (D as i32 - 1)),
        &scaled(queries, power),
        0.125 * 2f64.powi(power),
    );
    assert_eq!(bits(&expected), bits(&found));
}

fn permutes<const D: usize>(points: &[[f64; D]], areas: &[[f64; D]], queries: &[[f64; D]]) {
    let distinct = |vectors: &[[f64; D]]| -> Vec<usize> {
        let mut seen = std::collections::HashSet::new();
        (0..vectors.len()).filter(|&i| seen.insert(vectors[i].map(f64::to_bits))).collect()
    };
    let take = |from: &[[f64; D]], places: &[usize]| -> Arrays<D> { places.iter().map(|&i| from[i]).collect() };
    let mut places = distinct(points);
    let mut queries = take(queries, &distinct(queries));
    let expected = evaluate(&take(points, &places), &take(areas, &places), &queries, 0.0);
    places.reverse();
    queries.reverse();
    let mut found = evaluate(&take(points, &places), &take(areas, &places), &queries, 0.0);
    found.reverse();
    assert_eq!(bits(&expected), bits(&found));
}

fn same_for_threads<const D: usize>(points: &[[f64; D]], areas: &[[f64; D]], queries: &[[f64; D]]) {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        bits(&pool.install(|| evaluate(points, areas, queries, 0.01)))
    };
    let expected = on(1);
    assert!([2, 3, 8].into_iter().all(|threads| on(threads) == expected));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_direct_sum_is_met_in_3d((points, areas, queries) in cases::<3>(), epsilon in 0.0..0.3f64) {
        agrees(&points, &areas, &queries, 0.0);
        agrees(&points, &areas, &queries, epsilon);
    }

    #[test]
    fn the_direct_sum_is_met_in_2d((points, areas, queries) in cases::<2>(), epsilon in 0.0..0.3f64) {
        agrees(&points, &areas, &queries, 0.0);
        agrees(&points, &areas, &queries, epsilon);
    }

    #[test]
    fn scaling_by_a_power_of_two_changes_no_bit((p, a, q) in cases::<3>(), (p2, a2, q2) in cases::<2>(), power in -40..40) {
        scales(&p, &a, &q, power);
        scales(&p2, &a2, &q2, power);
    }

    #[test]
    fn the_order_of_distinct_points_and_queries_changes_no_bit((p, a, q) in cases::<3>(), (p2, a2, q2) in cases::<2>()) {
        permutes(&p, &a, &q);
        permutes(&p2, &a2, &q2);
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let wave = |i: usize, s: f64| (s * i as f64).sin();
    let points: Arrays<3> = (0..9000).map(|i| [wave(i, 1.0), wave(i, 2.3), wave(i, 0.7)]).collect();
    let areas: Arrays<3> = (0..9000).map(|i| [wave(i, 3.0), wave(i, 0.1), wave(i, 5.7)].map(|x| 1e-3 * x)).collect();
    same_for_threads(&points, &areas, &areas);
}

#[test]
fn no_points_wind_around_nothing() {
    assert_eq!(evaluate::<3>(&[], &[], &[[0.0; 3], [1.0; 3]], 0.0), [0.0; 2]);
    assert!(evaluate(&[[0.0; 2]], &[[1.0; 2]], &[], 0.0).is_empty());
}

#[test]
fn numbers_out_of_range_are_refused() -> Result<(), WindingError> {
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1.001 * LARGEST] {
        let refused = |error: WindingError, what: &str| {
            assert!(matches!(&error, WindingError::OutOfRange { what: w, index: 1, .. } if *w == what), "{error}");
        };
        let points = [[0.0, 0.0], [1.0, bad]];
        refused(Tree::new(&points, Options::default()).expect_err("a bad point"), "point");
        let tree = Tree::new(&[[0.0, 1.0], [1.0, 0.0]], Options::default())?;
        refused(tree.with_normals(&points).expect_err("a bad area vector"), "area vector");
        let winding = tree.with_normals(&[[1.0, 0.0], [0.0, 1.0]])?;
        refused(winding.evaluate(&points).expect_err("a bad query"), "query");
        refused(winding.evaluate_direct(&points).expect_err("a bad query"), "query");
        assert!(winding.at(&points[1]).is_err());
        let regularisation = Options { regularisation: bad, ..Options::default() };
        let tolerance = Options { tolerance: bad, ..Options::default() };
        for options in [regularisation, tolerance] {
            assert!(matches!(Tree::<3>::new(&[], options), Err(WindingError::Option { .. })));
        }
    }
    let tree = Tree::new(&[[0.0, 1.0]], Options::default())?;
    assert_eq!(
        tree.with_normals(&[]).expect_err("too few"),
        WindingError::CountMismatch { points: 1, area_vectors: 0 }
    );
    Ok(())
}
