//! Slips of the finger: whatever is named wrong, the line offers the nearest name.

use std::fs;

use cromosim_bag::{BagOptions, BagWriter};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_spatial::Stamp;

use crate::common::{TINY_BVH, succeed};
use crate::refuses;

/// Options, and the name that was meant.
const NAMES: [(&[&str], &str); 14] = [
    (&["--scheme", "splin"], "spline"),
    (&["--device", "consumer_mens"], "consumer_mems"),
    (&["--placement", "wrist=left_wach"], "left_watch"),
    (&["--learned", "motion_captur"], "motion_capture"),
    (&["--placements", "field.yaml"], "rate_hz"),
    (&["--placements", "head.yaml"], "placements"),
    (&["--placements", "device.yaml"], "consumer_mems"),
    (&["--device", "effect.yaml"], "gyro_bias"),
    (&["--device", "parameter.yaml"], "deviation"),
    (&["--device", "noise.yaml"], "accel_density"),
    (&["--mapping", "mapping.yaml"], "placements"),
    (&["--draw", "draws.yaml", "--format", "parquet"], "wearing"),
    (&["--draw", "worn.yaml", "--format", "parquet"], "pocket"),
    (
        &["--draw", "whom.yaml", "--format", "parquet"],
        "left_wrist",
    ),
];

#[test]
fn the_nearest_name_is_offered_for_what_simulate_takes() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let placement = |fields: &str| {
        format!("schema: cromosim/placements/1\nplacements:\n  wrist: {{{fields}}}\n")
    };
    let draws = |fields: &str| format!("schema: cromosim/draws/1\ndraws: 2\n{fields}\n");
    for (name, content) in [
        ("field.yaml", placement("site: left_watch, rate_h: 100")),
        (
            "head.yaml",
            "schema: cromosim/placements/1\nplacement: {}\n".to_owned(),
        ),
        (
            "device.yaml",
            placement("site: left_watch, rate_hz: 100, device: consumr_mems"),
        ),
        (
            "effect.yaml",
            "schema: cromosim/device/1\neffects: [{effect: gyro_bia}]\n".to_owned(),
        ),
        (
            "parameter.yaml",
            "schema: cromosim/device/1\neffects: [{effect: gyro_bias_instability, deviatin: [0, 0, 0]}]\n"
                .to_owned(),
        ),
        (
            "noise.yaml",
            "schema: cromosim/device/1\ndeclared_noise: {accel_densit: 0.1, gyro_density: 0.1}\n"
                .to_owned(),
        ),
        (
            "mapping.yaml",
            "schema: cromosim/mapping/1\nplacement: {}\n".to_owned(),
        ),
        ("draws.yaml", draws("waering: {}")),
        ("worn.yaml", draws("wearing: {head: poket}")),
        ("whom.yaml", draws("wearing: {left_wrst: pocket}")),
    ] {
        fs::write(here.join(name), content).unwrap();
    }
    for (options, meant) in NAMES {
        let arguments = [&["simulate", "--walk", "--out", "out"], options].concat();
        refuses(here, &arguments, &["nearest", meant]);
    }
}

/// Commands, and the name that was meant.
const COMMANDS: [(&str, &str); 16] = [
    ("node recordr", "recorder"),
    ("inspect walk.bvh --skeleton-map mixmo", "mixamo"),
    ("inspect walk.bvh --skeleton-map joints.yaml", "pelvis"),
    ("inspect walk.bvh --skeleton-map field.yaml", "thumb_side"),
    ("diagnose walk.mcap --out d --without gyro_bia", "gyro_bias"),
    ("diagnose walk.mcap --out d --config one.yaml", "left_wrist"),
    ("diagnose walk.mcap --out d --config diagnose.yaml", "seed"),
    (
        "simulate --reference walk.mcap --effects effects.yaml --out o",
        "left_wrist",
    ),
    (
        "convert walk.mcap w.tum --topic /imu/head/dat",
        "/imu/head/data",
    ),
    ("convert walk.mcap w.tum --joint left_wrst", "left_wrist"),
    ("convert walk.mcap w.tum --site left_wach", "left_watch"),
    ("convert walk.mcap w.parquet --placement hed", "head"),
    ("convert people.mcap p.npz --person annn", "ann"),
    ("device show bmi27", "bmi270"),
    (
        "device from-allan walk.mcap --placement hed --out d",
        "head",
    ),
    (
        "evaluate fidelity --protocol fidelity.yaml --out e",
        "studies",
    ),
];

#[test]
fn the_nearest_name_is_offered_for_what_files_hold() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (name, content) in [
        ("walk.bvh", TINY_BVH),
        (
            "joints.yaml",
            "name: mine\ndescription: mine\njoints: {pelviz: Hips}\n",
        ),
        ("field.yaml", "name: mine\nthumb_sid: forward\n"),
        ("one.yaml", "placements: [left_wrst]\n"),
        ("diagnose.yaml", "sed: 3\n"),
        (
            "effects.yaml",
            "schema: cromosim/effects/1\nplacements:\n  left_wrst: {epoch: 0, declared_noise: {accel_density: 0.1, gyro_density: 0.1}, effects: []}\n",
        ),
        ("fidelity.yaml", "schema: cromosim/fidelity/1\nstudis: []\n"),
    ] {
        fs::write(here.join(name), content).unwrap();
    }
    succeed(here, &["simulate", "--walk", "--out", "walk.mcap"]);
    let mut people = BagWriter::create(&here.join("people.mcap"), BagOptions::default()).unwrap();
    for body_id in ["ann", "bob"].map(str::to_owned) {
        let pose = SmplPose {
            body_id,
            ..SmplPose::default()
        };
        people
            .write("/smpl/pose", Stamp::from_nanos(1), &pose)
            .unwrap();
    }
    people.finish().unwrap();
    for (command, meant) in COMMANDS {
        let arguments: Vec<&str> = command.split(' ').collect();
        refuses(here, &arguments, &["nearest", meant]);
    }
    let rate = [
        "node",
        "replay",
        "--check-config",
        "--ros-args",
        "-p",
        "rat:=1",
    ];
    refuses(here, &rate, &["did you mean 'rate'?"]);
}

#[test]
fn what_a_file_should_hold_is_said_in_words_of_the_user() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("number.yaml"), "5\n").unwrap();
    fs::write(here.join("walk.bvh"), TINY_BVH).unwrap();
    let set = "schema: cromosim/placements/1\nplacements: {wrist: 5}\n";
    fs::write(here.join("wrist.yaml"), set).unwrap();
    succeed(
        here,
        &[
            "simulate",
            "--walk",
            "--duration",
            "2",
            "--out",
            "walk.mcap",
        ],
    );
    let simulate = ["simulate", "--walk", "--out", "out"];
    let file = "number.yaml";
    for (command, options) in [
        (&simulate[..], &["--placements", file][..]),
        (&simulate, &["--placements", "wrist.yaml"]),
        (&simulate, &["--device", file]),
        (&simulate, &["--mapping", file]),
        (&simulate, &["--draw", file, "--format", "parquet"]),
        (
            &["simulate", "--reference", "walk.mcap", "--out", "out.mcap"],
            &["--effects", file],
        ),
        (
            &["diagnose", "walk.mcap", "--out", "out"],
            &["--config", file],
        ),
        (&["inspect", "walk.bvh"], &["--skeleton-map", file]),
    ] {
        let arguments = [command, options].concat();
        refuses(here, &arguments, &[options[1], "expected a map of fields"]);
    }
}
