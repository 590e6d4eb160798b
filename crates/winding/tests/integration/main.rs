//! The tree code against the direct sum, and its laws. One binary, since each is compiled with all that it calls.

#![allow(clippy::expect_used, reason = "a panic is how a test fails")]

mod agreement;
mod laws;
