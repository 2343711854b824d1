//! Tables of poses with a header, and the data sets' text files: no panic.
#![no_main]

use cromosim_motion::datasets::{parse_pamap2, parse_totalcapture_calibration, parse_totalcapture_reference, parse_totalcapture_sensors};
use cromosim_motion::rigid::{parse_imu_csv, parse_pose_csv, write_imu_csv, write_pose_csv};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(trajectory) = parse_pose_csv(data, "fuzz") {
        let again = parse_pose_csv(write_pose_csv(&trajectory).as_bytes(), "again").expect("what was written can be read");
        assert_eq!(again.stamps, trajectory.stamps);
    }
    if let Ok(series) = parse_imu_csv(data, "fuzz") {
        assert_eq!(parse_imu_csv(write_imu_csv(&series).as_bytes(), "again").expect("what was written can be read"), series);
    }
    let _ = parse_pamap2(data, "fuzz");
    let _ = parse_totalcapture_sensors(data, "fuzz");
    let _ = parse_totalcapture_calibration(data, "fuzz");
    let (positions, orientations) = data.split_at(data.len() / 2);
    let _ = parse_totalcapture_reference(positions, orientations, ["fuzz", "fuzz"]);
});
