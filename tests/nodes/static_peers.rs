//! Another DDS implementation on a host that is found by its address.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{in_private_network, is_private};
use cromosim_ros::{Network, Node, NodeOptions, Parameters, Qos, RosArgs};

use crate::common::{python, root, skipped, text};

const HERE: &str = "10.9.8.1";
const THERE: &str = "10.9.8.2";
const LONG: Duration = Duration::from_secs(60);
const MESSAGES: &str = "50";

/// CycloneDDS on the other end of the cable, which looks for this host by its address.
fn configuration(multicast: &str) -> String {
    format!(
        "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='veth1'/></Interfaces>\
         <AllowMulticast>{multicast}</AllowMulticast></General><Discovery>\
         <ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='{HERE}'/></Peers>\
         </Discovery></Domain></CycloneDDS>"
    )
}

fn shell(script: &str) {
    let status = Command::new("bash").args(["-ec", script]).status().unwrap();
    assert!(status.success(), "{script}");
}

/// A listener in a namespace of its own, joined by a cable.
fn listener(python: &std::path::Path, multicast: &str, out: fs::File) -> Child {
    let script = format!(
        "echo here >&2; read; ip link set lo up; ip addr add {THERE}/24 dev veth1; \
         ip link set veth1 up; exec \"$@\""
    );
    let mut child = Command::new("unshare")
        .args(["-n", "bash", "-ec", &script, "listener"])
        .arg(python)
        .arg(root().join("tests/interop/cyclone_listener.py"))
        .args([
            "/imu",
            "--messages",
            MESSAGES,
            "--timeout",
            "60",
            "--any-network",
        ])
        .env("CYCLONEDDS_URI", configuration(multicast))
        .stdin(Stdio::piped())
        .stdout(out)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    said.read_line(&mut line).unwrap();
    assert_eq!(line, "here\n");
    // What it says later has to have somewhere to go.
    std::thread::spawn(move || said.lines().for_each(|line| println!("{line:?}")));
    shell(&format!(
        "ip link add veth0 type veth peer name veth1; ip link set veth1 netns {}; \
         ip addr add {HERE}/24 dev veth0; ip link set veth0 up",
        child.id()
    ));
    writeln!(child.stdin.take().unwrap()).unwrap();
    child
}

#[test]
fn cyclonedds_on_a_named_host_hears_every_message() {
    in_private_network(
        "static_peers::cyclonedds_on_a_named_host_hears_every_message",
        || {
            let Some(python) = python() else { return };
            if !is_private() {
                return skipped("no network namespaces here");
            }
            let folder = tempfile::tempdir().unwrap();
            for multicast in ["false", "true"] {
                let report = folder.path().join("report.json");
                let out = fs::File::create(&report).unwrap();
                let listener = listener(&python, multicast, out);
                let network = Network {
                    peers: vec![THERE.parse().unwrap()],
                    ..Network::default()
                };
                let options = NodeOptions::new("talker", &RosArgs::default(), &Parameters::new());
                let node = Node::start(options.unwrap().network(network)).unwrap();
                let publisher = node.publisher::<Imu>("/imu", Qos::reliable()).unwrap();
                assert!(publisher.wait_for_subscriptions(1, LONG), "{multicast}");
                for _ in 0..MESSAGES.parse().unwrap() {
                    publisher.publish(&Imu::default()).unwrap();
                    std::thread::sleep(Duration::from_millis(10));
                }
                let output = listener.wait_with_output().unwrap();
                let said = fs::read_to_string(&report).unwrap();
                assert!(output.status.success(), "{said}{}", text(&output));
                assert!(said.contains("/talker"), "{said}");
                let _ = Command::new("ip").args(["link", "del", "veth0"]).output();
            }
        },
    );
}
