//! From poses to states, frames and IMUs; the shipped parameter files.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_ros::Qos;
use cromosim_ros::testing::in_private_network;

use crate::common::{self, root};
use crate::process::{PATIENCE, Process, observer};

#[test]
fn states_frames_and_imus_follow_poses() {
    in_private_network("chain::states_frames_and_imus_follow_poses", || {
        let folder = tempfile::tempdir().unwrap();
        let node = observer();
        let frames = node
            .subscription::<TFMessage>("/tf", Qos::tf().depth(1000))
            .unwrap();
        let imus = node
            .subscription::<Imu>("/people/imu/head/data", Qos::recorder())
            .unwrap();
        let nodes = [
            Process::start(
                folder.path(),
                &[
                    "node",
                    "virtual_imu",
                    "--ros-args",
                    "-r",
                    "__ns:=/people",
                    "-p",
                    "prefix:=alice",
                    "-p",
                    "rate_hz:=50.0",
                ],
            ),
            Process::start(
                folder.path(),
                &[
                    "node",
                    "smpl_state",
                    "--ros-args",
                    "-r",
                    "__ns:=/people",
                    "-p",
                    "prefix:=alice",
                    "-p",
                    "ready_subscriptions:=1",
                ],
            ),
        ];
        assert!(frames.wait_for_publishers(2, PATIENCE) && imus.wait_for_publishers(1, PATIENCE));
        // A late one gets the static frames all the same.
        let late = node
            .subscription::<TFMessage>("/tf_static", Qos::tf_static())
            .unwrap();
        let base = late.recv_timeout(PATIENCE).unwrap().unwrap().message;
        assert_eq!(base.transforms[0].child_frame_id, "alice/base_link");
        let replay = Process::start(
            folder.path(),
            &[
                "node",
                "replay",
                "--ros-args",
                "-r",
                "__ns:=/people",
                "-p",
                "duration_seconds:=2.0",
                "-p",
                "ready_subscriptions:=1",
            ],
        );
        let imu = imus.recv_timeout(PATIENCE).unwrap().unwrap().message;
        assert_eq!(imu.header.frame_id, "alice/head_imu");
        let mut children = std::collections::BTreeSet::new();
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until && children.len() < 29 {
            if let Some(received) = frames.recv_timeout(Duration::from_secs(1)).unwrap() {
                children.extend(
                    received
                        .message
                        .transforms
                        .into_iter()
                        .map(|edge| (edge.header.frame_id, edge.child_frame_id)),
                );
            }
        }
        let edge = |parent: &str, child: &str| (parent.to_owned(), child.to_owned());
        for expected in [
            edge("world", "alice/pelvis"),
            edge("alice/left_elbow", "alice/left_wrist"),
            edge("alice/head", "alice/head_imu"),
        ] {
            assert!(
                children.contains(&expected),
                "{expected:?} is not in {children:?}"
            );
        }
        drop(replay);
        nodes.into_iter().for_each(Process::interrupt);
    });
}

#[test]
fn shipped_parameter_files_and_scripts_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["replay", "smpl_state", "virtual_imu", "recorder", "viewer"] {
        if name == "viewer" && cfg!(not(feature = "view")) {
            continue;
        }
        let file = root().join("config").join(format!("{name}.yaml"));
        let said = common::succeed(
            folder.path(),
            &[
                "node",
                name,
                "--check-config",
                "--ros-args",
                "--params-file",
                file.to_str().unwrap(),
            ],
        );
        assert!(said.contains("is valid"), "{name}: {said}");
        let help = common::succeed(folder.path(), &["node", name, "--help"]);
        for parameter in fs::read_to_string(&file)
            .unwrap()
            .lines()
            .filter_map(|line| line.strip_prefix("    ")?.split(':').next())
        {
            assert!(
                help.contains(&format!("  {parameter} [")),
                "{name}: --help does not tell of {parameter}"
            );
        }
    }
    assert!(common::succeed(folder.path(), &["node", "--help"]).contains("virtual_imu"));
    let placements: Vec<PathBuf> = fs::read_dir(root().join("config/placements"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    for file in placements {
        let parameter = format!("placements:='{}'", file.display());
        common::succeed(
            folder.path(),
            &[
                "node",
                "virtual_imu",
                "--check-config",
                "--ros-args",
                "-p",
                &parameter,
            ],
        );
    }
    for script in ["demo.sh", "live.sh", "nodes.sh", "people.sh"] {
        assert!(
            Command::new("bash")
                .arg("-n")
                .arg(root().join("launch_scripts").join(script))
                .status()
                .unwrap()
                .success(),
            "{script}"
        );
    }
    for launch in ["demo.launch.py", "live.launch.py"] {
        let compile = "import ast, sys; ast.parse(open(sys.argv[1]).read())";
        let status = Command::new("python3")
            .args(["-c", compile])
            .arg(root().join("launch_scripts").join(launch))
            .status();
        assert!(status.unwrap().success(), "{launch}");
    }
}
