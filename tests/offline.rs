//! Motion to bag without DDS: `cromosim simulate`, and what reads its output.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{cromosim_in, python, root, shared_data, skipped, succeed, text};
use cromosim_bag::BagReader;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;

const PLACEMENTS: [&str; 5] = ["left_wrist", "right_ankle", "pelvis", "sternum", "head"];

#[test]
fn the_embedded_walk_becomes_a_bag() {
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &["simulate", "--walk", "--out", "walk.mcap", "--csv", "csv"],
    );
    let reader = BagReader::open(&folder.path().join("walk.mcap")).unwrap();
    let states = reader.read::<SmplState>("/smpl/state").unwrap();
    let seconds = reader.summary().duration();
    assert!((seconds - 10.0).abs() < 0.02, "{seconds}");
    for name in PLACEMENTS {
        let raw = reader
            .read::<Imu>(&format!("/imu/{name}/data_raw"))
            .unwrap();
        let full = reader.read::<Imu>(&format!("/imu/{name}/data")).unwrap();
        let reference = reader
            .read::<PoseStamped>(&format!("/reference/{name}"))
            .unwrap();
        assert_eq!(
            (full.len(), reference.len()),
            (raw.len(), states.len()),
            "{name}"
        );
        assert!(
            (990..=1001).contains(&raw.len()),
            "{name}: little is cut off at the ends, {}",
            raw.len()
        );
        assert_eq!(
            raw[0].1.orientation_covariance[0], -1.0,
            "REP-145: data_raw has no orientation"
        );
        assert_ne!(full[0].1.orientation_covariance[0], -1.0);
        // Over a whole walk that ends where it stands, the mean specific force in the world is
        // gravity's counterpart.
        let up: f64 = full.iter().map(|(_, imu)| world_z(imu)).sum::<f64>() / full.len() as f64;
        assert!(
            (up - 9.80665).abs() < 0.3,
            "{name}: mean upward specific force {up} m/s2"
        );
        let rows = fs::read_to_string(folder.path().join(format!("csv/walk_{name}.csv")))
            .unwrap()
            .lines()
            .count();
        assert_eq!(rows, raw.len() + 1, "{name}: a header and a row a sample");
    }
    assert!(reader.attachment("placements.yaml").is_some());
    assert_eq!(reader.metadata("cromosim").unwrap()["seed"], "0");
}

/// The uncertain ends go with `--bandwidth` as they go with a scheme, and how much is said.
#[test]
fn a_fixed_bandwidth_leaves_out_its_ends() {
    let folder = tempfile::tempdir().unwrap();
    let simulate = |out: &str, trim: &[&str]| {
        let mut arguments = vec![
            "simulate",
            "--walk",
            "--bandwidth",
            "6",
            "--no-noise",
            "--out",
            out,
        ];
        arguments.extend(trim);
        let said = succeed(folder.path(), &arguments);
        let reader = BagReader::open(&folder.path().join(out)).unwrap();
        let count = reader.read::<Imu>("/imu/head/data_raw").unwrap().len();
        let metadata = reader.metadata("cromosim").unwrap();
        (said, count, metadata["trimmed_s.head"].clone())
    };
    let (said, whole, gone) = simulate("whole.mcap", &["--trim", "0"]);
    assert_eq!((whole, gone.as_str()), (1001, "start 0.000, end 0.000"));
    assert!(!said.contains("left out"), "{said}");
    let (said, count, gone) = simulate("walk.mcap", &[]);
    assert!(
        said.contains("at the end left out as uncertain (--trim 0 keeps them)"),
        "{said}"
    );
    let [start, end]: [f64; 2] = ["start ", "end "].map(|side| {
        let (_, rest) = gone.split_once(side).unwrap();
        rest.split(',').next().unwrap().parse().unwrap()
    });
    assert!(
        (0.02..=0.25).contains(&start) && (0.02..=0.25).contains(&end),
        "{gone}"
    );
    assert_eq!(whole - count, ((start + end) * 100.0).round() as usize);
}

/// Specific force along the world's z axis: third row of world_from_sensor times the reading.
fn world_z(imu: &Imu) -> f64 {
    let world_from_sensor: nalgebra::UnitQuaternion<f64> = imu.orientation.try_into().unwrap();
    let force: nalgebra::Vector3<f64> = imu.linear_acceleration.into();
    (world_from_sensor * force).z
}

#[test]
fn same_input_and_seed_same_bytes_at_any_number_of_threads() {
    // One name in three folders: a bag states the name of its file.
    let bytes = |seed: &str, threads: &str| {
        let folder = tempfile::tempdir().unwrap();
        let mut command = std::process::Command::new(common::CROMOSIM);
        command
            .args(["simulate", "--walk", "--out", "walk.mcap", "--seed", seed])
            .current_dir(folder.path())
            .env("RAYON_NUM_THREADS", threads);
        assert!(command.output().unwrap().status.success());
        fs::read(folder.path().join("walk.mcap")).unwrap()
    };
    let first = bytes("7", "1");
    // Not assert_eq, which would print megabytes.
    assert!(
        first == bytes("7", "4"),
        "the number of threads shows in the bytes"
    );
    assert!(
        first != bytes("8", "1"),
        "the seed does not show in the bytes"
    );
}

#[test]
fn a_real_bvh_file_becomes_imu_messages() {
    let Some(data) = shared_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let walk = data.join("mocap_cmu/07_01.bvh");
    let drink = data.join("mocap_cmu/13_07.bvh");
    let (walk, drink) = (walk.to_str().unwrap(), drink.to_str().unwrap());
    let said = succeed(folder.path(), &["inspect", walk]);
    assert!(said.contains("motion") && said.contains("daz"), "{said}");
    succeed(
        folder.path(),
        &["simulate", walk, drink, "--out", "bags", "--no-noise"],
    );
    let reader = BagReader::open(&folder.path().join("bags/07_01.mcap")).unwrap();
    let ankle = reader.read::<Imu>("/imu/right_ankle/data_raw").unwrap();
    let rates: Vec<f64> = ankle
        .iter()
        .map(|(_, imu)| nalgebra::Vector3::<f64>::from(imu.angular_velocity).norm())
        .collect();
    let fastest = rates.iter().copied().fold(0.0, f64::max);
    assert!(rates.iter().all(|rate| rate.is_finite()));
    assert!(
        (2.0..15.0).contains(&fastest),
        "a walking ankle turns at some rad/s at most: {fastest}"
    );
    assert!(folder.path().join("bags/13_07.mcap").exists());
}

/// Files of SMPL parameters: said by their content, and simulated on the embedded body.
#[test]
fn files_of_smpl_parameters_become_imu_messages() {
    let samples =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("nodes/lib/motion/tests/data/poses");
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        (
            "amass.npz",
            [
                "AMASS",
                "6 frames",
                "120 Hz",
                "gender female",
                "betas of SMPL",
            ],
        ),
        (
            "vibe.joblib",
            [
                "VIBE",
                "2 people",
                "rate not stated",
                "no trajectory",
                "person 7: 6 frames (10 to 16)",
            ],
        ),
        (
            "wham.pkl",
            [
                "WHAM",
                "2 people",
                "up (0.00, 1.00, 0.00)",
                "mean body instead of betas of SMPL",
                "rate assumed",
            ],
        ),
    ];
    for (name, parts) in cases {
        let path = samples.join(name);
        let said = succeed(folder.path(), &["inspect", path.to_str().unwrap()]);
        assert!(
            parts.iter().all(|part| said.contains(part)),
            "{parts:?} should be in: {said}"
        );
        succeed(
            folder.path(),
            &[
                "simulate",
                path.to_str().unwrap(),
                "--out",
                "out.mcap",
                "--no-noise",
                "--force",
            ],
        );
    }
    let body = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("nodes/lib/body/tests/data/model_smplh_female.pkl");
    let said = succeed(folder.path(), &["inspect", body.to_str().unwrap()]);
    assert!(
        said.contains("body") && said.contains("24 joints"),
        "{said}"
    );
}

#[test]
fn a_recording_is_simulated_again_from_its_reference() {
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &[
            "simulate",
            "--walk",
            "--out",
            "walk.mcap",
            "--no-noise",
            "--rate",
            "100",
            // Its poses are exact, and the estimate from a reference takes them so.
            "--scheme",
            "spline",
        ],
    );
    succeed(
        folder.path(),
        &[
            "simulate",
            "--reference",
            "walk.mcap",
            "--no-noise",
            "--out",
            "again.mcap",
        ],
    );
    let open = |name: &str| BagReader::open(&folder.path().join(name)).unwrap();
    let (first, again) = (open("walk.mcap"), open("again.mcap"));
    for name in PLACEMENTS {
        let topic = format!("/imu/{name}/data_raw");
        let (one, other) = (
            first.read::<Imu>(&topic).unwrap(),
            again.read::<Imu>(&topic).unwrap(),
        );
        assert_eq!(one.len(), other.len());
        for ((_, one), (_, other)) in one.iter().zip(&other) {
            assert_eq!(one.header.stamp, other.header.stamp);
            let difference = nalgebra::Vector3::from(one.angular_velocity)
                - nalgebra::Vector3::from(other.angular_velocity);
            assert!(
                difference.norm() < 0.02,
                "{name}: the biases of the demo's devices at most, {difference}"
            );
        }
    }
}

#[test]
fn the_sample_without_a_gap_has_none_but_noise() {
    let cases = root().join("../shared/cases/none/check.mcap");
    if !cases.exists() {
        return skipped("no ../shared/cases");
    }
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &[
            "simulate",
            "--reference",
            cases.to_str().unwrap(),
            "--no-noise",
            "--out",
            "again.mcap",
        ],
    );
    let measured = BagReader::open(&cases)
        .unwrap()
        .read::<Imu>("/imu/wrist/data_raw")
        .unwrap();
    let simulated = BagReader::open(&folder.path().join("again.mcap"))
        .unwrap()
        .read::<Imu>("/imu/wrist/data_raw")
        .unwrap();
    assert_eq!(measured.len(), simulated.len());
    let rmse = |of: fn(&Imu) -> nalgebra::Vector3<f64>| {
        let sum: f64 = measured
            .iter()
            .zip(&simulated)
            .map(|((_, one), (_, other))| (of(one) - of(other)).norm_squared())
            .sum();
        (sum / measured.len() as f64).sqrt()
    };
    let (force, rate) = (
        rmse(|imu| imu.linear_acceleration.into()),
        rmse(|imu| imu.angular_velocity.into()),
    );
    // Declared noise and what smoothing leaves of the reference's 0.1 mm and 0.05 degrees.
    assert!(
        force < 0.35 && rate < 0.06,
        "specific force {force} m/s2, angular velocity {rate} rad/s"
    );
}

#[test]
fn python_reads_what_simulate_writes() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["simulate", "--walk", "--out", "walk.mcap"]);
    succeed(folder.path(), &["simulate", "--walk", "--out", "walk"]);
    for bag in ["walk.mcap", "walk"] {
        let output = std::process::Command::new(&python)
            .arg(root().join("tests/interop/check_bag.py"))
            .arg(folder.path().join(bag))
            .output()
            .unwrap();
        assert!(output.status.success(), "{bag}: {}", text(&output));
    }
}

#[test]
fn bodies_are_exported_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["body", "export", "body.npz"]);
    succeed(
        folder.path(),
        &["body", "export", "tall.obj", "--betas", "2.0,-1.0"],
    );
    let said = succeed(folder.path(), &["inspect", "body.npz"]);
    assert!(
        said.contains("6954 vertices") && said.contains("1.701 m tall"),
        "{said}"
    );
    succeed(
        folder.path(),
        &[
            "simulate",
            "--walk",
            "--out",
            "a.mcap",
            "--body",
            "body.npz",
            "--no-noise",
        ],
    );
    assert!(Path::new(&folder.path().join("a.mcap")).exists());
}

#[test]
fn completion_knows_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let script = succeed(folder.path(), &["completion", shell]);
        assert!(
            script.contains("simulate") && script.contains("recover"),
            "{shell}"
        );
    }
}

#[test]
fn the_bags_that_are_shipped_are_made_by_the_commands_they_state() {
    let bags = root().join("bags");
    let origin = fs::read_to_string(bags.join("README.md")).unwrap();
    let mut made = 0;
    for line in origin
        .lines()
        .filter_map(|line| line.trim().strip_prefix("cromosim "))
    {
        let folder = tempfile::tempdir().unwrap();
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let output = cromosim_in(folder.path(), &arguments);
        assert!(output.status.success(), "{line}: {}", text(&output));
        let name = arguments[arguments
            .iter()
            .position(|argument| *argument == "--out")
            .unwrap()
            + 1];
        let open = |folder: &Path| BagReader::open(&folder.join(name)).unwrap();
        let (fresh, shipped) = (open(folder.path()), open(&bags));
        assert_eq!(
            fresh.summary(),
            shipped.summary(),
            "{name}: make it anew: cromosim {line}"
        );
        // Not byte for byte: the sines of two machines may differ in their last bit.
        for placement in PLACEMENTS {
            let topic = format!("/imu/{placement}/data");
            for ((_, one), (_, other)) in fresh
                .read::<Imu>(&topic)
                .unwrap()
                .iter()
                .zip(shipped.read::<Imu>(&topic).unwrap())
            {
                let difference = nalgebra::Vector3::from(one.linear_acceleration)
                    - nalgebra::Vector3::from(other.linear_acceleration);
                assert!(
                    difference.norm() < 1e-6,
                    "{name}, {topic}: make it anew: cromosim {line}"
                );
            }
        }
        made += 1;
    }
    assert!(made > 0, "bags/README.md states no command");
}

#[test]
fn an_interrupt_leaves_nothing_half_written() {
    let Some(data) = shared_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    // A quarter of an hour of motion, so that there is time to interrupt.
    let clip = fs::read_to_string(data.join("mocap_cmu/13_07.bvh")).unwrap();
    let (head, frames) = clip.split_once("Frame Time:").unwrap();
    let (time, frames) = frames.split_once('\n').unwrap();
    let (structure, count) = head.rsplit_once("Frames:").unwrap();
    let many = 75;
    let count = count.trim().parse::<usize>().unwrap() * many;
    fs::write(
        folder.path().join("long.bvh"),
        format!(
            "{structure}Frames: {count}\nFrame Time:{time}\n{}",
            frames.repeat(many)
        ),
    )
    .unwrap();
    let mut command = std::process::Command::new(common::CROMOSIM);
    command
        .args(["simulate", "long.bvh", "--out", "long.mcap"])
        .current_dir(folder.path())
        .stderr(std::process::Stdio::piped());
    let child = command.spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    assert!(
        std::process::Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(text(&output).contains("interrupted"), "{}", text(&output));
    let left: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(left, ["long.bvh"]);
}

/// Each person's topics, frames and CSV files; and errors that name who is there.
#[test]
fn several_people_become_one_bag() {
    let file = root().join("nodes/lib/motion/tests/data/poses/chain_wham.pkl");
    let file = file.to_str().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let said = succeed(
        folder.path(),
        &[
            "simulate",
            file,
            "--person",
            "all",
            "--out",
            "people.mcap",
            "--csv",
            "csv",
        ],
    );
    assert!(said.contains("2 people"), "{said}");
    let people = BagReader::open(&folder.path().join("people.mcap")).unwrap();
    for (label, frames, id) in [("person_0", 61, "0"), ("person_3", 50, "3")] {
        let states = people
            .read::<SmplState>(&format!("/{label}/smpl/state"))
            .unwrap();
        assert_eq!((states.len(), states[0].1.body_id.as_str()), (frames, id));
        let raw = people
            .read::<Imu>(&format!("/{label}/imu/head/data_raw"))
            .unwrap();
        assert_eq!(raw[0].1.header.frame_id, format!("{label}/head_imu"));
        assert_eq!(
            people
                .read::<PoseStamped>(&format!("/{label}/reference/head"))
                .unwrap()
                .len(),
            frames
        );
        assert!(
            folder
                .path()
                .join(format!("csv/people_{label}_head.csv"))
                .exists()
        );
    }
    // Alone, a person reads the same, but for noise: a device of its own, and a clock of its own.
    succeed(
        folder.path(),
        &[
            "simulate",
            file,
            "--person",
            "3",
            "--out",
            "alone.mcap",
            "--no-noise",
        ],
    );
    succeed(
        folder.path(),
        &[
            "simulate",
            file,
            "--person",
            "3,0",
            "--out",
            "both.mcap",
            "--no-noise",
        ],
    );
    let read = |name: &str, topic: &str| {
        BagReader::open(&folder.path().join(name))
            .unwrap()
            .read::<Imu>(topic)
            .unwrap()
    };
    let (alone, both) = (
        read("alone.mcap", "/imu/head/data_raw"),
        read("both.mcap", "/person_3/imu/head/data_raw"),
    );
    assert_eq!(alone.len(), both.len());
    for ((_, alone), (_, both)) in alone.iter().zip(&both) {
        assert_eq!(
            both.header.stamp.nanos() - alone.header.stamp.nanos(),
            200_000_000
        );
        let apart = nalgebra::Vector3::from(alone.linear_acceleration)
            - nalgebra::Vector3::from(both.linear_acceleration);
        assert!(apart.norm() < 1e-5, "{apart}");
    }
    let wrong: [&[&str]; 2] = [
        &["simulate", file, "--person", "0,5", "--out", "x.mcap"],
        &["convert", file, "x.bvh", "--person", "all"],
    ];
    for arguments in wrong {
        let output = cromosim_in(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2));
        assert!(
            text(&output).contains("is not in it; there are 0 (61 frames), 3 (50 frames)"),
            "{}",
            text(&output)
        );
    }
    assert!(!folder.path().join("x.mcap").exists() && !folder.path().join("x.bvh").exists());
    // A skeleton's file holds one person.
    succeed(
        folder.path(),
        &["convert", file, "walk.bvh", "--person", "3"],
    );
    succeed(
        folder.path(),
        &[
            "simulate", "walk.bvh", "--person", "all", "--out", "one.mcap",
        ],
    );
    assert!(!read("one.mcap", "/person_0/imu/head/data_raw").is_empty());
}
