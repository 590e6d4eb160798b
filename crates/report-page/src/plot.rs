//! Plots as inline SVG, whose colours are the page's.

use std::fmt::Write;

use crate::markup::{Text, figure};

/// Values over steps 0, 1, 2, …
pub(crate) struct Plot<'a> {
    pub title: &'a str,
    /// What is to be seen, for those who cannot see it.
    pub description: String,
    pub logarithmic: bool,
    /// One name for each step.
    pub steps: Vec<String>,
    pub series: Vec<Series<'a>>,
    /// Vertical lines before a step, with a name.
    pub sections: Vec<(usize, String)>,
    /// A horizontal line, with a name.
    pub limit: Option<(f64, &'a str)>,
    /// The steps that count in the end: their values are marked.
    pub chosen: Vec<usize>,
}

pub(crate) struct Series<'a> {
    pub name: &'a str,
    /// One for each step, if there is one.
    pub values: Vec<Option<f64>>,
}

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 54.0;
const BOTTOM: f64 = 38.0;

impl Plot<'_> {
    /// The figure, or nothing if there are fewer than two steps or no values.
    pub fn html(&self) -> String {
        let values =
            || self.series.iter().flat_map(|series| series.values.iter().flatten().copied()).filter(|v| self.fits(*v));
        if self.steps.len() < 2 || values().next().is_none() {
            return String::new();
        }
        let limits = self.limit.iter().map(|(value, _)| *value).filter(|v| self.fits(*v));
        let scaled = || values().chain(limits.clone()).map(|v| self.scaled(v));
        let (mut low, mut high) = (scaled().fold(f64::INFINITY, f64::min), scaled().fold(f64::NEG_INFINITY, f64::max));
        if !self.logarithmic {
            low = low.min(0.0);
        }
        let room = if high > low { 0.06 * (high - low) } else { 0.5 * high.abs().max(0.1) };
        high += room;
        if self.logarithmic {
            low -= room;
        }
        let x = |step: f64| LEFT + (step + 0.5) / self.steps.len() as f64 * (WIDTH - LEFT - RIGHT);
        let y = |value: f64| HEIGHT - BOTTOM - (self.scaled(value) - low) / (high - low) * (HEIGHT - TOP - BOTTOM);

        let mut svg = format!(
            "<figure class=\"plot\"><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\"><title>{}</title><desc>{}</desc>\n\
             <text x=\"{LEFT}\" y=\"16\" class=\"title\">{}</text>\n",
            Text(self.title),
            Text(&self.description),
            Text(self.title)
        );
        for tick in self.ticks(low, high) {
            let at = y(tick);
            let _ = writeln!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{}\"/><text x=\"{}\" y=\"{:.1}\" class=\"tick end\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 6.0,
                at + 4.0,
                figure(tick)
            );
        }
        for (step, name) in &self.sections {
            let at = x(*step as f64 - 0.5);
            let _ = writeln!(
                svg,
                "<path class=\"section\" d=\"M{at:.1} {}V{}\"/><text x=\"{:.1}\" y=\"{}\" class=\"tick\">{}</text>",
                TOP - 4.0,
                HEIGHT - BOTTOM,
                at + 5.0,
                TOP + 6.0,
                Text(name)
            );
        }
        // Names of steps that would run into each other are left out.
        let longest = self.steps.iter().map(|name| name.chars().count()).max().unwrap_or(1) as f64;
        let every = (7.0 * (longest + 1.0) * self.steps.len() as f64 / (WIDTH - LEFT - RIGHT)).ceil().max(1.0) as usize;
        for (step, name) in self.steps.iter().enumerate().step_by(every) {
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{}\" class=\"tick middle\">{}</text>",
                x(step as f64),
                HEIGHT - BOTTOM + 18.0,
                Text(name)
            );
        }
        if let Some((value, name)) = self.limit.filter(|(value, _)| self.fits(*value)) {
            let at = y(value);
            let _ = writeln!(
                svg,
                "<path class=\"limit\" d=\"M{LEFT} {at:.1}H{}\"/><text x=\"{}\" y=\"{:.1}\" class=\"tick end\">{}</text>",
                WIDTH - RIGHT,
                WIDTH - RIGHT,
                at - 5.0,
                Text(name)
            );
        }
        let mut legend = LEFT;
        for (k, series) in self.series.iter().enumerate() {
            let known =
                || series.values.iter().enumerate().filter_map(|(i, v)| v.filter(|v| self.fits(*v)).map(|v| (i, v)));
            let mut line = String::new();
            let mut last = None;
            for (step, value) in known() {
                let begin = last != step.checked_sub(1) || last.is_none();
                let _ = write!(line, "{}{:.1} {:.1}", if begin { 'M' } else { 'L' }, x(step as f64), y(value));
                last = Some(step);
            }
            let _ = writeln!(svg, "<g class=\"series s{k}\"><path d=\"{line}\"/>");
            for (step, value) in known() {
                let radius = if self.chosen.contains(&step) { 5.5 } else { 3.0 };
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\"><title>{}: {}</title></circle>",
                    x(step as f64),
                    y(value),
                    Text(&self.steps[step]),
                    figure(value)
                );
            }
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"30\" r=\"4\"/><text x=\"{:.1}\" y=\"34\">{}</text></g>",
                legend + 4.0,
                legend + 13.0,
                Text(series.name)
            );
            legend += 34.0 + 6.6 * series.name.chars().count() as f64;
        }
        svg.push_str("</svg></figure>\n");
        svg
    }

    /// Logarithms are of positive numbers.
    fn fits(&self, value: f64) -> bool {
        value.is_finite() && (!self.logarithmic || value > 0.0)
    }

    fn scaled(&self, value: f64) -> f64 {
        if self.logarithmic { value.log10() } else { value }
    }

    /// Round numbers between two scaled ends.
    fn ticks(&self, low: f64, high: f64) -> Vec<f64> {
        if self.logarithmic {
            let every = ((high - low) / 7.0).ceil().max(1.0) as usize;
            let ticks = |shares: &[f64]| -> Vec<f64> {
                let powers = (low.floor() as i32..=high.ceil() as i32).step_by(every);
                let all = powers.flat_map(|power| shares.iter().map(move |share| share * 10f64.powi(power)));
                all.filter(|tick| (low..=high).contains(&tick.log10())).collect()
            };
            let shares: [&[f64]; 5] = [
                &[1.0],
                &[1.0, 3.0],
                &[1.0, 2.0, 5.0],
                &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0],
                &[1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
            ];
            let enough = shares.into_iter().map(ticks).find(|ticks| ticks.len() >= 3);
            return enough.unwrap_or_else(|| ticks(shares[4]));
        }
        let rough = (high - low) / 5.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|share| share * power >= rough).unwrap_or(10.0);
        (0..20).map(|k| ((low / step).ceil() + f64::from(k)) * step).take_while(|tick| *tick <= high).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(logarithmic: bool, values: Vec<Option<f64>>) -> String {
        let steps = (0..values.len()).map(|k| k.to_string()).collect();
        let series = vec![Series { name: "error & co", values }];
        let (sections, chosen) = (vec![(1, "level <0>".into())], vec![1]);
        let (title, description) = ("Errors", "falling".into());
        Plot { title, description, logarithmic, steps, series, sections, limit: Some((0.4, "no trust")), chosen }.html()
    }

    #[test]
    fn every_value_has_its_place_and_its_words() {
        let svg = plot(true, vec![Some(1.0), Some(0.01), None, Some(1e-4), Some(0.0), Some(f64::NAN)]);
        assert_eq!(svg.matches("<circle").count(), 3 + 1, "three values that have a logarithm, and the legend");
        assert!(
            svg.contains("error &amp; co") && svg.contains("level &lt;0&gt;") && svg.contains("<title>1: 0.01</title>")
        );
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        // The line breaks where a value is missing.
        assert_eq!(
            svg.split("class=\"series s0\"").nth(1).unwrap().split("\"/>").next().unwrap().matches('M').count(),
            2
        );
    }

    #[test]
    fn there_is_no_plot_of_nothing() {
        assert_eq!(plot(true, vec![Some(1.0)]), "");
        assert_eq!(plot(true, vec![None, Some(-1.0)]), "");
        for values in [vec![Some(0.0); 2], vec![Some(3.0); 3], vec![Some(1e300), Some(1e-300)]] {
            let svg = plot(false, values);
            assert!(svg.contains("</svg>") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn ticks_are_round_and_few() {
        let ticks = |logarithmic, low, high| {
            let plot = Plot {
                title: "",
                description: String::new(),
                logarithmic,
                steps: vec![],
                series: vec![],
                sections: vec![],
                limit: None,
                chosen: vec![],
            };
            plot.ticks(low, high)
        };
        assert_eq!(ticks(false, 0.0, 1.0), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(ticks(true, -3.2, -0.5).len(), 3);
        assert_eq!(ticks(true, -0.4, 0.4).len(), 3);
        assert!((3..=8).contains(&ticks(true, 6.01, 6.6).len()));
        assert!(ticks(true, -30.0, 8.0).len() <= 8);
    }
}
