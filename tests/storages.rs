//! Recordings that others keep in SQLite or in bags of ROS 1, made by rosbags from one of ours.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::{python, root, succeed};

/// The same recording in another storage.
fn converted(python: &Path, to: &Path, options: &[&str]) {
    let output = Command::new(python)
        .args(["-m", "rosbags.convert", "--src"])
        .arg(root().join("bags/gap/session"))
        .arg("--dst")
        .arg(to)
        .args(options)
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn a_recording_gives_the_same_diagnosis_from_every_storage() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let diagnosed = |recording: &Path, name: &str| {
        let out = at(&format!("{name}_diagnosis"));
        succeed(
            folder.path(),
            &[
                "diagnose",
                recording.to_str().unwrap(),
                "--out",
                out.to_str().unwrap(),
            ],
        );
        fs::read(out.join("diagnosis.json")).unwrap()
    };
    let expected = diagnosed(&root().join("bags/gap/session"), "mcap");
    for (name, options) in [
        ("sqlite", &["--dst-storage", "sqlite3"][..]),
        (
            "files",
            &[
                "--dst-storage",
                "sqlite3",
                "--compress",
                "zstd",
                "--compress-mode",
                "file",
            ],
        ),
        (
            "messages",
            &[
                "--dst-storage",
                "mcap",
                "--compress",
                "zstd",
                "--compress-mode",
                "message",
            ],
        ),
        ("session.bag", &["--compress", "lz4"]),
    ] {
        converted(&python, &at(name), options);
        assert!(
            diagnosed(&at(name), name) == expected,
            "{name}: the same recording, another diagnosis"
        );
    }
    // And out again, as any recording.
    let csv = at("wrist.csv");
    succeed(
        folder.path(),
        &[
            "convert",
            at("session.bag").to_str().unwrap(),
            csv.to_str().unwrap(),
            "--topic",
            "/imu/right_wrist/data_raw",
        ],
    );
    let ours = at("ours.csv");
    succeed(
        folder.path(),
        &[
            "convert",
            root().join("bags/gap/session").to_str().unwrap(),
            ours.to_str().unwrap(),
            "--topic",
            "/imu/right_wrist/data_raw",
        ],
    );
    assert_eq!(fs::read(csv).unwrap(), fs::read(ours).unwrap());
}
