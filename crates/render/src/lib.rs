//! Pictures of surfaces with their points, and of plane functions: a small renderer in plain software.
//!
//! A surface is drawn by a z-buffer from parallel rays, smoothly shaded on white, its points as small balls that are hidden where
//! the surface is nearer. Triangles seen from behind are orange: a closed outward surface shows none of it.
//!
//! ```
//! use zeroset_render::{Scene, Size, View, draw};
//!
//! let tetrahedron = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let outward = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
//! let scene = Scene { vertices: &tetrahedron, triangles: &outward, ..Scene::default() };
//! let image = draw(&scene, &[View::from_direction([1.0, 1.0, 1.0])], Size { width: 60, height: 40 })?;
//! let [red, _, blue] = image.pixel(30, 20);
//! assert!(blue > red, "the outside is blue");
//! assert_eq!(image.pixel(0, 0), [255; 3]);
//! # Ok::<(), zeroset_render::RenderError>(())
//! ```
//!
//! [`Plan`] is the same for functions of two variables: filled levels, curves and points, as pixels or as SVG.
//!
//! **Guaranteed.** The same bytes for any number of threads. Everything fits into the picture, with a margin; views side by side
//! have one scale.
//!
//! **Not here.** Files (see `zeroset-io`), perspective, shadows, transparency.

mod canvas;
mod colour;
mod error;
mod fill;
mod image;
mod plan;
mod plan_svg;
mod scene;
mod shading;
mod surface;
mod view;

pub use error::RenderError;
pub use image::{Image, Size};
pub use plan::{Layer, Plan};
pub use scene::{Scene, draw};
pub use view::{Up, View};
