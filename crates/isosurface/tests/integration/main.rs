//! What every extraction must satisfy. One binary, since each is compiled with all that it calls.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod closed_manifold;
mod crossed_cells;
