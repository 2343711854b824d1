//! Exports of motion capture systems and sensors: no panic, and what comes out is in order.
#![no_main]

use cromosim_motion::{UpAxis, parse_motive_markers, parse_mvnx, parse_vicon_markers};
use cromosim_recording::datasets::{DatasetRecording, parse_movella, parse_mvnx_sensors, parse_optitrack, parse_vicon, sniff_dataset};
use libfuzzer_sys::fuzz_target;

fn check(recording: &DatasetRecording) {
    assert!(!recording.placements().is_empty());
    for (_, poses) in &recording.references {
        assert!(poses.stamps.windows(2).all(|pair| pair[0] < pair[1]), "stamps rise");
        assert_eq!([poses.positions.len(), poses.rotations.len()], [poses.stamps.len(); 2]);
        assert!(poses.positions.iter().flatten().all(|value| value.is_finite()));
        assert!(poses.rotations.iter().all(|rotation| (rotation.norm() - 1.0).abs() < 1e-6));
    }
    for imu in &recording.imus {
        let (stamps, count) = (&imu.series.stamps, imu.series.stamps.len());
        assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]), "stamps rise");
        assert_eq!([imu.series.specific_force.len(), imu.series.angular_velocity.len()], [count; 2]);
        assert!(imu.world_from_sensor.is_empty() || imu.world_from_sensor.len() == count);
        let vectors = imu.series.specific_force.iter().chain(&imu.series.angular_velocity);
        assert!(vectors.flatten().all(|value| value.is_finite()));
    }
}

fuzz_target!(|bytes: &[u8]| {
    let _ = sniff_dataset(bytes);
    let read = [
        parse_optitrack(bytes, "fuzz", UpAxis::Detect),
        parse_vicon(bytes, "fuzz", UpAxis::Detect),
        parse_movella(bytes, "fuzz"),
        parse_mvnx_sensors(bytes, "fuzz"),
    ];
    read.iter().flatten().for_each(check);
    let text = String::from_utf8_lossy(bytes);
    if let Ok(suit) = parse_mvnx(&text, "fuzz") {
        let _ = suit.clip();
    }
    for markers in [parse_vicon_markers(&text, "fuzz"), parse_motive_markers(&text, "fuzz")].iter().flatten() {
        assert!(markers.frames.iter().all(|frame| frame.len() == markers.labels.len()));
    }
});
