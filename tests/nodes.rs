//! The nodes as processes over DDS, in a private network namespace.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{CROMOSIM, cromosim_in, python, root, skipped, text};
use cromosim_bag::BagReader;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::rosbag2_interfaces as srv;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_ros::testing::{environment, in_private_network, network};
use cromosim_ros::{Node, NodeOptions, Parameters, Qos, RosArgs};

const PATIENCE: Duration = Duration::from_secs(30);

/// A node process; killed when the test ends.
struct Process(Child);

impl Process {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = Command::new(CROMOSIM);
        command
            .args(arguments)
            .current_dir(folder)
            .envs(environment())
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        Self(command.spawn().unwrap())
    }

    fn signal(&self, signal: &str) {
        assert!(
            Command::new("kill")
                .args([signal, &self.0.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
    }

    /// Ends the process as a user would, by SIGINT; it must exit cleanly.
    fn interrupt(mut self) {
        self.signal("-INT");
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            if let Some(status) = self.0.try_wait().unwrap() {
                assert!(status.success(), "{status}");
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("the process did not end on SIGINT");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn observer() -> Node {
    let args = RosArgs::parse(Vec::<String>::new()).unwrap();
    Node::start(
        NodeOptions::new("observer", &args, &Parameters::new())
            .unwrap()
            .network(network()),
    )
    .unwrap()
}

fn demo(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(CROMOSIM);
    let output = command
        .arg("demo")
        .args(arguments)
        .current_dir(folder)
        .envs(environment())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    text(&output)
}

#[test]
fn the_demo_makes_a_bag_and_a_recording() {
    in_private_network("the_demo_makes_a_bag_and_a_recording", || {
        let folder = tempfile::tempdir().unwrap();
        // A foreign subscriber beside the suite's own nodes.
        let listener = python().map(|python| {
            let topics = ["left_wrist", "right_ankle", "pelvis", "sternum", "head"]
                .map(|name| format!("/imu/{name}/data_raw"));
            let out = fs::File::create(folder.path().join("cyclone.json")).unwrap();
            let mut command = Command::new(python);
            command
                .arg(root().join("tests/interop/cyclone_listener.py"))
                .args(["--timeout", "120"])
                .args(topics);
            command
                .envs(environment())
                .stdout(out)
                .stderr(Stdio::inherit())
                .spawn()
                .unwrap()
        });
        let mut extra: Vec<&str> = vec![];
        if cfg!(not(feature = "view")) {
            extra.push("--no-viewer");
        }
        // Two subscriptions of the suite, and the foreign one where there is Python.
        let waits = listener.is_some().then_some(["--listeners", "1"]);
        extra.extend(waits.iter().flatten());
        let said = demo(folder.path(), &extra);
        println!("{said}");
        let out = folder.path().join("cromosim-demo");
        let reader = BagReader::open(&out.join("bag")).unwrap();
        let count = |topic: &str| {
            reader
                .summary()
                .topics
                .iter()
                .find(|counted| counted.topic.name == topic)
                .map_or(0, |counted| counted.message_count)
        };
        let poses = count("/smpl/pose");
        assert_eq!(poses, count("/smpl/state"), "every pose becomes a state");
        assert!(poses >= 1000, "10 s at 100 Hz or more: {poses}");
        for name in ["left_wrist", "right_ankle", "pelvis", "sternum", "head"] {
            let imus = reader
                .read::<Imu>(&format!("/imu/{name}/data_raw"))
                .unwrap();
            // 10 s at 100 Hz, less the delay of the scheme at the end.
            assert!((960..=1002).contains(&imus.len()), "{name}: {}", imus.len());
            for pair in imus.windows(2) {
                let interval = pair[1].1.header.stamp.nanos() - pair[0].1.header.stamp.nanos();
                assert!(
                    (interval - 10_000_000).abs() <= 2,
                    "{name}: stamps stand on a 100 Hz grid, {interval} ns"
                );
            }
            assert!(
                said.contains(&format!("/imu/{name}/data_raw")),
                "the summary names every topic"
            );
        }
        assert!(
            reader.attachment("placements.yaml").is_some(),
            "the recorder keeps the placements"
        );
        assert!(reader.metadata("cromosim").is_some());
        if let (Some(python), Some(listener)) = (python(), listener) {
            check_foreign_readers(
                &python,
                &out,
                listener,
                &folder.path().join("cyclone.json"),
                &reader,
            );
        }
    });
}

fn check_foreign_readers(
    python: &Path,
    out: &Path,
    mut listener: Child,
    report: &Path,
    reader: &BagReader,
) {
    assert!(
        Command::new("kill")
            .args(["-INT", &listener.id().to_string()])
            .status()
            .unwrap()
            .success()
    );
    assert!(
        listener.wait().unwrap().success(),
        "the CycloneDDS subscriber failed"
    );
    let report: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(report).unwrap()).unwrap();
    for name in ["left_wrist", "right_ankle", "pelvis", "sternum", "head"] {
        let topic = format!("/imu/{name}/data_raw");
        let recorded = reader.read::<Imu>(&topic).unwrap().len() as u64;
        let received = report["topics"][&topic]["messages"].as_u64().unwrap();
        assert_eq!(
            received, recorded,
            "{topic}: CycloneDDS receives every message: {report}"
        );
        assert_eq!(
            report["topics"][&topic]["nodes"],
            serde_json::json!(["/virtual_imu"]),
            "node names resolve: {report}"
        );
    }
    let bag = out.join("bag");
    let output = Command::new(python)
        .arg(root().join("tests/interop/check_bag.py"))
        .arg(&bag)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    let Some(rerun) = std::env::var_os("CROMOSIM_RERUN") else {
        return skipped("CROMOSIM_RERUN names no rerun program");
    };
    if cfg!(feature = "view") {
        let output = Command::new(rerun)
            .args(["rrd", "verify"])
            .arg(out.join("demo.rrd"))
            .env("RERUN_ANALYTICS", "false")
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", text(&output));
    }
}

#[test]
fn a_killed_recorder_loses_half_a_second_at_most() {
    in_private_network("a_killed_recorder_loses_half_a_second_at_most", || {
        let folder = tempfile::tempdir().unwrap();
        let recorder = Process::start(
            folder.path(),
            &["node", "recorder", "--ros-args", "-p", "bag_path:=bag"],
        );
        let node = observer();
        let publisher = node
            .publisher::<Imu>("/imu/x/data_raw", Qos::reliable().depth(1000))
            .unwrap();
        assert!(publisher.wait_for_subscriptions(1, PATIENCE));
        let mut imu = Imu::default();
        let begun = Instant::now();
        let mut sent = 0;
        while begun.elapsed() < Duration::from_secs(3) {
            imu.header.stamp.nanosec = sent;
            publisher.publish(&imu).unwrap();
            sent += 1;
            std::thread::sleep(Duration::from_millis(5));
        }
        let in_half_a_second = f64::from(sent) / begun.elapsed().as_secs_f64() * 0.5;
        recorder.signal("-KILL");
        drop(recorder);
        let output = cromosim_in(folder.path(), &["inspect", "bag"]);
        assert_eq!(
            output.status.code(),
            Some(2),
            "an unfinished bag says so: {}",
            text(&output)
        );
        common::succeed(folder.path(), &["bag", "recover", "bag"]);
        let kept = BagReader::open(&folder.path().join("bag_recovered"))
            .unwrap()
            .read::<Imu>("/imu/x/data_raw")
            .unwrap();
        assert!(
            kept.iter()
                .enumerate()
                .all(|(index, (_, imu))| imu.header.stamp.nanosec == index as u32),
            "nothing is missing in the middle"
        );
        let lost = f64::from(sent) - kept.len() as f64;
        assert!(
            lost <= in_half_a_second,
            "{lost} of {sent} lost; half a second are {in_half_a_second}"
        );
    });
}

#[test]
fn a_bag_is_replayed_with_everything_in_it() {
    in_private_network("a_bag_is_replayed_with_everything_in_it", || {
        let folder = tempfile::tempdir().unwrap();
        common::succeed(folder.path(), &["simulate", "--out", "walk.mcap"]);
        let recorded = BagReader::open(&folder.path().join("walk.mcap")).unwrap();
        let node = observer();
        let wrist = node
            .subscription::<Imu>("/imu/left_wrist/data_raw", Qos::recorder().depth(5000))
            .unwrap();
        let states = node
            .subscription::<SmplState>("/smpl/state", Qos::recorder().depth(5000))
            .unwrap();
        let clock = node
            .subscription::<cromosim_msgs::rosgraph_msgs::Clock>("/clock", Qos::clock())
            .unwrap();
        let parameters = [
            "-p",
            "bag:=walk.mcap",
            "-p",
            "rate:=4.0",
            "-p",
            "clock_rate_hz:=50.0",
            "-p",
            "topics:=[/imu/left_wrist/data_raw, /smpl/state]",
            "-p",
            "ready_subscriptions:=1",
        ];
        let replay = Process::start(
            folder.path(),
            &[["node", "replay", "--ros-args"].as_slice(), &parameters].concat(),
        );
        let mut received = Vec::new();
        while let Some(message) = wrist
            .recv_timeout(if received.is_empty() {
                PATIENCE
            } else {
                Duration::from_secs(2)
            })
            .unwrap()
        {
            received.push(message.message);
        }
        let expected: Vec<Imu> = recorded
            .read::<Imu>("/imu/left_wrist/data_raw")
            .unwrap()
            .into_iter()
            .map(|(_, imu)| imu)
            .collect();
        assert_eq!(received.len(), expected.len());
        assert!(
            received == expected,
            "messages come out as they were recorded, stamps included"
        );
        let mut count = 0;
        while states.try_recv().unwrap().is_some() {
            count += 1;
        }
        assert_eq!(
            count,
            recorded.read::<SmplState>("/smpl/state").unwrap().len()
        );
        let last = std::iter::from_fn(|| clock.try_recv().unwrap())
            .last()
            .unwrap()
            .message
            .clock
            .nanos();
        assert!(
            (1_000_000_000..=11_100_000_000).contains(&last),
            "/clock shows the recording's time: {last}"
        );
        drop(replay);
    });
}

#[test]
fn playback_services_pause_step_seek_and_change_the_rate() {
    in_private_network(
        "playback_services_pause_step_seek_and_change_the_rate",
        || {
            let folder = tempfile::tempdir().unwrap();
            let node = observer();
            let poses = node
                .subscription::<SmplPose>("/smpl/pose", Qos::recorder())
                .unwrap();
            let parameters = [
                "-p",
                "start_paused:=true",
                "-p",
                "clock_rate_hz:=10.0",
                "-r",
                "__ns:=/stage",
                "-r",
                "smpl/pose:=/smpl/pose",
            ];
            let replay = Process::start(
                folder.path(),
                &[["node", "replay", "--ros-args"].as_slice(), &parameters].concat(),
            );
            assert!(poses.wait_for_publishers(1, PATIENCE));
            let nothing = || {
                poses
                    .recv_timeout(Duration::from_millis(300))
                    .unwrap()
                    .is_none()
            };
            assert!(nothing(), "it begins paused");
            macro_rules! call {
                ($service:ident, $name:literal, $request:expr) => {{
                    let client = node
                        .client::<srv::$service>(concat!("/stage/replay/", $name))
                        .unwrap();
                    assert!(client.wait_for_service(PATIENCE));
                    client.call(&$request, PATIENCE).unwrap()
                }};
            }
            assert!(call!(IsPaused, "is_paused", srv::IsPausedRequest::default()).paused);
            assert_eq!(
                call!(Burst, "burst", srv::BurstRequest { num_messages: 3 }).actually_burst,
                3
            );
            let stamps: Vec<i64> = (0..3)
                .map(|_| {
                    poses
                        .recv_timeout(PATIENCE)
                        .unwrap()
                        .unwrap()
                        .message
                        .header
                        .stamp
                        .nanos()
                })
                .collect();
            assert_eq!(stamps[0], 1_000_000_000);
            assert!(nothing(), "three and no more");
            let time = cromosim_msgs::builtin_interfaces::Time::from_nanos(6_000_000_000);
            assert!(call!(Seek, "seek", srv::SeekRequest { time }).success);
            let beyond = cromosim_msgs::builtin_interfaces::Time::from_nanos(60_000_000_000);
            assert!(!call!(Seek, "seek", srv::SeekRequest { time: beyond }).success);
            assert!(call!(PlayNext, "play_next", srv::PlayNextRequest::default()).success);
            let after = poses
                .recv_timeout(PATIENCE)
                .unwrap()
                .unwrap()
                .message
                .header
                .stamp
                .nanos();
            assert!((6_000_000_000..6_020_000_000).contains(&after), "{after}");
            assert!(call!(SetRate, "set_rate", srv::SetRateRequest { rate: 5.0 }).success);
            assert!(!call!(SetRate, "set_rate", srv::SetRateRequest { rate: -1.0 }).success);
            assert_eq!(
                call!(GetRate, "get_rate", srv::GetRateRequest::default()).rate,
                5.0
            );
            call!(Resume, "resume", srv::ResumeRequest::default());
            let mut last = 0;
            while let Some(pose) = poses.recv_timeout(Duration::from_secs(3)).unwrap() {
                last = pose.message.header.stamp.nanos();
            }
            assert!(last > 10_900_000_000, "it plays to the end: {last}");
            drop(replay);
        },
    );
}

#[test]
fn states_frames_and_imus_follow_poses() {
    in_private_network("states_frames_and_imus_follow_poses", || {
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
