//! Every reader of points: the first byte chooses the format, the rest is the file.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if let Some((choice, file)) = data.split_first() {
        let extensions = zeroset_io::POINT_EXTENSIONS;
        let extension = extensions[usize::from(*choice) % extensions.len()];
        if let Some(format) = zeroset_io::PointFormat::named(extension) {
            let _ = zeroset_io::parse_points(file, format);
        }
    }
});
