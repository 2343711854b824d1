//! Recordings of data sets (TotalCapture, PAMAP2, RealWorld, BROAD, phone and watch, columns, DIP-IMU) and
//! labelled skeleton clips. No panic, and what comes out is in order.
#![no_main]

use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Container, Entry, Limits};
use cromosim_recording::datasets::{
    DatasetRecording, DipArray, DipRecording, parse_broad, parse_columns, parse_har_spsw, parse_marked_imu, parse_pamap2, parse_realworld, parse_skeleton_npz,
    parse_totalcapture_calibration, parse_totalcapture_reference, parse_totalcapture_sensors, sniff_dataset,
};
use libfuzzer_sys::fuzz_target;

fn check(recording: &DatasetRecording) {
    for imu in &recording.imus {
        let (stamps, count) = (&imu.series.stamps, imu.series.stamps.len());
        assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]), "stamps rise");
        assert_eq!([imu.series.specific_force.len(), imu.series.angular_velocity.len()], [count; 2]);
        assert!(imu.world_from_sensor.is_empty() || imu.world_from_sensor.len() == count);
        assert!(
            imu.series.specific_force.iter().chain(&imu.series.angular_velocity).all(|vector| vector.iter().all(|value| value.is_finite()))
        );
    }
    for (_, poses) in &recording.references {
        assert!(poses.rotations.iter().all(|rotation| (rotation.norm() - 1.0).abs() < 1e-6));
    }
}

fn dip(bytes: &[u8]) -> Option<DipRecording> {
    let limits = Limits { decoded_bytes: 64 << 20, opcodes: 1_000_000, ..Limits::default() };
    let mut container = Container::new(Cursor::new(bytes), Path::new("fuzz.pkl"), limits).ok()?;
    let numbers = |entry: Entry| entry.floats_with_nan(&vec![None; entry.shape().ok()?.len()], "any").ok();
    let [ori, acc, gt] = ["imu_ori", "imu_acc", "gt"].map(|key| container.at(key).ok().and_then(numbers));
    let (ori, acc, gt) = (ori?, acc?, gt?);
    fn view(array: &cromosim_arrays::Array<f64>) -> DipArray<'_> {
        DipArray { shape: &array.shape, values: &array.values }
    }
    DipRecording::from_arrays(view(&ori), view(&acc), view(&gt), "fuzz").ok()
}

fuzz_target!(|bytes: &[u8]| {
    let _ = sniff_dataset(bytes);
    let texts = [parse_pamap2(bytes, "fuzz"), parse_totalcapture_sensors(bytes, "fuzz")];
    texts.iter().flatten().for_each(check);
    let _ = parse_totalcapture_calibration(bytes, "fuzz");
    let (positions, orientations) = bytes.split_at(bytes.len() / 2);
    let _ = parse_totalcapture_reference(positions, orientations, ["fuzz", "fuzz"]);
    if let Ok(recording) = parse_broad(Cursor::new(bytes), "fuzz") {
        check(&recording);
    }
    if let Ok(recording) = parse_marked_imu(Cursor::new(bytes), "fuzz") {
        check(&recording);
    }
    if let Ok(recording) = parse_har_spsw(Cursor::new(bytes), "fuzz") {
        check(&recording);
    }
    if let Ok(recording) = parse_columns(bytes.to_vec(), "fuzz") {
        check(&recording);
    }
    // One zip in both places: each table is its own partner.
    if let Ok(recording) = parse_realworld(Cursor::new(bytes), Cursor::new(bytes), ["fuzz", "fuzz"]) {
        check(&recording);
    }
    let _ = dip(bytes);
    if let Ok(labelled) = parse_skeleton_npz(Cursor::new(bytes), "fuzz") {
        let frames = labelled.clip.frame_count();
        assert!(labelled.labels.is_empty() || labelled.labels.len() == frames);
        assert_eq!(labelled.clip.world_from_joints(frames - 1).len(), labelled.clip.joints().len());
    }
});
