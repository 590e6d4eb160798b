//! The normal operator, on bands and whole lattices, and its solver. One binary, since each is compiled with all that it calls.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a panic is how a test fails")]

mod band;
mod solver;
