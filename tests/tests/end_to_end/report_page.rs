//! The page as a browser gets it: everything in it, nothing from elsewhere, and no text that turns into markup.

use zeroset::{Options, Report, Topology, extract_curve, extract_surface, reconstruct};
use zeroset_report_page::{Drawing, Page, Setting, Surface};

const NASTY: &str = "</script><img src=x onerror=alert(1)>\"'&.ply";

fn circle(options: &Options) -> Report {
    let points: Vec<[f64; 2]> =
        (0..80).map(|i| (f64::from(i) * std::f64::consts::TAU / 80.0).sin_cos().into()).collect();
    let mut circle = reconstruct(&points, options).unwrap();
    extract_curve(&mut circle).unwrap();
    circle.report
}

fn page<'a>(report: &'a Report, drawings: &'a [Drawing<'a>]) -> Page<'a> {
    let (settings, outputs) = (&[], &[]);
    Page {
        program: "zeroset 0",
        file: "circle.xy",
        report,
        sides: &[2.0, 2.0],
        settings,
        outputs,
        drawings,
        surface: None,
        up: [0.0, 1.0, 0.0],
    }
}

/// Every element is closed, in order; returns how many there are.
fn well_formed(html: &str) -> usize {
    const VOID: [&str; 5] = ["meta", "link", "img", "input", "br"];
    let (mut open, mut count, mut rest) = (Vec::new(), 0, html);
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        let end = rest.find('>').expect("a tag ends");
        let (tag, after) = (&rest[..end], &rest[end + 1..]);
        rest = after;
        let name: String = tag.trim_start_matches('/').chars().take_while(char::is_ascii_alphanumeric).collect();
        if tag.starts_with('!') || VOID.contains(&name.as_str()) {
            continue;
        }
        if tag.starts_with('/') {
            assert_eq!(open.pop().as_deref(), Some(name.as_str()), "</{name}> at {:.60}", rest);
        } else if !tag.ends_with('/') {
            count += 1;
            if ["script", "style"].contains(&name.as_str()) {
                rest = &rest[rest.find(&format!("</{name}>")).expect("it ends")..];
            }
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
    count
}

/// Nothing is asked for from anywhere: addresses are data or none.
fn self_contained(html: &str) {
    for scheme in ["http:", "https:", "//cdn", "@import", "url(", "fetch(", "XMLHttpRequest", "import(", "WebSocket"] {
        assert!(!html.contains(scheme), "{scheme}");
    }
    for attribute in [" src=\"", " href=\"", " srcset=\"", " action=\"", " poster=\"", " data=\""] {
        for (at, _) in html.match_indices(attribute) {
            assert!(html[at + attribute.len()..].starts_with("data:"), "{:.80}", &html[at..]);
        }
    }
    assert!(html.contains("http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'"));
}

#[test]
fn a_curve_with_all_its_sections() {
    let report = circle(&Options::default());
    let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 2 2\"><path d=\"M0 0\"/></svg>\n";
    let html = page(&report, &[Drawing::Svg { document: svg, caption: "levels" }]).to_html();
    assert!(well_formed(&html) > 100);
    self_contained(&html);
    for title in [
        "What it looks like",
        "What was read",
        "What came out",
        "How far to trust it",
        "Where the time went",
        "How it converged",
        "Settings",
    ] {
        assert_eq!(html.matches(&format!("<h2>{title}</h2>")).count(), 1, "{title}");
    }
    assert!(html.contains("No doubts") && html.contains("A closed curve: 1 part with 0 holes, area 3.14"));
    // Candidates may be one alone; two plots of the refinement there are always.
    assert!(html.matches("<figure class=\"plot\">").count() >= 2);
    assert_eq!(html.matches("class=\"bar\"").count(), report.stages.len());
    assert!(!html.contains("NaN") && !html.contains("id=\"view\""));
    assert!(html.len() < 100_000, "{}", html.len());
}

#[test]
fn every_road_has_its_plots() {
    for options in [
        Options { topology: Topology::Paper, ..Options::default() },
        Options { degree: 2, ..Options::default() },
        Options { refine: false, ..Options::default() },
    ] {
        let html = page(&circle(&options), &[]).to_html();
        well_formed(&html);
        self_contained(&html);
        let refined = html.contains("Distance of the points after each step");
        assert_eq!(refined, options.refine);
        assert_eq!(html.contains("<title>Error of each eigenvector"), options.topology == Topology::Paper);
        assert!(!html.contains("What it looks like"));
    }
}

#[test]
fn names_warnings_and_settings_are_text() {
    let mut report = circle(&Options::default());
    let plain = well_formed(&page(&report, &[]).to_html());
    report.warnings.push(format!("a warning with {NASTY}"));
    report.doubt = Some(format!("a doubt with {NASTY}"));
    let (settings, outputs) = ([Setting { name: NASTY, value: NASTY.into(), given: true }], [NASTY.into()]);
    let drawings = [Drawing::Png { bytes: &[1, 2, 3], size: [1, 1], caption: NASTY }];
    let nasty = Page {
        program: NASTY,
        file: NASTY,
        settings: &settings,
        outputs: &outputs,
        drawings: &drawings,
        ..page(&report, &[])
    };
    let html = nasty.to_html();
    self_contained(&html);
    assert!(!html.contains("<img src=x") && !html.contains("onerror=alert(1)>"));
    assert_eq!(html.matches("</script>").count(), 1, "the page's own");
    let more = well_formed(&html) - plain;
    // Doubt: div h2 p; warnings: div h2 ul li; picture: section h2 div figure figcaption; setting: tr th code td td; file: p ul li code.
    assert_eq!(more, 3 + 4 + 5 + 5 + 4);
    assert!(html.contains("Not to be trusted") && html.contains("A doubt with &lt;/script&gt;"));
    assert!(html.contains("src=\"data:image/png;base64,AQID\""));
    assert!(html.find("A doubt").unwrap() < html.find("What was read").unwrap(), "first things first");
}

#[test]
fn a_surface_comes_with_a_view() {
    // Points on a sphere, far from the origin, by the golden angle.
    let points: Vec<[f64; 3]> = (0..600)
        .map(|i| {
            let z = (f64::from(i) + 0.5) / 300.0 - 1.0;
            let (s, c) = (f64::from(i) * 2.399_963).sin_cos();
            let r = (1.0 - z * z).sqrt();
            [5e5 + r * c, r * s, z]
        })
        .collect();
    let mut sphere = reconstruct(&points, &Options { resolution: Some(12), ..Options::default() }).unwrap();
    let (mesh, _) = extract_surface(&mut sphere).unwrap();
    let surface =
        Surface { vertices: &mesh.vertices, normals: &mesh.normals, triangles: &mesh.triangles, points: &points };
    let html = Page { surface: Some(surface), ..page(&sphere.report, &[]) }.to_html();
    well_formed(&html);
    self_contained(&html);
    assert!(html.contains("A closed surface: 1 component of genus 0"));
    assert!(html.contains(&format!(
        "data-vertices=\"{}\" data-triangles=\"{}\" data-points=\"600\"",
        mesh.vertices.len(),
        mesh.triangles.len()
    )));
    let data = html.split("id=\"view-data\">").nth(1).unwrap().split('<').next().unwrap();
    // Eight bytes for a vertex, six for a point; a corner takes one to three.
    let fixed = 8 * mesh.vertices.len() + 6 * 600;
    let bytes = data.len() * 3 / 4;
    assert!((fixed + 3 * mesh.triangles.len()..=fixed + 9 * mesh.triangles.len() + 2).contains(&bytes), "{bytes}");
}
