//! Data sets: look-alikes that the tests make, and the real ones that are at hand.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use cromosim_body::Joint;
use cromosim_recording::datasets::{
    DIP_SENSORS, DatasetFiles, DatasetFormat, DipArray, DipRecording, open_dataset, parse_broad,
    parse_har_spsw, parse_marked_imu, parse_pamap2, parse_realworld,
    parse_totalcapture_calibration, parse_totalcapture_reference, parse_totalcapture_sensors,
};
use cromosim_spatial::Stamp;
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
    assert_eq!(ankle.magnetic_field[0], Vector3::new(310.5, 311.5, 312.5));
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

fn npy(shape: &str, values: &[f64]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

#[test]
fn broad_keeps_the_imu_where_the_cameras_lose_the_body() {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let vectors: Vec<f64> = (0..30).map(f64::from).collect();
    let quaternions: Vec<f64> = (0..10)
        .flat_map(|k| {
            if k == 4 {
                [f64::NAN; 4]
            } else {
                [0.8, 0.0, 0.0, 0.6]
            }
        })
        .collect();
    let three = |values: &[f64]| npy("(10, 3)", values);
    for (name, content) in [
        ("fs", npy("()", &[2000.0 / 7.0])),
        ("acc", three(&vectors)),
        ("gyr", three(&vectors)),
        ("mag", three(&vectors)),
        ("pos", three(&vectors)),
        ("quat_wxyz", npy("(10, 4)", &quaternions)),
    ] {
        writer
            .start_file(format!("{name}.npy"), SimpleFileOptions::default())
            .unwrap();
        writer.write_all(&content).unwrap();
    }
    let bytes = writer.finish().unwrap().into_inner();
    let recording = parse_broad(Cursor::new(&bytes), "01.npz").unwrap();
    let (imu, (_, body)) = (&recording.imus[0], &recording.references[0]);
    assert_eq!(
        (
            imu.series.stamps.len(),
            body.stamps.len(),
            imu.series.stamps[1].nanos
        ),
        (10, 9, 3_500_000)
    );
    assert_eq!(body.positions[4], Vector3::new(15.0, 16.0, 17.0));
    assert!((body.rotations[0].k - 0.6).abs() < 1e-15);
    common::damaged(&bytes, 200, |bytes| {
        drop(parse_broad(Cursor::new(bytes), "x"))
    });
}

#[test]
fn broad_as_published_is_told_read_and_cut() {
    let path = common::own_file("broad.mat");
    let (format, mut recording) = open_dataset(&path, &DatasetFiles::default())
        .unwrap()
        .unwrap();
    assert_eq!(
        (format, (recording.rate_hz * 7.0).round()),
        (DatasetFormat::Broad, 2000.0)
    );
    let (imu, (name, body)) = (&recording.imus[0], &recording.references[0]);
    assert_eq!(
        (imu.series.stamps.len(), body.stamps.len(), name.as_str()),
        (40, 37, "body")
    );
    assert_eq!(imu.magnetic_field[7], Vector3::new(20.0, 0.0, -40.0));
    // Rows of MATLAB's columns: the body turns about z by 0.5 rad/s and goes along x by 0.1 m/s.
    let (last, time) = (body.rotations.len() - 1, 39.0 * 3.5e-3);
    assert!(
        (body.rotations[last].scaled_axis() - Vector3::new(0.0, 0.0, 0.5 * time)).norm() < 1e-12
    );
    assert!((body.positions[last] - Vector3::new(0.1 * time, 0.0, 1.0)).norm() < 1e-12);
    let spans: Vec<_> = recording
        .activities
        .iter()
        .map(|span| (span.activity.as_str(), span.end.nanos))
        .collect();
    assert_eq!(spans, [("rest", 66_500_000), ("movement", 136_500_000)]);
    recording.between(Stamp::from_nanos(35_000_000), Stamp::from_nanos(70_000_000));
    let (imu, (_, body)) = (&recording.imus[0], &recording.references[0]);
    assert_eq!(
        (
            imu.series.stamps.len(),
            imu.series.specific_force.len(),
            imu.magnetic_field.len(),
            imu.world_from_sensor.len()
        ),
        (11, 11, 11, 0)
    );
    assert_eq!(
        (
            body.stamps.len(),
            body.stamps[0].nanos,
            recording.activities.len()
        ),
        (8, 45_500_000, 2)
    );
    assert_eq!(
        recording
            .span()
            .map(|(first, last)| (first.nanos, last.nanos)),
        Some((35_000_000, 70_000_000))
    );
    let bytes = std::fs::read(path).unwrap();
    common::damaged(&bytes, 200, |bytes| {
        drop(parse_broad(Cursor::new(bytes), "x"))
    });
}

#[test]
fn broad_itself() {
    let Some(folder) = common::shared_data("paired_broad") else {
        return;
    };
    let path = folder.join("21_undisturbed_fast_combined.npz");
    let recording = parse_broad(std::fs::File::open(&path).unwrap(), "21").unwrap();
    let (imu, (_, body)) = (&recording.imus[0], &recording.references[0]);
    println!(
        "{} readings, {} poses at {:.3} Hz",
        imu.series.stamps.len(),
        body.stamps.len(),
        recording.rate_hz
    );
    assert!(
        body.stamps.len() > imu.series.stamps.len() / 2
            && (recording.rate_hz - 285.714).abs() < 0.001
    );
    // At rest (the first second) the accelerometer shows gravity, and the optical orientation turns
    // it up.
    let mean = imu.series.specific_force[..285]
        .iter()
        .sum::<Vector3<f64>>()
        / 285.0;
    let up = body.rotations[100] * mean;
    println!(
        "gravity at rest {:.3} m/s2, up in the world by {:.2} deg",
        mean.norm(),
        up.angle(&Vector3::z()).to_degrees()
    );
    assert!((mean.norm() - 9.81).abs() < 0.1 && up.angle(&Vector3::z()).to_degrees() < 3.0);
}

#[test]
fn markers_on_a_segment_give_its_pose() {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let shape = [[0.1, 0.0, 0.0], [-0.1, 0.05, 0.0], [0.0, -0.1, 0.02]].map(Vector3::from);
    let centre = shape.iter().sum::<Vector3<f64>>() / 3.0;
    let turn = |frame: usize| {
        nalgebra::UnitQuaternion::from_scaled_axis(Vector3::y() * (0.08 * frame as f64))
    };
    // The second marker is hidden in one frame: two are no pose.
    let seen = |marker: usize| -> Vec<f64> {
        let at = |frame: usize| {
            if (marker, frame) == (1, 4) {
                Vector3::repeat(f64::NAN)
            } else {
                turn(frame) * shape[marker] + Vector3::z()
            }
        };
        (0..10)
            .flat_map(|frame| <[f64; 3]>::from(at(frame)))
            .collect()
    };
    let still: Vec<f64> = (0..20).flat_map(|_| [0.0, 0.0, 9.8]).collect();
    let markers = [0, 1, 2].map(|marker| npy("(10, 3)", &seen(marker)));
    let [a, b, c] = markers;
    for (name, content) in [
        ("fs_imu", npy("()", &[200.0])),
        ("fs_mocap", npy("()", &[100.0])),
        ("acc", npy("(20, 3)", &still)),
        ("gyr", npy("(20, 3)", &still)),
        ("marker_a", a),
        ("marker_b", b),
        ("marker_c", c),
    ] {
        writer
            .start_file(format!("{name}.npy"), SimpleFileOptions::default())
            .unwrap();
        writer.write_all(&content).unwrap();
    }
    let bytes = writer.finish().unwrap().into_inner();
    let recording = parse_marked_imu(Cursor::new(&bytes), "shoe.npz").unwrap();
    let (imu, (_, segment)) = (&recording.imus[0], &recording.references[0]);
    assert_eq!(
        (
            imu.series.stamps.len(),
            segment.stamps.len(),
            segment.stamps[4].nanos
        ),
        (20, 9, 50_000_000)
    );
    for (stamp, (position, rotation)) in segment
        .stamps
        .iter()
        .zip(segment.positions.iter().zip(&segment.rotations))
    {
        let expected = turn((stamp.as_seconds() * 100.0).round() as usize);
        assert!(
            rotation.angle_to(&expected) < 1e-9
                && (position - expected * centre - Vector3::z()).norm() < 1e-9
        );
    }
    common::damaged(&bytes, 200, |bytes| {
        drop(parse_marked_imu(Cursor::new(bytes), "x"))
    });
}

#[test]
fn a_shoe_of_gaitmap_is_told_and_read() {
    let Some(folder) = common::shared_data("paired_gaitmap_foot") else {
        return;
    };
    let (format, recording) =
        open_dataset(&folder.join("left_sensor.npz"), &DatasetFiles::default())
            .unwrap()
            .unwrap();
    let (_, foot) = &recording.references[0];
    assert_eq!(
        (format, foot.stamps.len()),
        (DatasetFormat::MarkedImu, 3870)
    );
    // A foot that walks turns by more than a radian, and comes nowhere near the ground's other
    // side.
    let turned = foot
        .rotations
        .iter()
        .map(|rotation| rotation.angle_to(&foot.rotations[0]))
        .fold(0.0, f64::max);
    assert!(
        turned > 1.0
            && foot
                .positions
                .iter()
                .all(|position| position.z > 0.0 && position.z < 0.6)
    );
}

#[test]
fn phone_and_watch_are_told_and_read() {
    let path = common::own_file("har_spsw.npz");
    let (format, recording) = open_dataset(&path, &DatasetFiles::default())
        .unwrap()
        .unwrap();
    assert_eq!((format, recording.imus.len()), (DatasetFormat::HarSpsw, 2));
    let [phone, watch] = &recording.imus[..] else {
        panic!("two devices")
    };
    assert_eq!(
        (
            phone.placement.as_str(),
            watch.placement.as_str(),
            phone.segment
        ),
        ("pocket", "wrist", None)
    );
    // One stamp of each execution comes twice.
    let milliseconds =
        |index: usize| phone.series.stamps[index].nanos / 1_000_000 - 1_657_533_977_800;
    assert_eq!(
        (0..10).map(milliseconds).collect::<Vec<_>>(),
        [0, 10, 21, 85, 95, 5000, 5010, 5021, 5085, 5095]
    );
    assert_eq!(
        (
            phone.rows_left_out,
            watch.rows_left_out,
            watch.series.stamps.len()
        ),
        (2, 1, 5)
    );
    assert_eq!(
        phone.series.specific_force[2],
        Vector3::new(3.5, 12.75, 2.75)
    );
    assert_eq!(
        watch.series.angular_velocity[4],
        Vector3::new(0.25, 0.0, -0.5)
    );
    // The last span of an execution does not go on in the next.
    let spans: Vec<_> = recording
        .activities
        .iter()
        .map(|span| {
            (
                span.activity.as_str(),
                (span.end.nanos - span.start.nanos) / 1_000_000,
            )
        })
        .collect();
    let one = [("SEATED", 10), ("STANDING_UP", 64), ("SEATED", 0)];
    assert_eq!(spans, [one, one].concat());
    let bytes = std::fs::read(path).unwrap();
    common::damaged(&bytes, 300, |bytes| {
        drop(parse_har_spsw(Cursor::new(bytes), "x"))
    });
}

#[test]
fn a_wrong_array_of_phone_and_watch_is_named() {
    let file = |times: &[u32]| {
        let mut writer = cromosim_arrays::NpzWriter::new(Cursor::new(Vec::new()));
        for key in ["07_sp__acc", "07_sp__gyr"] {
            writer.floats(key, &[2, 3], &[0.5; 6]).unwrap();
        }
        writer
            .integers("07_sp__t_ms", &[times.len()], times)
            .unwrap();
        writer.text("07_sp__label", "SEATED").unwrap();
        writer.finish().unwrap().into_inner()
    };
    let read = |bytes: Vec<u8>| parse_har_spsw(Cursor::new(bytes), "s07.npz");
    let message = read(file(&[1, 2])).unwrap_err().to_string();
    assert!(
        message.contains("s07.npz")
            && message.contains("07_sp__label: 1 rows, but 07_sp__acc has 2"),
        "{message}"
    );
    let message = read(file(&[1])).unwrap_err().to_string();
    assert!(message.contains("07_sp__t_ms: 1 rows"), "{message}");
}

#[test]
fn phone_and_watch_themselves() {
    let Some(folder) = common::shared_data("har_spsw") else {
        return;
    };
    let (format, recording) = open_dataset(&folder.join("s01.npz"), &DatasetFiles::default())
        .unwrap()
        .unwrap();
    assert_eq!(format, DatasetFormat::HarSpsw);
    let (phone, labels) = (
        &recording.imus[0],
        recording
            .activities
            .iter()
            .map(|span| span.activity.as_str()),
    );
    println!(
        "{} readings, {} left out, {} spans",
        phone.series.stamps.len(),
        phone.rows_left_out,
        recording.activities.len()
    );
    let labels: std::collections::BTreeSet<&str> = labels.collect();
    assert_eq!(
        labels.into_iter().collect::<Vec<_>>(),
        [
            "SEATED",
            "SITTING_DOWN",
            "STANDING_UP",
            "TURNING",
            "WALKING"
        ]
    );
    // Two turns an execution, six executions.
    assert_eq!(
        recording
            .activities
            .iter()
            .filter(|span| span.activity == "TURNING")
            .count(),
        12
    );
    let mut lengths: Vec<f64> = phone
        .series
        .specific_force
        .iter()
        .map(|force| force.norm())
        .collect();
    lengths.sort_by(f64::total_cmp);
    let median = lengths[lengths.len() / 2];
    assert!((median - 9.81).abs() < 0.5, "{median}");
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
