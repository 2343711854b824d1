//! Bad input: one line that names file and place, exit code 2, and nothing half-written.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{TINY_BVH, cromosim_in, succeed};
use cromosim_bag::{BagOptions, BagWriter};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

/// Runs the command, which must fail as the rules say; `expected` are parts of its one line.
fn refuses(folder: &Path, arguments: &[&str], expected: &[&str]) {
    let before = listing(folder);
    let output = cromosim_in(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
    assert_eq!(
        error.trim_end().lines().count(),
        1,
        "{arguments:?} says more than a line: {error}"
    );
    for part in expected {
        assert!(
            error.contains(part),
            "{arguments:?}: '{part}' is not in: {error}"
        );
    }
    assert!(!error.contains("panicked"), "{error}");
    assert_eq!(
        listing(folder),
        before,
        "{arguments:?} left something behind"
    );
}

fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn motion_files() {
    let folder = tempfile::tempdir().unwrap();
    let truncated = &TINY_BVH[..TINY_BVH.len() - 30];
    let cases = [
        (
            "truncated.bvh",
            truncated.to_owned(),
            vec!["truncated.bvh", "line"],
        ),
        (
            "cut_header.bvh",
            TINY_BVH[..120].to_owned(),
            vec!["cut_header.bvh", "line"],
        ),
        (
            "nan.bvh",
            TINY_BVH.replace("0 90 0 0 0 0 0 0 0\n0", "0 90 0 nan 0 0 0 0 0\n0"),
            vec!["nan.bvh", "line 19"],
        ),
        (
            "channels.bvh",
            TINY_BVH.replace("0 90 0 0 0 0 0 0 0\n0", "0 90 0 0 0 0 0 0\n0"),
            vec!["channels.bvh", "line 19", "9", "8"],
        ),
        (
            "no_frames.bvh",
            TINY_BVH.replace("Frames: 2", "Frames: 0"),
            vec!["no_frames.bvh", "line 17"],
        ),
        (
            "backwards.bvh",
            TINY_BVH.replace("Frame Time: 0.01", "Frame Time: -0.01"),
            vec!["backwards.bvh", "line 18"],
        ),
        ("no_body.bvh", TINY_BVH.to_owned(), vec!["no_body.bvh"]),
        ("text.bvh", "what is this".to_owned(), vec!["text.bvh"]),
        ("empty.bvh", String::new(), vec!["empty.bvh"]),
    ];
    for (name, content, _) in &cases {
        fs::write(folder.path().join(name), content).unwrap();
    }
    for (name, _, expected) in &cases {
        refuses(
            folder.path(),
            &["simulate", name, "--out", "out.mcap"],
            expected,
        );
        refuses(folder.path(), &["inspect", name], expected);
        refuses(
            folder.path(),
            &[
                "node",
                "replay",
                "--check-config",
                "--ros-args",
                "-p",
                &format!("motion:={name}"),
            ],
            expected,
        );
    }
    refuses(
        folder.path(),
        &["simulate", "missing.bvh", "--out", "out.mcap"],
        &["missing.bvh"],
    );
    refuses(
        folder.path(),
        &["demo", "--motion", "nan.bvh"],
        &["nan.bvh", "line 19"],
    );
    fs::create_dir(folder.path().join("folder.bvh")).unwrap();
    refuses(
        folder.path(),
        &["simulate", "folder.bvh", "--out", "out.mcap"],
        &["folder.bvh"],
    );
}

#[test]
fn placements_and_settings() {
    let folder = tempfile::tempdir().unwrap();
    let file = |fields: &str| {
        format!("schema: cromosim/placements/1\nplacements:\n  wrist: {{{fields}}}\n")
    };
    let cases = [
        (
            "site.yaml",
            file("site: left_toe_ring, rate_hz: 100"),
            vec!["left_toe_ring", "wrist"],
        ),
        (
            "mount.yaml",
            file(
                "site: left_watch, rate_hz: 100, mount: {matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}",
            ),
            vec!["mount.yaml", "wrist", "mount"],
        ),
        (
            "rate.yaml",
            file("site: left_watch, rate_hz: -5"),
            vec!["rate.yaml", "wrist", "rate_hz"],
        ),
        (
            "unknown.yaml",
            file("site: left_watch, rate_hz: 100, colour: red"),
            vec!["unknown.yaml", "wrist", "colour"],
        ),
        (
            "none.yaml",
            "schema: cromosim/placements/1\nplacements: {}\n".to_owned(),
            vec!["none.yaml", "placements"],
        ),
        ("yaml.yaml", "placements: [".to_owned(), vec!["yaml.yaml"]),
    ];
    for (name, content, expected) in &cases {
        fs::write(folder.path().join(name), content).unwrap();
        refuses(
            folder.path(),
            &["simulate", "--placements", name, "--out", "out.mcap"],
            expected,
        );
        refuses(
            folder.path(),
            &[
                "node",
                "virtual_imu",
                "--check-config",
                "--ros-args",
                "-p",
                &format!("placements:={name}"),
            ],
            expected,
        );
    }
    refuses(
        folder.path(),
        &["simulate", "--rate", "-5", "--out", "out.mcap"],
        &["--rate", "-5"],
    );
    refuses(
        folder.path(),
        &["simulate", "--rate", "1e9", "--out", "out.mcap"],
        &["--rate", "100000"],
    );
    refuses(
        folder.path(),
        &["simulate", "--scheme", "guess", "--out", "out.mcap"],
        &["guess", "spline"],
    );
    refuses(
        folder.path(),
        &["simulate", "--body", "nobody.npz", "--out", "out.mcap"],
        &["nobody.npz"],
    );
    refuses(
        folder.path(),
        &["simulate", "--out", "missing/out.mcap"],
        &["missing"],
    );
}

#[test]
fn options_of_another_mode_of_simulate() {
    let folder = tempfile::tempdir().unwrap();
    let reference = ["simulate", "--reference", "r.mcap", "--out", "out.mcap"];
    let rigid = [
        "simulate", "--rigid", "r.tum", "--rate", "100", "--out", "out.mcap",
    ];
    let of_motions: [&[&str]; 15] = [
        &["--placements", "p.yaml"],
        &["--csv", "csv"],
        &["--pose-error-correlation", "1"],
        &["--up-axis", "z"],
        &["--unit", "0.01"],
        &["--start", "1"],
        &["--duration", "1"],
        &["--skeleton", "s.asf"],
        &["--motion-rate", "60"],
        &["--marker-set", "plug_in_gait"],
        &["--subject", "anna"],
        &["--placements-as-given"],
        &["--person", "1"],
        &["--shape", "mean"],
        &["--source-body", "b.npz"],
    ];
    for option in of_motions {
        for (mode, name) in [(&reference[..], "--reference"), (&rigid[..], "--rigid")] {
            refuses(
                folder.path(),
                &[mode, option].concat(),
                &[option[0], "goes with motion files", name],
            );
        }
    }
    let motions = ["simulate", "--out", "out.mcap"];
    let cases: [(&[&str], &[&str], &str); 10] = [
        (&motions, &["--placement", "wrist"], "not with motion files"),
        (&motions, &["--device", "d.yaml"], "not with motion files"),
        (&motions, &["--effects", "e.yaml"], "not with motion files"),
        (
            &reference,
            &["--placement", "wrist"],
            "not with --reference",
        ),
        (&reference, &["--device", "d.yaml"], "not with --reference"),
        (&reference, &["--learned", "video"], "not with --reference"),
        (&reference, &["--mapping", "m.yaml"], "not with --reference"),
        (&reference, &["--rigid", "r.tum"], "give one of them"),
        (&rigid, &["--body", "b.npz"], "not with --rigid"),
        (&rigid, &["walk.bvh"], "--rigid"),
    ];
    for (mode, option, expected) in cases {
        refuses(
            folder.path(),
            &[mode, option].concat(),
            &[option[0], expected],
        );
    }
    refuses(
        folder.path(),
        &["simulate", "--rigid", "r.tum", "--out", "out.mcap"],
        &["--rate"],
    );
    refuses(
        folder.path(),
        &[&rigid[..], &["--device", "d.yaml", "--effects", "e.yaml"]].concat(),
        &["--device", "--effects"],
    );
}

#[test]
fn parameters_of_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let node = |name: &'static str, parameter: &'static str| {
        vec![
            "node",
            name,
            "--check-config",
            "--ros-args",
            "-p",
            parameter,
        ]
    };
    refuses(
        folder.path(),
        &node("virtual_imu", "rate:=50.0"),
        &["unknown parameter 'rate'"],
    );
    refuses(
        folder.path(),
        &node("virtual_imu", "rate_hz:=-5.0"),
        &["rate_hz", "-5"],
    );
    refuses(
        folder.path(),
        &node("virtual_imu", "scheme:=guess"),
        &["scheme", "guess"],
    );
    refuses(folder.path(), &node("replay", "rate:=0.0"), &["rate", "0"]);
    refuses(
        folder.path(),
        &node("replay", "bag:=missing.mcap"),
        &["missing.mcap"],
    );
    refuses(
        folder.path(),
        &node("recorder", "compression:=zip"),
        &["compression", "zip"],
    );
    refuses(
        folder.path(),
        &node("recorder", "bag_path:=."),
        &[".", "bag_path"],
    );
    refuses(
        folder.path(),
        &node("smpl_state", "smoothing_cutoff_hz:=fast"),
        &["smoothing_cutoff_hz", "number"],
    );
    refuses(
        folder.path(),
        &[
            "node",
            "smpl_state",
            "--check-config",
            "--ros-args",
            "--params-file",
            "missing.yaml",
        ],
        &["missing.yaml"],
    );
    fs::write(
        folder.path().join("p.yaml"),
        "smpl_state:\n  ros__parameters:\n    prefix: alice\n    hight: 3\n",
    )
    .unwrap();
    refuses(
        folder.path(),
        &[
            "node",
            "smpl_state",
            "--check-config",
            "--ros-args",
            "--params-file",
            "p.yaml",
        ],
        &["p.yaml", "line 4", "hight"],
    );
    refuses(
        folder.path(),
        &node("smpl_state", "source_position:=[.nan, 0.0, 0.0]"),
        &["source_position"],
    );
    refuses(
        folder.path(),
        &node("replay", "ready_timeout_seconds:=1e300"),
        &["ready_timeout_seconds"],
    );
    refuses(folder.path(), &["node", "nobody"], &["nobody", "replay"]);
    refuses(
        folder.path(),
        &["node", "replay", "--speed", "3"],
        &["--speed", "--help"],
    );
}

#[test]
fn bags() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    succeed(folder.path(), &["simulate", "--out", "walk.mcap"]);
    let whole = fs::read(path("walk.mcap")).unwrap();
    fs::write(path("cut.mcap"), &whole[..whole.len() * 2 / 3]).unwrap();
    fs::write(path("text.mcap"), "not a bag").unwrap();
    for command in [
        ["inspect", "cut.mcap"].as_slice(),
        &["simulate", "--reference", "cut.mcap", "--out", "out.mcap"],
    ] {
        refuses(folder.path(), command, &["cut.mcap", "bag recover"]);
    }
    refuses(
        folder.path(),
        &[
            "node",
            "replay",
            "--check-config",
            "--ros-args",
            "-p",
            "bag:=cut.mcap",
        ],
        &["cut.mcap", "bag recover"],
    );
    refuses(
        folder.path(),
        &["simulate", "--reference", "text.mcap", "--out", "out.mcap"],
        &["text.mcap"],
    );
    refuses(
        folder.path(),
        &["bag", "csv", "walk.mcap", "/imu/nose/data"],
        &["/imu/nose/data", "/imu/head/data"],
    );
    refuses(
        folder.path(),
        &["simulate", "--out", "walk.mcap"],
        &["walk.mcap"],
    );
    refuses(
        folder.path(),
        &[
            "simulate",
            "--reference",
            "walk.mcap",
            "--out",
            "walk.mcap",
            "--force",
        ],
        &["walk.mcap", "another name"],
    );
    assert_eq!(
        fs::read(path("walk.mcap")).unwrap(),
        whole,
        "an existing bag is not touched"
    );

    let said = succeed(folder.path(), &["bag", "recover", "cut.mcap"]);
    assert!(said.contains("cut_recovered.mcap"), "{said}");
    let said = succeed(folder.path(), &["inspect", "cut_recovered.mcap"]);
    assert!(said.contains("/imu/left_wrist/data_raw"), "{said}");
}

/// A recording of one placement: so many poses and messages at 100 Hz of something that swings,
/// changed by the caller.
fn recording(path: &Path, poses: usize, imus: usize, change: impl Fn(&mut PoseStamped, &mut Imu)) {
    let mut bag = BagWriter::create(path, BagOptions::default()).unwrap();
    for k in 0..poses.max(imus) {
        let (nanos, t) = (
            1_700_000_000_000_000_000 + 10_000_000 * k as i64,
            k as f64 / 100.0,
        );
        let (mut pose, mut imu) = (PoseStamped::default(), Imu::default());
        (pose.header, imu.header) = (Header::new(nanos, "world"), Header::new(nanos, "wrist_imu"));
        pose.pose.position.x = (2.0 * t).sin();
        (pose.pose.orientation.z, pose.pose.orientation.w) = (0.1 * t).sin_cos();
        imu.linear_acceleration =
            nalgebra::Vector3::new(t.sin(), (1.1 * t).sin(), 9.8 + (1.2 * t).sin()).into();
        imu.angular_velocity =
            nalgebra::Vector3::new((1.3 * t).sin(), (1.4 * t).sin(), 0.2 + (1.5 * t).sin()).into();
        change(&mut pose, &mut imu);
        let log_time = Stamp::from_nanos(nanos);
        if k < poses {
            bag.write("/reference/wrist", log_time, &pose).unwrap();
        }
        if k < imus {
            bag.write("/imu/wrist/data_raw", log_time, &imu).unwrap();
        }
    }
    bag.finish().unwrap();
}

#[test]
fn recordings_to_diagnose() {
    type Change = fn(&mut PoseStamped, &mut Imu);
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, usize, usize, Change, &[&str]); 10] = [
        (
            "apart.mcap",
            2000,
            2000,
            |_, imu| imu.header.stamp.sec += 1000,
            &["wrist", "reference", "recorded together"],
        ),
        (
            "no_reference.mcap",
            0,
            2000,
            |_, _| {},
            &["no_reference.mcap", "/reference/NAME"],
        ),
        (
            "no_imu.mcap",
            2000,
            0,
            |_, _| {},
            &["no_imu.mcap", "/imu/wrist/data_raw"],
        ),
        (
            "one_sample.mcap",
            2000,
            1,
            |_, _| {},
            &["wrist", "1 usable messages"],
        ),
        (
            "one_pose.mcap",
            1,
            2000,
            |_, _| {},
            &["wrist", "reference", "16"],
        ),
        (
            "nan.mcap",
            2000,
            2000,
            |_, imu| imu.angular_velocity.x = f64::NAN,
            &["wrist", "NaN"],
        ),
        (
            "nan_poses.mcap",
            2000,
            2000,
            |pose, _| pose.pose.position.z = f64::INFINITY,
            &["/reference/wrist", "NaN or infinite"],
        ),
        (
            "zero.mcap",
            2000,
            2000,
            |pose, _| (pose.pose.orientation.z, pose.pose.orientation.w) = (0.0, 0.0),
            &["zero.mcap", "/reference/wrist", "not a rotation"],
        ),
        (
            "stuck.mcap",
            2000,
            2000,
            |_, imu| imu.linear_acceleration.y = 1.0,
            &["wrist", "accel_y", "stuck"],
        ),
        (
            "one_time.mcap",
            2000,
            2000,
            |_, imu| imu.header.stamp = Header::new(1_700_000_001_000_000_000, "").stamp,
            &["wrist", "1 usable"],
        ),
    ];
    for (name, poses, imus, change, _) in &cases {
        recording(&folder.path().join(name), *poses, *imus, change);
    }
    for (name, .., expected) in &cases {
        refuses(
            folder.path(),
            &["diagnose", name, "--out", "found"],
            expected,
        );
    }
    fs::write(folder.path().join("text.mcap"), "not a bag").unwrap();
    refuses(
        folder.path(),
        &["diagnose", "text.mcap", "--out", "found"],
        &["text.mcap"],
    );
    refuses(
        folder.path(),
        &["diagnose", "missing.mcap", "--out", "found"],
        &["missing.mcap"],
    );
    refuses(
        folder.path(),
        &["simulate", "--reference", "zero.mcap", "--out", "out.mcap"],
        &["zero.mcap", "/reference/wrist", "not a rotation"],
    );
    refuses(
        folder.path(),
        &[
            "simulate",
            "--reference",
            "one_pose.mcap",
            "--out",
            "out.mcap",
        ],
        &["wrist", "16"],
    );
}

#[test]
fn settings_of_a_diagnosis() {
    let folder = tempfile::tempdir().unwrap();
    recording(&folder.path().join("good.mcap"), 2000, 2000, |_, _| {});
    let diagnose =
        |more: &[&'static str]| [&["diagnose", "good.mcap", "--out", "found"], more].concat();
    refuses(
        folder.path(),
        &diagnose(&["--without", "leverarm"]),
        &["--without leverarm", "no such effect", "lever_arm"],
    );
    refuses(
        folder.path(),
        &diagnose(&["--without", "unknown"]),
        &["--without unknown", "no such effect"],
    );
    let cases = [
        (
            "effect.yaml",
            "without: [accel_bais]\n",
            ["effect.yaml", "accel_bais", "accel_bias"],
        ),
        (
            "field.yaml",
            "seed: 1\nwihtout: []\n",
            ["field.yaml", "line 2", "wihtout"],
        ),
        ("seed.yaml", "seed: -1\n", ["seed.yaml", "line 1", "-1"]),
        (
            "yaml.yaml",
            "placements: [\n",
            ["yaml.yaml", "line 2", "flow node"],
        ),
        (
            "names.yaml",
            "placements: [nose]\n",
            ["good.mcap", "nose", "wrist"],
        ),
    ];
    for (name, content, expected) in &cases {
        fs::write(folder.path().join(name), content).unwrap();
        refuses(
            folder.path(),
            &["diagnose", "good.mcap", "--out", "found", "--config", name],
            expected,
        );
    }
    refuses(
        folder.path(),
        &diagnose(&["--config", "missing.yaml"]),
        &["missing.yaml"],
    );
    refuses(
        folder.path(),
        &["diagnose", "good.mcap", "--out", "good.mcap"],
        &["good.mcap", "no folder"],
    );
    refuses(
        folder.path(),
        &["diagnose", "good.mcap", "--out", "good.mcap/found"],
        &["good.mcap", "no folder"],
    );
    // A folder in the place of a file: nothing is written, neither the other files nor temporary
    // ones.
    fs::create_dir_all(folder.path().join("taken/effects.yaml")).unwrap();
    refuses(
        folder.path(),
        &["diagnose", "good.mcap", "--out", "taken"],
        &["effects.yaml", "folder"],
    );
    assert_eq!(listing(&folder.path().join("taken")), ["effects.yaml"]);
}
