//! What several tests need.
#![allow(dead_code, clippy::unwrap_used)]

pub mod acclaim;
pub mod export;
pub mod known;
pub mod marker_files;
pub mod shot;

use std::path::PathBuf;

/// The folder of third-party recordings; `None`, with a word about it, where it is absent.
pub fn shared_data(part: &str) -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../shared/data");
    let folder = std::env::var_os("CROMOSIM_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from).join(part);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var("CROMOSIM_REQUIRE_ALL").as_deref() != Ok("1"), "{}: absent, but CROMOSIM_REQUIRE_ALL=1", folder.display());
    // Past the test harness, which swallows what passing tests print.
    let _ = std::io::Write::write_all(
        &mut std::io::stderr(),
        format!("skipped: {} is absent (set CROMOSIM_DATA)\n", folder.display()).as_bytes(),
    );
    None
}

/// Our own small files.
pub fn own_file(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data")).join(name)
}

/// The value below which `fraction` of the values lie.
pub fn quantile(values: &[f64], fraction: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * fraction).round() as usize]
}
