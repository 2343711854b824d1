//! Readings in columns: what `simulate` writes as Parquet is what it writes as a bag, and `convert`
//! takes it both ways.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{CROMOSIM, refuses, succeed};
use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_recording::datasets::{DatasetRecording, parse_columns};

fn columns(path: &Path) -> DatasetRecording {
    parse_columns(fs::read(path).unwrap(), "columns").unwrap()
}

#[test]
fn columns_hold_what_the_bag_holds() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let simulate = [
        "simulate",
        "--walk",
        "--duration",
        "3",
        "--seed",
        "5",
        "--device",
        "consumer_mems",
    ];
    succeed(here, &[&simulate[..], &["--out", "walk.mcap"]].concat());
    let said = succeed(here, &[&simulate[..], &["--out", "walk.parquet"]].concat());
    assert!(said.contains("rows, 5 placements"), "{said}");
    let recording = columns(&here.join("walk.parquet"));
    let bag = BagReader::open(&here.join("walk.mcap")).unwrap();
    assert_eq!(recording.imus.len(), 5);
    for imu in &recording.imus {
        let topic = format!("/imu/{}/data_raw", imu.placement);
        let messages = bag.read::<Imu>(&topic).unwrap();
        assert_eq!(
            (imu.rows_left_out, imu.series.stamps.len()),
            (0, messages.len())
        );
        assert!(messages.len() > 200);
        for (row, (_, message)) in messages.iter().enumerate() {
            assert_eq!(imu.series.stamps[row].nanos, message.header.stamp.nanos());
            let pairs = [
                (imu.series.specific_force[row], message.linear_acceleration),
                (imu.series.angular_velocity[row], message.angular_velocity),
            ];
            for (own, said) in pairs {
                let said = nalgebra::Vector3::from(said).map(|value: f64| f64::from(value as f32));
                assert_eq!(own, said, "{topic}, row {row}");
            }
        }
    }
}

#[test]
fn same_input_and_seed_same_bytes_at_any_number_of_threads() {
    let bytes = |seed: &str, threads: &str| {
        let folder = tempfile::tempdir().unwrap();
        let mut command = std::process::Command::new(CROMOSIM);
        command
            .args([
                "simulate",
                "--walk",
                "--duration",
                "2",
                "--out",
                "walk.parquet",
                "--seed",
                seed,
            ])
            .current_dir(folder.path())
            .env("RAYON_NUM_THREADS", threads);
        assert!(command.output().unwrap().status.success());
        fs::read(folder.path().join("walk.parquet")).unwrap()
    };
    let first = bytes("7", "1");
    assert!(first == bytes("7", "4"), "the number of threads shows");
    assert!(first != bytes("8", "1"), "the seed does not show");
}

#[test]
fn series_and_bags_become_columns_and_columns_become_series() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let simulate = ["simulate", "--walk", "--duration", "2", "--out"];
    succeed(here, &[&simulate[..], &["walk.mcap"]].concat());
    succeed(here, &[&simulate[..], &["walk.parquet"]].concat());
    // All IMUs of a bag at once: the rows that simulate writes.
    succeed(here, &["convert", "walk.mcap", "from_bag.parquet"]);
    let (mut own, mut converted) = (
        columns(&here.join("walk.parquet")).imus,
        columns(&here.join("from_bag.parquet")).imus,
    );
    own.sort_by(|one, other| one.placement.cmp(&other.placement));
    converted.sort_by(|one, other| one.placement.cmp(&other.placement));
    assert_eq!(own, converted);
    // To a table and back: float32 has one shortest text.
    succeed(
        here,
        &["convert", "walk.parquet", "head.csv", "--placement", "head"],
    );
    succeed(
        here,
        &["convert", "head.csv", "head.parquet", "--name", "head"],
    );
    let head = &columns(&here.join("head.parquet")).imus[0];
    assert_eq!(Some(head), own.iter().find(|imu| imu.placement == "head"));
    succeed(here, &["convert", "walk.parquet", "again.mcap"]);
    let bag = BagReader::open(&here.join("again.mcap")).unwrap();
    let messages = bag.read::<Imu>("/imu/head/data_raw").unwrap();
    assert_eq!(messages.len(), head.series.stamps.len());
    let said = succeed(here, &["inspect", "walk.parquet"]);
    assert!(
        said.contains("columns (Parquet), 5 IMUs at 100.000 Hz"),
        "{said}"
    );
}

#[test]
fn what_cannot_be_columns_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let refused = |arguments: &[&str], words: &[&str]| refuses(here, arguments, words);
    refused(
        &["simulate", "--walk", "--out", "x.parquet", "--csv", "csv"],
        &["--csv", "leave it out"],
    );
    let rigid = [
        "simulate",
        "--rigid",
        "x.tum",
        "--rate",
        "100",
        "--out",
        "x.parquet",
    ];
    refused(&rigid, &["x.parquet", "--rigid", ".mcap"]);
    succeed(
        here,
        &[
            "simulate",
            "--walk",
            "--duration",
            "1",
            "--out",
            "walk.parquet",
        ],
    );
    refused(
        &[
            "simulate",
            "--walk",
            "--duration",
            "1",
            "--out",
            "walk.parquet",
        ],
        &["exists already"],
    );
    refused(
        &["convert", "walk.parquet", "x.csv"],
        &["--placement", "sternum"],
    );
    refused(
        &["convert", "walk.parquet", "x.tum", "--placement", "head"],
        &["no reference"],
    );
    let whole = fs::read(here.join("walk.parquet")).unwrap();
    fs::write(here.join("cut.parquet"), &whole[..whole.len() / 2]).unwrap();
    refused(
        &["convert", "cut.parquet", "x.csv"],
        &["cut.parquet", "damaged or cut off"],
    );
    assert!(!here.join("x.csv").exists());
}
