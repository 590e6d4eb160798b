//! Refinement on one lattice and level by level, redistancing, and bounds. One binary, since each is compiled with all that it calls.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod levels;
mod redistance;
mod refinement;
mod within_bounds;
