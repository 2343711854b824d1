//! Exports of motion capture systems: several bodies become several placements.

use std::fs;

use cromosim_bag::BagReader;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_recording::rigid::parse_tum;

use crate::common::{self, refuses, succeed};

/// A file that the tests of the library read, too.
fn sample(name: &str) -> String {
    let folder = common::root().join("nodes/lib/recording/tests/data/captures");
    folder.join(name).display().to_string()
}

#[test]
fn bodies_of_an_export_become_placements() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    let optitrack = sample("optitrack.csv");
    let said = succeed(here, &["inspect", &optitrack]);
    for line in [
        "recording of OptiTrack (CSV), 2 references at 120.000 Hz",
        "wand: 60 poses, 0.492 s, path of 0.50 m",
        "Rigid_Body_2: not seen in 4 of 60 frames",
    ] {
        assert!(said.contains(line), "{said}");
    }
    succeed(here, &["convert", &optitrack, "all.mcap"]);
    let bag = BagReader::open(&at("all.mcap")).unwrap();
    let count = |name: &str| bag.read::<PoseStamped>(name).unwrap().len();
    assert_eq!(
        [count("/reference/wand"), count("/reference/Rigid_Body_2")],
        [60, 56]
    );
    succeed(
        here,
        &["convert", &optitrack, "wand.tum", "--placement", "wand"],
    );
    let wand = parse_tum(&fs::read(at("wand.tum")).unwrap(), "wand.tum").unwrap();
    assert!((wand.positions[0].z - 1.0).abs() < 1e-9, "z is up");
    // As the file has it.
    succeed(
        here,
        &[
            "convert",
            &optitrack,
            "y.tum",
            "--placement",
            "wand",
            "--up-axis",
            "z",
        ],
    );
    let as_it_is = parse_tum(&fs::read(at("y.tum")).unwrap(), "y.tum").unwrap();
    assert!((as_it_is.positions[0].y - 1.0).abs() < 1e-9);

    let rigid = [
        "simulate", "--rigid", &optitrack, "--rate", "100", "--trim", "0",
    ];
    succeed(here, &[&rigid[..], &["--out", "both.mcap"]].concat());
    let bag = BagReader::open(&at("both.mcap")).unwrap();
    for name in ["wand", "Rigid_Body_2"] {
        let imu = bag.read::<Imu>(&format!("/imu/{name}/data_raw")).unwrap();
        let mean = imu.iter().map(|(_, imu)| imu.linear_acceleration.z);
        let mean = mean.sum::<f64>() / imu.len() as f64;
        assert!((mean - 9.8).abs() < 1.0, "{name}: {mean}");
    }
    succeed(
        here,
        &[
            &rigid[..],
            &["--placement", "grip=Rigid_Body_2", "--out", "one.mcap"],
        ]
        .concat(),
    );
    let bag = BagReader::open(&at("one.mcap")).unwrap();
    assert_eq!(
        bag.read::<PoseStamped>("/reference/grip").unwrap().len(),
        56
    );
}

#[test]
fn what_an_export_does_not_hold_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let optitrack = sample("optitrack.csv");
    let rigid = [
        "simulate", "--rigid", &optitrack, "--rate", "100", "--out", "o.mcap",
    ];
    refuses(
        here,
        &[&rigid[..], &["--placement", "wnd"]].concat(),
        &[
            "wnd",
            "no such body",
            "wand, Rigid_Body_2",
            "the nearest is wand",
        ],
    );
    refuses(
        here,
        &[
            &rigid[..],
            &["--placement", "a=wand", "--placement", "a=Rigid_Body_2"],
        ]
        .concat(),
        &["a is given twice"],
    );
    for (out, expected) in [
        (
            "o.tum",
            "several placements; give --placement, one of wand, Rigid_Body_2",
        ),
        (
            "o.parquet",
            "it has no IMU, and columns hold readings alone",
        ),
    ] {
        refuses(
            here,
            &["convert", &optitrack, out],
            &["optitrack.csv", expected],
        );
    }
    refuses(
        here,
        &["convert", &optitrack, "o.mcap", "--skeleton-map", "cmu"],
        &["--skeleton-map is for motions, and this is a recording; leave it out"],
    );
    fs::write(here.join("a.tum"), "0 0 0 1 0 0 0 1\n1 0 0 1 0 0 0 1\n").unwrap();
    refuses(
        here,
        &[
            "simulate",
            "--rigid",
            "a.tum",
            "--rate",
            "10",
            "--up-axis",
            "y",
            "--out",
            "o.mcap",
        ],
        &[
            "a.tum",
            "--up-axis is for motion files and exports of motion capture",
        ],
    );
}
