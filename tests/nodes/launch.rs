//! The launch files under ROS 2's own launch, where there is one. It is on no package index.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use cromosim_bag::BagReader;
use cromosim_ros::testing::{environment, in_private_network};

use crate::common::{CROMOSIM, root, text};

/// A `cromosim` whose viewer only waits for its end, and of which one node dies.
const STAND_IN: &str = r#"#!/bin/bash
[ "$2" = "$DIES" ] && { sleep 2; exit 3; }
[ "$2" = viewer ] && { trap 'exit 0' INT TERM; while :; do sleep 0.1; done; }
exec "$CROMOSIM" "$@"
"#;

fn launch(folder: &Path, file: &str, dies: &str) -> Output {
    let stand_in = folder.join("cromosim");
    fs::write(&stand_in, STAND_IN).unwrap();
    fs::set_permissions(&stand_in, fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var("PATH").unwrap();
    Command::new("python3")
        .arg(root().join("tests/interop/run_launch.py"))
        .arg(root().join("launch_scripts").join(file))
        .env("PATH", format!("{}:{path}", folder.display()))
        .env("CROMOSIM", CROMOSIM)
        .env("DIES", dies)
        .env("ROS_LOG_DIR", folder.join("log"))
        .envs(environment())
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn launches_leave_a_bag_or_end_with_an_error_when_a_node_dies() {
    let there = Command::new("python3")
        .args(["-c", "from launch_ros.actions import Node"])
        .output();
    if !there.is_ok_and(|output| output.status.success()) {
        eprintln!("left out: python3 has no launch_ros of ROS 2");
        return;
    }
    in_private_network(
        "launch::launches_leave_a_bag_or_end_with_an_error_when_a_node_dies",
        || {
            let folder = tempfile::tempdir().unwrap();
            let output = launch(folder.path(), "demo.launch.py", "nobody");
            assert!(output.status.success(), "{}", text(&output));
            BagReader::open(&folder.path().join("cromosim-demo/bag")).unwrap();
            for (file, dies) in [
                ("demo.launch.py", "smpl_state"),
                ("live.launch.py", "replay"),
            ] {
                let folder = tempfile::tempdir().unwrap();
                let output = launch(folder.path(), file, dies);
                assert_eq!(output.status.code(), Some(1), "{file}: {}", text(&output));
                assert!(
                    text(&output).contains(&format!("{dies}-"))
                        && text(&output).contains("has ended with exit code 3"),
                    "{file}: {}",
                    text(&output)
                );
            }
        },
    );
}
