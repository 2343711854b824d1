//! Long work is told of where standard error is no terminal; short work says nothing.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::process::Command;

use common::{CROMOSIM, cromosim_in, text};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{embedded_walk, write_bvh};
use cromosim_ros::testing::{environment, in_private_network};

/// Seconds that the demo plays: a line comes after ten.
const PLAYED_S: f64 = 13.0;

#[test]
fn a_line_tells_of_long_work_and_of_the_time_left() {
    in_private_network("a_line_tells_of_long_work_and_of_the_time_left", || {
        let folder = tempfile::tempdir().unwrap();
        let mut motion = embedded_walk();
        motion.rate_hz *= motion.duration_s() / PLAYED_S;
        let body = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
        fs::write(folder.path().join("slow.bvh"), write_bvh(&motion, &body)).unwrap();
        let output = Command::new(CROMOSIM)
            .args(["demo", "--motion", "slow.bvh", "--no-viewer"])
            .current_dir(folder.path())
            .envs(environment())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", text(&output));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let told: Vec<&str> = said
            .lines()
            .filter(|line| line.starts_with("playing, tenths of a second: "))
            .collect();
        assert!(
            !told.is_empty()
                && told.iter().all(|line| {
                    line.contains(" of 1")
                        && line.contains(" s gone, about ")
                        && line.ends_with(" s left")
                }),
            "{said}"
        );
    });
}

#[test]
fn short_work_says_nothing_of_its_progress() {
    let folder = tempfile::tempdir().unwrap();
    let output = cromosim_in(
        folder.path(),
        &[
            "simulate",
            "--walk",
            "--duration",
            "1",
            "--out",
            "walk.mcap",
        ],
    );
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{}",
        text(&output)
    );
}
