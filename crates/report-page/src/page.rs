//! The page as a whole.

use std::fmt::Write;

use zeroset::Report;

use crate::base64;
use crate::convergence;
use crate::facts;
use crate::markup::{Text, count, figure};
use crate::stages;
use crate::view_data::ViewData;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("view.js");

/// What the page tells of.
#[derive(Debug, Clone, Copy)]
pub struct Page<'a> {
    /// The program and its version.
    pub program: &'a str,
    /// The file that the points came from.
    pub file: &'a str,
    /// The report, with the stage of the extraction.
    pub report: &'a Report,
    /// Sides of the points' bounding box, in the data's unit.
    pub sides: &'a [f64],
    /// The settings of the run.
    pub settings: &'a [Setting<'a>],
    /// The files that the run writes beside this page.
    pub outputs: &'a [String],
    /// Pictures of the result.
    pub drawings: &'a [Drawing<'a>],
    /// For the interactive view.
    pub surface: Option<Surface<'a>>,
    /// The direction that points up in the view: y or z.
    pub up: [f64; 3],
}

/// One setting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting<'a> {
    /// Its name, as on the command line.
    pub name: &'a str,
    /// Its value in words.
    pub value: String,
    /// Whether the user gave it.
    pub given: bool,
}

/// A picture.
#[derive(Debug, Clone, Copy)]
pub enum Drawing<'a> {
    /// The bytes of a PNG file.
    Png {
        /// The file's bytes.
        bytes: &'a [u8],
        /// Pixels along a row, and rows.
        size: [usize; 2],
        /// What is to be seen.
        caption: &'a str,
    },
    /// An SVG document, which is taken as it is.
    Svg {
        /// The document.
        document: &'a str,
        /// What is to be seen.
        caption: &'a str,
    },
}

/// A surface with its points, in any unit.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Vertices, `V × 3`.
    pub vertices: &'a [[f64; 3]],
    /// Their outward normals, `V × 3`.
    pub normals: &'a [[f64; 3]],
    /// Corners from 0, counter-clockwise seen from outside, `T × 3`.
    pub triangles: &'a [[u32; 3]],
    /// Points, `P × 3`.
    pub points: &'a [[f64; 3]],
}

impl Page<'_> {
    /// The page.
    pub fn to_html(&self) -> String {
        let report = self.report;
        let name = self.file.rsplit(['/', '\\']).next().unwrap_or(self.file);
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
             script-src 'unsafe-inline'; img-src data:\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<meta name=\"generator\" content=\"{}\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{} – reconstruction report</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n",
            Text(self.program),
            Text(name)
        );
        let (class, verdict) = match (&report.doubt, report.warnings.len()) {
            (Some(_), _) => ("bad", "Not to be trusted"),
            (None, 0) => ("good", "No doubts"),
            (None, 1) => ("fair", "One warning"),
            (None, _) => ("fair", "Several warnings"),
        };
        let _ = write!(
            html,
            "<header>\n<p class=\"kind\">Reconstruction report</p>\n<h1>{}</h1>\n<p class=\"result\"><span class=\"verdict \
             {class}\">{verdict}</span> {}</p>\n</header>\n<main>\n",
            Text(name),
            facts::in_one_sentence(report)
        );
        self.notes(&mut html);
        html.push_str(&facts::tiles(report));
        self.see(&mut html);
        section(&mut html, "What was read", &facts::read(report, self.file, self.sides));
        section(&mut html, "What came out", &facts::result(report));
        section(&mut html, "How far to trust it", &facts::trust(report));
        section(&mut html, "Where the time went", &stages::table(report));
        section(&mut html, "How it converged", &convergence::plots(report));
        section(&mut html, "Settings", &self.run());
        let _ = write!(
            html,
            "</main>\n<footer><p>Written by {}. Everything on this page is in this one file; it asks the network for \
             nothing.</p></footer>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            Text(self.program)
        );
        html
    }

    /// Doubts and warnings.
    fn notes(&self, html: &mut String) {
        if let Some(doubt) = &self.report.doubt {
            let _ =
                writeln!(html, "<div class=\"note bad\" role=\"note\"><h2>Doubt</h2><p>{}.</p></div>", sentence(doubt));
        }
        if !self.report.warnings.is_empty() {
            html.push_str("<div class=\"note fair\" role=\"note\"><h2>Before you rely on it</h2><ul>\n");
            for warning in &self.report.warnings {
                let _ = writeln!(html, "<li>{}.</li>", sentence(warning));
            }
            html.push_str("</ul></div>\n");
        }
    }

    /// The view and the pictures.
    fn see(&self, html: &mut String) {
        let view = self.surface.as_ref().and_then(ViewData::of);
        if view.is_none() && self.drawings.is_empty() {
            return;
        }
        html.push_str("<section><h2>What it looks like</h2>\n");
        if let Some(view) = view {
            self.view(html, &view);
        }
        html.push_str("<div class=\"pictures\">\n");
        for drawing in self.drawings {
            let _ = match *drawing {
                Drawing::Png { bytes, size: [width, height], caption } => writeln!(
                    html,
                    "<figure><img alt=\"{}\" width=\"{width}\" height=\"{height}\" src=\"data:image/png;base64,{}\">\
                     <figcaption>{}</figcaption></figure>",
                    Text(caption),
                    base64::encode(bytes),
                    Text(caption)
                ),
                // A name of the space that elements are in is needed in a file of its own only.
                Drawing::Svg { document, caption } => writeln!(
                    html,
                    "<figure class=\"drawing\" role=\"img\" aria-label=\"{}\">{}<figcaption>{}</figcaption></figure>",
                    Text(caption),
                    document.trim().replace(" xmlns=\"http://www.w3.org/2000/svg\"", ""),
                    Text(caption)
                ),
            };
        }
        html.push_str("</div>\n</section>\n");
    }

    fn view(&self, html: &mut String, data: &ViewData) {
        let given = self.surface.map_or(0, |surface| surface.triangles.len());
        let shown = match data.merged {
            Some(side) => format!(
                "The view shows {} triangles in place of all {}: corners within {} of each other are drawn as one. The files have \
                 them all.",
                count(data.triangles),
                count(given),
                figure(side)
            ),
            None => format!("All {} triangles.", count(given)),
        };
        let points = self.surface.map_or(0, |surface| surface.points.len());
        let some = if data.points < points {
            format!(" {} of {} points.", count(data.points), count(points))
        } else {
            String::new()
        };
        let numbers = |numbers: [f64; 3]| numbers.map(|c| format!("{c:e}")).join(" ");
        let _ = write!(
            html,
            "<div class=\"live\">\n<canvas id=\"view\" tabindex=\"0\" role=\"img\" aria-label=\"The surface, to be turned with the mouse or \
             the arrow keys\" data-vertices=\"{}\" data-triangles=\"{}\" data-points=\"{}\" data-size=\"{}\" data-up=\"{}\"></canvas>\n\
             <div class=\"controls\" role=\"group\" aria-label=\"View\">\
             <button type=\"button\" data-view=\"front\">Front</button><button type=\"button\" data-view=\"oblique\">Oblique</button>\
             <button type=\"button\" data-view=\"top\">Top</button>\
             <label><input type=\"checkbox\" id=\"show-surface\" checked> surface</label>\
             <label><input type=\"checkbox\" id=\"show-points\"> points</label></div>\n\
             <p class=\"hint\">Drag to turn, with the right button or Shift to move; two fingers move and zoom. After a click the wheel \
             zooms; arrow keys turn, + and − zoom, 0 resets. Blue is the outside; orange is the inside. {shown}{some}</p>\n\
             <noscript><p>The interactive view needs JavaScript.</p></noscript>\n\
             <script type=\"text/plain\" id=\"view-data\">{}</script>\n</div>\n",
            data.vertices,
            data.triangles,
            data.points,
            numbers(data.size),
            numbers(self.up),
            data.base64
        );
    }

    /// Settings and files.
    fn run(&self) -> String {
        let mut html = String::from(
            "<table><thead><tr><th scope=\"col\">Option</th><th scope=\"col\">Value</th><th scope=\"col\">Chosen by</th></tr></thead><tbody>\n",
        );
        for setting in self.settings {
            let by = if setting.given { "you" } else { "default" };
            let _ = writeln!(
                html,
                "<tr{}><th scope=\"row\"><code>{}</code></th><td>{}</td><td>{by}</td></tr>",
                if setting.given { " class=\"given\"" } else { "" },
                Text(setting.name),
                Text(&setting.value)
            );
        }
        html.push_str("</tbody></table>\n");
        if !self.outputs.is_empty() {
            html.push_str("<p>Files of this run:</p>\n<ul>\n");
            for output in self.outputs {
                let _ = writeln!(html, "<li><code>{}</code></li>", Text(output));
            }
            html.push_str("</ul>\n");
        }
        html
    }
}

fn section(html: &mut String, title: &str, content: &str) {
    if !content.is_empty() {
        let _ = writeln!(html, "<section><h2>{}</h2>\n{content}</section>", Text(title));
    }
}

/// With a capital letter at its start.
fn sentence(text: &str) -> String {
    let text = text.trim_end_matches('.');
    let mut letters = text.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
    Text(&(first + letters.as_str())).to_string()
}
