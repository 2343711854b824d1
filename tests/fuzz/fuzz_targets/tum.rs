//! TUM trajectories: no panic, and what was read comes back.
#![no_main]

use cromosim_recording::rigid::{parse_tum, sniff_rigid, write_tum};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = sniff_rigid(data);
    if let Ok(trajectory) = parse_tum(data, "fuzz") {
        let again = parse_tum(write_tum(&trajectory).as_bytes(), "again").expect("what was written can be read");
        assert_eq!(again.stamps, trajectory.stamps);
        assert_eq!(again.positions, trajectory.positions);
    }
});
