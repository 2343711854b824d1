//! Exports of motion capture systems: no panic, and what comes out is in order.
#![no_main]

use cromosim_motion::UpAxis;
use cromosim_recording::datasets::{DatasetRecording, parse_optitrack, sniff_dataset};
use libfuzzer_sys::fuzz_target;

fn check(recording: &DatasetRecording) {
    assert!(!recording.placements().is_empty());
    for (_, poses) in &recording.references {
        assert!(poses.stamps.windows(2).all(|pair| pair[0] < pair[1]), "stamps rise");
        assert_eq!([poses.positions.len(), poses.rotations.len()], [poses.stamps.len(); 2]);
        assert!(poses.positions.iter().flatten().all(|value| value.is_finite()));
        assert!(poses.rotations.iter().all(|rotation| (rotation.norm() - 1.0).abs() < 1e-6));
    }
}

fuzz_target!(|bytes: &[u8]| {
    let _ = sniff_dataset(bytes);
    if let Ok(recording) = parse_optitrack(bytes, "fuzz", UpAxis::Detect) {
        check(&recording);
    }
});
