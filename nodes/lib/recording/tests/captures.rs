//! Exports of motion capture systems: look-alikes that `scripts/make_captures.py` makes give the
//! one motion back that they hold; what is wrong with a file is said in one line.
#![allow(clippy::unwrap_used)]

mod common;

use cromosim_body::Joint;
use cromosim_motion::UpAxis;
use cromosim_recording::datasets::{
    DatasetFiles, DatasetFormat, DatasetRecording, open_dataset, parse_movella, parse_mvnx_sensors,
    parse_optitrack, parse_vicon,
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

/// Each pose is the motion's, moved by `arm` in the body's axes, within what the printed digits
/// give.
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
fn vicon_gives_the_motion_back() {
    // Nexus: helical vectors in degrees.
    let recording = parse_vicon(&sample("vicon_nexus.csv"), "v.csv", UpAxis::Detect).unwrap();
    assert_holds_both(&recording, ["wand", "tool_tip"], FRAMES - 4);
    let wand = recording.reference("wand").unwrap();
    assert_eq!(wand.stamps[0].nanos, 10_000_000, "frame 1 at 100 Hz");
    let notes = recording.notes.join("\n");
    for said in [
        "tool_tip: not seen in 4 of 60",
        "sections left alone: trajectories",
    ] {
        assert!(notes.contains(said), "{notes}");
    }
    // Tracker: a quaternion, and Euler angles about z, y, x in radians, between semicolons.
    let recording = parse_vicon(&sample("vicon_tracker.csv"), "v.csv", UpAxis::Z).unwrap();
    assert_holds_both(&recording, ["wand", "tool_tip"], FRAMES);
    let notes = recording.notes.join("\n");
    assert!(
        notes.contains("in their parents' axes, and left alone: 1 of the columns' names"),
        "{notes}"
    );
    // y up.
    let turned = parse_vicon(&sample("vicon_nexus.csv"), "v.csv", UpAxis::Y).unwrap();
    let turned = turned.reference("wand").unwrap().positions[0];
    let wand = wand.positions[0];
    assert!((turned - Vector3::new(wand.x, -wand.z, wand.y)).norm() < 1e-12);
}

#[test]
fn vicon_takes_sub_frames_and_says_what_is_wrong() {
    let small = "Objects\n200\n,,a:b,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,deg,deg,deg,mm,mm,mm\n\
                 1,0,0,0,90,1,2,3\n1,1,0,0,90,1,2,3\n2,0,,,,,,\n2,1,0,0,90,1,2,3\n";
    let recording = parse_vicon(small.as_bytes(), "v.csv", UpAxis::Detect).unwrap();
    let poses = recording.reference("a_b").unwrap();
    let stamps: Vec<i64> = poses.stamps.iter().map(|stamp| stamp.nanos).collect();
    assert_eq!(stamps, [10_000_000, 15_000_000, 25_000_000]);
    assert!((poses.rotations[0] * Vector3::x() - Vector3::y()).norm() < 1e-12);
    for (from, to, expected) in [
        (
            "200",
            "fast",
            "v.csv: line 2: expected the section's rate in Hz",
        ),
        (
            "Frame,",
            "Frames,",
            "v.csv: line 4: expected columns that begin with Frame, found Frames",
        ),
        ("RY", "RQ", "v.csv: line 5: a:b has no column RY"),
        (
            "deg",
            "grad",
            "v.csv: line 5: a:b: RX in \"grad\"; expected deg or rad",
        ),
        (
            "mm",
            "miles",
            "v.csv: line 5: a:b: TX in \"miles\"; expected mm, cm or m",
        ),
        (
            ",,a:b",
            ",,Global Angle (Euler) a:b",
            "v.csv: line 5: a:b: Euler angles without an order such as XYZ",
        ),
        (
            "1,1,0",
            "1,x,0",
            "v.csv, line 7, column 2: expected a whole number, found \"x\"",
        ),
        (
            "2,1,0",
            "2,0,0",
            "v.csv, line 9: stamp 20000000 ns is not after",
        ),
        (
            "90,1,2,3\n1",
            "90,1,2,3x\n1",
            "v.csv, line 6, column 8: expected a finite number, found \"3x\"",
        ),
        (
            "Objects",
            "Trajectories",
            "v.csv: sections: no Objects and no Segments, but trajectories; export them, too",
        ),
    ] {
        assert!(small.contains(from), "{from}");
        let damaged = small.replacen(from, to, 1);
        let said = parse_vicon(damaged.as_bytes(), "v.csv", UpAxis::Detect);
        let said = said.unwrap_err().to_string();
        assert!(said.starts_with(expected), "{said}");
    }
    let more = format!("{small}\nfoot\n1\n");
    let said = parse_vicon(more.as_bytes(), "v.csv", UpAxis::Detect).unwrap_err();
    assert!(
        said.to_string()
            .contains("line 11: expected the name of a section"),
        "{said}"
    );
}

/// What an IMU in the moving body reads: specific force, angular velocity, both in its axes.
fn reading(seconds: f64) -> (Vector3<f64>, Vector3<f64>) {
    let world_from_body = pose(seconds).1;
    let acceleration = Vector3::new(
        -2.0 * (2.0 * seconds).cos(),
        -2.0 * (2.0 * seconds).sin(),
        -0.9 * (3.0 * seconds).sin(),
    );
    let gravity_in_world = Vector3::new(0.0, 0.0, -9.80665);
    let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.4 * (2.0 * seconds).sin());
    let turn = roll.inverse() * Vector3::new(0.0, 0.0, 0.8);
    (
        world_from_body.inverse() * (acceleration - gravity_in_world),
        turn + Vector3::new(0.8 * (2.0 * seconds).cos(), 0.0, 0.0),
    )
}

/// Readings are those of the motion, where the first stamp is at the motion's `begin`.
fn assert_reads_the_motion(recording: &DatasetRecording, count: usize) {
    let [imu] = recording.imus.as_slice() else {
        panic!("{} IMUs", recording.imus.len());
    };
    assert_eq!(imu.series.stamps.len(), count);
    let first = imu.series.stamps[0];
    for (index, stamp) in imu.series.stamps.iter().enumerate() {
        let seconds = *stamp - first;
        let (force, rate) = reading(seconds);
        let off = (imu.series.specific_force[index] - force).norm();
        assert!(off < 2e-6, "{seconds}: {off} m/s2");
        let off = (imu.series.angular_velocity[index] - rate).norm();
        assert!(off < 2e-6, "{seconds}: {off} rad/s");
        if let Some(turn) = imu.world_from_sensor.get(index) {
            assert!(turn.angle_to(&pose(seconds).1) < 1e-6, "{seconds}");
        }
    }
}

#[test]
fn movella_tables_give_the_readings_back() {
    // Degrees a second, microseconds that begin again at 0 after ten samples, a packet lost.
    let recording = parse_movella(&sample("dot.csv"), "d.csv").unwrap();
    assert_reads_the_motion(&recording, FRAMES - 1);
    let imu = &recording.imus[0];
    assert_eq!(
        (
            imu.placement.as_str(),
            imu.rows_left_out,
            imu.world_from_sensor.len()
        ),
        ("Left_wrist", 1, FRAMES - 1)
    );
    assert!((recording.rate_hz - 60.0).abs() < 1e-12 && imu.magnetic_field.is_empty());
    let notes = recording.notes.join("\n");
    for said in ["degrees a second", "magnetic field, in units of its own"] {
        assert!(notes.contains(said), "{notes}");
    }
    // Radians a second, no time but the counter's, which begins again at 0.
    let recording = parse_movella(&sample("mt_manager.txt"), "m.txt").unwrap();
    assert_reads_the_motion(&recording, FRAMES);
    let stamps = &recording.imus[0].series.stamps;
    assert_eq!((stamps[0].nanos, stamps[59].nanos), (0, 590_000_000));
    assert!(recording.notes.join("").contains("rad/s"));
    // Increments by the rate are the same.
    let recording = parse_movella(&sample("dot_increments.csv"), "d.csv").unwrap();
    assert_reads_the_motion(&recording, FRAMES);
    assert_eq!(recording.imus[0].placement, "body");
}

#[test]
fn movella_free_acceleration_and_other_columns() {
    // Without Acc: by the orientation.
    let text = String::from_utf8(sample("dot.csv")).unwrap();
    let without = text.replace(",Acc_X,Acc_Y,Acc_Z", ",A,B,C");
    let recording = parse_movella(without.as_bytes(), "d.csv").unwrap();
    assert_reads_the_motion(&recording, FRAMES - 1);
    assert!(recording.notes.join("").contains("free acceleration"));
    // MT Manager's SampleTimeFine counts tenths of milliseconds.
    let ticks = "// Update Rate: 100.0Hz\nPacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tRoll\tPitch\tYaw\n\
                 1\t1000\t0\t0\t9.8\t0\t0\t1\t0\t0\t90\n2\t1100\t0\t0\t9.8\t0\t0\t1\t0\t0\t90\n";
    let recording = parse_movella(ticks.as_bytes(), "m.txt").unwrap();
    let imu = &recording.imus[0];
    assert_eq!(imu.series.stamps[1].nanos, 110_000_000);
    assert!((imu.world_from_sensor[0] * Vector3::x() - Vector3::y()).norm() < 1e-12);
    assert!((imu.series.angular_velocity[0].z - 1.0).abs() < 1e-15);
    for (from, to, expected) in [
        (
            "Gyr_X",
            "Gy",
            "d.csv, line 11: the header names no angular velocity (Gyr_X, Gyr_Y, Gyr_Z; or dq); it has PacketCounter",
        ),
        ("Acc_X,Acc_Y,Acc_Z,Gyr", "A,B,C,Gyr", ""),
        (
            "PacketCounter",
            "Packets",
            "d.csv: header: no line with PacketCounter among its columns",
        ),
        (
            "\n2,",
            "\n2,x",
            "d.csv, line 14, column 2: expected a whole number, found \"x",
        ),
        (
            "0.9999556",
            "0.9999556x",
            "d.csv, line 13, column 3: expected a finite number",
        ),
        (
            "0.9999556",
            "3.9999556",
            "d.csv, line 13: the quaternion has length",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let damaged = text.replacen(from, to, 1);
        match parse_movella(damaged.as_bytes(), "d.csv") {
            Ok(_) => assert!(expected.is_empty(), "{from}"),
            Err(said) => assert!(
                !expected.is_empty() && said.to_string().starts_with(expected),
                "{said}"
            ),
        }
    }
    let untimed = text
        .replace("SampleTimeFine", "Time")
        .replace("OutputRate", "Rate");
    let said = parse_movella(untimed.as_bytes(), "d.csv").unwrap_err();
    assert!(
        said.to_string()
            .contains("neither SampleTimeFine nor a rate"),
        "{said}"
    );
}

#[test]
fn a_suit_gives_readings_and_segments_back() {
    let recording = parse_mvnx_sensors(&sample("suit.mvnx"), "s.mvnx").unwrap();
    assert_eq!(recording.placements(), ["Pelvis", "L5"]);
    let start = 1_700_000_000_250_000_000;
    // The same from 0 on, which the motion counts from.
    let from_zero = |poses: &PoseTrajectory| {
        let mut poses = poses.clone();
        for stamp in &mut poses.stamps {
            stamp.nanos -= start;
        }
        poses
    };
    let [pelvis, spine] =
        ["Pelvis", "L5"].map(|name| from_zero(recording.reference(name).unwrap()));
    assert_is_the_motion(&pelvis, Vector3::zeros());
    assert_is_the_motion(&spine, Vector3::new(0.1, 0.0, 0.02));
    assert_eq!(pelvis.stamps.len(), FRAMES);
    let [imu] = recording.imus.as_slice() else {
        panic!("{} IMUs", recording.imus.len());
    };
    assert_eq!(
        (imu.placement.as_str(), imu.segment),
        ("Pelvis", Some(Joint::Pelvis))
    );
    let sensor_from_body =
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -std::f64::consts::FRAC_PI_2);
    for (index, stamp) in pelvis.stamps.iter().enumerate() {
        let (force, rate) = reading(stamp.as_seconds());
        let off = (imu.series.specific_force[index] - sensor_from_body * force).norm();
        assert!(off < 3e-6, "{stamp:?}: {off} m/s2");
        let off = (imu.series.angular_velocity[index] - sensor_from_body * rate).norm();
        assert!(off < 3e-6, "{stamp:?}: {off} rad/s");
    }
    let text = String::from_utf8(sample("suit.mvnx")).unwrap();
    let without = text.replace("sensorFreeAcceleration", "sensorAcceleration");
    let recording = parse_mvnx_sensors(without.as_bytes(), "s.mvnx").unwrap();
    assert!(recording.imus.is_empty() && recording.notes[1].starts_with("no readings"));
    let cut = &text[..text.len() / 2];
    let said = parse_mvnx_sensors(cut.as_bytes(), "s.mvnx")
        .unwrap_err()
        .to_string();
    assert!(said.starts_with("s.mvnx, line "), "{said}");
}

#[test]
fn exports_are_told_by_content() {
    for (name, format) in [
        ("optitrack.csv", DatasetFormat::OptiTrack),
        ("optitrack_euler.csv", DatasetFormat::OptiTrack),
        ("vicon_nexus.csv", DatasetFormat::Vicon),
        ("vicon_tracker.csv", DatasetFormat::Vicon),
        ("dot.csv", DatasetFormat::Movella),
        ("dot_increments.csv", DatasetFormat::Movella),
        ("mt_manager.txt", DatasetFormat::Movella),
        ("suit.mvnx", DatasetFormat::Mvnx),
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
    let samples: [(&str, Parser); 7] = [
        ("optitrack.csv", |bytes| {
            parse_optitrack(bytes, "x", UpAxis::Detect)
        }),
        ("optitrack_euler.csv", |bytes| {
            parse_optitrack(bytes, "x", UpAxis::Detect)
        }),
        ("vicon_nexus.csv", |bytes| {
            parse_vicon(bytes, "x", UpAxis::Detect)
        }),
        ("vicon_tracker.csv", |bytes| {
            parse_vicon(bytes, "x", UpAxis::Detect)
        }),
        ("dot.csv", |bytes| parse_movella(bytes, "x")),
        ("mt_manager.txt", |bytes| parse_movella(bytes, "x")),
        ("suit.mvnx", |bytes| parse_mvnx_sensors(bytes, "x")),
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
        assert!(counts[0] > 100 && counts[1] > 1, "{name}: {counts:?}");
    }
}
