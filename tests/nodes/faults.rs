//! Nodes whose surroundings fail: a parent that is killed, hasty users, full disks, clocks and
//! late listeners.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use cromosim_bag::BagReader;
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::rosgraph_msgs::Clock;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{environment, in_private_network};
use cromosim_ros::{Node, Publisher, Qos};

use crate::common::{CROMOSIM, skipped, text};
use crate::process::{PATIENCE, Process, observer};

/// Waits until `done`, or fails with `what`.
fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !done() {
        assert!(begun.elapsed() < PATIENCE, "not in time: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Processes that this one has started.
fn children(pid: u32) -> Vec<u32> {
    let path = format!("/proc/{pid}/task/{pid}/children");
    let text = fs::read_to_string(path).unwrap_or_default();
    text.split_whitespace()
        .map(|pid| pid.parse().unwrap())
        .collect()
}

/// Whether a process runs; one that nobody has waited for does not.
fn runs(pid: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{pid}/stat"));
    // The state stands behind the name in brackets.
    status.is_ok_and(|text| !text.rsplit(") ").next().unwrap().starts_with('Z'))
}

#[test]
fn nodes_end_with_the_demo_that_started_them() {
    in_private_network("faults::nodes_end_with_the_demo_that_started_them", || {
        let folder = tempfile::tempdir().unwrap();
        let mut demo = Command::new(CROMOSIM)
            .args(["demo", "--no-viewer"])
            .current_dir(folder.path())
            .envs(environment())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let node = observer();
        let imus = node
            .subscription::<Imu>("/imu/head/data_raw", Qos::recorder())
            .unwrap();
        // In the middle of the motion.
        assert!(imus.recv_timeout(PATIENCE).unwrap().is_some());
        let nodes = children(demo.id());
        assert_eq!(nodes.len(), 4, "{nodes:?}");
        demo.kill().unwrap();
        demo.wait().unwrap();
        wait_until("nodes end", || !nodes.iter().any(|&pid| runs(pid)));
        BagReader::open(&folder.path().join("cromosim-demo/bag")).unwrap();
    });
}

/// A publisher of many messages, to which a recorder listens.
fn recorded(node: &Node, folder: &Path, name: &str) -> (Process, Publisher<Imu>) {
    let recorder = Process::start(
        folder,
        &[
            "node",
            "recorder",
            "--ros-args",
            "-p",
            &format!("bag_path:={name}"),
        ],
    );
    let publisher = node
        .publisher::<Imu>("/imu/x/data_raw", Qos::reliable().depth(1000))
        .unwrap();
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    (recorder, publisher)
}

#[test]
fn who_is_told_to_end_again_and_again_still_closes_its_bag() {
    in_private_network(
        "faults::who_is_told_to_end_again_and_again_still_closes_its_bag",
        || {
            let folder = tempfile::tempdir().unwrap();
            let node = observer();
            for round in 0..4 {
                let name = format!("bag{round}");
                let (recorder, publisher) = recorded(&node, folder.path(), &name);
                for _ in 0..100 {
                    publisher.publish(&Imu::default()).unwrap();
                }
                // The terminal's and launch's, and a user who does not wait; as long as it ends.
                // And here one child ends while another starts: this process, too, is signalled.
                for signal in ["-INT", "-INT", "-TERM", "-INT"] {
                    recorder.signal(signal);
                    std::thread::sleep(Duration::from_millis(3 * round));
                }
                recorder.interrupt();
                BagReader::open(&folder.path().join(&name)).unwrap();
            }
        },
    );
}

#[test]
fn a_node_that_was_stopped_and_continued_goes_on() {
    in_private_network(
        "faults::a_node_that_was_stopped_and_continued_goes_on",
        || {
            let folder = tempfile::tempdir().unwrap();
            let node = observer();
            let (recorder, publisher) = recorded(&node, folder.path(), "bag");
            // Ctrl-Z and `fg`, more than once.
            for _ in 0..3 {
                for signal in ["-STOP", "-CONT"] {
                    std::thread::sleep(Duration::from_millis(50));
                    recorder.signal(signal);
                }
                publisher.publish(&Imu::default()).unwrap();
                assert!(publisher.wait_for_acknowledgments(PATIENCE));
            }
            recorder.interrupt();
            let bag = BagReader::open(&folder.path().join("bag")).unwrap();
            let counts = bag.summary().topics.iter().map(|topic| topic.message_count);
            assert_eq!(counts.sum::<u64>(), 3);
        },
    );
}

/// A small file system of its own at `folder/small`, seen by this process's children alone; none
/// where that is not allowed.
fn on_a_small_disk(folder: &Path, arguments: &[&str]) -> Option<Command> {
    fs::create_dir(folder.join("small")).unwrap();
    let mount = "mount -t tmpfs -o size=400k small small";
    let allowed = Command::new("unshare")
        .args(["-m", "bash", "-c", mount])
        .current_dir(folder)
        .status()
        .is_ok_and(|status| status.success());
    allowed.then(|| {
        let mut command = Command::new("unshare");
        command
            .args([
                "-m",
                "bash",
                "-c",
                &format!("{mount} && exec \"$0\" \"$@\""),
                CROMOSIM,
            ])
            .args(arguments)
            .current_dir(folder)
            .envs(environment());
        command
    })
}

#[test]
fn a_demo_whose_disk_is_full_says_so_at_once() {
    in_private_network("faults::a_demo_whose_disk_is_full_says_so_at_once", || {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["demo", "--no-viewer", "--out", "small/demo"];
        let Some(mut demo) = on_a_small_disk(folder.path(), &arguments) else {
            return skipped("no mount namespaces here");
        };
        let output = demo.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        assert!(
            said.contains("recorder") && said.contains("No space left"),
            "{said}"
        );
    });
}

#[test]
fn the_recorder_follows_the_clock_and_a_bags_clock_is_not_played_beside_a_new_one() {
    in_private_network(
        "faults::the_recorder_follows_the_clock_and_a_bags_clock_is_not_played_beside_a_new_one",
        || {
            let folder = tempfile::tempdir().unwrap();
            let run = |bag: &str, parameters: &[&str]| {
                let bag = format!("bag_path:={bag}");
                let recorder = ["node", "recorder", "--ros-args", "-p", "use_sim_time:=true"];
                let recorder = Process::start(
                    folder.path(),
                    &[recorder.as_slice(), &["-p", bag.as_str()]].concat(),
                );
                let replay = ["node", "replay", "--ros-args", "-p", "clock_rate_hz:=50.0"];
                let options = ["-p", "duration_seconds:=2.0"];
                let output = Command::new(CROMOSIM)
                    .args([replay.as_slice(), &options, parameters].concat())
                    .current_dir(folder.path())
                    .envs(environment())
                    .output()
                    .unwrap();
                assert!(output.status.success(), "{}", text(&output));
                recorder.interrupt();
            };
            run("first", &[]);
            run("second", &["-p", "bag:=first"]);
            for name in ["first", "second"] {
                let bag = BagReader::open(&folder.path().join(name)).unwrap();
                let (first, last) = bag.summary().time_range.unwrap();
                // The embedded walk begins at 1 s.
                assert!(
                    first.as_seconds() >= 1.0 && last.as_seconds() < 4.0,
                    "{name}: {first:?} to {last:?}"
                );
                let clock = bag.read::<Clock>("/clock").unwrap();
                assert!(clock.len() > 50, "{name}: {} ticks", clock.len());
                let backward = clock
                    .windows(2)
                    .filter(|pair| pair[1].1.clock.nanos() < pair[0].1.clock.nanos());
                assert_eq!(backward.count(), 0, "{name}");
            }
        },
    );
}

#[test]
fn a_replay_waits_for_those_who_listen_and_begins_without_them_in_the_end() {
    in_private_network(
        "faults::a_replay_waits_for_those_who_listen_and_begins_without_them_in_the_end",
        || {
            let folder = tempfile::tempdir().unwrap();
            let replay = |parameters: &[&str]| {
                let mut command = Command::new(CROMOSIM);
                command
                    .args([
                        "node",
                        "replay",
                        "--ros-args",
                        "-p",
                        "duration_seconds:=1.0",
                    ])
                    .args(parameters)
                    .current_dir(folder.path())
                    .envs(environment())
                    .stdout(Stdio::null())
                    .stderr(Stdio::piped());
                command.spawn().unwrap()
            };
            let (node, begun) = (observer(), Instant::now());
            let alone = replay(&["-p", "ready_timeout_seconds:=1.0"]);
            let output = alone.wait_with_output().unwrap();
            let said = text(&output);
            assert!(output.status.success(), "{said}");
            assert!(begun.elapsed() > Duration::from_secs(2), "{said}");
            assert!(
                said.contains("waits") && said.contains("nobody listens"),
                "{said}"
            );

            let waiting = replay(&["-p", "ready_timeout_seconds:=30.0"]);
            std::thread::sleep(Duration::from_secs(2));
            let poses = node
                .subscription::<SmplPose>("/smpl/pose", Qos::recorder())
                .unwrap();
            let output = waiting.wait_with_output().unwrap();
            assert!(output.status.success(), "{}", text(&output));
            let received = std::iter::from_fn(|| poses.try_recv().unwrap());
            let frames: Vec<i64> = received
                .map(|pose| pose.message.header.stamp.nanos())
                .collect();
            // The embedded walk has 100 frames a second or more.
            let span = frames.last().unwrap() - frames[0];
            assert!(
                (990_000_000..=1_000_000_000).contains(&span) && frames.len() >= 100,
                "{} frames over {span} ns",
                frames.len()
            );
        },
    );
}
