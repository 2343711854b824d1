//! `--body` on every command and `body` of every node that a body matters to, and what it changes.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use common::{CROMOSIM, cromosim_in, root, succeed, text};
use cromosim_bag::{BagOptions, BagReader, BagWriter, Selection};
use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_imu::{MountedSensors, PlacementSet};
use cromosim_motion::embedded_walk;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_ros::testing::{environment, in_private_network};
use cromosim_spatial::Stamp;

/// Commands that take poses or shapes of a body, and those that never see one.
const WITH_BODY: [&str; 12] = [
    "demo",
    "simulate",
    "train",
    "evaluate fidelity",
    "evaluate har",
    "diagnose",
    "convert",
    "trajectory",
    "inspect",
    "body export",
    "body sites",
    "list sites",
];
const WITHOUT_BODY: [&str; 16] = [
    "compare",
    "map",
    "bag recover",
    "bag csv",
    "device from-allan",
    "device from-kalibr",
    "device to-kalibr",
    "device from-diagnosis",
    "device show",
    "list effects",
    "list schemes",
    "list devices",
    "list models",
    "list nodes",
    "completion",
    "node",
];
const NODES_WITH_BODY: [&str; 4] = ["replay", "smpl_state", "virtual_imu", "viewer"];
const NODES_WITHOUT_BODY: [&str; 2] = ["recorder", "gap_monitor"];

/// The names under `Commands:` of a help text.
fn commands(help: &str) -> Vec<String> {
    let list = help
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| line.starts_with("  "));
    // A long description goes on below, further in.
    list.filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next().map(str::to_owned))
        .filter(|name| name != "help")
        .collect()
}

/// Every command that does something: those with commands of their own are opened.
fn all_commands(folder: &Path) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for name in commands(&succeed(folder, &["--help"])) {
        // A node's help is its own.
        let below = if name == "node" {
            Vec::new()
        } else {
            commands(&succeed(folder, &[&name, "--help"]))
        };
        if below.is_empty() {
            all.insert(name);
        } else {
            all.extend(below.iter().map(|command| format!("{name} {command}")))
        }
    }
    all
}

#[test]
fn every_command_and_node_that_a_body_matters_to_takes_one() {
    let folder = tempfile::tempdir().unwrap();
    let known: BTreeSet<String> = WITH_BODY
        .iter()
        .chain(&WITHOUT_BODY)
        .map(|name| (*name).to_owned())
        .collect();
    assert_eq!(
        all_commands(folder.path()),
        known,
        "a new command: does a body matter to it?"
    );
    for command in WITH_BODY {
        let words: Vec<&str> = command.split(' ').chain(["--help"]).collect();
        assert!(
            succeed(folder.path(), &words).contains("--body <FILE>"),
            "{command} has no --body"
        );
    }
    let nodes = succeed(folder.path(), &["node", "--help"]);
    let listed: BTreeSet<&str> = nodes.split(['<', '>']).nth(1).unwrap().split('|').collect();
    assert_eq!(
        listed,
        NODES_WITH_BODY
            .into_iter()
            .chain(NODES_WITHOUT_BODY)
            .collect()
    );
    for node in NODES_WITH_BODY {
        let output = cromosim_in(folder.path(), &["node", node, "--help"]);
        // Without the feature `view` there is no viewer to ask.
        let absent = node == "viewer" && text(&output).contains("built without the feature `view`");
        assert!(
            absent
                || text(&output)
                    .lines()
                    .any(|line| line.trim_start().starts_with("body")),
            "{node}: {}",
            text(&output)
        );
        let file = fs::read_to_string(root().join(format!("config/{node}.yaml"))).unwrap();
        assert!(
            file.lines()
                .any(|line| line.trim_start().starts_with("body:")),
            "config/{node}.yaml"
        );
    }
}

#[test]
fn a_file_that_is_no_body_is_refused_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("walk.bvh"), common::TINY_BVH).unwrap();
    fs::write(at("no.npz"), "no body").unwrap();
    let shot = [
        "--keypoints",
        ".",
        "--depth",
        ".",
        "--cameras",
        ".",
        "--image",
        "8x8",
        "--camera-axes",
        "opencv",
        "--depth-encoding",
        "depth",
    ];
    let trajectory: Vec<&str> = ["trajectory", "walk.bvh", "x.bvh", "--scale", "1"]
        .into_iter()
        .chain(shot)
        .collect();
    succeed(
        folder.path(),
        &[
            "simulate",
            "--walk",
            "--out",
            "walk.mcap",
            "--duration",
            "0.5",
        ],
    );
    let calls: [&[&str]; 10] = [
        &["demo"],
        &["simulate", "--walk", "--out", "x.mcap"],
        &["simulate", "--reference", "walk.mcap", "--out", "x.mcap"],
        &["diagnose", "walk.mcap", "--out", "diagnosis"],
        &["convert", "walk.bvh", "x.npz"],
        &trajectory,
        &["inspect", "walk.bvh"],
        &["body", "export", "x.obj"],
        &["evaluate", "har", "--out", "evaluation"],
        &["evaluate", "fidelity", "--out", "evaluation"],
    ];
    for call in calls {
        let output = cromosim_in(folder.path(), &[call, &["--body", "no.npz"]].concat());
        let said = text(&output);
        assert!(
            output.status.code() == Some(2) && said.contains("no.npz"),
            "{call:?}: {said}"
        );
    }
    for made in [
        "x.mcap",
        "x.npz",
        "x.bvh",
        "x.obj",
        "diagnosis",
        "evaluation",
        "cromosim-demo",
    ] {
        assert!(!at(made).exists(), "{made} was left behind");
    }
}

/// A recording as the nodes make it: states, real IMUs and placements, without references.
fn states_only(from: &Path, to: &Path) {
    let reader = BagReader::open(from).unwrap();
    let mut bag = BagWriter::create(to, BagOptions::default()).unwrap();
    bag.write_metadata("cromosim", reader.metadata("cromosim").unwrap().clone())
        .unwrap();
    let placements = reader.attachment("placements.yaml").unwrap().to_vec();
    bag.attach(
        "placements.yaml",
        "application/yaml",
        reader.summary().time_range.unwrap().0,
        &placements,
    )
    .unwrap();
    let topics = Some(vec![
        "/smpl/state".to_owned(),
        "/imu/left_wrist/data_raw".to_owned(),
    ]);
    let mut ids = std::collections::BTreeMap::new();
    for message in reader
        .messages(&Selection {
            topics,
            ..Selection::default()
        })
        .unwrap()
    {
        let message = message.unwrap();
        let id = *ids
            .entry(message.topic.name.clone())
            .or_insert_with(|| bag.add_topic(&message.topic).unwrap());
        bag.write_payload(id, &message.payload, message.log_time, message.publish_time)
            .unwrap();
    }
    bag.finish().unwrap();
}

#[test]
fn a_recording_of_states_is_simulated_again_on_its_own_body() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    // A body of the file, a fifth taller than the embedded one.
    succeed(here, &["body", "export", "body.npz"]);
    common::taller(&at("body.npz"), &at("tall.npz"), 1.2);
    succeed(
        here,
        &[
            "simulate",
            "--walk",
            "--body",
            "tall.npz",
            "--no-noise",
            "--duration",
            "4",
            "--out",
            "whole.mcap",
        ],
    );
    states_only(&at("whole.mcap"), &at("states.mcap"));
    let refused = cromosim_in(
        here,
        &[
            "simulate",
            "--reference",
            "states.mcap",
            "--out",
            "again.mcap",
        ],
    );
    assert!(
        refused.status.code() == Some(2)
            && text(&refused)
                .contains("of the body tall, not of the embedded one; give --body FILE"),
        "{}",
        text(&refused)
    );
    let refused = cromosim_in(here, &["diagnose", "states.mcap", "--out", "diagnosis"]);
    assert!(
        refused.status.code() == Some(2) && text(&refused).contains("give --body FILE"),
        "{}",
        text(&refused)
    );
    let force = |name: &str| -> Vec<nalgebra::Vector3<f64>> {
        let reader = BagReader::open(&at(name)).unwrap();
        let messages = reader
            .read::<cromosim_msgs::sensor_msgs::Imu>("/imu/left_wrist/data_raw")
            .unwrap();
        messages
            .into_iter()
            .map(|(_, imu)| imu.linear_acceleration.into())
            .collect()
    };
    // What the references that simulate wrote beside the states say: the same sites on the same
    // body.
    let again = ["--scheme", "spline", "--no-noise"];
    succeed(
        here,
        &[
            &[
                "simulate",
                "--reference",
                "whole.mcap",
                "--out",
                "known.mcap",
            ],
            &again[..],
        ]
        .concat(),
    );
    let known = force("known.mcap");
    let apart = |body: &str, out: &str| {
        succeed(
            here,
            &[
                &[
                    "simulate",
                    "--reference",
                    "states.mcap",
                    "--body",
                    body,
                    "--out",
                    out,
                ],
                &again[..],
            ]
            .concat(),
        );
        let found = force(out);
        assert_eq!(found.len(), known.len());
        (found
            .iter()
            .zip(&known)
            .map(|(a, b)| (a - b).norm_squared())
            .sum::<f64>()
            / known.len() as f64)
            .sqrt()
    };
    let (own, other) = (
        apart("tall.npz", "own.mcap"),
        apart("body.npz", "other.mcap"),
    );
    println!(
        "left wrist, simulated again: on its own body {own:.1e} m/s2 apart, on the embedded one {other:.4} m/s2"
    );
    assert!(own < 1e-6 && other > 0.2, "{own} {other}");
}

#[test]
fn the_demo_tells_every_node_of_its_body() {
    in_private_network("the_demo_tells_every_node_of_its_body", || {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        succeed(folder.path(), &["body", "export", "body.npz"]);
        common::taller(&at("body.npz"), &at("tall.npz"), 1.2);
        let mut demo = Command::new(CROMOSIM);
        demo.args([
            "demo",
            "--body",
            "tall.npz",
            "--duration",
            "1",
            "--no-viewer",
            "--out",
            "out",
        ]);
        let output = demo
            .current_dir(folder.path())
            .envs(environment())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", text(&output));
        let bag = BagReader::open(&at("out/bag")).unwrap();
        let frames: Vec<_> = bag
            .read::<TFMessage>("/tf")
            .unwrap()
            .into_iter()
            .flat_map(|(_, message)| message.transforms)
            .collect();
        let distances = |child: &str| -> Vec<f64> {
            let of = frames.iter().filter(|frame| frame.child_frame_id == child);
            of.map(|frame| nalgebra::Vector3::from(frame.transform.translation).norm())
                .collect()
        };
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let standing = embedded_walk().frames[0].clone();
        let segments = body.world_from_segments(&standing);
        // smpl_state's shin, and the watch of virtual_imu, whose place changes as the skin bends.
        let shin = (segments[Joint::LeftKnee.index()].inverse()
            * segments[Joint::LeftAnkle.index()])
        .translation
        .vector
        .norm();
        let placements = PlacementSet::demo();
        let sites = MountedSensors::new(&body, placements.placements()).unwrap();
        let stamps = [Stamp::from_nanos(0), Stamp::from_nanos(10_000_000)];
        let watch = sites
            .trajectories(&stamps, &[standing.clone(), standing.clone()])
            .unwrap()[0]
            .frames()[0]
            .world_from_sensor;
        let arm = (segments[Joint::LeftElbow.index()].inverse() * watch)
            .translation
            .vector
            .norm();
        for (frame, expected, within) in [("left_ankle", shin, 1e-6), ("left_wrist_imu", arm, 0.02)]
        {
            let found = distances(frame);
            assert!(!found.is_empty(), "no frame {frame}");
            let off = found
                .iter()
                .map(|distance| (distance / (1.2 * expected) - 1.0).abs())
                .fold(0.0, f64::max);
            println!(
                "{frame}: {:.4} m from its parent, on the embedded body {expected:.4} m, largest difference {off:.1e}",
                found[0]
            );
            assert!(off < within, "{frame}: {off}");
        }
    });
}
