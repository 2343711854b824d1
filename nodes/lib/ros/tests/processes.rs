//! Many processes, a killed one, and what leaves the machine.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{in_private_network, is_private, network};
use cromosim_ros::{
    DiscoveryRange, Network, Node, NodeOptions, Parameters, Qos, RosArgs, Shutdown,
};

const LONG: Duration = Duration::from_secs(30);
const NAME: &str = "CROMOSIM_TEST_CHILD";

fn start(name: &str, network: Network) -> Node {
    let args = RosArgs::default();
    Node::start(
        NodeOptions::new(name, &args, &Parameters::new())
            .unwrap()
            .network(network),
    )
    .unwrap()
}

/// Not a test: a node in a process of its own. It publishes on /imu until it is told to end, and
/// says which nodes it sees.
#[test]
#[ignore = "run by the other tests"]
fn child() {
    let Some(name) = std::env::var(NAME).ok() else {
        return;
    };
    let domain_id = std::env::var("ROS_DOMAIN_ID")
        .ok()
        .and_then(|id| id.parse().ok())
        .unwrap();
    let args = RosArgs::default();
    let options = NodeOptions::new(&name, &args, &Parameters::new()).unwrap();
    let shutdown = Shutdown::on_signals().unwrap();
    let node = Node::start(
        options
            .network(Network {
                domain_id,
                ..Network::default()
            })
            .shutdown(&shutdown),
    )
    .unwrap();
    let publisher = node.publisher::<Imu>("/imu", Qos::reliable()).unwrap();
    let peers: usize = std::env::var("CROMOSIM_TEST_PEERS")
        .unwrap()
        .parse()
        .unwrap();
    node.wait_for_graph(LONG, || node.nodes().len() >= peers);
    println!("sees {}", node.nodes().len());
    while !shutdown.is_requested() {
        publisher.publish(&Imu::default()).unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }
    println!("ends");
}

struct Process {
    child: Child,
    lines: BufReader<ChildStdout>,
}

impl Process {
    fn start(name: &str, peers: usize) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "child", "--nocapture", "--ignored"])
            .env(NAME, name)
            .env("CROMOSIM_TEST_PEERS", peers.to_string())
            .env("ROS_DOMAIN_ID", network().domain_id.to_string())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Self { child, lines }
    }

    fn wait_for_line(&mut self, start: &str) -> String {
        self.lines
            .by_ref()
            .lines()
            .map(Result::unwrap)
            .find(|line| line.starts_with(start))
            .unwrap()
    }

    fn terminate(&mut self) {
        let status = Command::new("kill")
            .arg(self.child.id().to_string())
            .status()
            .unwrap();
        assert!(status.success());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn fourteen_processes_find_each_other_and_end_on_sigterm() {
    in_private_network(
        "fourteen_processes_find_each_other_and_end_on_sigterm",
        || {
            const COUNT: usize = 14;
            let mut processes: Vec<Process> = (0..COUNT)
                .map(|index| Process::start(&format!("node_{index}"), COUNT))
                .collect();
            for process in &mut processes {
                assert_eq!(process.wait_for_line("sees"), format!("sees {COUNT}"));
            }
            processes.iter_mut().for_each(Process::terminate);
            for process in &mut processes {
                process.wait_for_line("ends");
                assert!(process.child.wait().unwrap().success());
            }
        },
    );
}

#[test]
fn a_killed_publisher_is_matched_again_after_its_restart() {
    in_private_network(
        "a_killed_publisher_is_matched_again_after_its_restart",
        || {
            let node = start("listener", network());
            let subscription = node.subscription::<Imu>("/imu", Qos::reliable()).unwrap();
            let mut seen = BTreeSet::new();
            for life in 0..3 {
                let mut talker = Process::start("talker", 1);
                let started = Instant::now();
                let publisher = loop {
                    assert!(started.elapsed() < LONG, "life {life}: nothing received");
                    let received = subscription.recv_timeout(Duration::from_secs(1)).unwrap();
                    if let Some(received) =
                        received.filter(|received| !seen.contains(&received.publisher))
                    {
                        break received.publisher;
                    }
                };
                seen.insert(publisher);
                assert!(node.wait_for_graph(LONG, || {
                    node.publishers()
                        .iter()
                        .any(|p| p.gid == publisher && p.node.is_some())
                }));
                talker.child.kill().unwrap();
                talker.child.wait().unwrap();
            }
            assert_eq!(seen.len(), 3);
        },
    );
}

/// Packets sent on an interface since it came up.
fn sent(interface: &str) -> u64 {
    std::fs::read_to_string(format!("/sys/class/net/{interface}/statistics/tx_packets"))
        .unwrap()
        .trim()
        .parse()
        .unwrap()
}

#[test]
fn localhost_sends_nothing_on_other_interfaces_and_subnet_does() {
    in_private_network(
        "localhost_sends_nothing_on_other_interfaces_and_subnet_does",
        || {
            const PAIR: &str = "ip link add veth0 type veth peer name veth1 && ip addr add 10.9.8.1/24 dev veth0 && ip link set veth0 up && \
                            ip link set veth1 up && mount -t sysfs sysfs /sys";
            // /sys shows the interfaces of the namespace it was mounted in: mount it anew, in a
            // mount namespace of this test.
            if !is_private() || std::env::var_os("CROMOSIM_OWN_SYSFS").is_none() {
                let nested = is_private().then(|| {
                    Command::new("unshare")
                        .args(["-m", "bash", "-c", &format!("{PAIR} && exec \"$0\" \"$@\"")])
                        .arg(std::env::current_exe().unwrap())
                        .args([
                            "--exact",
                            "localhost_sends_nothing_on_other_interfaces_and_subnet_does",
                            "--nocapture",
                        ])
                        .env("CROMOSIM_OWN_SYSFS", "1")
                        .status()
                });
                match nested {
                    Some(Ok(status)) => assert!(status.success()),
                    _ => println!("skipped: no private network namespace with an own /sys"),
                }
                return;
            }
            // The kernel's own neighbour and multicast reports come in the first seconds.
            std::thread::sleep(Duration::from_secs(2));
            let exchange = |range| {
                let before = sent("veth0");
                let network = Network {
                    range,
                    ..Network::default()
                };
                let talker = start("talker", network.clone());
                let listener = start("listener", network);
                let publisher = talker.publisher::<Imu>("/imu", Qos::reliable()).unwrap();
                let subscription = listener
                    .subscription::<Imu>("/imu", Qos::reliable())
                    .unwrap();
                let matched = publisher.wait_for_subscriptions(
                    1,
                    if range == DiscoveryRange::Off {
                        Duration::from_secs(2)
                    } else {
                        LONG
                    },
                );
                publisher.publish(&Imu::default()).unwrap();
                let received = matched && subscription.recv_timeout(LONG).unwrap().is_some();
                (received, sent("veth0") - before)
            };
            let (received, packets) = exchange(DiscoveryRange::Localhost);
            println!("LOCALHOST: {packets} packets on veth0");
            assert!(received && packets <= 2, "{packets} packets");
            let (received, packets) = exchange(DiscoveryRange::Off);
            println!("OFF: {packets} packets on veth0, received: {received}");
            assert!(!received && packets <= 2, "{packets} packets");
            let (received, packets) = exchange(DiscoveryRange::Subnet);
            println!("SUBNET: {packets} packets on veth0");
            assert!(received && packets >= 5, "{packets} packets");
        },
    );
}
