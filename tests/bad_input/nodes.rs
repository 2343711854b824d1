//! Parameters of the nodes, and bags.

use std::fs;

use crate::common::succeed;
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
