//! The recordings in bags/robot: the diagnosis of one run names what is hidden in the robot's IMUs,
//! and another run confirms it.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{root, succeed};
use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::Imu;
use nalgebra::Vector3;
use serde_json::Value;

/// What a reader of bags/robot/README.md types: each placement's reference and IMU.
const TOPICS: [[&str; 3]; 3] = [
    ["trunk", "/odom", "/trunk/imu/data_raw"],
    ["shank_fl", "/tf:shank_fl_imu@odom", "/shank_fl/imu"],
    ["shank_hr", "/tf:shank_hr_imu@odom", "/shank_hr/imu"],
];
/// A file in the repository stays below this, bytes.
const LARGEST_BAG: u64 = 1_000_000;

fn with_topics(command: &[&str]) -> Vec<String> {
    let mut arguments: Vec<String> = command.iter().map(|&word| word.to_owned()).collect();
    for [name, reference, imu] in TOPICS {
        let named = |topic: &str| format!("{name}={topic}");
        arguments.extend(["--reference-topic".to_owned(), named(reference)]);
        arguments.extend(["--imu-topic".to_owned(), named(imu)]);
    }
    arguments
}

fn run(folder: &Path, command: &[&str]) -> String {
    let arguments = with_topics(command);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    succeed(folder, &arguments)
}

fn imus(recording: &Path, topic: &str) -> Vec<Imu> {
    let messages = BagReader::open(recording).unwrap().read::<Imu>(topic);
    messages.unwrap().into_iter().map(|(_, imu)| imu).collect()
}

/// Root mean squares of the difference of readings with the same stamps: specific force, m/s2, and
/// angular velocity, rad/s.
fn rmse(measured: &[Imu], simulated: &[Imu]) -> [f64; 2] {
    assert!(!simulated.is_empty() && measured.len() == simulated.len());
    let mut squares = [0.0; 2];
    for (one, other) in measured.iter().zip(simulated) {
        assert_eq!(one.header.stamp, other.header.stamp);
        let force =
            Vector3::from(one.linear_acceleration) - Vector3::from(other.linear_acceleration);
        let velocity = Vector3::from(one.angular_velocity) - Vector3::from(other.angular_velocity);
        squares[0] += force.norm_squared();
        squares[1] += velocity.norm_squared();
    }
    squares.map(|sum| (sum / measured.len() as f64).sqrt())
}

fn read_json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Numbers of a parameter, one or several.
fn numbers(value: &Value) -> Vec<f64> {
    let one = |value: &Value| value.as_f64().unwrap();
    match value.as_array() {
        Some(several) => several.iter().map(one).collect(),
        None => vec![one(value)],
    }
}

/// How far a found value may be from the hidden one. The lever arm is found within 1 mm; the bias
/// has the drift of the robot's own heading in it, the damping what 100 Hz of poses leave of a
/// footfall.
fn tolerance(effect: &str, parameter: &str) -> f64 {
    match (effect, parameter) {
        ("time_offset", "seconds") => 2e-4,
        ("lever_arm", "offset") => 2e-3,
        ("gyro_bias", "bias") => 5e-4,
        ("soft_tissue", "natural_hz") => 0.3,
        ("soft_tissue", "damping_ratio") => 0.04,
        _ => panic!("no tolerance of {effect}.{parameter}"),
    }
}

/// Named causes are those that were hidden, with their values. `unknown` may stand beside them:
/// footfalls are shorter than the poses' period, and the diagnosis says so.
fn finds_what_was_hidden(diagnosis: &Value, truth: &Value, name: &str) {
    let causes = diagnosis["placements"][name]["causes"].as_array().unwrap();
    let named = causes.iter().filter(|cause| cause["effect"] != "unknown");
    let mut found: Vec<&str> = named
        .clone()
        .map(|c| c["effect"].as_str().unwrap())
        .collect();
    let hidden = truth[name].as_object().unwrap();
    let mut expected: Vec<&str> = hidden.keys().map(String::as_str).collect();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected, "{name}");
    for cause in named {
        let effect = cause["effect"].as_str().unwrap();
        assert!(cause["probability"].as_f64().unwrap() >= 0.9, "{cause}");
        for (parameter, expected) in hidden[effect].as_object().unwrap() {
            let found = numbers(&cause["parameters"][parameter]);
            let expected = numbers(expected);
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() <= tolerance(effect, parameter),
                    "{name}, {effect}.{parameter}: {found}, hidden {expected}"
                );
            }
        }
    }
}

#[test]
fn a_robots_imus_are_diagnosed_and_another_run_confirms_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let shipped = root().join("bags/robot");
    let path = |run: &str| shipped.join(run).to_str().unwrap().to_owned();
    run(
        folder,
        &["diagnose", &path("session"), "--out", "diagnosis"],
    );
    let diagnosis = read_json(&folder.join("diagnosis/diagnosis.json"));
    let truth = read_json(&shipped.join("truth.json"));
    for [name, ..] in TOPICS {
        finds_what_was_hidden(&diagnosis, &truth, name);
    }

    let simulate = |options: &[&str], out: &str| {
        let check = path("check");
        let base = [
            "simulate",
            "--reference",
            &check,
            "--no-noise",
            "--out",
            out,
        ];
        run(folder, &[&base, options].concat());
        TOPICS.map(|[name, _, topic]| {
            let measured = imus(&shipped.join("check"), topic);
            let simulated = format!("/imu/{name}/data_raw");
            rmse(&measured, &imus(&folder.join(out), &simulated))
        })
    };
    let before = simulate(&[], "before.mcap");
    let after = simulate(&["--effects", "diagnosis/effects.yaml"], "after.mcap");
    println!("{before:?} {after:?}");
    // Of the trunk and the left fore shank: what is said in bags/robot/README.md, and a little.
    let falls =
        |placement: usize, channel: usize| after[placement][channel] / before[placement][channel];
    assert!(
        falls(0, 0) < 0.5 && falls(0, 1) < 0.13,
        "{before:?} {after:?}"
    );
    assert!(falls(1, 0) < 0.4, "{before:?} {after:?}");
    // Where nothing is wrong, nothing changes.
    for (placement, channel) in [(1, 1), (2, 0), (2, 1)] {
        assert!((falls(placement, channel) - 1.0).abs() < 0.02, "{after:?}");
    }
}

#[test]
fn the_bags_stay_small() {
    for run in ["session", "check"] {
        let files = fs::read_dir(root().join("bags/robot").join(run)).unwrap();
        let sizes = files.map(|file| file.unwrap().metadata().unwrap().len());
        assert!(sizes.sum::<u64>() < LARGEST_BAG, "{run}");
    }
}
