//! The memory that is told before a run is about what the run takes, and a limit is kept.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use peak_alloc::PeakAlloc;
use zeroset::{MemoryReport, Options, ReconstructError, extract_surface, reconstruct};
use zeroset_tests::Random;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Points of a spiral on a sphere, even by area.
fn sphere(count: usize) -> Vec<[f64; 3]> {
    let turn = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .map(|i| (i as f64 * turn, 1.0 - (2.0 * i as f64 + 1.0) / count as f64))
        .map(|(a, z)| [a.cos() * (1.0 - z * z).sqrt(), a.sin() * (1.0 - z * z).sqrt(), z])
        .collect()
}

/// What a run takes beyond what was taken before, bytes, with what it foretold and its warnings.
fn taken(points: &[[f64; 3]], options: &Options) -> (f64, MemoryReport, Vec<String>) {
    ALLOCATOR.reset_peak_usage();
    let before = ALLOCATOR.current_usage();
    let mut result = reconstruct(points, options).unwrap();
    let (_, topology) = extract_surface(&mut result).unwrap();
    assert!(topology.closed && topology.genus == 0, "{topology:?}");
    let taken = ALLOCATOR.peak_usage().saturating_sub(before) as f64;
    (taken, result.report.memory, result.report.warnings)
}

// One test, so that runs do not add up.
#[test]
fn memory_is_foretold_and_limited() {
    // The matrix library's buffers, 0.2 GB of addresses most of which are never used, are taken once and kept.
    let fine = Options { resolution: Some(128), ..Options::default() };
    taken(&sphere(2500), &fine);
    // A third of the spacing: the level of the dense lattice reaches farther, which is told once that is known.
    let mut random = Random(1);
    let noisy = sphere(10_000).iter().map(|p| p.map(|x| x + 0.01 * random.gaussian())).collect();
    let clouds = [(sphere(10_000), Options::default()), (sphere(40_000), fine), (noisy, Options::default())];
    for (points, options) in clouds {
        let (taken, foretold, warnings) = taken(&points, &options);
        let ratio = foretold.need as f64 / taken;
        println!("{} points: {:.0} MB taken, {ratio:.2} of it foretold, {foretold:?}", points.len(), taken / 1e6);
        // Too little would bring the machine down, too much would leave out levels that fit.
        assert!((0.7..=2.0).contains(&ratio), "{ratio}");
        assert!(foretold.levels == foretold.wanted_levels && warnings.is_empty(), "{foretold:?} {warnings:?}");
    }

    let limit = 200 << 20;
    let options = Options { resolution: Some(256), memory: Some(limit), ..Options::default() };
    let (taken, foretold, warnings) = taken(&sphere(10_000), &options);
    assert!(taken < limit as f64, "{taken}");
    assert_eq!((foretold.limit, foretold.levels, foretold.wanted_levels), (Some(limit), 1, 2));
    assert!(foretold.need <= limit && foretold.wanted_need > limit, "{foretold:?}");
    assert!(
        warnings[0].contains("up to 128 along the longest side in place of 256") && warnings[0].contains("200 MiB"),
        "{warnings:?}"
    );

    let error = reconstruct(&sphere(2500), &Options { memory: Some(10 << 20), ..Options::default() }).unwrap_err();
    assert!(matches!(error, ReconstructError::Memory { limit, .. } if limit == 10 << 20), "{error}");
    assert!(error.to_string().contains("--memory"), "{error}");
}
