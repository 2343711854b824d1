//! What a device says beside accelerometer and gyroscope: its magnetometer, and an orientation that it
//! fuses from its own readings.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{cromosim_in, refuses, succeed, text};
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, Joint};
use cromosim_motion::{MotionOptions, SmplMotion, embedded_walk};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_recording::convert::{MotionFile, Target, write_motion};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// T: east, north, up.
const FIELD: &str = "0,1.9e-5,-4.5e-5";
const NAMES: [&str; 5] = ["left_wrist", "right_ankle", "pelvis", "sternum", "head"];

fn field() -> Vector3<f64> {
    Vector3::new(0.0, 1.9e-5, -4.5e-5)
}

fn turn(q: &cromosim_msgs::geometry_msgs::Quaternion) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z))
}

/// A bag of the walk with these options.
fn walk(folder: &Path, out: &str, options: &[&str]) -> BagReader {
    let mut arguments = vec!["simulate", "--walk", "--out", out];
    arguments.extend(options);
    succeed(folder, &arguments);
    BagReader::open(&folder.join(out)).unwrap()
}

fn vector(v: &cromosim_msgs::geometry_msgs::Vector3) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

#[test]
fn a_magnetometer_reads_the_field_of_the_place() {
    let folder = tempfile::tempdir().unwrap();
    let options = ["--magnetic-field", FIELD, "--device", "ideal"];
    let bag = walk(folder.path(), "ideal.mcap", &options);
    for name in NAMES {
        let data = bag.read::<Imu>(&format!("/imu/{name}/data")).unwrap();
        let mag = bag
            .read::<MagneticField>(&format!("/imu/{name}/mag"))
            .unwrap();
        assert_eq!(data.len(), mag.len(), "{name}");
        for ((_, data), (_, mag)) in data.iter().zip(&mag) {
            assert_eq!(data.header, mag.header);
            let expected = turn(&data.orientation).inverse() * field();
            assert!((vector(&mag.magnetic_field) - expected).norm() < 1e-15);
            assert_eq!(mag.magnetic_field_covariance, [0.0; 9]);
        }
    }
    // A real one: iron, noise and steps of 0.3 uT, all of it of a few percent.
    let real = walk(folder.path(), "real.mcap", &["--magnetic-field", FIELD]);
    let data = real.read::<Imu>("/imu/pelvis/data").unwrap();
    let mag = real.read::<MagneticField>("/imu/pelvis/mag").unwrap();
    let mut errors = Vec::new();
    for ((_, data), (_, mag)) in data.iter().zip(&mag) {
        let error = vector(&mag.magnetic_field) - turn(&data.orientation).inverse() * field();
        assert!(error.norm() < 8e-6, "{error}");
        assert!(mag.magnetic_field_covariance[0] > 1e-14);
        let steps = mag.magnetic_field.x / 3e-7;
        assert!((steps - steps.round()).abs() < 1e-6);
        errors.push(error.norm());
    }
    assert!(errors.iter().sum::<f64>() / errors.len() as f64 > 1e-6);
}

#[test]
fn without_a_field_or_a_magnetometer_nothing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let none = walk(folder.path(), "none.mcap", &[]);
    assert!(none.topic("/imu/pelvis/mag").is_err());
    let six_axes = ["--magnetic-field", FIELD, "--device", "mpu6050"];
    let six_axes = walk(folder.path(), "six.mcap", &six_axes);
    assert!(six_axes.topic("/imu/pelvis/mag").is_err());
    let said = six_axes.metadata("cromosim").unwrap();
    assert_eq!(said["magnetic_field"], FIELD);
}

#[test]
fn a_table_holds_the_magnetometer_too() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "simulate",
        "--walk",
        "--placement",
        "wrist=left_watch",
        "--device",
        "ideal",
    ];
    let mut with: Vec<&str> = arguments.to_vec();
    with.extend([
        "--magnetic-field",
        "52.52N,13.41E,2026-11-24",
        "--out",
        "wrist.csv",
    ]);
    succeed(folder.path(), &with);
    let table = std::fs::read_to_string(folder.path().join("wrist.csv")).unwrap();
    let mut lines = table.lines();
    assert!(lines.next().unwrap().ends_with(",magnetic_field_z [T]"));
    for line in lines {
        let values: Vec<f64> = line
            .split(',')
            .map(|value| value.parse().unwrap())
            .collect();
        let strength = Vector3::new(values[7], values[8], values[9]).norm();
        // Berlin's, by WMM2025.
        assert!((4.9e-5..5.1e-5).contains(&strength), "{strength}");
    }
    // What reads series reads it, magnetometer or not.
    succeed(folder.path(), &["inspect", "wrist.csv"]);
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |options: &[&str], words: &[&str]| {
        let mut arguments = vec!["simulate", "--walk"];
        arguments.extend(options);
        refuses(folder.path(), &arguments, words);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    };
    refused(
        &["--out", "a.mcap", "--magnetic-field", "20,0,-43"],
        &["--magnetic-field", "20,0,-43", "1 uT is 1e-6 T"],
    );
    refused(
        &["--out", "a.mcap", "--orientation", "magdwick"],
        &["--orientation", "the nearest is madgwick"],
    );
    refused(
        &["--out", "a.parquet", "--magnetic-field", FIELD],
        &["--magnetic-field", ".mcap or .csv"],
    );
    refused(
        &[
            "--out",
            "a.csv",
            "--placement",
            "w=left_watch",
            "--orientation",
            "vqf",
        ],
        &["--orientation", ".mcap"],
    );
    refused(
        &["--out", "a.mcap", "--magnetic-field", "nowhere.yaml"],
        &["--magnetic-field", "nowhere.yaml", "No such file"],
    );
}

/// A minute of a thing in a hand that is turned about all axes, as TUM.
fn turning(file: &Path) {
    let line = |k: usize| {
        let t = k as f64 * 0.01;
        let turn = Vector3::new(
            1.3 * (1.1 * t).sin() + 0.8 * (2.3 * t).cos(),
            1.2 * (0.9 * t + 1.0).sin(),
            1.9 * (0.7 * t + 2.0).cos(),
        );
        let q = UnitQuaternion::from_scaled_axis(turn);
        let position = 0.2 * Vector3::new((2.0 * t).sin(), (1.7 * t).cos(), (2.9 * t).sin());
        format!(
            "{:.3} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9}\n",
            1.7e9 + t,
            position.x,
            position.y,
            position.z,
            q.i,
            q.j,
            q.k,
            q.w
        )
    };
    std::fs::write(file, (0..6000).map(line).collect::<String>()).unwrap();
}

const IRON: &str = "schema: cromosim/device/1
declared_noise: {accel_density: 0.0014, gyro_density: 0.00012}
magnetometer: {noise_density: 3.0e-8, hard_iron: [8.0e-6, -4.0e-6, 3.0e-6], delay: 0.03}
";

#[test]
fn what_a_magnetometer_does_is_found_and_simulated_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    turning(&folder.join("hand.tum"));
    std::fs::write(folder.join("iron.yaml"), IRON).unwrap();
    let again = |out: &str, options: &[&str]| {
        let mut all = vec!["simulate", "--out", out];
        all.extend(options);
        succeed(folder, &all);
        let bag = BagReader::open(&folder.join(out)).unwrap();
        bag.read::<MagneticField>("/imu/hand/mag").unwrap()
    };
    let rigid = [
        "--rigid",
        "hand.tum",
        "--placement",
        "hand",
        "--rate",
        "100",
    ];
    let device = ["--device", "iron.yaml", "--magnetic-field", FIELD];
    let real = again("real.mcap", &[&rigid[..], &device].concat());
    let said = succeed(folder, &["diagnose", "real.mcap", "--out", "found"]);
    assert!(
        said.contains("magnetometer: ") && said.contains("hard_iron"),
        "{said}"
    );
    let json = std::fs::read_to_string(folder.join("found/diagnosis.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let magnetometer = &json["placements"]["hand"]["magnetometer"];
    let causes = magnetometer["causes"].as_array().unwrap();
    let mut names: Vec<&str> = causes
        .iter()
        .filter_map(|it| it["effect"].as_str())
        .collect();
    names.sort_unstable();
    assert_eq!(names, ["delay", "hard_iron"], "{magnetometer}");
    let report = std::fs::read_to_string(folder.join("found/report.html")).unwrap();
    assert!(
        report.contains("<h3>Magnetometer</h3>") && report.contains("magnetometer x, residual")
    );
    // The same stamps, and the readings but for the noise of 0.3 uT.
    let effects = [
        "--reference",
        "real.mcap",
        "--effects",
        "found/effects.yaml",
        "--no-noise",
    ];
    let simulated = again("again.mcap", &effects);
    assert_eq!(real.len(), simulated.len());
    let square = |((_, real), (_, again)): (&(_, MagneticField), &(_, MagneticField))| {
        assert_eq!(real.header.stamp, again.header.stamp);
        (vector(&real.magnetic_field) - vector(&again.magnetic_field)).norm_squared()
    };
    let inside = 100..real.len() - 100;
    let squares = real[inside.clone()]
        .iter()
        .zip(&simulated[inside.clone()])
        .map(square);
    let rmse = (squares.sum::<f64>() / inside.len() as f64).sqrt();
    assert!((4.5e-7..6.0e-7).contains(&rmse), "{rmse}");
    // And as a device, anywhere.
    succeed(
        folder,
        &["device", "from-diagnosis", "found", "--out", "devices"],
    );
    let device = cromosim_imu::Device::read(&folder.join("devices/hand.yaml")).unwrap();
    let iron = device.magnetometer().unwrap();
    let off = iron.hard_iron - Vector3::new(8e-6, -4e-6, 3e-6);
    assert!(
        off.norm() < 1e-7 && (iron.delay - 0.03).abs() < 1e-3,
        "{iron:?}"
    );
}

/// Root mean squares over all placements: tilt and heading, rad.
fn fusion_errors(bag: &BagReader) -> [f64; 2] {
    let (mut squares, mut count) = ([0.0; 2], 0.0);
    for name in NAMES {
        let data = bag.read::<Imu>(&format!("/imu/{name}/data")).unwrap();
        let poses = bag
            .read::<PoseStamped>(&format!("/reference/{name}"))
            .unwrap();
        let truth: BTreeMap<i64, UnitQuaternion<f64>> = poses
            .iter()
            .map(|(_, pose)| (pose.header.stamp.nanos(), turn(&pose.pose.orientation)))
            .collect();
        for (_, message) in &data {
            let nanos = message.header.stamp.nanos();
            let before = truth.range(..=nanos).next_back();
            let after = truth.range(nanos..).next();
            let (Some((from, before)), Some((to, after))) = (before, after) else {
                continue;
            };
            let part = (nanos - from) as f64 / (to - from).max(1) as f64;
            let error = turn(&message.orientation) * before.slerp(after, part).inverse();
            let up = error * Vector3::z();
            squares[0] += up.xy().norm().atan2(up.z).powi(2) / 2.0;
            squares[1] += (2.0 * error.k.atan2(error.w)).sin().asin().powi(2);
            count += 1.0;
        }
    }
    squares.map(|sum: f64| (sum / count).sqrt())
}

#[test]
fn fusion_errs_as_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let mut ratios = Vec::new();
    for filter in ["vqf", "madgwick", "mahony"] {
        let out = format!("{filter}.mcap");
        let options = ["--magnetic-field", FIELD, "--orientation", filter];
        let bag = walk(folder.path(), &out, &options);
        let [tilt, heading] = fusion_errors(&bag);
        println!("{filter}: tilt {tilt:.4} rad about each axis, heading {heading:.4} rad");
        let message = &bag.read::<Imu>("/imu/pelvis/data").unwrap()[0].1;
        let stated = |k: usize| message.orientation_covariance[k].sqrt();
        // Rounded up to hundredths where the filter states them.
        for (error, stated) in [(tilt, stated(0)), (heading, stated(8))] {
            let rounded = (100.0 * error).ceil() / 100.0;
            ratios.push((filter, error, stated, (rounded - stated).abs() < 1e-9));
        }
        let raw = &bag.read::<Imu>("/imu/pelvis/data_raw").unwrap()[0].1;
        assert_eq!(raw.orientation_covariance[0], -1.0);
    }
    assert!(ratios.iter().all(|(.., is_so)| *is_so), "{ratios:?}");
    // Without a magnetometer the tilt is as good, and the heading is not said to be known.
    let bag = walk(folder.path(), "six.mcap", &["--orientation", "vqf"]);
    let data = bag.read::<Imu>("/imu/pelvis/data").unwrap();
    assert!(
        data.iter()
            .all(|(_, it)| it.orientation_covariance[8] > 3.0)
    );
    let bag = walk(folder.path(), "none.mcap", &["--orientation", "none"]);
    let data = bag.read::<Imu>("/imu/pelvis/data").unwrap();
    assert!(
        data.iter()
            .all(|(_, it)| it.orientation_covariance[0] == -1.0)
    );
}

/// Five seconds at rest, then 55 s of turning about and swinging arms and legs, at 60 Hz.
fn write_exercise(path: &Path) {
    let standing = embedded_walk();
    let frame = |number: u32| {
        let seconds = f64::from(number) / 60.0;
        let begun = ((seconds - 5.0) / 2.0).clamp(0.0, 1.0);
        let size = begun * begun * (3.0 - 2.0 * begun);
        let swing = |rate: f64, by: f64| size * by * (rate * seconds).sin();
        let mut pose = standing.frames[0].clone();
        pose.root_position += Vector3::new(swing(0.9, 0.3), swing(0.7, 0.2), 0.0);
        let mut turn = |joint: Joint, axis: Vector3<f64>, angle: f64| {
            let own = &mut pose.local_rotations[joint.index()];
            *own = UnitQuaternion::from_scaled_axis(axis * angle) * *own;
        };
        turn(Joint::Pelvis, Vector3::z(), swing(0.5, 1.5));
        turn(Joint::Spine3, Vector3::x(), swing(1.1, 0.2));
        turn(Joint::Head, Vector3::y(), swing(1.3, 0.5));
        turn(Joint::LeftShoulder, Vector3::z(), swing(2.1, 0.6));
        turn(Joint::LeftShoulder, Vector3::y(), swing(1.7, 0.6));
        turn(Joint::RightHip, Vector3::x(), swing(2.9, 0.4));
        pose
    };
    let motion = SmplMotion {
        rate_hz: 60.0,
        frames: (0..3600).map(frame).collect(),
        ..standing.clone()
    };
    let file = MotionFile {
        target: Target::Amass,
        options: &MotionOptions::default(),
        command: "test",
        replace: false,
    };
    write_motion(&motion, &BodyModel::embedded(), &file, path).unwrap();
}

/// The filters that others wrote, on our topics; each gives its errors against the reference, and VQF how
/// far ours is from it.
#[test]
fn filters_of_others_understand_our_topics() {
    let Some(python) = std::env::var_os("CROMOSIM_PYTHON") else {
        assert!(
            std::env::var_os("CROMOSIM_REQUIRE_ALL").is_none(),
            "no CROMOSIM_PYTHON"
        );
        println!("skipped: no CROMOSIM_PYTHON");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    // What is published is of calibrated devices, and of minutes.
    write_exercise(&folder.path().join("exercise.npz"));
    let mut arguments = vec!["simulate", "exercise.npz", "--out", "exercise.mcap"];
    arguments.extend([
        "--magnetic-field",
        FIELD,
        "--orientation",
        "vqf",
        "--device",
        "mti630",
    ]);
    succeed(folder.path(), &arguments);
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/interop/orientation.py");
    let output = Command::new(python)
        .arg(script)
        .arg(folder.path().join("exercise.mcap"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    print!("{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn help_names_them() {
    let folder = tempfile::tempdir().unwrap();
    let help = text(&cromosim_in(folder.path(), &["simulate", "--help"]));
    assert!(help.contains("--magnetic-field") && help.contains("--orientation"));
}
