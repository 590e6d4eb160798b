//! Plots with two logarithmic axes, as SVG.

use std::fmt::Write as _;

/// One line with its marks.
pub struct Series {
    pub name: String,
    pub colour: &'static str,
    pub places: Vec<(f64, f64)>,
}

/// One plot.
pub struct Panel {
    pub title: String,
    pub horizontal: String,
    pub vertical: String,
    pub series: Vec<Series>,
}

const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 280.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 42.0;

/// A logarithmic axis from one power of its base to another.
struct Axis {
    base: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// Powers of ten, or of two where all values lie within two decades.
    fn around(values: impl Iterator<Item = f64> + Clone) -> Self {
        let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (1.0, 1.0) };
        let base: f64 = if high / low > 100.0 { 10.0 } else { 2.0 };
        let from = low.log(base).floor();
        // A power of the base is one up to rounding.
        Self { base, from, to: (high.log(base) - 1e-9).ceil().max(from + 1.0) }
    }

    /// Where a value lies, from 0 to 1.
    fn share(&self, value: f64) -> f64 {
        (value.log(self.base) - self.from) / (self.to - self.from)
    }

    fn ticks(&self) -> impl Iterator<Item = f64> + '_ {
        (0..=(self.to - self.from) as i32).map(|k| self.base.powf(self.from + f64::from(k)))
    }
}

/// What stands beside a tick, in the room that is left of a panel.
fn label(tick: f64) -> String {
    if tick < 1e5 { tick.to_string() } else { format!("{tick:e}") }
}

/// Plots side by side.
pub fn panels(panels: &[Panel]) -> String {
    let width = WIDTH * panels.len() as f64;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (index, panel) in panels.iter().enumerate() {
        let _ = writeln!(svg, "<g transform=\"translate({},0)\">", WIDTH * index as f64);
        draw(&mut svg, panel);
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw(svg: &mut String, panel: &Panel) {
    let drawn = |(x, y): &&(f64, f64)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite();
    let all = || panel.series.iter().flat_map(|series| &series.places).filter(drawn);
    let (across, up) = (Axis::around(all().map(|p| p.0)), Axis::around(all().map(|p| p.1)));
    let x = |value: f64| LEFT + across.share(value) * (WIDTH - LEFT - RIGHT);
    let y = |value: f64| HEIGHT - BOTTOM - up.share(value) * (HEIGHT - TOP - BOTTOM);
    let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    let _ = writeln!(svg, "<text x=\"{LEFT}\" y=\"16\" font-weight=\"bold\">{}</text>", panel.title);
    for tick in up.ticks() {
        let at = y(tick);
        let _ = writeln!(svg, "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/>");
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 5.0,
            at + 4.0,
            label(tick)
        );
    }
    for tick in across.ticks() {
        let at = x(tick);
        let _ = writeln!(svg, "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{TOP}\" y2=\"{bottom}\" stroke=\"#eee\"/>");
        let _ =
            writeln!(svg, "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>", bottom + 15.0, label(tick));
    }
    let (middle, foot) = (0.5 * (LEFT + right), HEIGHT - 8.0);
    let _ = writeln!(svg, "<text x=\"{middle}\" y=\"{foot}\" text-anchor=\"middle\">{}</text>", panel.horizontal);
    let _ = writeln!(
        svg,
        "<text transform=\"translate(14,{}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        0.5 * (TOP + bottom),
        panel.vertical
    );
    for (index, Series { name, colour, places }) in panel.series.iter().enumerate() {
        let places: Vec<_> = places.iter().filter(drawn).map(|p| (x(p.0), y(p.1))).collect();
        let line: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\"/>",
            line.join(" ")
        );
        for (x, y) in &places {
            let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>");
        }
        let at = TOP + 12.0 + 15.0 * index as f64;
        let _ = writeln!(svg, "<text x=\"{}\" y=\"{at}\" fill=\"{colour}\">{name}</text>", LEFT + 8.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_between_the_ticks_around_them() {
        let axis = Axis::around([2.0, 300.0, 2500.0].into_iter());
        assert_eq!(axis.ticks().map(f64::round).collect::<Vec<_>>(), [1.0, 10.0, 100.0, 1000.0, 10_000.0]);
        // Logarithms of powers, up to rounding.
        assert!((axis.share(100.0) - 0.5).abs() < 1e-12);
        assert_eq!([0.01, 1024.0, 1e8].map(label), ["0.01", "1024", "1e8"]);
        let axis = Axis::around([64.0, 512.0].into_iter());
        assert_eq!(axis.ticks().map(f64::round).collect::<Vec<_>>(), [64.0, 128.0, 256.0, 512.0]);
        assert_eq!(Axis::around(std::iter::empty()).ticks().count(), 2);
    }

    #[test]
    fn what_is_no_number_is_left_out() {
        let series = Series { name: "a".into(), colour: "red", places: vec![(1.0, 1.0), (2.0, f64::NAN), (4.0, 3.0)] };
        let panel = Panel { title: "t".into(), horizontal: "h".into(), vertical: "v".into(), series: vec![series] };
        let svg = panels(&[panel]);
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(!svg.contains("NaN") && svg.ends_with("</svg>\n"));
    }
}
