//! Exports of motion capture systems: look-alikes that `scripts/make_captures.py` makes give the one
//! motion back that they hold; what is wrong with a file is said in one line.
#![allow(clippy::unwrap_used)]

mod common;

use cromosim_motion::UpAxis;
use cromosim_recording::datasets::{
    DatasetFiles, DatasetFormat, DatasetRecording, open_dataset, parse_optitrack,
};
use cromosim_recording::rigid::{PoseTrajectory, RigidError};
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

const FRAMES: usize = 60;

fn sample(name: &str) -> Vec<u8> {
    std::fs::read(common::own_file(&format!("captures/{name}"))).unwrap()
}

/// The motion of the script, z up: position, world_from_body.
fn pose(seconds: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let position = Vector3::new(
        0.5 * (2.0 * seconds).cos(),
        0.5 * (2.0 * seconds).sin(),
        1.0 + 0.1 * (3.0 * seconds).sin(),
    );
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.8 * seconds);
    let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.4 * (2.0 * seconds).sin());
    (position, heading * roll)
}

/// Each pose is the motion's, moved by `arm` in the body's axes, within what the printed digits give.
fn assert_is_the_motion(poses: &PoseTrajectory, arm: Vector3<f64>) {
    assert!(!poses.stamps.is_empty());
    for ((stamp, position), rotation) in poses
        .stamps
        .iter()
        .zip(&poses.positions)
        .zip(&poses.rotations)
    {
        let (origin, expected) = pose(stamp.as_seconds());
        let off = (position - origin - expected * arm).norm();
        assert!(off < 2e-6, "{stamp:?}: {off} m");
        let turn = rotation.angle_to(&expected);
        assert!(turn < 4e-6, "{stamp:?}: {turn} rad");
    }
}

fn assert_holds_both(recording: &DatasetRecording, names: [&str; 2], second: usize) {
    assert_eq!(recording.placements(), names);
    let [one, other] = names.map(|name| recording.reference(name).unwrap());
    assert_eq!((one.stamps.len(), other.stamps.len()), (FRAMES, second));
    assert_is_the_motion(one, Vector3::zeros());
    assert_is_the_motion(other, Vector3::new(0.1, 0.0, 0.02));
}

#[test]
fn optitrack_gives_the_motion_back() {
    let recording = parse_optitrack(&sample("optitrack.csv"), "o.csv", UpAxis::Detect).unwrap();
    assert_holds_both(&recording, ["wand", "Rigid_Body_2"], FRAMES - 4);
    assert!((recording.rate_hz - 120.0).abs() < 1e-12);
    // Times are printed with six digits, frames are exact.
    let wand = recording.reference("wand").unwrap();
    assert_eq!(wand.stamps[1].nanos, 8_333_333);
    let notes = recording.notes.join("\n");
    for said in [
        "2026-11-25 10.15.30.250 AM",
        "7 columns of markers",
        "Rigid_Body_2: not seen in 4 of 60 frames",
    ] {
        assert!(notes.contains(said), "{notes}");
    }
    // An older layout: angles about z, y, x in degrees, millimetres, a bone.
    let recording = parse_optitrack(&sample("optitrack_euler.csv"), "o.csv", UpAxis::Y).unwrap();
    assert_holds_both(&recording, ["wand", "suit_Hip"], FRAMES);
    // An export whose z axis is up is taken as it is.
    let as_it_is = parse_optitrack(&sample("optitrack.csv"), "o.csv", UpAxis::Z).unwrap();
    let y_up = as_it_is.reference("wand").unwrap();
    assert!((y_up.positions[0] - Vector3::new(0.5, 1.0, 0.0)).norm() < 1e-6);
}

#[test]
fn optitrack_says_what_is_wrong() {
    let text = String::from_utf8(sample("optitrack.csv")).unwrap();
    let refused = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let damaged = text.replacen(from, to, 1);
        parse_optitrack(damaged.as_bytes(), "o.csv", UpAxis::Detect)
            .unwrap_err()
            .to_string()
    };
    for (from, to, expected) in [
        (
            "Coordinate Space,Global",
            "Coordinate Space,Local",
            "o.csv: line 1: coordinate space \"Local\": poses have to be in the world; export with Global coordinates",
        ),
        (
            "Length Units,Meters",
            "Length Units,Furlongs",
            "o.csv: line 1: length units \"Furlongs\": expected Meters",
        ),
        (
            "Rotation Type,Quaternion",
            "Rotation Type,XYX",
            "o.csv: line 1: rotation type \"XYX\": expected Quaternion or an order",
        ),
        (
            "\r\nFrame,",
            "\r\nFrames,",
            "o.csv: header: no row of columns that begins with Frame",
        ),
        (
            "\r\n2,0.016667",
            "\r\n2,0.008333",
            "o.csv, line 10: stamp 8333333 ns is not after the 8333333 ns",
        ),
        (
            "\r\n1,0.008333,-0.704742",
            "\r\n1,0.008333,-0.704x",
            "o.csv, line 9, column 3: expected a finite number, found \"-0.704x\"",
        ),
        (
            "\r\n1,0.008333,-0.704742",
            "\r\n1,0.008333,-9.704742",
            "o.csv, line 9: the quaternion has length",
        ),
        (
            "Rotation,Rotation,Rotation,Rotation",
            "Rotation,Rotation,Rotation,Rotations",
            "o.csv: line 7: wand has no column \"rotation w\"",
        ),
    ] {
        let said = refused(from, to);
        assert!(said.starts_with(expected), "{said}");
    }
    let said = text.replace("Rigid Body", "Marker Set");
    let said = parse_optitrack(said.as_bytes(), "o.csv", UpAxis::Detect).unwrap_err();
    assert!(
        said.to_string().contains("no rigid bodies and no bones"),
        "{said}"
    );
    let cut = &text[..text.find("\r\n0,0.0").unwrap()];
    let said = parse_optitrack(cut.as_bytes(), "o.csv", UpAxis::Detect).unwrap_err();
    assert_eq!(said.to_string(), "o.csv: no rows of data");
}

#[test]
fn exports_are_told_by_content() {
    for (name, format) in [
        ("optitrack.csv", DatasetFormat::OptiTrack),
        ("optitrack_euler.csv", DatasetFormat::OptiTrack),
    ] {
        let path = common::own_file(&format!("captures/{name}"));
        let (found, recording) = open_dataset(&path, &DatasetFiles::default())
            .unwrap()
            .unwrap();
        assert_eq!(found, format, "{name}");
        assert_eq!(recording.traces().len(), recording.placements().len());
    }
}

fn assert_sound(recording: &DatasetRecording) {
    let rise = |stamps: &[Stamp]| stamps.windows(2).all(|pair| pair[0] < pair[1]);
    for (name, poses) in &recording.references {
        assert!(rise(&poses.stamps) && !poses.stamps.is_empty(), "{name}");
        let counts = [poses.positions.len(), poses.rotations.len()];
        assert_eq!(counts, [poses.stamps.len(); 2]);
        assert!(
            poses
                .positions
                .iter()
                .flatten()
                .all(|part| part.is_finite())
        );
        assert!(
            poses
                .rotations
                .iter()
                .all(|it| (it.norm() - 1.0).abs() < 1e-9)
        );
    }
    for imu in &recording.imus {
        assert!(rise(&imu.series.stamps));
        let vectors = imu
            .series
            .specific_force
            .iter()
            .chain(&imu.series.angular_velocity);
        assert!(vectors.flatten().all(|part| part.is_finite()));
    }
}

type Parser = fn(&[u8]) -> Result<DatasetRecording, RigidError>;

#[test]
fn damaged_exports_are_refused_by_name_or_hold_sound_values() {
    let samples: [(&str, Parser); 2] = [
        ("optitrack.csv", |bytes| {
            parse_optitrack(bytes, "x", UpAxis::Detect)
        }),
        ("optitrack_euler.csv", |bytes| {
            parse_optitrack(bytes, "x", UpAxis::Detect)
        }),
    ];
    for (name, parse) in samples {
        let mut counts = [0; 2];
        common::damaged(&sample(name), 400, |bytes| match parse(bytes) {
            Ok(recording) => {
                assert_sound(&recording);
                counts[1] += 1;
            }
            Err(error) => {
                assert!(error.to_string().starts_with('x'), "{error}");
                counts[0] += 1;
            }
        });
        println!("{name}: {counts:?}");
        assert!(counts[0] > 100 && counts[1] > 10, "{name}: {counts:?}");
    }
}
