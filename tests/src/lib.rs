//! End-to-end tests of zeroset: see `tests/tests`.
