//! What a diagnosis costs beside the simulation that it questions: processor time (user and system) of
//! `cromosim diagnose` over that of `cromosim simulate --reference` on the same recordings in the same
//! run, and the most memory that it held. Goals: 20 times, and 600 MB for ten minutes of five placements.
//!
//! `cargo bench --no-default-features --bench diagnosis_cost` prints the table; BROAD's trials are found by
//! `CROMOSIM_DATA` or at `../shared/data`. `cargo test` runs its first line once, so that it keeps running.
#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod run;
#[path = "../../nodes/lib/gap/tests/support/mod.rs"]
mod support;

use std::env;
use std::fs;
use std::path::Path;

use cromosim_bag::{BagOptions, BagWriter};
use cromosim_gap::PlacementRecord;
use cromosim_imu::EffectKind as K;
use cromosim_msgs::geometry_msgs::{Pose, PoseStamped};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use support::Scene;

/// The recordings that are made here: a minute of one placement, with a lever arm, with a time offset and a bias, and with its
/// reference smoothed, and ten minutes of five placements, one of them late and on soft tissue.
const MADE: [&str; 5] = [
    "no effect",
    "one effect",
    "two effects",
    "a smoothed reference",
    TEN_MINUTES,
];
const TEN_MINUTES: &str = "ten minutes of five placements";
/// How often a minute is measured.
const RUNS: usize = 5;
/// Whole trials, 190 s at 286 Hz with magnetometers.
const BROAD: [&str; 2] = [
    "06_undisturbed_fast_rotation_A",
    "21_undisturbed_fast_combined",
];

/// The placements of one of `MADE`.
fn scenes(name: &str) -> Vec<(String, Scene)> {
    let wrist = |scene| vec![("wrist".to_owned(), scene)];
    match name {
        "no effect" => wrist(Scene::new(1)),
        "one effect" => wrist(Scene::new(1).with(K::LeverArm, &[0.05, 0.02, -0.06])),
        "two effects" => wrist(
            Scene::new(1)
                .with(K::TimeOffset, &[0.021])
                .with(K::AccelBias, &[0.2, -0.15, 0.1]),
        ),
        "a smoothed reference" => wrist(Scene::new(1).with(K::ReferenceSmoothing, &[6.0, 0.0])),
        _ => (1..=5)
            .map(|seed| {
                let mut scene = Scene::new(seed);
                scene.seconds = 600.0;
                if seed == 2 {
                    scene = scene
                        .with(K::TimeOffset, &[0.03])
                        .with(K::SoftTissue, &[7.0, 0.3]);
                }
                (format!("placement_{seed}"), scene)
            })
            .collect(),
    }
}

/// Writes the recording; in a process of its own, as what this one holds would count as its children's.
fn make(name: &str, path: &Path) {
    let mut bag = BagWriter::create(path, BagOptions::default()).unwrap();
    for (placement, scene) in scenes(name) {
        write_placement(&mut bag, &placement, &scene.record());
    }
    bag.finish().unwrap();
}

fn write_placement(bag: &mut BagWriter, name: &str, record: &PlacementRecord) {
    let reference = &record.reference;
    for (k, stamp) in reference.stamps.iter().enumerate() {
        let message = PoseStamped {
            header: Header::new(stamp.nanos, "world"),
            pose: Pose {
                position: reference.positions[k].into(),
                orientation: reference.rotations[k].into(),
            },
        };
        bag.write(&format!("/reference/{name}"), *stamp, &message)
            .unwrap();
    }
    let declared = [
        record.imu.declared.accelerometer,
        record.imu.declared.gyroscope,
    ]
    .map(|sigma| sigma.unwrap().powi(2));
    for (stamp, reading) in record.imu.stamps.iter().zip(&record.imu.readings) {
        let mut message = Imu {
            header: Header::new(stamp.nanos, name),
            ..Imu::default()
        };
        message.linear_acceleration = reading.specific_force.into();
        message.angular_velocity = reading.angular_velocity.into();
        for axis in [0, 4, 8] {
            message.linear_acceleration_covariance[axis] = declared[0];
            message.angular_velocity_covariance[axis] = declared[1];
        }
        message.orientation_covariance[0] = -1.0;
        bag.write(&format!("/imu/{name}/data_raw"), *stamp, &message)
            .unwrap();
    }
}

/// Measures a recording and prints its line: medians of `runs` turns, the two in turn.
fn measure(folder: &Path, name: &str, recording: &Path, runs: usize) {
    let found = folder.join("found");
    let again = folder.join("again.mcap");
    let [recording, found, again] = [recording, &found, &again].map(|path| path.to_str().unwrap());
    let (mut simulations, mut diagnoses) = (Vec::new(), Vec::new());
    for _ in 0..runs {
        simulations.push(run::cromosim(&[
            "simulate",
            "--reference",
            recording,
            "--out",
            again,
            "--force",
        ]));
        diagnoses.push(run::cromosim(&[
            "diagnose", recording, "--out", found, "--force",
        ]));
    }
    let [simulation, diagnosis] = [&simulations, &diagnoses].map(|all| median(all));
    let most = diagnoses
        .iter()
        .map(|used| used.megabytes)
        .fold(0.0, f64::max);
    println!(
        "| {name} | {simulation:.2} | {diagnosis:.2} | {:.1} | {most:.0} MB |",
        diagnosis / simulation,
    );
}

/// Of processor times, s.
fn median(all: &[run::Used]) -> f64 {
    let mut seconds: Vec<f64> = all.iter().map(|used| used.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    if let [verb, name, path] = arguments.as_slice()
        && verb == "make"
    {
        return make(name, Path::new(path));
    }
    let measures = arguments.iter().any(|argument| argument == "--bench");
    let folder = tempfile::tempdir().unwrap();
    println!(
        "| recording | simulation, s | diagnosis, s | times | memory |\n|---|---|---|---|---|"
    );
    for name in &MADE[..if measures { MADE.len() } else { 1 }] {
        let recording = folder.path().join("made.mcap");
        run::this_program(&["make", name, recording.to_str().unwrap()]);
        let runs = if measures && *name != TEN_MINUTES {
            RUNS
        } else {
            1
        };
        measure(folder.path(), name, &recording, runs);
        fs::remove_file(&recording).unwrap();
    }
    if !measures {
        return;
    }
    let Some(data) = common::shared_data() else {
        return;
    };
    for trial in BROAD {
        let recording = folder.path().join(format!("{trial}.mcap"));
        let file = data.join(format!("paired_broad/{trial}.npz"));
        run::cromosim(&[
            "convert",
            file.to_str().unwrap(),
            recording.to_str().unwrap(),
        ]);
        measure(folder.path(), trial, &recording, 1);
    }
}
