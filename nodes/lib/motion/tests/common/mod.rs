//! What several tests need.
#![allow(dead_code, clippy::unwrap_used)]

pub mod acclaim;
pub mod containers;
pub mod export;
pub mod known;
pub mod marker_files;

use std::path::PathBuf;

/// The folder of third-party recordings; `None`, with a word about it, where it is absent.
pub fn shared_data(part: &str) -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../shared/data");
    let folder = std::env::var_os("CROMOSIM_DATA")
        .map_or_else(|| PathBuf::from(beside), PathBuf::from)
        .join(part);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(
        std::env::var("CROMOSIM_REQUIRE_ALL").as_deref() != Ok("1"),
        "{}: absent, but CROMOSIM_REQUIRE_ALL=1",
        folder.display()
    );
    // Past the test harness, which swallows what passing tests print.
    let _ = std::io::Write::write_all(
        &mut std::io::stderr(),
        format!(
            "skipped: {} is absent (set CROMOSIM_DATA)\n",
            folder.display()
        )
        .as_bytes(),
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

/// Calls `parse` with `rounds` damaged versions of a sample: bytes changed, removed, repeated, cut
/// off, digits grown; the same ones every time.
pub fn damaged(sample: &[u8], rounds: u64, mut parse: impl FnMut(&[u8])) {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    let mut index = |length: usize| {
        ((random.random::<f64>() * length as f64) as usize).min(length.saturating_sub(1))
    };
    for _ in 0..rounds {
        let mut bytes = sample.to_vec();
        for _ in 0..1 + index(6) {
            let place = index(bytes.len());
            match index(6) {
                _ if bytes.is_empty() => {}
                0 => bytes[place] = index(256) as u8,
                1 => bytes[place] ^= 1 << index(8),
                2 => drop(
                    bytes.drain(
                        place
                            ..(place + 1 + index(20))
                                .min(sample.len().min(bytes.len()))
                                .max(place),
                    ),
                ),
                3 => bytes.truncate(place),
                4 => {
                    let part = bytes[place..(place + index(30)).min(bytes.len())].to_vec();
                    bytes.splice(place..place, part);
                }
                _ => {
                    let grown = *[
                        b"999999999999".as_slice(),
                        b"-",
                        b"e308",
                        b"\xff\xff\xff\x7f",
                        b"nan",
                        b"\0\0\0\0",
                    ]
                    .get(index(6))
                    .unwrap();
                    bytes.splice(place..place, grown.iter().copied());
                }
            }
        }
        parse(&bytes);
    }
}
