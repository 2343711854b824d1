//! Parameters of the nodes, and bags.

use std::fs;
use std::process::Command;

use crate::common::{CROMOSIM, succeed};
use crate::refuses;

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

/// Nothing starts that would talk in the clear where that is forbidden.
#[test]
fn security_that_cannot_be_had() {
    let folder = tempfile::tempdir().unwrap();
    let said = |variables: &[(&str, &str)], arguments: &[&str]| {
        let mut command = Command::new(CROMOSIM);
        command.args(arguments).current_dir(folder.path());
        for variable in ["ENABLE", "STRATEGY", "KEYSTORE", "ENCLAVE_OVERRIDE"] {
            command.env_remove(format!("ROS_SECURITY_{variable}"));
        }
        let output = command.envs(variables.iter().copied()).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), error)
    };
    let (on, enforce) = (
        ("ROS_SECURITY_ENABLE", "true"),
        ("ROS_SECURITY_STRATEGY", "Enforce"),
    );
    let recorder = ["node", "recorder"];
    let check = ["node", "recorder", "--check-config"];
    let nowhere = ("ROS_SECURITY_KEYSTORE", "nowhere");
    type Case<'a> = (&'a [(&'a str, &'a str)], &'a [&'a str], &'a str);
    let cases: [Case<'_>; 5] = [
        (&[on, enforce], &recorder, "Enforce: "),
        (&[on, enforce, nowhere], &check, "Enforce: "),
        (&[on, enforce], &["demo", "--no-viewer"], "Enforce: "),
        (
            &[("ROS_SECURITY_ENABLE", "yes")],
            &check,
            "expected true or false",
        ),
        (
            &[on, ("ROS_SECURITY_STRATEGY", "enforce")],
            &check,
            "expected Enforce or Permissive",
        ),
    ];
    for (variables, arguments, expected) in cases {
        let (code, error) = said(variables, arguments);
        assert_eq!(code, Some(2), "{variables:?}: {error}");
        assert_eq!(
            error.trim_end().lines().count(),
            1,
            "{variables:?}: {error}"
        );
        assert!(error.contains(expected), "{variables:?}: {error}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    let (code, warning) = said(&[on], &check);
    assert_eq!(code, Some(0), "{warning}");
    assert!(warning.contains("messages are in the clear"), "{warning}");
}

#[test]
fn bags() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    succeed(folder.path(), &["simulate", "--walk", "--out", "walk.mcap"]);
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
        &["simulate", "--walk", "--out", "walk.mcap"],
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
