//! Pictures whose content is known.

use std::f64::consts::PI;

use zeroset_render::{Image, Layer, Plan, RenderError, Scene, Size, Up, View, draw};

type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// A sphere of radius 1 around `centre` by rings, outward.
fn sphere(centre: [f64; 3]) -> Mesh {
    let (rings, sectors) = (60u32, 120u32);
    let at = |ring: u32, sector: u32| {
        let (s, c) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        let (sine, cosine) = (2.0 * PI * f64::from(sector) / f64::from(sectors)).sin_cos();
        [centre[0] + s * cosine, centre[1] + s * sine, centre[2] + c]
    };
    let vertices = (0..=rings).flat_map(|ring| (0..sectors).map(move |sector| at(ring, sector))).collect();
    let number = |ring: u32, sector: u32| ring * sectors + sector % sectors;
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b, c, d] =
                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(down, right)| number(ring + down, sector + right));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (vertices, triangles)
}

fn scene((vertices, triangles): &Mesh) -> Scene<'_> {
    Scene { vertices, triangles, ..Scene::default() }
}

const SIZE: Size = Size { width: 200, height: 200 };

/// Pixels that are not white.
fn covered(image: &Image) -> usize {
    image.rgb.chunks(3).filter(|pixel| *pixel != [255; 3]).count()
}

#[test]
fn a_sphere_has_its_silhouette_and_its_shade() {
    // Far from the origin, as measured data are.
    let centre = [5e6, -5e6, 500.0];
    let sphere = sphere(centre);
    let normals: Vec<[f64; 3]> = sphere.0.iter().map(|p| std::array::from_fn(|k| p[k] - centre[k])).collect();
    let scene = Scene { normals: &normals, ..scene(&sphere) };
    for view in [View::front(Up::Y), View::oblique(Up::Z), View::top(Up::Y)] {
        let image = draw(&scene, &[view], SIZE).unwrap();
        // A margin of 5 % leaves a radius of 90 pixels, and half of those on the rim count too much: 2 π · 90 / 2 of them.
        let area = covered(&image) as f64 - PI * 90.0;
        assert!((area / (PI * 90.0 * 90.0) - 1.0).abs() < 0.01, "{area}");
        // What a normal towards the viewer gives; the pixel's centre is half a pixel off.
        let close = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1);
        assert!(close(image.pixel(100, 100), [171, 190, 215]), "{:?}", image.pixel(100, 100));
        let sum = |row| image.pixel(100, row).map(u32::from).iter().sum::<u32>();
        assert!(sum(60) > sum(140) + 60, "light comes from above");
    }
}

#[test]
fn the_inside_is_orange() {
    let mut inverted = sphere([0.0; 3]);
    inverted.1.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    let image = draw(&scene(&inverted), &[View::front(Up::Y)], SIZE).unwrap();
    let is_orange = |pixel: &[u8]| i32::from(pixel[0]) - i32::from(pixel[2]) > 40;
    assert!(image.rgb.chunks(3).filter(|pixel| is_orange(pixel)).count() > 24_000);
    let outward = draw(&scene(&sphere([0.0; 3])), &[View::front(Up::Y)], SIZE).unwrap();
    assert!(!outward.rgb.chunks(3).any(is_orange));
}

#[test]
fn points_are_seen_in_front_of_the_surface_and_hidden_behind_it() {
    let sphere = sphere([0.0; 3]);
    let with = |points: &[[f64; 3]]| {
        draw(&Scene { points, ..scene(&sphere) }, &[View::front(Up::Y)], SIZE).unwrap().pixel(100, 100)
    };
    let without = draw(&scene(&sphere), &[View::front(Up::Y)], SIZE).unwrap().pixel(100, 100);
    assert_ne!(with(&[[0.0, 0.0, 1.0]]), without);
    assert_eq!(with(&[[0.0, 0.0, 0.8], [0.0, 0.0, -1.0]]), without);
    // Alone they are drawn too, and so is a single one.
    let points = &[[3.0, 4.0, 5.0]];
    let image = draw(&Scene { points, ..Scene::default() }, &[View::front(Up::Y)], SIZE).unwrap();
    assert_ne!(image.pixel(100, 100), [255; 3]);
}

#[test]
fn views_stand_side_by_side_in_one_scale() {
    let size = Size { width: 100, height: 50 };
    let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let scene = Scene { vertices: &corners, triangles: &triangles, ..Scene::default() };
    let image =
        draw(&scene, &[View::front(Up::Y), View::top(Up::Y), View::from_direction([1.0, 0.0, 0.0])], size).unwrap();
    assert_eq!((image.size, image.rgb.len()), (Size { width: 300, height: 50 }, 45_000));
    let columns =
        |from: usize| (from..from + 100).filter(|x| (0..50).any(|y| image.pixel(*x, y) != [255; 3])).count() as i32;
    // 4 long and 90 pixels wide, seen from the side half as wide as 1 is long.
    assert!((columns(0) - 90).abs() <= 2 && (columns(100) - 90).abs() <= 2 && (columns(200) - 11).abs() <= 2);
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let sphere = sphere([0.0; 3]);
    let scene = Scene { points: &sphere.0, ..scene(&sphere) };
    let loops = vec![vec![[0.1, 0.1], [0.9, 0.2], [0.4, 0.8]]];
    let layers = [Layer { loops: loops.clone(), colour: [9, 90, 200] }];
    let plan = plan(&layers, &loops);
    let pictures = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (draw(&scene, &[View::oblique(Up::Y)], SIZE).unwrap(), plan.draw(SIZE).unwrap()))
    };
    assert_eq!(pictures(1), pictures(3));
}

fn plan<'a>(layers: &'a [Layer], curves: &'a [Vec<[f64; 2]>]) -> Plan<'a> {
    Plan { lower: [0.0; 2], upper: [1.0; 2], background: [255; 3], layers, curves, points: &[] }
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let one = [View::front(Up::Y)];
    let sphere = sphere([0.0; 3]);
    assert_eq!(draw(&Scene::default(), &one, SIZE), Err(RenderError::Empty));
    assert_eq!(draw(&scene(&sphere), &[], SIZE), Err(RenderError::Empty));
    for (width, height) in [(0, 10), (10, 0), (20_000, 10), (16_000, 16_000), (usize::MAX, usize::MAX)] {
        let size = Size { width, height };
        assert!(matches!(draw(&scene(&sphere), &one, size), Err(RenderError::Size { .. })), "{size:?}");
    }
    let wrong = Scene { triangles: &[[0, 1, 9_999_999]], ..scene(&sphere) };
    assert!(matches!(draw(&wrong, &one, SIZE), Err(RenderError::Corner { corner: 9_999_999, .. })));
    let wrong = Scene { normals: &[[0.0, 0.0, 1.0]], ..scene(&sphere) };
    assert!(matches!(draw(&wrong, &one, SIZE), Err(RenderError::Normals { normals: 1, .. })));
    for coordinate in [f64::NAN, f64::INFINITY] {
        let wrong = Scene { points: &[[0.0, coordinate, 0.0]], ..scene(&sphere) };
        assert_eq!(draw(&wrong, &one, SIZE), Err(RenderError::NotFinite { what: "points" }));
    }
    let far = Scene { points: &[[f64::MAX, 0.0, 0.0], [-f64::MAX, 0.0, 0.0]], ..Scene::default() };
    assert!(matches!(draw(&far, &one, SIZE), Err(RenderError::NotFinite { .. })));
    let flat = Plan { upper: [1.0, 0.0], ..plan(&[], &[]) };
    assert_eq!(flat.draw(SIZE), Err(RenderError::Empty));
    assert_eq!(flat.to_svg(100), Err(RenderError::Empty));
    let wrong = vec![vec![[0.0, f64::NAN]]];
    assert_eq!(plan(&[], &wrong).draw(SIZE), Err(RenderError::NotFinite { what: "curves" }));
}

#[test]
fn a_plan_is_filled_by_the_even_odd_rule_with_y_up() {
    let square = |low: f64, high: f64| vec![[low, low], [high, low], [high, high], [low, high]];
    let layers = [
        Layer { loops: vec![square(0.1, 0.9), square(0.3, 0.5)], colour: [10, 20, 30] },
        Layer { loops: vec![square(0.6, 0.8)], colour: [200, 0, 0] },
    ];
    let plan = plan(&layers, &[]);
    let image = plan.draw(SIZE).unwrap();
    let count = |colour: [u8; 3]| image.rgb.chunks(3).filter(|pixel| *pixel == colour).count();
    // Sides of 160, 40 and 40 pixels, whose corners lie between pixels.
    assert_eq!((count([10, 20, 30]), count([200, 0, 0])), (160 * 160 - 2 * 40 * 40, 40 * 40));
    assert_eq!(image.pixel(80, 120), [255; 3], "the hole lies at the lower left");
    assert_eq!(image.pixel(140, 60), [200, 0, 0], "the other square at the upper right");
    let svg = plan.to_svg(200).unwrap();
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    assert!(
        svg.contains(r##"<path fill="#0a141e" fill-rule="evenodd" d="M20 180L180 180L180 20L20 20ZM60 140"##),
        "{svg}"
    );
}
