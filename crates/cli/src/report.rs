//! Reports of a reconstruction: `.json`, and pages.

use clap::ValueEnum;
use serde::Serialize;
use zeroset::isosurface::TriMesh;
use zeroset_report_page::{Drawing, Page, Setting, Surface};

use crate::arguments::{Reconstruct, UpAxis};
use crate::axis_by_axis::{axis_by_axis, bounding_box};
use crate::failure::Failure;
use crate::input;
use crate::picture::PREVIEW;

/// The report as it is written: the file, then what the library says.
#[derive(Serialize)]
struct RunReport<'a> {
    zeroset: &'static str,
    file: &'a str,
    #[serde(flatten)]
    report: &'a zeroset::Report,
}

/// What a page shows of the result.
pub enum Pictures<'a> {
    /// The levels of a plane function as an SVG document.
    Plane { svg: String },
    /// A surface from some sides, as captions with the bytes of PNG files.
    Space { views: Vec<(&'static str, Vec<u8>)>, mesh: &'a TriMesh, points: &'a [[f64; 3]] },
}

/// Writes every report that was asked for; pictures are made only where there is a page.
pub fn write_reports<'a, const D: usize>(
    arguments: &Reconstruct,
    points: &[[f64; D]],
    report: &zeroset::Report,
    pictures: impl Fn() -> Result<Pictures<'a>, Failure>,
) -> Result<(), Failure> {
    for path in &arguments.report {
        if zeroset_io::extension_among(path, &["html"]).is_ok() {
            let html = page(arguments, points, report, &pictures()?);
            zeroset_io::write_page(path, &html).map_err(Failure::writing)?;
        } else {
            let report = RunReport { zeroset: env!("CARGO_PKG_VERSION"), file: &input::names(arguments), report };
            zeroset_io::write_report(path, &report).map_err(Failure::writing)?;
        }
    }
    Ok(())
}

fn page<const D: usize>(
    arguments: &Reconstruct,
    points: &[[f64; D]],
    report: &zeroset::Report,
    pictures: &Pictures,
) -> String {
    let [low, high] = bounding_box(points);
    let sides = axis_by_axis(high, low, |high, low| high - low);
    let others = arguments.output.iter().chain(&arguments.oriented).chain(&arguments.report);
    let outputs: Vec<String> = others.map(|path| path.display().to_string()).collect();
    let (drawings, surface) = match pictures {
        Pictures::Plane { svg } => {
            let caption =
                "The function in bands of equal value, blue inside and sand outside, with the curve and the points";
            (vec![Drawing::Svg { document: svg, caption }], None)
        }
        Pictures::Space { views, mesh, points } => {
            let size = [PREVIEW.width, PREVIEW.height];
            let drawings = views.iter().map(|(caption, bytes)| Drawing::Png { bytes, size, caption }).collect();
            let TriMesh { vertices, normals, triangles } = mesh;
            (drawings, Some(Surface { vertices, normals, triangles, points }))
        }
    };
    Page {
        program: concat!("zeroset ", env!("CARGO_PKG_VERSION")),
        file: &input::names(arguments),
        report,
        sides: &sides,
        settings: &settings(arguments),
        outputs: &outputs,
        drawings: &drawings,
        surface,
        up: match arguments.up {
            UpAxis::Y => [0.0, 1.0, 0.0],
            UpAxis::Z => [0.0, 0.0, 1.0],
        },
    }
    .to_html()
}

/// The options that decide what comes out.
fn settings(arguments: &Reconstruct) -> Vec<Setting<'static>> {
    let given = |name, value: Option<String>, default: &str| Setting {
        name,
        given: value.is_some(),
        value: value.unwrap_or_else(|| default.into()),
    };
    let flag = |name, on: bool| given(name, on.then(|| "yes".into()), "no");
    let standard = |name, value: String, default: &str| Setting { name, given: value != default, value };
    vec![
        given("--resolution", arguments.resolution.map(|n| format!("{n} cells")), "from the spacing of the points"),
        given("--smooth", arguments.smooth.map(|length| length.to_string()), "automatic"),
        given("--robust", arguments.robust.map(|length| length.to_string()), "automatic"),
        given("--margin", arguments.margin.map(|length| length.to_string()), "a few cells"),
        standard("--normals", name_of(arguments.normals), "hint"),
        given("--plane", arguments.plane.map(name_of), "none"),
        given("--box", (!arguments.corners.is_empty()).then(|| numbers(&arguments.corners)), "all points"),
        flag("--open", arguments.open),
        standard("--degree", arguments.degree.to_string(), "3"),
        standard("--topology", name_of(arguments.topology), "continuation"),
        standard("--distance", name_of(arguments.distance), "closest-point"),
        flag("--no-refine", arguments.no_refine),
        flag("--accept-doubt", arguments.accept_doubt),
        given("--memory", arguments.memory.map(|bytes| format!("{} MiB", bytes >> 20)), "70 % of what is free"),
    ]
}

fn numbers(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

/// As it is written on the command line.
fn name_of(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}
