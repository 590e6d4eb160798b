//! End-to-end tests of zeroset on the fixtures: see `tests/tests`.
