//! `simulate --texture`: drawn, said, seeded, and off unless asked for. What it is worth on real IMUs: tests/texture.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::{refuses, succeed};
use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::Imu;
use nalgebra::Vector3;

const OUT: &str = "walk.mcap";

/// What was said, the bytes and the summed squares of the ankle's changes from sample to sample.
fn simulated(options: &[&str]) -> (String, Vec<u8>, f64) {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "simulate",
        "--walk",
        "--duration",
        "4",
        "--no-noise",
        "--out",
        OUT,
    ];
    let said = succeed(folder.path(), &[&arguments[..], options].concat());
    let path = folder.path().join(OUT);
    let reader = BagReader::open(&path).unwrap();
    let imu = reader.read::<Imu>("/imu/right_ankle/data_raw").unwrap();
    let force = |k: usize| Vector3::from(imu[k].1.linear_acceleration);
    let rough = (1..imu.len()).map(|k| (force(k) - force(k - 1)).norm_squared());
    (said, fs::read(&path).unwrap(), rough.sum())
}

#[test]
fn texture_is_drawn_by_the_seed_where_it_is_asked_for() {
    let (said, plain, smooth) = simulated(&[]);
    assert!(!said.contains("texture"), "{said}");
    let (said, textured, rough) = simulated(&["--texture"]);
    assert!(said.contains("above, texture is drawn"), "{said}");
    assert!(rough > 1.2 * smooth, "{rough} {smooth}");
    assert!(textured == simulated(&["--texture"]).1, "the same bytes");
    assert!(textured != simulated(&["--texture", "--seed", "1"]).1);
    assert!(plain == simulated(&["--seed", "0"]).1, "none without it");
}

#[test]
fn a_bag_says_what_was_drawn_and_from_where_on() {
    let folder = tempfile::tempdir().unwrap();
    let metadata = |options: &[&str]| {
        let arguments = ["simulate", "--walk", "--force", "--out", OUT];
        succeed(folder.path(), &[&arguments[..], options].concat());
        let reader = BagReader::open(&folder.path().join(OUT)).unwrap();
        reader.metadata("cromosim").unwrap().clone()
    };
    let drawn = metadata(&["--texture", "--bandwidth", "10"]);
    let from = "specific force from 10.0 Hz, angular velocity from 10.0 Hz on";
    for (name, segment) in [
        ("right_ankle", "shank"),
        ("left_wrist", "arm"),
        ("head", "head"),
    ] {
        let said = &drawn[&format!("texture.{name}")];
        assert_eq!(said, &format!("segment {segment}, drawn: {from}"));
    }
    let drawn = metadata(&["--texture=foot"]);
    assert!(drawn["texture.head"].contains("segment foot"));
    assert!(!metadata(&[]).keys().any(|key| key.starts_with("texture")));
}

#[test]
fn a_rigid_body_counts_as_held() {
    let folder = tempfile::tempdir().unwrap();
    let swing = |k: i32| {
        let time = f64::from(k) * 0.01;
        let turn = 0.4 * (3.0 * time).sin();
        let place = 0.3 * (5.0 * time).sin();
        format!(
            "{time} {place} 0 1 0 0 {} {}\n",
            (turn / 2.0).sin(),
            (turn / 2.0).cos()
        )
    };
    let tum: String = (0..600).map(swing).collect();
    fs::write(folder.path().join("robot.tum"), tum).unwrap();
    let arguments = [
        "simulate",
        "--rigid",
        "robot.tum",
        "--rate",
        "100",
        "--force",
        "--out",
        OUT,
    ];
    let read = |options: &[&str]| {
        succeed(folder.path(), &[&arguments[..], options].concat());
        let reader = BagReader::open(&folder.path().join(OUT)).unwrap();
        let said = reader
            .metadata("cromosim")
            .unwrap()
            .get("texture.body")
            .cloned();
        let count = reader.read::<Imu>("/imu/body/data_raw").unwrap().len();
        (said, count)
    };
    let (said, count) = read(&["--texture"]);
    assert!(said.unwrap().contains("segment held"));
    assert_eq!(read(&[]), (None, count), "what is trimmed is the motion's");
}

#[test]
fn what_texture_cannot_go_with_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (options, words) in [
        (
            &["--walk", "--texture=hoof"][..],
            ["--texture=hoof", "foot, shank"],
        ),
        (
            &["--walk", "--texture", "--scheme", "richardson"],
            ["left_wrist", "--bandwidth"],
        ),
        (
            &["--walk", "--texture", "--learned", "motion_capture"],
            ["--learned", "--texture"],
        ),
        (
            &["--texture", "--reference", "r.mcap"],
            ["--texture", "--reference"],
        ),
    ] {
        refuses(
            folder,
            &[&["simulate", "--out", OUT], options].concat(),
            &words,
        );
        assert!(!folder.join(OUT).exists());
    }
}
