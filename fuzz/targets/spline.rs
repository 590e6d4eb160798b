//! The reader of splines.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let _ = zeroset_io::parse_spline(data);
});
