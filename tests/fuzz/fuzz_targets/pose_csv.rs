//! Tables of poses and of readings with a header: no panic, and what is written is read again.
#![no_main]

use cromosim_recording::rigid::{parse_imu_csv, parse_pose_csv, write_imu_csv, write_pose_csv};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(trajectory) = parse_pose_csv(data, "fuzz") {
        let again = parse_pose_csv(write_pose_csv(&trajectory).as_bytes(), "again").expect("what was written can be read");
        assert_eq!(again.stamps, trajectory.stamps);
    }
    if let Ok(series) = parse_imu_csv(data, "fuzz") {
        assert_eq!(parse_imu_csv(write_imu_csv(&series).as_bytes(), "again").expect("what was written can be read"), series);
    }
});
