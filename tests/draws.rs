//! `simulate --draw`: people, wearing and devices drawn anew for each motion.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{CROMOSIM, refuses, root, succeed};
use cromosim_recording::datasets::{PlacedImu, parse_columns};

fn imus(path: &Path) -> Vec<PlacedImu> {
    parse_columns(fs::read(path).unwrap(), "columns")
        .unwrap()
        .imus
}

#[test]
fn each_draw_is_somebody_else_and_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let config = root().join("config/draws.yaml");
    let draw_on = |threads: &str, out: &str, more: &[&str]| {
        let mut command = std::process::Command::new(CROMOSIM);
        command
            .args(["simulate", "--walk", "--duration", "2", "--draw"])
            .arg(&config)
            .args(["--out", out])
            .args(more)
            .current_dir(here)
            .env("RAYON_NUM_THREADS", threads);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", common::text(&output));
        fs::read(here.join(out)).unwrap()
    };
    let draw = |out: &str, more: &[&str]| draw_on("4", out, more);
    let first = draw("a.parquet", &[]);
    let said = imus(&here.join("a.parquet"));
    let names: Vec<&str> = said.iter().map(|imu| imu.placement.as_str()).collect();
    assert_eq!(names.len(), 4 * 5);
    assert_eq!((names[0], names[19]), ("draw_0_left_wrist", "draw_3_head"));
    let of = |draw: usize| &said[5 * draw].series;
    for other in 1..4 {
        let (one, other) = (of(0), of(other));
        let apart = (one.specific_force[50] - other.specific_force[50]).norm();
        assert!((1e-2..30.0).contains(&apart), "{apart}");
        let [one, other] = [one, other].map(|it| it.stamps.len());
        assert!(
            one.abs_diff(other) < 50,
            "at most a fifth of 2 s: {one}, {other}"
        );
    }
    assert!(
        first != draw("c.parquet", &["--seed", "1"]),
        "the seed draws others"
    );
    draw("b.parquet", &[]);
    let other = imus(&here.join("b.parquet"));
    assert!(
        other[0].series != said[0].series,
        "another recording, other people"
    );
    assert!(
        first == draw_on("1", "a.parquet", &["--force"]),
        "at any number of threads"
    );
}

#[test]
fn nothing_drawn_is_what_is_simulated_without() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(
        here.join("none.yaml"),
        "schema: cromosim/draws/1\ndraws: 1\n",
    )
    .unwrap();
    let simulate = [
        "simulate",
        "--walk",
        "--duration",
        "2",
        "--no-noise",
        "--device",
        "consumer_mems",
    ];
    succeed(here, &[&simulate[..], &["--out", "plain.parquet"]].concat());
    succeed(
        here,
        &[
            &simulate[..],
            &["--draw", "none.yaml", "--out", "drawn.parquet"],
        ]
        .concat(),
    );
    assert_eq!(
        imus(&here.join("plain.parquet")),
        imus(&here.join("drawn.parquet"))
    );
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let config = |text: &str| fs::write(here.join("d.yaml"), text).unwrap();
    let refused = |out: &str, words: &[&str]| {
        refuses(
            here,
            &["simulate", "--walk", "--draw", "d.yaml", "--out", out],
            words,
        );
        assert!(!here.join(out).exists());
    };
    config("schema: cromosim/draws/1\ndraws: 2\nwearing: {knee: thigh}\n");
    refused("x.mcap", &["--draw", "--format parquet"]);
    refused("x.parquet", &["d.yaml: wearing.knee", "left_wrist"]);
    config("schema: cromosim/draws/1\ndraws: 2\nwearing: {head: nose}\n");
    refused(
        "x.parquet",
        &["d.yaml: wearing.head: nose is no way of wearing", "pocket"],
    );
    config("schema: cromosim/draws/1\ndraws: 2\ndevices: {accel_bias: 0.1, colour: 3}\n");
    refused("x.parquet", &["d.yaml", "colour"]);
}
