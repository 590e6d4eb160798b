//! What must hold for splines, whatever their coefficients. One binary, since each is compiled with all that it calls.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod common;
mod critical_points;
mod crossed_cells;
mod implicit;
