//! The recordings in bags/gap are what their script makes, and the diagnosis finds what is hidden
//! in them.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::{CROMOSIM, root, succeed, text};
use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::Imu;
use nalgebra::Vector3;
use serde_json::Value;

const RECORDINGS: [&str; 2] = ["session", "check"];
const PLACEMENTS: [&str; 2] = ["right_wrist", "sternum"];

/// Messages of one placement's IMU.
fn imus(recording: &Path, placement: &str) -> Vec<Imu> {
    let messages = BagReader::open(recording)
        .unwrap()
        .read::<Imu>(&format!("/imu/{placement}/data_raw"))
        .unwrap();
    messages.into_iter().map(|(_, message)| message).collect()
}

/// Root mean squares of the difference of two series with the same stamps: specific force, m/s2,
/// and angular velocity, rad/s.
fn rmse(measured: &[Imu], simulated: &[Imu]) -> [f64; 2] {
    assert_eq!(measured.len(), simulated.len());
    let mut squares = [0.0; 2];
    for (one, other) in measured.iter().zip(simulated) {
        assert_eq!(one.header.stamp, other.header.stamp);
        let force =
            Vector3::from(one.linear_acceleration) - Vector3::from(other.linear_acceleration);
        let velocity = Vector3::from(one.angular_velocity) - Vector3::from(other.angular_velocity);
        squares[0] += force.norm_squared();
        squares[1] += velocity.norm_squared();
    }
    squares.map(|sum| (sum / measured.len() as f64).sqrt())
}

#[test]
fn their_script_makes_them_anew() {
    let shipped = root().join("bags/gap");
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("made_from")).unwrap();
    for entry in fs::read_dir(shipped.join("made_from")).unwrap() {
        let entry = entry.unwrap();
        let copy = folder.path().join("made_from").join(entry.file_name());
        fs::copy(entry.path(), copy).unwrap();
    }
    fs::copy(shipped.join("make.sh"), folder.path().join("make.sh")).unwrap();
    let output = Command::new("bash")
        .arg("make.sh")
        .current_dir(folder.path())
        .env("CROMOSIM", CROMOSIM)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    for recording in RECORDINGS {
        let (fresh, shipped) = (folder.path().join(recording), shipped.join(recording));
        let summary = |path: &Path| BagReader::open(path).unwrap().summary().clone();
        assert_eq!(
            summary(&fresh),
            summary(&shipped),
            "{recording}: run bags/gap/make.sh"
        );
        for placement in PLACEMENTS {
            // Not byte for byte: the sines of two machines may differ in their last bit.
            let [force, velocity] = rmse(&imus(&fresh, placement), &imus(&shipped, placement));
            assert!(
                force < 1e-6 && velocity < 1e-6,
                "{recording}, {placement}: run bags/gap/make.sh"
            );
        }
    }
}

/// One value of a named cause, with its bounds.
fn is_near(found: &Value, expected: f64, tolerance: f64) {
    let found = found.as_f64().unwrap();
    assert!(
        (found - expected).abs() < tolerance,
        "{found}, expected {expected} within {tolerance}"
    );
}

#[test]
fn the_diagnosis_names_what_is_hidden_and_another_recording_confirms_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| root().join("bags/gap").join(name);
    let (session, check) = (path("session"), path("check"));
    let check_name = check.to_str().unwrap();
    let said = succeed(
        folder.path(),
        &["diagnose", session.to_str().unwrap(), "--out", "diagnosis"],
    );
    let diagnosis = fs::read_to_string(folder.path().join("diagnosis/diagnosis.json")).unwrap();
    let diagnosis: Value = serde_json::from_str(&diagnosis).unwrap();
    let causes = |placement: &str| {
        let causes = diagnosis["placements"][placement]["causes"].clone();
        causes.as_array().unwrap().clone()
    };
    let wrist = causes("right_wrist");
    let names: Vec<&str> = wrist
        .iter()
        .map(|cause| cause["effect"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["time_offset", "lever_arm"], "{said}");
    assert!(causes("sternum").is_empty(), "{said}");
    // As in bags/gap/made_from/the_watch.yaml.
    is_near(&wrist[0]["parameters"]["seconds"], 0.018, 1e-4);
    for (axis, expected) in [-0.06, 0.0, 0.0].into_iter().enumerate() {
        is_near(&wrist[1]["parameters"]["offset"][axis], expected, 2e-3);
    }
    for cause in &wrist {
        assert!(cause["probability"].as_f64().unwrap() >= 0.9, "{said}");
    }

    let simulate = |arguments: &[&str], out: &str| {
        let common = ["simulate", "--reference", check_name, "--no-noise"];
        let all: Vec<&str> = common
            .iter()
            .chain(arguments)
            .chain(&["--out", out])
            .copied()
            .collect();
        succeed(folder.path(), &all);
        let simulated = imus(&folder.path().join(out), "right_wrist");
        rmse(&imus(&check, "right_wrist"), &simulated)
    };
    let before = simulate(&[], "before.mcap");
    let after = simulate(&["--effects", "diagnosis/effects.yaml"], "after.mcap");
    for channel in 0..2 {
        assert!(
            after[channel] < 0.1 * before[channel],
            "from {before:?} to {after:?} only"
        );
    }
}
