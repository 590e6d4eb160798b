//! What is written comes back, bit for bit where f64 is stored.

#![allow(clippy::panic, reason = "a panic is how a test fails")]

use std::io::Cursor;
use std::path::Path;

use ndarray::{Array0, Array2, Array3, ArrayD, ArrayView3, ShapeBuilder};
use ndarray_npy::{NpzReader, WriteNpyExt};
use proptest::prelude::*;
use zeroset_io::{
    Curves, EvaluationTable, Field, PointFormat, PointSet, Points, SplineFile, SplineLevel, TriMesh, WriteError,
    parse_points, read_points, read_spline, write_curves, write_field, write_mesh, write_oriented, write_points,
    write_report, write_spline, write_table,
};

const TETRAHEDRON: [[f64; 3]; 4] = [[0.1, 0.0, 0.0], [5e6 + 0.1, 0.0, 0.0], [0.0, 1.0 / 3.0, 0.0], [0.0, 0.0, -1e-300]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

fn space(path: &Path) -> PointSet<3> {
    match read_points(path) {
        Ok(Points::Three(set)) => set,
        other => panic!("{other:?}"),
    }
}

fn bits<const D: usize>(points: &[[f64; D]]) -> Vec<u64> {
    points.as_flattened().iter().map(|c| c.to_bits()).collect()
}

fn any_finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("refused on reading", |c| c.is_finite())
}

/// Level `k` over a root of that shape: every `step`-th function, from the last to the first.
fn level(shape: &[usize], k: usize, step: usize, values: &[f64]) -> SplineLevel {
    let extent: Vec<usize> = shape.iter().map(|n| ((n - 3) << k) + 3).collect();
    let chosen: Vec<usize> = (0..extent.iter().product()).step_by(step).collect();
    let index = Array2::from_shape_fn((chosen.len(), extent.len()), |(row, axis)| {
        let stride: usize = extent[axis + 1..].iter().product();
        (chosen[chosen.len() - 1 - row] / stride % extent[axis]) as i32
    });
    let coefficients = values.iter().copied().cycle().skip(k).take(chosen.len()).collect();
    SplineLevel { index, coefficients }
}

proptest! {
    // Each case writes four files.
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn coordinates_come_back_bit_for_bit(points in prop::collection::vec(prop::array::uniform3(any_finite()), 1..20)) {
        let folder = tempfile::tempdir().unwrap();
        let values = vec![0.0; points.len()];
        for name in ["a.ply", "a.obj", "a.csv"] {
            let path = folder.path().join(name);
            if name == "a.csv" {
                let table = EvaluationTable { points: &points, values: &values, gradients: &[], hessians: &[], distances: &[] };
                write_table(&path, &table).unwrap();
            } else {
                write_mesh(&path, &TriMesh { vertices: &points, normals: &[], triangles: &[], ..Default::default() }).unwrap();
            }
            prop_assert_eq!(bits(&space(&path).points), bits(&points), "{}", name);
        }
        let array = Array2::from_shape_vec((points.len(), 3), points.as_flattened().to_vec()).unwrap();
        let path = folder.path().join("a.npy");
        write_field(&path, &Field { values: array.view().into_dyn(), origin: &[0.0; 2], spacing: &[1.0; 2], confidence: None }).unwrap();
        prop_assert_eq!(bits(&space(&path).points), bits(&points));
    }

    #[test]
    fn splines_come_back_bit_for_bit(
        degree in 1usize..=5,
        extra in prop::collection::vec(0usize..4, 2..=3),
        values in prop::collection::vec(any_finite(), 9 * 9 * 9),
        origin in prop::array::uniform3(any_finite()),
        levels in 0usize..3,
        step in 1usize..40,
        open: bool,
    ) {
        let shape: Vec<usize> = extra.iter().map(|e| degree + 1 + e).collect();
        let knots: Vec<Vec<f64>> = shape.iter().map(|n| (0..n + degree + 1).map(|k| k as f64 / 3.0).collect()).collect();
        let coefficients = ArrayD::from_shape_vec(shape.clone(), values[..shape.iter().product()].to_vec()).unwrap();
        let spline = SplineFile::new(origin[..shape.len()].to_vec(), knots, degree, coefficients).unwrap();
        let levels = if degree == 3 { (1..=levels).map(|k| level(&shape, k, step, &values)).collect() } else { vec![] };
        let spline = spline.with_levels(levels).unwrap().with_open(open);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.npz");
        write_spline(&path, &spline).unwrap();
        let first = std::fs::read(&path).unwrap();
        // A reader that knows no levels must take all dense files, and refuse all others.
        let mut entries = NpzReader::new(Cursor::new(&first)).unwrap();
        let version: Array0<i64> = entries.by_name("version").unwrap();
        prop_assert_eq!(version.into_scalar(), if spline.levels.is_empty() { 1 } else { 2 });
        // −0 and 0 are equal, so the bits are compared by writing again.
        let back = read_spline(&path).unwrap();
        prop_assert_eq!(&back, &spline);
        write_spline(&path, &back).unwrap();
        prop_assert_eq!(std::fs::read(&path).unwrap(), first);
    }
}

#[test]
fn arrays_of_every_number_type_and_layout_are_points() {
    fn read<T: ndarray_npy::WritableElement>(array: &Array2<T>) -> Vec<[f64; 3]> {
        let mut bytes = Vec::new();
        array.write_npy(&mut bytes).unwrap();
        match parse_points(&bytes, PointFormat::Npy) {
            Ok(Points::Three(set)) => set.points,
            other => panic!("{other:?}"),
        }
    }
    let expected = [[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]];
    let value = |(i, j): (usize, usize)| (10 * i + j) as u8;
    let array = Array2::from_shape_fn((2, 3), value);
    let fortran = Array2::from_shape_fn((2, 3).f(), value);
    assert!(!fortran.is_standard_layout());
    macro_rules! each { ($($number:ty)*) => {$(
        assert_eq!(read(&array.mapv(<$number>::from)), expected, stringify!($number));
        assert_eq!(read(&fortran.mapv(<$number>::from)), expected, stringify!($number));
    )*} }
    each!(u8 i16 u16 i32 u32 i64 u64 f32 f64);
    assert_eq!(read(&array.mapv(|n| n as i8)), expected);
    // More than f32 holds.
    assert_eq!(read(&array.mapv(|n| i64::from(n) + (1 << 52) + 1))[0][0], (1u64 << 52) as f64 + 1.0);
}

#[test]
fn oriented_points_come_back_with_their_normals() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("oriented.ply");
    let normals = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -0.5, 0.25]];
    write_oriented(&path, &TETRAHEDRON, &normals, &[1.0, 0.5, 0.25, 0.0], &[false, false, true, false]).unwrap();
    let set = space(&path);
    assert_eq!(set.points, TETRAHEDRON);
    assert_eq!(set.normals.unwrap(), normals);
    let outlier = set.attributes.iter().find(|attribute| attribute.name == "outlier").unwrap();
    assert_eq!(outlier.values, [0.0, 0.0, 1.0, 0.0]);

    write_oriented(&path, &[[1.0, 2.0]], &[[0.0, 1.0]], &[1.0], &[false]).unwrap();
    let set = space(&path);
    assert_eq!((set.points, set.normals), (vec![[1.0, 2.0, 0.0]], Some(vec![[0.0, 1.0, 0.0]])));
    assert!(matches!(write_oriented(&path, &[[1.0, 2.0]], &[], &[1.0], &[false]), Err(WriteError::Invalid { .. })));
}

#[test]
fn points_alone_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.ply");
    let points = [[0.1, -0.0, 1e-310], [f64::MAX, 1.0 / 3.0, -7.0]];
    write_points(&path, &points).unwrap();
    let set = space(&path);
    assert_eq!((bits(&set.points), set.normals), (bits(&points), None));
    let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    assert!(text.contains("element vertex 2\n") && !text.contains("element face"), "{text}");
    assert!(matches!(write_points(path.with_extension("xyz"), &points), Err(WriteError::UnknownExtension(_))));
}

#[test]
fn a_mesh_in_ply_has_the_declared_layout() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    write_mesh(
        &path,
        &TriMesh { vertices: &TETRAHEDRON, normals: &TETRAHEDRON, triangles: &FACES, ..Default::default() },
    )
    .unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    // Vertices: three doubles and three floats; faces: a count byte and three 32-bit indices.
    assert_eq!(bytes.len() - end, 4 * (3 * 8 + 3 * 4) + 4 * (1 + 3 * 4));
    let last = &bytes[bytes.len() - 13..];
    assert_eq!(last, [3, 0, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0]);
}

#[test]
fn a_mesh_in_obj_counts_from_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    write_mesh(&path, &TriMesh { vertices: &TETRAHEDRON, normals: &[], triangles: &FACES, ..Default::default() })
        .unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.ends_with("f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"), "{text}");
    write_mesh(
        &path,
        &TriMesh { vertices: &TETRAHEDRON, normals: &TETRAHEDRON, triangles: &FACES, ..Default::default() },
    )
    .unwrap();
    assert!(std::fs::read_to_string(&path).unwrap().contains("f 1//1 3//3 2//2\n"));
}

#[test]
fn a_mesh_that_does_not_fit_together_is_refused_and_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    std::fs::write(&path, "old").unwrap();
    for (normals, triangles) in [(&TETRAHEDRON[..1], &FACES[..]), (&[], &[[0, 1, 4]])] {
        let error = write_mesh(&path, &TriMesh { vertices: &TETRAHEDRON, normals, triangles, ..Default::default() })
            .unwrap_err();
        assert!(matches!(error, WriteError::Invalid { .. }));
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert!(matches!(
        write_mesh(
            folder.path().join("mesh.stp"),
            &TriMesh { vertices: &[], normals: &[], triangles: &[], ..Default::default() }
        ),
        Err(WriteError::UnknownExtension(_))
    ));
}

#[test]
fn curves_in_json_do_not_repeat_the_first_vertex() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("curves.json");
    let triangle = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 0.1]];
    write_curves(&path, &Curves { curves: &[triangle], ..Default::default() }).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "{\"curves\":[[[0.0,0.0],[1.0,0.0],[0.0,0.1]]]}\n");
    let broken = [vec![[0.0, f64::NAN]]];
    assert!(matches!(
        write_curves(&path, &Curves { curves: &broken, ..Default::default() }),
        Err(WriteError::Invalid { .. })
    ));
}

#[test]
fn curves_in_svg_lie_in_the_view_and_keep_large_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("curves.svg");
    let far = 5e6;
    let square = vec![[far, far], [far + 2.0, far], [far + 2.0, far + 1.0], [far, far + 1.0]];
    let dots = [[far + 1.0, far + 0.5]];
    write_curves(&path, &Curves { curves: &[square], points: &dots, ..Default::default() }).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains(r#"fill-rule="evenodd""#) && text.contains("scale(1 -1)"), "{text}");
    // The margin is 5 % of the longer side, 2; 0.1 is not exact at 5e6, hence only the first digits.
    assert!(text.contains(r#"d="M0.0999"#) || text.contains(r#"d="M0.1"#), "{text}");
    assert_eq!(text.matches("<circle").count(), 1);
    write_curves(&path, &Curves::default()).unwrap();
    write_curves(&path, &Curves { curves: &[], points: &[[1.0, 1.0]], ..Default::default() }).unwrap();
    assert!(!std::fs::read_to_string(&path).unwrap().contains("NaN"));
}

#[test]
fn fields_are_written_in_c_order_from_any_view() {
    let folder = tempfile::tempdir().unwrap();
    let (c_order, f_order) = (folder.path().join("c.npy"), folder.path().join("f.npy"));
    let values = Array3::from_shape_fn((2, 3, 4), |(i, j, k)| (i * 100 + j * 10 + k) as f64);
    let mut fortran = Array3::zeros((2, 3, 4).f());
    fortran.assign(&values);
    let field = |view: ArrayView3<'_, f64>, path: &Path| {
        write_field(path, &Field { values: view.into_dyn(), origin: &[0.0; 3], spacing: &[1.0; 3], confidence: None })
            .unwrap();
        std::fs::read(path).unwrap()
    };
    let bytes = field(values.view(), &c_order);
    assert_eq!(bytes, field(fortran.view(), &f_order));
    assert!(bytes.ends_with(&123f64.to_le_bytes()));
}

#[test]
fn fields_in_exr_have_x_to_the_right_y_up_and_a_layer_for_each_z() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("field.exr");
    let values = Array3::from_shape_fn((4, 3, 2), |(i, j, k)| (i * 100 + j * 10 + k) as f64);
    let field = Field { values: values.view().into_dyn(), origin: &[0.0; 3], spacing: &[1.0; 3], confidence: None };
    write_field(&path, &field).unwrap();
    let image = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
    let names: Vec<String> =
        image.layer_data.iter().map(|l| l.attributes.layer_name.as_ref().unwrap().to_string()).collect();
    assert_eq!(names, ["z0000", "z0001"]);
    for (k, layer) in image.layer_data.iter().enumerate() {
        let pixels: Vec<f32> = layer.channel_data.list[0].sample_data.values_as_f32().collect();
        for row in 0..3 {
            for column in 0..4 {
                assert_eq!(f64::from(pixels[row * 4 + column]), values[[column, 2 - row, k]]);
            }
        }
    }
    let plane = Array2::<f64>::zeros((4, 3));
    write_field(
        &path,
        &Field { values: plane.view().into_dyn(), origin: &[0.0; 2], spacing: &[1.0; 2], confidence: None },
    )
    .unwrap();
    assert_eq!(exr::prelude::read_all_flat_layers_from_file(&path).unwrap().layer_data.len(), 1);
    let misfit = Field { values: plane.view().into_dyn(), origin: &[0.0; 3], spacing: &[1.0; 2], confidence: None };
    assert!(matches!(write_field(&path, &misfit), Err(WriteError::Invalid { .. })));
}

#[test]
fn tables_name_their_columns() {
    let folder = tempfile::tempdir().unwrap();
    let table = EvaluationTable {
        points: &[[1.0, 2.0, 3.0]],
        values: &[4.0],
        gradients: &[[5.0, 6.0, 7.0]],
        hessians: &[[[8.0, 9.0, 10.0], [9.0, 11.0, 12.0], [10.0, 12.0, f64::NAN]]],
        distances: &[-13.0],
    };
    let path = folder.path().join("table.csv");
    write_table(&path, &table).unwrap();
    assert_eq!(
        std::fs::read_to_string(&path).unwrap(),
        "x,y,z,f,fx,fy,fz,fxx,fxy,fxz,fyy,fyz,fzz,distance\n1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,9.0,10.0,11.0,12.0,NaN,-13.0\n"
    );
    // The points of a table can be read again.
    assert_eq!(space(&path).points, [[1.0, 2.0, 3.0]]);
    let short = EvaluationTable { values: &[], ..table };
    assert!(matches!(write_table(&path, &short), Err(WriteError::Invalid { .. })));
}

#[test]
fn a_report_is_indented_json() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.json");
    write_report(&path, &[("residual", f64::NAN)]).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "[\n  [\n    \"residual\",\n    null\n  ]\n]\n");
}
