//! A BVH file whose joints nobody knows: `inspect` drafts its skeleton map, and every command that
//! reads the file takes it.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{refuses, succeed};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{embedded_walk, write_bvh};

/// The walk with its own joint names, and with names that say nothing.
fn prepare(folder: &Path) {
    let motion = embedded_walk().slice(1.0, Some(3.0)).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
    let text = write_bvh(&motion, &body);
    let mut count = 0;
    let mut renamed = |line: &str| {
        let start = line.trim_start();
        let kind = ["ROOT ", "JOINT "]
            .into_iter()
            .find(|kind| start.starts_with(kind));
        kind.map_or_else(
            || line.to_owned(),
            |kind| {
                count += 1;
                format!("{kind}knochen{count}")
            },
        )
    };
    let unknown: Vec<String> = text.lines().map(&mut renamed).collect();
    fs::write(folder.join("walk.bvh"), &text).unwrap();
    fs::write(folder.join("unknown.bvh"), unknown.join("\n") + "\n").unwrap();
}

fn positions(file: &Path) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(file).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.map(|row| {
        let values: Vec<f64> = row
            .split(' ')
            .filter_map(|word| word.parse().ok())
            .collect();
        [values[1], values[2], values[3]]
    })
    .collect()
}

const TRAINING: &str = "\
schema: cromosim/training/1
input: residual
network: {channels: 8, kernel: 3, convolutions: 3, hidden: 8, layers: 2}
turns: heading
validation: [a]
training: {steps: 1, windows: 1, learning_rate: 0.01, validate_every: 1, patience: 1, seed: 3}
data:
  - {subject: a, licence: own, motions: [unknown.bvh], sites: [left_watch]}
";

#[test]
fn a_draft_of_the_map_makes_unknown_joints_known() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here);
    refuses(
        here,
        &["inspect", "unknown.bvh"],
        &[
            "no skeleton map fits",
            "cromosim inspect FILE --skeleton-map-draft",
        ],
    );
    let draft = ["inspect", "unknown.bvh", "--skeleton-map-draft", "map.yaml"];
    let said = succeed(here, &draft);
    assert!(said.contains("--skeleton-map map.yaml"), "{said}");
    refuses(here, &draft, &["map.yaml", "--force"]);
    refuses(
        here,
        &["inspect", "map.yaml", "--skeleton-map-draft", "b.yaml"],
        &["map.yaml: neither BVH nor AMC"],
    );
    let with = |arguments: &[&'static str]| [arguments, &["--skeleton-map", "map.yaml"]].concat();
    succeed(here, &with(&["inspect", "unknown.bvh"]));
    succeed(here, &with(&["simulate", "unknown.bvh", "--out", "a.mcap"]));
    fs::write(here.join("train.yaml"), TRAINING).unwrap();
    let train = ["train", "train.yaml", "--check", "--out", "t"];
    refuses(here, &train, &["unknown.bvh", "no skeleton map fits"]);
    succeed(here, &with(&train));
    for joint in ["left_wrist", "right_ankle", "head"] {
        let convert =
            |from: &'static str, to: &'static str| ["convert", from, to, "--force", "--joint"];
        let known = [&convert("walk.bvh", "known.tum")[..], &[joint]].concat();
        succeed(here, &known);
        succeed(
            here,
            &[
                &with(&convert("unknown.bvh", "found.tum")[..4])[..],
                &["--joint", joint],
            ]
            .concat(),
        );
        let [known, found] = ["known.tum", "found.tum"].map(|file| positions(&here.join(file)));
        assert!(known.len() > 50 && known.len() == found.len());
        for (known, found) in known.iter().zip(&found) {
            let apart = (0..3)
                .map(|axis| (known[axis] - found[axis]).powi(2))
                .sum::<f64>()
                .sqrt();
            assert!(apart < 0.05, "{joint}: {apart} m apart");
        }
    }
    refuses(
        here,
        &[
            "simulate",
            "--rigid",
            "known.tum",
            "--rate",
            "100",
            "--skeleton-map",
            "map.yaml",
            "--out",
            "r.mcap",
        ],
        &["--skeleton-map goes with motion files"],
    );
}
