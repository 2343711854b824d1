//! Data sets in files of arrays (npz, npy, MAT): look-alikes that the tests make, and the real ones
//! that are at hand.
#![allow(clippy::unwrap_used)]

mod common;

use std::io::{Cursor, Write as _};

use cromosim_recording::datasets::{
    DatasetFiles, DatasetFormat, open_dataset, parse_broad, parse_har_spsw, parse_marked_imu,
};
use cromosim_spatial::Stamp;
use nalgebra::Vector3;
use zip::write::SimpleFileOptions;

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
    assert_eq!(imu.magnetic_field[7], Vector3::new(20.0, 0.0, -40.0) * 1e-6);
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
    // Markers that move as one body say that its poses are right.
    let frames = segment.frames();
    let largest = |of: fn(&cromosim_imu::PoseStd) -> f64| {
        let stds = frames.iter().map(|frame| of(&frame.pose_std));
        stds.fold(0.0, f64::max)
    };
    assert_eq!(segment.pose_stds.len(), frames.len());
    assert!(largest(|std| std.position_m) < 1e-9 && largest(|std| std.rotation_rad) < 1e-8);
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
    // A shoe bends by some millimetres between its markers.
    let mut stds: Vec<f64> = foot.pose_stds.iter().map(|std| std.position_m).collect();
    stds.sort_by(f64::total_cmp);
    assert!(
        (0.5e-3..5e-3).contains(&stds[stds.len() / 2]),
        "{}",
        stds[stds.len() / 2]
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
