//! What was read, what came out, and how far to trust it, in words.

use std::fmt::Write;

use zeroset::{ExtractionReport, Figures, NO_TRUST, Report, SOME_DOUBT, StageFigures};

use crate::markup::{Text, along, bytes, count, counted, facts, figure, percent, seconds};

fn extraction(report: &Report) -> Option<&ExtractionReport> {
    report.stages.iter().rev().find_map(|stage| match &stage.figures {
        StageFigures::Extraction(extraction) => Some(extraction),
        _ => None,
    })
}

pub(crate) fn total_seconds(report: &Report) -> f64 {
    report.stages.iter().map(|stage| stage.seconds).sum()
}

/// The result.
pub(crate) fn in_one_sentence(report: &Report) -> String {
    match extraction(report).map(|extraction| &extraction.zero_set) {
        Some(Figures::Surface { topology: t, area, volume, .. }) if t.closed => format!(
            "A closed surface: {} of genus {}, volume {}, area {}.",
            counted(t.components, "component"),
            t.genus,
            figure(*volume),
            figure(*area)
        ),
        Some(Figures::Surface { topology: t, area, .. }) => format!(
            "An open surface: {} of genus {} with {}, area {}.",
            counted(t.components, "component"),
            t.genus,
            counted(t.boundary_loops, "boundary loop"),
            figure(*area)
        ),
        Some(Figures::Curve { topology: t, .. }) if t.paths > 0 => format!(
            "A curve: {} and {}, length {}.",
            counted(t.paths, "open path"),
            counted(t.loops, "closed loop"),
            figure(t.length)
        ),
        Some(Figures::Curve { topology: t, .. }) => format!(
            "A closed curve: {} with {}, area {}, length {}.",
            counted(t.parts, "part"),
            counted(t.holes, "hole"),
            figure(t.area),
            figure(t.length)
        ),
        None => "Nothing was extracted.".into(),
    }
}

/// The figures that most people look for.
pub(crate) fn tiles(report: &Report) -> String {
    let mut tiles = vec![("points", count(report.input.points))];
    match extraction(report).map(|extraction| &extraction.zero_set) {
        Some(Figures::Surface { triangles, area, volume, topology: t, .. }) => {
            tiles.push(("components", count(t.components)));
            tiles.push(("genus", t.genus.to_string()));
            tiles.push(if t.closed {
                ("volume", figure(*volume))
            } else {
                ("boundary loops", count(t.boundary_loops))
            });
            tiles.push(("area", figure(*area)));
            tiles.push(("triangles", count(*triangles)));
        }
        Some(Figures::Curve { vertices, topology: t, .. }) => {
            tiles.push(("closed loops", count(t.loops)));
            tiles.push(if t.paths > 0 { ("open paths", count(t.paths)) } else { ("area", figure(t.area)) });
            tiles.push(("length", figure(t.length)));
            tiles.push(("vertices", count(*vertices)));
        }
        None => {}
    }
    tiles.push(("time", seconds(total_seconds(report))));
    let mut html = String::from("<dl class=\"tiles\">\n");
    for (name, value) in tiles {
        let _ = writeln!(html, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    html.push_str("</dl>\n");
    html
}

pub(crate) fn read(report: &Report, file: &str, sides: &[f64]) -> String {
    let input = &report.input;
    let ratio = input.noise / input.spacing;
    let noise = match ratio {
        r if r < 0.1 => "hardly any: below a tenth of the spacing",
        r if r < 0.5 => "some, but less than half of the spacing",
        r if r < 1.0 => "much: near the spacing, so fine detail is smoothed away",
        _ if input.averaged.is_some() => "more than the spacing",
        _ => "more than the spacing: only the coarse shape can be had",
    };
    let dimension =
        if input.dimension == 2 { "x and y: a curve in the plane" } else { "x, y and z: a surface in space" };
    let mut rows = vec![
        ("file", Text(file).to_string(), ""),
        ("points", count(input.points), dimension),
        (
            "sides of their box",
            along(sides.iter().map(|side| figure(*side))),
            "all lengths here are in the unit of the file, which it does not say",
        ),
        ("typical spacing", figure(input.spacing), "from a point to its neighbours; much finer detail cannot be seen"),
        ("noise", figure(input.noise), noise),
    ];
    if let Some(means) = input.averaged {
        rows.push((
            "means that were fitted",
            count(means),
            "in the points' place, for their noise is deeper than they are apart",
        ));
    }
    if let Some(apart) = input.in_lines {
        let why = "the points lie in lines, much closer along than across; so many are as far apart as the spacing says, the others between";
        rows.push(("apart from each other", count(apart), why));
    }
    if let Some(tails) = &input.heavy_tails {
        rows.push((
            "points with less weight",
            count(tails.points),
            "they lie so much farther off than their neighbours that they count less than half",
        ));
    }
    if input.repeated > 0 {
        rows.push(("repeated points", count(input.repeated), "counted once"));
    }
    let share = input.outliers as f64 / input.points.max(1) as f64;
    let outliers = if input.outliers > 0 {
        format!("{} of the points lie on no surface with others; they were not fitted", percent(share))
    } else {
        "every point lies on a surface with others".into()
    };
    rows.push(("outliers", count(input.outliers), &outliers));
    facts("The points", &rows)
}

pub(crate) fn result(report: &Report) -> String {
    let Some(extraction) = extraction(report) else { return String::new() };
    let closing = "the part that is far from every point: it closes holes, and no point vouches for it";
    let mut rows = Vec::new();
    let caption = match &extraction.zero_set {
        Figures::Surface { vertices, triangles, area, volume, unsupported_area, unsupported_share, topology: t } => {
            rows.push(("components", count(t.components), "connected parts".to_string()));
            rows.push((
                "genus",
                t.genus.to_string(),
                "handles or tunnels of all parts together: a ball has none, a ring one".into(),
            ));
            let edges = match (t.closed, t.non_manifold_edges + t.non_manifold_vertices) {
                (true, _) => "watertight: every edge has two triangles",
                (false, 0) => "it ends where the points do",
                _ => "there are edges or vertices where more than one sheet meets",
            };
            rows.push(("closed", if t.closed { "yes" } else { "no" }.into(), edges.into()));
            if t.boundary_loops > 0 {
                rows.push((
                    "boundary loops",
                    count(t.boundary_loops),
                    format!("with {} edges", count(t.boundary_edges)),
                ));
            }
            if t.closed {
                rows.push(("volume", figure(*volume), "enclosed, in the file's unit cubed".into()));
            }
            rows.push(("area", figure(*area), "in the file's unit squared".into()));
            rows.push((
                "without points",
                format!("{} ({})", percent(*unsupported_share), figure(*unsupported_area)),
                closing.into(),
            ));
            rows.push(("mesh", format!("{} triangles", count(*triangles)), format!("{} vertices", count(*vertices))));
            "The surface"
        }
        Figures::Curve { vertices, unsupported_length, unsupported_share, topology: t } => {
            rows.push((
                "closed loops",
                count(t.loops),
                format!(
                    "{} and {}",
                    counted(t.parts, "outer rim"),
                    counted(t.holes, "rim of a hole").replace("holes", "hole")
                ),
            ));
            if t.paths > 0 {
                rows.push(("open paths", count(t.paths), "they end where the points do".into()));
            }
            rows.push(("area", figure(t.area), "enclosed, holes taken off, in the file's unit squared".into()));
            rows.push(("length", figure(t.length), "in the file's unit".into()));
            rows.push((
                "without points",
                format!("{} ({})", percent(*unsupported_share), figure(*unsupported_length)),
                closing.into(),
            ));
            rows.push(("vertices", count(*vertices), "of the polylines".into()));
            "The curve"
        }
    };
    rows.push((
        "cells",
        along(&report.frame.cells),
        format!("of side {} on the final dense lattice", figure(report.frame.cell)),
    ));
    if extraction.found.capped > 0 {
        rows.push((
            "cut at the box",
            count(extraction.found.capped),
            "vertices where it leaves the function's box and was closed".into(),
        ));
    }
    let rows: Vec<(&str, String, &str)> =
        rows.iter().map(|(name, value, meaning)| (*name, value.clone(), meaning.as_str())).collect();
    facts(caption, &rows)
}

pub(crate) fn trust(report: &Report) -> String {
    let trust = &report.trust;
    let score = trust.score;
    let meter = format!(
        "{} <meter min=\"0\" max=\"0.6\" low=\"{SOME_DOUBT}\" high=\"{NO_TRUST}\" optimum=\"0\" value=\"{}\">{}</meter>",
        figure(score),
        score.clamp(0.0, 0.6),
        figure(score)
    );
    let limits = format!(
        "how far the sides of the points contradict winding numbers: below {SOME_DOUBT} is sound, above {NO_TRUST} there is no trust; \
         of open surfaces it says little"
    );
    let (least, around) = trust.regions.first().map_or_else(Default::default, |region| {
        let centre: Vec<String> = region.centre.iter().map(|x| figure(*x)).collect();
        (figure(region.confidence), format!("at {} points around ({})", count(region.points), centre.join(", ")))
    });
    let around = format!("from 0 to 1, over a box of an eighth of the longest side; {around}");
    let uncovered = extraction(report).map_or(f64::NAN, |extraction| extraction.uncovered);
    let distance = &report.distance;
    let slope = format!("{} ± {}", figure(distance.slope), figure(distance.slope_error));
    let differs = format!(
        "|f| away from the points, against the distance from them: on average, and at most {}; in cells of the dense lattice",
        figure(distance.largest_error)
    );
    let memory = report.memory.limit.map_or_else(String::new, |limit| format!("{} were allowed", bytes(limit)));
    facts(
        "The function against the points",
        &[
            ("score", meter, &limits),
            ("side unsure", percent(trust.unsure), "share of the points that could as well be on the other side"),
            ("least sure part", least, &around),
            (
                "off the result",
                percent(trust.misfit),
                "share of the points much farther from the result than the others are",
            ),
            (
                "off it together",
                count(trust.off.points),
                "points whose neighbours lie on the same side of the result, farther than noise explains: something is smoothed over",
            ),
            (
                "in two layers",
                trust.layers.map_or_else(|| "–".to_owned(), |layers| format!("{layers:.2}")),
                "mean distance of noisy points over its root mean square: 0.8 for noise; above 0.88 they lie on both sides of the result",
            ),
            (
                "inside and outside hardly differ",
                percent(trust.flat),
                "share of the points where walls or gaps are too thin for the sampling",
            ),
            (
                "topology hangs on little",
                format!("at {} places", trust.fragile.len()),
                "places where noise and spacing could undo a neck, a gap, a wall or a tunnel; the report in JSON lists them",
            ),
            ("not covered", percent(uncovered), "share of the points with no part of the result within two spacings"),
            ("‖∇f‖", slope, "within two spacings of the points; that of a distance is 1"),
            ("off the distance", figure(distance.error), &differs),
            ("memory", bytes(report.memory.need), &memory),
        ],
    )
}
