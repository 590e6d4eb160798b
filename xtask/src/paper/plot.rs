//! Line plots with a logarithmic vertical axis, as SVG.

use std::fmt::Write as _;

/// One line: its name, colour and values over 0, 1, 2, …
pub struct Series {
    pub name: &'static str,
    pub colour: &'static str,
    pub values: Vec<f64>,
}

const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 40.0;

/// Several plots side by side, two to a row.
pub fn panels(plots: &[(String, Vec<Series>, f64)], horizontal: &str, vertical: &str) -> String {
    let rows = plots.len().div_ceil(2);
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}" font-family="sans-serif" font-size="11">
<rect width="100%" height="100%" fill="white"/>
"#,
        2.0 * WIDTH,
        rows as f64 * HEIGHT
    );
    for (index, (title, series, target)) in plots.iter().enumerate() {
        let _ = writeln!(
            svg,
            r#"<g transform="translate({},{})">"#,
            (index % 2) as f64 * WIDTH,
            (index / 2) as f64 * HEIGHT
        );
        panel(&mut svg, title, series, *target, horizontal, vertical);
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    svg
}

fn panel(svg: &mut String, title: &str, series: &[Series], target: f64, horizontal: &str, vertical: &str) {
    let values = || series.iter().flat_map(|s| s.values.iter().copied()).chain([target]).filter(|v| *v > 0.0);
    let lowest = values().fold(f64::INFINITY, f64::min).log10().floor();
    let highest = values().fold(0.0, f64::max).log10().ceil().max(lowest + 1.0);
    let longest = series.iter().map(|s| s.values.len()).max().unwrap_or(1).max(2) as f64 - 1.0;
    let x = |k: f64| LEFT + k / longest * (WIDTH - LEFT - RIGHT);
    let y = |v: f64| {
        let share = (v.max(1e-300).log10() - lowest) / (highest - lowest);
        HEIGHT - BOTTOM - share.clamp(0.0, 1.0) * (HEIGHT - TOP - BOTTOM)
    };
    let mut line = |text: String| {
        svg.push_str(&text);
        svg.push('\n');
    };
    line(format!(r#"<text x="{LEFT}" y="16" font-weight="bold">{title}</text>"#));
    let mut decade = lowest;
    while decade <= highest {
        let at = y(10f64.powf(decade));
        line(format!(r##"<line x1="{LEFT}" x2="{}" y1="{at:.1}" y2="{at:.1}" stroke="#ddd"/>"##, WIDTH - RIGHT));
        line(format!(r#"<text x="{}" y="{:.1}" text-anchor="end">1e{decade}</text>"#, LEFT - 5.0, at + 4.0));
        decade += 1.0;
    }
    let step = (longest / 6.0).ceil().max(1.0);
    let mut tick = 0.0;
    while tick <= longest {
        line(format!(r#"<text x="{:.1}" y="{}" text-anchor="middle">{tick}</text>"#, x(tick), HEIGHT - BOTTOM + 15.0));
        tick += step;
    }
    line(format!(r#"<text x="{}" y="{}" text-anchor="middle">{horizontal}</text>"#, x(0.5 * longest), HEIGHT - 8.0));
    line(format!(
        r#"<text transform="translate(14,{}) rotate(-90)" text-anchor="middle">{vertical}</text>"#,
        0.5 * HEIGHT
    ));
    let at = y(target);
    line(format!(
        r##"<line x1="{LEFT}" x2="{}" y1="{at:.1}" y2="{at:.1}" stroke="#555" stroke-dasharray="4 3"/>"##,
        WIDTH - RIGHT
    ));
    for (index, series) in series.iter().enumerate() {
        let points: Vec<String> =
            series.values.iter().enumerate().map(|(k, v)| format!("{:.1},{:.1}", x(k as f64), y(*v))).collect();
        line(format!(
            r#"<polyline points="{}" fill="none" stroke="{}" stroke-width="1.8"/>"#,
            points.join(" "),
            series.colour
        ));
        let legend = TOP + 14.0 + 15.0 * index as f64;
        line(format!(
            r#"<text x="{}" y="{legend}" text-anchor="end" fill="{}">{}</text>"#,
            WIDTH - RIGHT - 4.0,
            series.colour,
            series.name
        ));
    }
}
