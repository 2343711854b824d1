//! `cromosim train` and `cromosim map`, and what they make in `cromosim simulate`.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{refuses, succeed, write_networks};
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_imu::{Scheme, SensorFrame, SensorTrajectory};
use cromosim_learned::{Input, LearnedSimulator, SiteMotion};
use cromosim_motion::{embedded_walk, write_bvh};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_recording::rigid::parse_tum;
use nalgebra::{Isometry3, UnitQuaternion};

/// A device that filters and rings much, so that a short training finds something.
const CONFIG: &str = "\
schema: cromosim/training/1
input: INPUT
network: {channels: 8, kernel: 3, convolutions: 3, hidden: 8, layers: 2}
turns: heading
validation: [b]
training: {steps: 240, windows: 8, learning_rate: 0.01, validate_every: 40, patience: 5, seed: 3}
data:
  - {subject: a, licence: own, motions: [\"wal*.bvh\"], sites: [left_watch, right_instep], repeats: 2, devices: &one {tissue_probability: 1.0, tissue_hz: [6.0, 7.0], low_pass_hz: [6.0, 7.0], accel_bias: 0.0, gyro_bias: 0.0, scale: 0.0, misalignment: 0.0, lever_arm: 0.0}}
  - {subject: b, licence: own, motions: [walk.bvh], sites: [left_watch], devices: *one}
";

fn prepare(folder: &Path, input: &str) {
    let motion = embedded_walk().slice(1.0, Some(7.0)).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
    fs::write(folder.join("walk.bvh"), write_bvh(&motion, &body)).unwrap();
    fs::write(folder.join("train.yaml"), CONFIG.replace("INPUT", input)).unwrap();
}

fn forces(bag: &Path, placement: &str) -> Vec<[f64; 3]> {
    let messages = BagReader::open(bag)
        .unwrap()
        .read::<Imu>(&format!("/imu/{placement}/data_raw"))
        .unwrap();
    messages
        .into_iter()
        .map(|(_, imu)| {
            [
                imu.linear_acceleration.x,
                imu.linear_acceleration.y,
                imu.linear_acceleration.z,
            ]
        })
        .collect()
}

#[test]
fn networks_learn_and_simulate_takes_them() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here, "residual");
    let said = succeed(here, &["train", "train.yaml", "--out", "model"]);
    assert!(
        said.contains("subject a: 4 pairs") && said.contains("| left_watch |"),
        "{said}"
    );
    let card = fs::read_to_string(here.join("model/card.md")).unwrap();
    assert!(
        card.contains("own") && card.contains("b (validation)"),
        "{card}"
    );

    // Person and device of the validation were never seen, yet less is left of them than after the
    // analytic simulation.
    let row = said
        .lines()
        .find(|line| line.starts_with("| left_watch |"))
        .unwrap();
    let errors: Vec<f64> = row
        .split('|')
        .filter_map(|cell| cell.trim().parse().ok())
        .collect();
    let [analytic, learned, ..] = errors[..] else {
        panic!("{row}")
    };
    // So few steps take off little.
    assert!(learned < 0.99 * analytic, "{row}");
    let history = fs::read_to_string(here.join("model/acceleration_history.csv")).unwrap();
    assert_eq!(history.lines().count(), 7);

    // The same again gives the same bytes; a finished training is not begun anew.
    succeed(here, &["train", "train.yaml", "--out", "again"]);
    succeed(here, &["train", "train.yaml", "--out", "model"]);
    for name in [
        "acceleration.safetensors",
        "angular_velocity.safetensors",
        "card.md",
        "acceleration_history.csv",
    ] {
        let [one, other] =
            ["model", "again"].map(|model| fs::read(here.join(model).join(name)).unwrap());
        assert!(one == other, "{name} differs");
    }

    // Other data are another training.
    fs::write(
        here.join("other.yaml"),
        CONFIG
            .replace("INPUT", "residual")
            .replace("repeats: 2", "repeats: 1"),
    )
    .unwrap();
    refuses(
        here,
        &["train", "other.yaml", "--out", "model"],
        &["model/training.yaml", "other.yaml", "--force"],
    );

    succeed(
        here,
        &[
            "simulate",
            "walk.bvh",
            "--no-noise",
            "--scheme",
            "spline",
            "--out",
            "plain.mcap",
        ],
    );
    succeed(
        here,
        &[
            "simulate",
            "walk.bvh",
            "--no-noise",
            "--learned",
            "model",
            "--out",
            "learned.mcap",
        ],
    );
    let [plain, learned] =
        ["plain.mcap", "learned.mcap"].map(|bag| forces(&here.join(bag), "left_wrist"));
    assert_eq!(plain.len(), learned.len());
    let changed: f64 = plain
        .iter()
        .zip(&learned)
        .map(|(a, b)| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>())
        .sum();
    assert!((changed / plain.len() as f64).sqrt() > 0.1);

    // Ranks: the mapped simulation has the other's extremes, sample by sample in the same order.
    succeed(
        here,
        &[
            "map",
            "--simulated",
            "plain.mcap",
            "--measured",
            "learned.mcap",
            "--out",
            "map.yaml",
        ],
    );
    succeed(
        here,
        &[
            "simulate",
            "walk.bvh",
            "--no-noise",
            "--scheme",
            "spline",
            "--mapping",
            "map.yaml",
            "--out",
            "mapped.mcap",
        ],
    );
    let mapped = forces(&here.join("mapped.mcap"), "left_wrist");
    let largest =
        |forces: &[[f64; 3]]| forces.iter().map(|force| force[0]).fold(f64::MIN, f64::max);
    assert!((largest(&mapped) - largest(&learned)).abs() < 1e-9);
    for (before, after) in [(0, 40), (100, 300), (250, 251)] {
        assert_eq!(
            plain[before][0] < plain[after][0],
            mapped[before][0] < mapped[after][0]
        );
    }
}

#[test]
fn what_cannot_be_used_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here, "residual");
    let config = |from: &str, to: &str| {
        fs::write(
            here.join("bad.yaml"),
            CONFIG.replace("INPUT", "residual").replace(from, to),
        )
        .unwrap()
    };
    for (from, to, words) in [
        (
            "turns: heading",
            "turns: sideways",
            vec!["bad.yaml", "turns"],
        ),
        (
            "validation: [b]",
            "validation: [c]",
            vec!["bad.yaml", "no data of subject c"],
        ),
        (
            ", sites: [left_watch, right_instep]",
            "",
            vec!["bad.yaml", "subject a", "sites"],
        ),
        (
            "left_watch, right_instep",
            "left_wach",
            vec!["left_wach", "left_watch"],
        ),
        ("wal*.bvh", "run*.bvh", vec!["no file matches run*.bvh"]),
        (
            "learning_rate: 0.01",
            "learning_rate: -1.0",
            vec!["bad.yaml", "learning_rate"],
        ),
        (
            "training/1",
            "training/9",
            vec!["bad.yaml", "cromosim/training/1"],
        ),
        (
            "steps: 240",
            "engine: torch, steps: 240",
            vec!["bad.yaml", "torch", "kernels"],
        ),
        #[cfg(not(feature = "cuda"))]
        (
            "steps: 240",
            "engine: cuda, steps: 240",
            vec!["bad.yaml", "engine cuda", "--features cuda"],
        ),
    ] {
        config(from, to);
        refuses(here, &["train", "bad.yaml", "--out", "model"], &words);
        assert!(!here.join("model").exists(), "{to}");
    }
    refuses(
        here,
        &[
            "simulate",
            "walk.bvh",
            "--learned",
            "nowhere",
            "--out",
            "x.mcap",
        ],
        &["nowhere: neither a folder", "motion_capture"],
    );
    fs::write(
        here.join("map.yaml"),
        "schema: cromosim/mapping/1\nplacements: {}\n",
    )
    .unwrap();
    refuses(
        here,
        &[
            "simulate",
            "walk.bvh",
            "--mapping",
            "map.yaml",
            "--out",
            "x.mcap",
        ],
        &["map.yaml", "none of the placements"],
    );
    succeed(
        here,
        &[
            "simulate",
            "walk.bvh",
            "--out",
            "walk.mcap",
            "--duration",
            "0.1",
            "--trim",
            "0",
        ],
    );
    refuses(
        here,
        &[
            "map",
            "--simulated",
            "walk.mcap",
            "--measured",
            "walk.mcap",
            "--out",
            "m.yaml",
        ],
        &["11 samples, at least 20"],
    );
    assert!(!here.join("x.mcap").exists() && !here.join("m.yaml").exists());
}

#[test]
fn a_rigid_body_takes_networks_and_a_mapping() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_networks(Input::Residual, &here.join("model"));
    let mut tum = String::new();
    for k in 0..600 {
        let t = f64::from(k) / 120.0;
        let turn = UnitQuaternion::from_euler_angles(
            0.4 * (2.0 * t).sin(),
            0.1 * t,
            0.3 * (3.0 * t).cos(),
        );
        let q = turn.quaternion();
        let (x, y, z) = (0.3 * (2.1 * t).sin(), 0.2 * (3.3 * t).cos(), 1.0);
        tum += &format!(
            "{:.9} {x} {y} {z} {} {} {} {}\n",
            100.0 + t,
            q.i,
            q.j,
            q.k,
            q.w
        );
    }
    fs::write(here.join("robot.tum"), &tum).unwrap();
    let channel = "{simulated: [-50.0, 50.0], measured: [-99.0, 101.0]}";
    let channels: String = [
        "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z",
    ]
    .iter()
    .map(|name| format!("    {name}: {channel}\n"))
    .collect();
    fs::write(
        here.join("map.yaml"),
        format!("schema: cromosim/mapping/1\nplacements:\n  body:\n{channels}"),
    )
    .unwrap();
    let simulate = [
        "simulate",
        "--rigid",
        "robot.tum",
        "--rate",
        "100",
        "--learned",
        "model",
    ];
    succeed(here, &[&simulate[..], &["--out", "learned.mcap"]].concat());
    succeed(
        here,
        &[
            &simulate[..],
            &["--mapping", "map.yaml", "--out", "mapped.mcap"],
        ]
        .concat(),
    );

    // What the library says of the same trajectory.
    let poses = parse_tum(tum.as_bytes(), "robot.tum").unwrap();
    let frame = |k: usize| {
        SensorFrame::new(
            poses.stamps[k],
            Isometry3::from_parts(poses.positions[k].into(), poses.rotations[k]),
        )
    };
    let trajectory = SensorTrajectory::new((0..poses.stamps.len()).map(frame).collect()).unwrap();
    let motion = SiteMotion::rigid(&trajectory, Scheme::Spline).unwrap();
    let expected = LearnedSimulator::read(&here.join("model"))
        .unwrap()
        .simulate(&motion)
        .unwrap();
    let (learned, mapped) = (
        forces(&here.join("learned.mcap"), "body"),
        forces(&here.join("mapped.mcap"), "body"),
    );
    assert!(learned.len() >= 499 && learned.len() == mapped.len());
    // The last sample lies beyond the networks' grid, where what they add is held.
    for (k, ((learned, mapped), expected)) in learned
        .iter()
        .zip(&mapped)
        .zip(&expected)
        .enumerate()
        .take(498)
    {
        let force = expected.imu().specific_force;
        let analytic = motion.kinematics[k].imu().specific_force;
        assert!(
            (force - analytic).norm() > 0.01,
            "the networks say something"
        );
        for axis in 0..3 {
            assert!(
                (learned[axis] - force[axis]).abs() < 1e-3,
                "sample {k}: {} {}",
                learned[axis],
                force[axis]
            );
            assert!(
                (mapped[axis] - (1.0 + 2.0 * learned[axis])).abs() < 1e-9,
                "sample {k}: {} {}",
                mapped[axis],
                learned[axis]
            );
        }
    }
    refuses(
        here,
        &[
            &simulate[..],
            &[
                "--placement",
                "gripper",
                "--mapping",
                "map.yaml",
                "--out",
                "x.mcap",
            ],
        ]
        .concat(),
        &["none of the placements gripper"],
    );
}
