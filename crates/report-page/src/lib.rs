//! The report of a reconstruction as one HTML page: what came out and how far to trust it in plain words, pictures, an interactive
//! view of the surface, the stages with their times, and how they converged.
//!
//! ```
//! use zeroset::{Options, extract_curve, reconstruct};
//! use zeroset_report_page::{Drawing, Page, Setting};
//!
//! let points: Vec<[f64; 2]> = (0..100).map(|i| (0.063 * f64::from(i)).sin_cos().into()).collect();
//! let mut circle = reconstruct(&points, &Options::default())?;
//! extract_curve(&mut circle)?;
//! let html = Page {
//!     program: "example 1.0",
//!     file: "a <circle>.xy",
//!     report: &circle.report,
//!     sides: &[2.0, 2.0],
//!     settings: &[Setting { name: "--open", value: "no".into(), given: false }],
//!     outputs: &[],
//!     drawings: &[Drawing::Svg { document: "<svg viewBox=\"0 0 2 2\"></svg>", caption: "Nothing yet" }],
//!     surface: None,
//!     up: [0.0, 1.0, 0.0],
//! }
//! .to_html();
//! assert!(html.starts_with("<!doctype html>") && html.contains("a &lt;circle&gt;.xy"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Guaranteed.** The page asks for nothing: style, script, pictures and data are in it, and its security policy forbids the rest.
//! Names of files, warnings and settings are text and never markup. It stays below 20 MB: larger surfaces are thinned for the
//! view, and the page says so.
//!
//! **Not here.** Drawing (see `zeroset-render`), files (see `zeroset-io`). Documents of drawings are taken as they are.

mod base64;
mod convergence;
mod facts;
mod markup;
mod page;
mod plot;
mod stages;
mod thinned;
mod view_data;

pub use page::{Drawing, Page, Setting, Surface};
