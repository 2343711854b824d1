//! Recordings to diagnose, and the settings of a diagnosis.

use std::fs;
use std::path::Path;

use cromosim_bag::{BagOptions, BagWriter};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

use crate::{listing, refuses};

/// A recording of one placement: so many poses and messages at 100 Hz of something that swings,
/// changed by the caller.
fn recording(path: &Path, poses: usize, imus: usize, change: impl Fn(&mut PoseStamped, &mut Imu)) {
    let mut bag = BagWriter::create(path, BagOptions::default()).unwrap();
    for k in 0..poses.max(imus) {
        let (nanos, t) = (
            1_700_000_000_000_000_000 + 10_000_000 * k as i64,
            k as f64 / 100.0,
        );
        let (mut pose, mut imu) = (PoseStamped::default(), Imu::default());
        (pose.header, imu.header) = (Header::new(nanos, "world"), Header::new(nanos, "wrist_imu"));
        pose.pose.position.x = (2.0 * t).sin();
        (pose.pose.orientation.z, pose.pose.orientation.w) = (0.1 * t).sin_cos();
        imu.linear_acceleration =
            nalgebra::Vector3::new(t.sin(), (1.1 * t).sin(), 9.8 + (1.2 * t).sin()).into();
        imu.angular_velocity =
            nalgebra::Vector3::new((1.3 * t).sin(), (1.4 * t).sin(), 0.2 + (1.5 * t).sin()).into();
        change(&mut pose, &mut imu);
        let log_time = Stamp::from_nanos(nanos);
        if k < poses {
            bag.write("/reference/wrist", log_time, &pose).unwrap();
        }
        if k < imus {
            bag.write("/imu/wrist/data_raw", log_time, &imu).unwrap();
        }
    }
    bag.finish().unwrap();
}

#[test]
fn recordings_to_diagnose() {
    type Change = fn(&mut PoseStamped, &mut Imu);
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, usize, usize, Change, &[&str]); 10] = [
        (
            "apart.mcap",
            2000,
            2000,
            |_, imu| imu.header.stamp.sec += 1000,
            &["wrist", "reference", "recorded together"],
        ),
        (
            "no_reference.mcap",
            0,
            2000,
            |_, _| {},
            &["no_reference.mcap", "/reference/NAME"],
        ),
        (
            "no_imu.mcap",
            2000,
            0,
            |_, _| {},
            &["no_imu.mcap", "/imu/wrist/data_raw"],
        ),
        (
            "one_sample.mcap",
            2000,
            1,
            |_, _| {},
            &["wrist", "1 usable messages"],
        ),
        (
            "one_pose.mcap",
            1,
            2000,
            |_, _| {},
            &["wrist", "reference", "16"],
        ),
        (
            "nan.mcap",
            2000,
            2000,
            |_, imu| imu.angular_velocity.x = f64::NAN,
            &["wrist", "NaN"],
        ),
        (
            "nan_poses.mcap",
            2000,
            2000,
            |pose, _| pose.pose.position.z = f64::INFINITY,
            &["/reference/wrist", "NaN or infinite"],
        ),
        (
            "zero.mcap",
            2000,
            2000,
            |pose, _| (pose.pose.orientation.z, pose.pose.orientation.w) = (0.0, 0.0),
            &["zero.mcap", "/reference/wrist", "not a rotation"],
        ),
        (
            "stuck.mcap",
            2000,
            2000,
            |_, imu| imu.linear_acceleration.y = 1.0,
            &["wrist", "accel_y", "stuck"],
        ),
        (
            "one_time.mcap",
            2000,
            2000,
            |_, imu| imu.header.stamp = Header::new(1_700_000_001_000_000_000, "").stamp,
            &["wrist", "1 usable"],
        ),
    ];
    for (name, poses, imus, change, _) in &cases {
        recording(&folder.path().join(name), *poses, *imus, change);
    }
    for (name, .., expected) in &cases {
        refuses(
            folder.path(),
            &["diagnose", name, "--out", "found"],
            expected,
        );
    }
    fs::write(folder.path().join("text.mcap"), "not a bag").unwrap();
    refuses(
        folder.path(),
        &["diagnose", "text.mcap", "--out", "found"],
        &["text.mcap"],
    );
    refuses(
        folder.path(),
        &["diagnose", "missing.mcap", "--out", "found"],
        &["missing.mcap"],
    );
    refuses(
        folder.path(),
        &["simulate", "--reference", "zero.mcap", "--out", "out.mcap"],
        &["zero.mcap", "/reference/wrist", "not a rotation"],
    );
    refuses(
        folder.path(),
        &[
            "simulate",
            "--reference",
            "one_pose.mcap",
            "--out",
            "out.mcap",
        ],
        &["wrist", "16"],
    );
}

#[test]
fn settings_of_a_diagnosis() {
    let folder = tempfile::tempdir().unwrap();
    recording(&folder.path().join("good.mcap"), 2000, 2000, |_, _| {});
    let diagnose =
        |more: &[&'static str]| [&["diagnose", "good.mcap", "--out", "found"], more].concat();
    refuses(
        folder.path(),
        &diagnose(&["--without", "leverarm"]),
        &["--without leverarm", "no such effect", "lever_arm"],
    );
    refuses(
        folder.path(),
        &diagnose(&["--without", "unknown"]),
        &["--without unknown", "no such effect"],
    );
    let cases = [
        (
            "effect.yaml",
            "without: [accel_bais]\n",
            ["effect.yaml", "accel_bais", "accel_bias"],
        ),
        (
            "field.yaml",
            "seed: 1\nwihtout: []\n",
            ["field.yaml", "line 2", "wihtout"],
        ),
        ("seed.yaml", "seed: -1\n", ["seed.yaml", "line 1", "-1"]),
        (
            "yaml.yaml",
            "placements: [\n",
            ["yaml.yaml", "line 2", "flow node"],
        ),
        (
            "names.yaml",
            "placements: [nose]\n",
            ["good.mcap", "nose", "wrist"],
        ),
    ];
    for (name, content, expected) in &cases {
        fs::write(folder.path().join(name), content).unwrap();
        refuses(
            folder.path(),
            &["diagnose", "good.mcap", "--out", "found", "--config", name],
            expected,
        );
    }
    refuses(
        folder.path(),
        &diagnose(&["--config", "missing.yaml"]),
        &["missing.yaml"],
    );
    refuses(
        folder.path(),
        &["diagnose", "good.mcap", "--out", "good.mcap"],
        &["good.mcap", "no folder"],
    );
    refuses(
        folder.path(),
        &["diagnose", "good.mcap", "--out", "good.mcap/found"],
        &["good.mcap", "no folder"],
    );
    refuses(
        folder.path(),
        &["diagnose", "good.mcap", "./good.mcap", "--out", "found"],
        &["./good.mcap", "given twice"],
    );
    // A folder in the place of a file: nothing is written, neither the other files nor temporary
    // ones.
    fs::create_dir_all(folder.path().join("taken/effects.yaml")).unwrap();
    refuses(
        folder.path(),
        &["diagnose", "good.mcap", "--out", "taken"],
        &["effects.yaml", "folder"],
    );
    assert_eq!(listing(&folder.path().join("taken")), ["effects.yaml"]);
}
