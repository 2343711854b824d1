//! Data sets: look-alikes that the tests make, and the real ones that are at hand.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use cromosim_body::Joint;
use cromosim_recording::datasets::{
    DIP_SENSORS, DipArray, DipRecording, parse_pamap2, parse_realworld,
    parse_totalcapture_calibration, parse_totalcapture_reference, parse_totalcapture_sensors,
};
use nalgebra::{UnitQuaternion, Vector3};
use zip::write::SimpleFileOptions;

#[test]
fn totalcapture_sensors_are_read_by_placement() {
    let names = [
        "Head", "Sternum", "Pelvis", "L_UpArm", "R_UpArm", "L_LowArm", "R_LowArm", "L_UpLeg",
        "R_UpLeg", "L_LowLeg", "R_LowLeg", "L_Foot", "R_Foot",
    ];
    let mut text = format!("{}\t{}\n", names.len(), 4);
    for frame in 1..=4 {
        writeln!(text, "{frame}").unwrap();
        for (sensor, name) in names.iter().enumerate() {
            writeln!(
                text,
                "{name}\t0.8 0 0.6 0\t{frame} {sensor} 9.81\t0.1 0.2 {frame}\t1 2 3"
            )
            .unwrap();
        }
    }
    let recording = parse_totalcapture_sensors(text.as_bytes(), "acting1.sensors").unwrap();
    assert_eq!((recording.imus.len(), recording.rate_hz), (13, 60.0));
    let wrist = &recording.imus[6];
    assert_eq!(
        (
            wrist.placement.as_str(),
            wrist.segment,
            wrist.series.stamps.len()
        ),
        ("R_LowArm", Some(Joint::RightElbow), 4)
    );
    assert_eq!(wrist.series.specific_force[3], Vector3::new(4.0, 6.0, 9.81));
    assert_eq!(
        wrist.series.angular_velocity[2],
        Vector3::new(0.1, 0.2, 3.0)
    );
    assert!(
        (wrist.world_from_sensor[0].j - 0.6).abs() < 1e-15
            && (wrist.world_from_sensor[0].w - 0.8).abs() < 1e-15
    );
    assert_eq!(
        wrist
            .series
            .stamps
            .iter()
            .map(|stamp| stamp.nanos)
            .collect::<Vec<_>>(),
        [0, 16_666_667, 33_333_333, 50_000_000]
    );

    let message = |text: &str| {
        parse_totalcapture_sensors(text.as_bytes(), "a.sensors")
            .unwrap_err()
            .to_string()
    };
    let cut: String = text
        .lines()
        .take(30)
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(
        message(&cut).contains("a.sensors: frame 3: the file ends here"),
        "{}",
        message(&cut)
    );
    assert!(message("1 1\n1\nHead 1 0 0 0 1 2 3\n").contains("AuxFields"));
    assert!(message("99999999 1\n").contains("column 1"));
    assert!(message("13 99999999999\n").contains("column 2"));
    assert!(
        message(&text.replace("3\nHead", "3\nBelly")).contains("in the order of the first frame")
    );
    common::damaged(text.as_bytes(), 300, |bytes| {
        drop(parse_totalcapture_sensors(bytes, "x"))
    });
}

#[test]
fn totalcapture_references_turn_to_metres_and_z_up() {
    let positions = "Hips\tHead\n0 40 0\t0 70 10\n10 40 0\t0 70 10\n";
    let orientations =
        "Hips\tHead\n0 0 0 1\t0 0.6 0 0.8\n0 0 0 1\t0 0.6 0 0.8\n0 0 0 1\t0 0.6 0 0.8\n";
    let joints = parse_totalcapture_reference(
        positions.as_bytes(),
        orientations.as_bytes(),
        ["pos.txt", "ori.txt"],
    )
    .unwrap();
    assert_eq!(joints.len(), 2);
    let (name, head) = &joints[1];
    assert_eq!((name.as_str(), head.stamps.len()), ("Head", 2));
    assert!(
        (head.positions[0] - Vector3::new(0.0, -0.254, 1.778)).norm() < 1e-12,
        "{}",
        head.positions[0]
    );
    // Turning about y, which was up, is turning about z.
    let turn = head.rotations[0] * joints[0].1.rotations[0].inverse();
    assert!((turn.axis().unwrap().into_inner() - Vector3::z()).norm() < 1e-12);
    let wrong = parse_totalcapture_reference(
        positions.as_bytes(),
        b"Hips\tNeck\n",
        ["pos.txt", "ori.txt"],
    )
    .unwrap_err()
    .to_string();
    assert!(
        wrong.contains("ori.txt, line 1: the header names no joints of pos.txt"),
        "{wrong}"
    );
    let calibration =
        parse_totalcapture_calibration(b"2\nHead 0 0 0 1\nPelvis 0.6 0 0 0.8\n", "ref.txt")
            .unwrap();
    assert_eq!(
        (
            calibration.len(),
            calibration[1].0.as_str(),
            calibration[1].1.i
        ),
        (2, "Pelvis", 0.6)
    );
}

#[test]
fn pamap2_is_read_with_activities_and_lost_packets() {
    let imu = |sensor: u32, k: u32| {
        let numbers: Vec<String> = (0..17)
            .map(|column| format!("{}.5", 100 * sensor + column + k))
            .collect();
        numbers.join(" ")
    };
    let mut text = String::new();
    for k in 0..200 {
        let (activity, hand) = (
            if k < 120 { 4 } else { 24 },
            if k % 10 == 3 {
                vec!["NaN"; 17].join(" ")
            } else {
                imu(1, k)
            },
        );
        writeln!(
            text,
            "{:.2} {activity} NaN {hand} {} {}",
            5.0 + 0.01 * f64::from(k),
            imu(2, k),
            imu(3, k)
        )
        .unwrap();
    }
    let recording = parse_pamap2(text.as_bytes(), "subject101.dat").unwrap();
    let [hand, chest, ankle] = &recording.imus[..] else {
        panic!("three IMUs")
    };
    assert_eq!(
        (
            hand.series.stamps.len(),
            hand.rows_left_out,
            chest.series.stamps.len()
        ),
        (180, 20, 200)
    );
    // Columns 5 to 7, 11 to 13 and 14 to 16 of the file, 1-based, and 17 further for each IMU.
    assert_eq!(
        hand.series.specific_force[0],
        Vector3::new(101.5, 102.5, 103.5)
    );
    assert_eq!(
        hand.series.angular_velocity[0],
        Vector3::new(107.5, 108.5, 109.5)
    );
    assert_eq!(
        ankle.magnetic_field[0],
        Vector3::new(310.5, 311.5, 312.5) * 1e-6
    );
    assert_eq!(chest.series.stamps[1].nanos, 5_010_000_000);
    let spans: Vec<_> = recording
        .activities
        .iter()
        .map(|span| (span.activity.as_str(), span.start.nanos, span.end.nanos))
        .collect();
    assert_eq!(
        spans,
        [
            ("walking", 5_000_000_000, 6_190_000_000),
            ("rope_jumping", 6_200_000_000, 6_990_000_000)
        ]
    );
    let message = |text: &str| {
        parse_pamap2(text.as_bytes(), "s.dat")
            .unwrap_err()
            .to_string()
    };
    assert!(message("1 2 3\n").contains("line 1: expected 54"));
    assert!(message(&text.replacen(" 4 NaN", " 99 NaN", 1)).contains("line 1, column 2"));
    let two_lines: String = text
        .lines()
        .take(2)
        .map(|line| format!("{line}\n"))
        .collect();
    common::damaged(two_lines.as_bytes(), 300, |bytes| {
        drop(parse_pamap2(bytes, "x"))
    });
}

fn zipped(members: &[(&str, String)]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in members {
        writer
            .start_file(*name, SimpleFileOptions::default())
            .unwrap();
        writer.write_all(content.as_bytes()).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

#[test]
fn realworld_joins_accelerometer_and_gyroscope() {
    let table = |shift_ms: i64, slope: f64, skip: std::ops::Range<i64>| {
        let mut text = "id,attr_time,attr_x,attr_y,attr_z\n".to_owned();
        for k in (0..100).filter(|k| !skip.contains(k)) {
            let time = 1_435_995_800_000 + 20 * k + shift_ms;
            writeln!(
                text,
                "{},{time},{},1.5,-9.5",
                k + 1,
                slope * (20 * k + shift_ms) as f64
            )
            .unwrap();
        }
        text
    };
    let acc = zipped(&[
        ("acc_walking_forearm.csv", table(0, 1.0, 0..0)),
        ("acc_walking_chest.csv", table(0, 1.0, 0..0)),
        ("readMe", String::new()),
    ]);
    let gyr = zipped(&[
        ("Gyroscope_walking_forearm.csv", table(7, 0.5, 40..60)),
        ("Gyroscope_walking_head.csv", table(7, 0.5, 0..0)),
    ]);
    let recording =
        parse_realworld(Cursor::new(&acc), Cursor::new(&gyr), ["acc.zip", "gyr.zip"]).unwrap();
    assert_eq!(recording.imus.len(), 1, "only the forearm has both");
    let forearm = &recording.imus[0];
    assert_eq!(
        (
            forearm.placement.as_str(),
            recording.activities[0].activity.as_str()
        ),
        ("forearm", "walking")
    );
    // One before the gyroscope begins, 21 in its gap.
    assert_eq!(
        (forearm.rows_left_out, forearm.series.stamps.len()),
        (22, 78)
    );
    for (a, w) in forearm
        .series
        .specific_force
        .iter()
        .zip(&forearm.series.angular_velocity)
    {
        assert!(
            (0.5 * a.x - w.x).abs() < 1e-9,
            "interpolated to the accelerometer's stamps"
        );
    }
    let none = parse_realworld(
        Cursor::new(&acc),
        Cursor::new(&zipped(&[])),
        ["acc.zip", "gyr.zip"],
    )
    .unwrap_err()
    .to_string();
    assert!(none.contains("no position has both"), "{none}");
    let wrong = zipped(&[("acc_walking_chest.csv", "time,x\n".to_owned())]);
    let wrong = parse_realworld(
        Cursor::new(&wrong),
        Cursor::new(&gyr),
        ["acc.zip", "gyr.zip"],
    )
    .unwrap_err()
    .to_string();
    assert!(
        wrong.contains("acc.zip/acc_walking_chest.csv, line 1"),
        "{wrong}"
    );
    common::damaged(&acc, 200, |bytes| {
        drop(parse_realworld(
            Cursor::new(bytes),
            Cursor::new(&gyr),
            ["x", "y"],
        ))
    });
}

#[test]
fn dip_takes_the_decoded_arrays() {
    let count = 3;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.2, 0.3)).to_rotation_matrix();
    let matrix: Vec<f64> = turn.matrix().transpose().iter().copied().collect(); // row-major
    let mut orientations: Vec<f64> = matrix
        .iter()
        .copied()
        .cycle()
        .take(count * 17 * 9)
        .collect();
    orientations[9..18].fill(f64::NAN);
    let accelerations = vec![0.5; count * 17 * 3];
    let poses = vec![0.1; count * 72];
    let shapes: [&[usize]; 3] = [&[count, 17, 3, 3], &[count, 17, 3], &[count, 72]];
    let array = |shape, values| DipArray { shape, values };
    let recording = DipRecording::from_arrays(
        array(shapes[0], &orientations),
        array(shapes[1], &accelerations),
        array(shapes[2], &poses),
        "01.pkl",
    )
    .unwrap();
    assert_eq!(
        (
            recording.poses.len(),
            DIP_SENSORS.len(),
            recording.orientations[0][1]
        ),
        (3, 17, None)
    );
    assert!(
        recording.orientations[2][16]
            .unwrap()
            .angle_to(&UnitQuaternion::from(turn))
            < 1e-12
    );
    assert!((recording.poses[0].axis_angles()[5] - Vector3::repeat(0.1)).norm() < 1e-12);
    let wrong = DipRecording::from_arrays(
        array(shapes[1], &accelerations),
        array(shapes[1], &accelerations),
        array(shapes[2], &poses),
        "01.pkl",
    );
    assert!(
        wrong
            .unwrap_err()
            .to_string()
            .contains("01.pkl: imu_ori: expected shape [3, 17, 3, 3]")
    );
}
