//! EuRoC/ASL ground truth and IMU files: no panic, and what was read comes back.
#![no_main]

use cromosim_recording::rigid::{parse_euroc_ground_truth, parse_euroc_imu, write_euroc_ground_truth, write_euroc_imu};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(series) = parse_euroc_imu(data, "fuzz") {
        assert_eq!(parse_euroc_imu(write_euroc_imu(&series).as_bytes(), "again").expect("what was written can be read"), series);
    }
    if let Ok(truth) = parse_euroc_ground_truth(data, "fuzz") {
        let again = parse_euroc_ground_truth(write_euroc_ground_truth(&truth).as_bytes(), "again").expect("what was written can be read");
        assert_eq!(again.trajectory.stamps, truth.trajectory.stamps);
        assert_eq!(again.velocities, truth.velocities);
    }
});
