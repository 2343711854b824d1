//! What commands say as JSON.
#![allow(clippy::unwrap_used)]

mod common;

use common::{root, succeed};
use cromosim_bag::BagReader;
use serde_json::Value;

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn inspect_prints_an_object_for_each_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let walk = root().join("bags/walk");
    succeed(here, &["convert", walk.to_str().unwrap(), "walk.bvh"]);
    succeed(
        here,
        &["convert", "walk.bvh", "wrist.tum", "--site", "left_watch"],
    );
    let said = succeed(
        here,
        &[
            "inspect",
            "--json",
            walk.to_str().unwrap(),
            "walk.bvh",
            "wrist.tum",
        ],
    );
    let objects: Vec<Value> = said.lines().map(parsed).collect();
    let [bag, motion, rigid] = objects.as_slice() else {
        panic!("three files, three lines: {said}");
    };
    assert_eq!(bag["kind"], "bag");
    assert_eq!(bag["messages"], 6416);
    let topics = bag["topics"].as_array().unwrap();
    let wrist = topics
        .iter()
        .find(|topic| topic["name"] == "/imu/left_wrist/data_raw")
        .unwrap();
    assert_eq!(wrist["type"], "sensor_msgs/msg/Imu");
    assert!((wrist["rate_hz"].as_f64().unwrap() - 100.0).abs() < 0.01 && wrist["gaps"] == 0);
    assert_eq!(bag["attachments"][0]["name"], "placements.yaml");
    assert_eq!(bag["metadata"]["cromosim"]["seed"], "0");
    assert_eq!(
        (&motion["kind"], &motion["path"]),
        (&"motion".into(), &"walk.bvh".into())
    );
    assert!(
        motion["duration_s"].as_f64().unwrap() > 3.9
            && motion["pelvis_path_m"].as_f64().unwrap() > 1.0
    );
    assert_eq!(rigid["kind"], "rigid");
    assert_eq!(rigid["rows"], motion["frames"]);
}

#[test]
fn diagnose_and_compare_print_what_their_files_hold() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let session = root().join("bags/gap/session");
    let said = succeed(
        here,
        &[
            "diagnose",
            session.to_str().unwrap(),
            "--out",
            "diagnosis",
            "--json",
        ],
    );
    assert_eq!(
        said,
        std::fs::read_to_string(here.join("diagnosis/diagnosis.json")).unwrap()
    );
    assert_eq!(
        parsed(&said)["placements"]["right_wrist"]["causes"][0]["effect"],
        "time_offset"
    );
    let check = root().join("bags/gap/check");
    let said = succeed(
        here,
        &[
            "compare",
            session.to_str().unwrap(),
            check.to_str().unwrap(),
            "--out",
            "found.json",
            "--json",
        ],
    );
    assert_eq!(
        said,
        std::fs::read_to_string(here.join("found.json")).unwrap()
    );
    assert!(parsed(&said).is_object());
}

#[test]
fn simulate_prints_an_object_for_each_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let object = |arguments: &[&str]| parsed(&succeed(here, arguments));
    let walk = object(&["simulate", "--walk", "--out", "walk.mcap", "--json"]);
    assert_eq!(walk["out"], "walk.mcap");
    assert_eq!(walk["placements"].as_array().unwrap().len(), 5);
    let wrist = &walk["placements"][0];
    assert_eq!(wrist["name"], "left_wrist");
    assert!(wrist["specific_force_bandwidth_hz"].as_f64().unwrap() > 5.0);
    let count = BagReader::open(&here.join("walk.mcap")).unwrap();
    assert_eq!(walk["messages"], count.summary().message_count());
    let columns = object(&["simulate", "--walk", "--out", "walk.parquet", "--json"]);
    assert!(columns["rows"].as_u64().unwrap() > 4000 && columns["messages"].is_null());
    let again = object(&[
        "simulate",
        "--reference",
        "walk.mcap",
        "--out",
        "again.mcap",
        "--json",
    ]);
    assert_eq!(again["placements"].as_array().unwrap().len(), 5);
    succeed(here, &["convert", "walk.mcap", "walk.bvh"]);
    let lines = succeed(
        here,
        &["simulate", "walk.bvh", "*.bvh", "--out", "many", "--json"],
    );
    let lines: Vec<Value> = lines.lines().map(parsed).collect();
    assert_eq!(lines[1]["written"], 1, "{lines:?}");
}
