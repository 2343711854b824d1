//! What stands in a recording's file, read back with the SDK's own decoder.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::net::TcpListener;
use std::path::Path;

use cromosim_spatial::Stamp;
use cromosim_view::{Destination, Recording, RecordingOptions, TimeAxis};
use nalgebra::{Isometry3, Vector3};
use re_sdk::StoreKind;
use re_sdk::external::re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};

const VERTICES: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// Rows per entity and the last time on the timeline, of the recording and of its layout.
#[derive(Debug, Default)]
struct Content {
    rows: BTreeMap<String, usize>,
    static_rows: BTreeMap<String, usize>,
    layout: BTreeMap<String, usize>,
    times: Vec<i64>,
    activations: usize,
}

fn read(path: &Path) -> Content {
    let mut content = Content::default();
    for message in DecoderApp::decode_eager(BufReader::new(File::open(path).unwrap())).unwrap() {
        match message.unwrap() {
            LogMsg::ArrowMsg(store, message) => {
                let chunk = Chunk::from_arrow_msg(&message).unwrap();
                let (path, rows) = (chunk.entity_path().to_string(), chunk.num_rows());
                let counts = match (store.kind(), chunk.is_static()) {
                    (StoreKind::Blueprint, _) => &mut content.layout,
                    (_, true) => &mut content.static_rows,
                    (_, false) => &mut content.rows,
                };
                *counts.entry(path).or_default() += rows;
                if store.kind() == StoreKind::Recording {
                    content.times.extend(
                        chunk
                            .timelines()
                            .values()
                            .flat_map(|column| column.times_raw().iter().copied()),
                    );
                    assert!(chunk.timelines().keys().all(|name| name.as_str() == "time"));
                }
            }
            LogMsg::BlueprintActivationCommand(_) => content.activations += 1,
            LogMsg::SetStoreInfo(_) => {}
        }
    }
    content
}

fn record(path: &Path, options: RecordingOptions, start: Stamp) -> cromosim_view::Summary {
    let mut recording = Recording::open(
        &[Destination::File {
            path: path.to_owned(),
        }],
        options,
    )
    .unwrap();
    recording.set_body(&VERTICES, &FACES).unwrap();
    for k in 0..100 {
        let stamp = start.plus_seconds(0.01 * f64::from(k));
        assert_eq!(recording.wants_body(stamp), k % 4 == 0, "frame {k}");
        recording.log_body(stamp, &VERTICES).unwrap();
        for name in ["left_wrist", "head"] {
            recording
                .log_sensor(stamp, name, &Isometry3::translation(0.0, 0.0, 1.0))
                .unwrap();
            recording
                .log_imu(
                    stamp,
                    name,
                    &Vector3::new(0.0, 0.0, 9.80665),
                    &Vector3::zeros(),
                )
                .unwrap();
        }
    }
    recording.finish().unwrap()
}

#[test]
fn a_second_at_100_hz_is_25_frames_and_100_samples() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let options = RecordingOptions {
        placements: vec!["left_wrist".into(), "head".into()],
        ..RecordingOptions::default()
    };
    let summary = record(&path, options, Stamp::from_nanos(1_700_000_000_123_456_789));
    assert_eq!(
        (
            summary.body_frames,
            summary.sensor_frames,
            summary.imu_samples
        ),
        (25, 50, 200)
    );

    let content = read(&path);
    assert_eq!(content.rows["/world/body"], 25);
    assert_eq!(content.rows["/world/anchor"], 25);
    assert_eq!(content.rows["/world/sensors/head"], 25);
    assert_eq!(content.rows["/imu/left_wrist/specific_force"], 100);
    assert_eq!(content.rows["/imu/head/angular_velocity"], 100);
    assert_eq!(content.static_rows["/world/body"], 1);
    assert_eq!(content.times.iter().min(), Some(&0));
    assert_eq!(content.times.iter().max(), Some(&990_000_000));
}

#[test]
fn dates_stay_dates() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let start = Stamp::from_nanos(1_700_000_000_000_000_000);
    record(
        &path,
        RecordingOptions {
            time_axis: TimeAxis::Date,
            ..RecordingOptions::default()
        },
        start,
    );
    assert_eq!(read(&path).times.iter().min(), Some(&start.nanos));
}

#[test]
fn the_layout_has_a_view_per_quantity_and_comes_with_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    record(
        &path,
        RecordingOptions {
            placements: vec!["left_wrist".into(), "head".into()],
            ..RecordingOptions::default()
        },
        Stamp::default(),
    );
    let content = read(&path);
    assert_eq!(content.activations, 1);
    let views = content
        .layout
        .keys()
        .filter(|path| path.ends_with("/ViewContents"))
        .count();
    assert_eq!(views, 1 + 2 * 2);
    assert_eq!(
        content
            .layout
            .keys()
            .filter(|path| path.ends_with("/EyeControls3D"))
            .count(),
        1
    );
    assert!(content.layout.contains_key("/time_panel") && content.layout.contains_key("/viewport"));
}

#[test]
fn placements_that_appear_later_get_their_curves_in_one_go() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    record(&path, RecordingOptions::default(), Stamp::default());
    let content = read(&path);
    assert_eq!(content.activations, 2);
    assert_eq!(content.static_rows["/imu/head/specific_force"], 1);
    assert_eq!(content.static_rows["/world/sensors/left_wrist/case"], 1);
}

#[test]
fn a_skeleton_alone_is_followed_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let mut recording = Recording::open(
        &[Destination::File { path: path.clone() }],
        RecordingOptions::default(),
    )
    .unwrap();
    let joints = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.5]];
    assert!(
        recording
            .log_skeleton(Stamp::default(), &joints, &[None, Some(0)])
            .unwrap()
    );
    assert!(
        !recording
            .log_skeleton(Stamp::default(), &joints, &[None, Some(0)])
            .unwrap()
    );
    let error = recording
        .log_skeleton(Stamp::default(), &joints, &[None, Some(7)])
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "joints up to a parent: expected 8, found 2"
    );
    recording.finish().unwrap();
    let content = read(&path);
    assert_eq!(
        (
            content.rows["/world/skeleton"],
            content.rows["/world/anchor"]
        ),
        (1, 1)
    );
}

#[test]
fn names_with_slashes_are_one_part_of_a_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let mut recording = Recording::open(
        &[Destination::File { path: path.clone() }],
        RecordingOptions::default(),
    )
    .unwrap();
    recording
        .log_imu(
            Stamp::default(),
            "left/wrist 1",
            &Vector3::x(),
            &Vector3::y(),
        )
        .unwrap();
    recording.finish().unwrap();
    assert_eq!(read(&path).rows[r"/imu/left\/wrist\ 1/specific_force"], 1);
}

#[test]
fn what_was_flushed_is_readable_without_an_end() {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (
        folder.path().join("run.rrd"),
        folder.path().join("copy.rrd"),
    );
    let mut recording = Recording::open(
        &[Destination::File { path: path.clone() }],
        RecordingOptions::default(),
    )
    .unwrap();
    for k in 0..10 {
        recording
            .log_imu(Stamp::from_nanos(k), "head", &Vector3::x(), &Vector3::y())
            .unwrap();
    }
    recording.flush().unwrap();
    std::fs::copy(&path, &copy).unwrap();
    assert_eq!(read(&copy).rows["/imu/head/specific_force"], 10);
}

#[test]
fn bad_destinations_and_options_are_named() {
    let open = |destination, options| Recording::open(&[destination], options).err().unwrap();
    let path = std::path::PathBuf::from("/nonexistent/run.rrd");
    let error = open(Destination::File { path }, RecordingOptions::default());
    assert!(
        error
            .to_string()
            .starts_with("/nonexistent/run.rrd: cannot create the recording"),
        "{error}"
    );

    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    drop(taken);
    let error = open(
        Destination::Connect { address },
        RecordingOptions::default(),
    );
    assert!(
        error.to_string().contains("no Rerun viewer answers"),
        "{error}"
    );

    let path = tempfile::tempdir().unwrap().path().join("run.rrd");
    let options = RecordingOptions {
        frame_rate_hz: -1.0,
        ..RecordingOptions::default()
    };
    let error = open(Destination::File { path: path.clone() }, options);
    assert_eq!(
        error.to_string(),
        "frame_rate_hz: expected a positive number, found -1"
    );
    assert!(!path.exists());
    assert!(Recording::open(&[], RecordingOptions::default()).is_err());
}

#[test]
fn a_body_is_needed_and_keeps_its_vertices() {
    let path = tempfile::tempdir().unwrap().path().join("run.rrd");
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut recording =
        Recording::open(&[Destination::File { path }], RecordingOptions::default()).unwrap();
    assert!(recording.log_body(Stamp::default(), &VERTICES).is_err());
    recording.set_body(&VERTICES, &FACES).unwrap();
    let error = recording
        .log_body(Stamp::default(), &VERTICES[1..])
        .unwrap_err();
    assert_eq!(error.to_string(), "body vertices: expected 4, found 3");
}
