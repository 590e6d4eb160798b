//! The whole road on the fixtures and on shapes with a known answer. One binary, since each costs a minute to build.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a panic is how a test fails")]

mod awkward;
mod density;
mod few_points;
mod fixtures;
mod holes;
mod invariance;
mod joints;
mod knots;
mod lines;
mod narrow_gaps;
mod noise;
mod open_surfaces;
mod outlines;
mod report_page;
mod signed_distance;
mod soak;
mod strays;
mod tori;
mod voxels;
