//! Nodes that find each other by `ROS_STATIC_PEERS`, over a cable that no multicast passes.
#![allow(clippy::unwrap_used)]

use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, UdpSocket};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{in_private_network, is_private};
use cromosim_ros::{DiscoveryRange, Network, Node, NodeOptions, Parameters, Qos, RosArgs};

const HERE: Ipv4Addr = Ipv4Addr::new(10, 9, 8, 1);
const THERE: Ipv4Addr = Ipv4Addr::new(10, 9, 8, 2);
/// An address that no host has.
const NOBODY: Ipv4Addr = Ipv4Addr::new(10, 9, 8, 9);
const OTHER_HOST: &str = "CROMOSIM_TEST_OTHER_HOST";
const LONG: Duration = Duration::from_secs(40);
/// For announcements, which must not come by multicast.
const AT_LEAST: Duration = Duration::from_secs(2);
/// For messages that must not come.
const QUIET: Duration = Duration::from_secs(4);

fn shell(script: &str) {
    let status = Command::new("bash").args(["-ec", script]).status().unwrap();
    assert!(status.success(), "{script}");
}

/// A node with the network of the environment.
fn options(name: &str) -> NodeOptions {
    NodeOptions::new(name, &RosArgs::default(), &Parameters::new()).unwrap()
}

/// Not a test: the other host. Publishes on /there, and answers each line of its input with how many
/// messages of /here it has heard, and how many multicast datagrams of the other host.
#[test]
#[ignore = "run by the other test"]
fn other_host() {
    if std::env::var_os(OTHER_HOST).is_none() {
        return;
    }
    println!("\nhere");
    let mut lines = std::io::stdin().lines().map(Result::unwrap);
    assert_eq!(lines.next().as_deref(), Some("joined"));
    shell(&format!(
        "ip link set lo up; ip addr add {THERE}/24 dev veth1; ip link set veth1 up"
    ));
    let heard = Arc::new(AtomicU64::new(0));
    let multicast = Arc::new(AtomicU64::new(0));
    let (counting, announced) = (Arc::clone(&heard), Arc::clone(&multicast));
    // RTPS's announcements of domain 0; made before the node, which does not use the port.
    let socket = UdpSocket::bind("0.0.0.0:7400").unwrap();
    let group = Ipv4Addr::new(239, 255, 0, 1);
    socket.join_multicast_v4(&group, &THERE).unwrap();
    std::thread::spawn(move || {
        while let Ok((_, from)) = socket.recv_from(&mut [0; 65_536]) {
            announced.fetch_add(u64::from(from.ip() == HERE), Ordering::SeqCst);
        }
    });
    std::thread::spawn(move || {
        let node = Node::start(options("there")).unwrap();
        let subscription = node.subscription::<Imu>("/here", Qos::reliable()).unwrap();
        let publisher = node.publisher::<Imu>("/there", Qos::reliable()).unwrap();
        loop {
            publisher.publish(&Imu::default()).unwrap();
            let message = subscription.recv_timeout(Duration::from_millis(20));
            counting.fetch_add(u64::from(message.unwrap().is_some()), Ordering::SeqCst);
        }
    });
    for _ in lines {
        let count = |of: &AtomicU64| of.load(Ordering::SeqCst);
        println!("{} {}", count(&heard), count(&multicast));
    }
}

/// Another host with a node; gone when this is dropped.
struct OtherHost {
    child: Child,
    input: ChildStdin,
    lines: BufReader<ChildStdout>,
}

impl OtherHost {
    /// Its node looks so far, and at these peers; `multicast` is what the cable's devices say of
    /// themselves.
    fn join(range: &str, peers: &str, multicast: &str) -> Self {
        let mut child = Command::new("unshare")
            .arg("-n")
            .arg(std::env::current_exe().unwrap())
            .args(["--exact", "other_host", "--nocapture", "--ignored"])
            .env(OTHER_HOST, "1")
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", range)
            .env("ROS_STATIC_PEERS", peers)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        while line != "here\n" {
            line.clear();
            assert!(lines.read_line(&mut line).unwrap() > 0, "no other host");
        }
        shell(&format!(
            "ip link add veth0 type veth peer name veth1; ip link set veth0 multicast {multicast}; \
             ip link set veth1 multicast {multicast}; ip link set veth1 netns {}; \
             ip addr add {HERE}/24 dev veth0; ip link set veth0 up",
            child.id()
        ));
        let mut input = child.stdin.take().unwrap();
        writeln!(input, "joined").unwrap();
        Self {
            child,
            input,
            lines,
        }
    }

    /// Messages of /here that it heard, and multicast datagrams.
    fn counts(&mut self) -> (u64, u64) {
        writeln!(self.input, "counts").unwrap();
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        let (heard, multicast) = line.trim().split_once(' ').unwrap();
        (heard.parse().unwrap(), multicast.parse().unwrap())
    }
}

impl Drop for OtherHost {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        // The namespace and its end of the cable go with the process, the kernel takes its time.
        let _ = Command::new("ip").args(["link", "del", "veth0"]).status();
    }
}

/// What crossed to and from a node in this network: messages of /there here, those of /here
/// there, multicast datagrams there. Until 20 of each have, or for so long.
fn exchange(network: Network, other: &mut OtherHost, at_most: Duration) -> (u64, u64, u64) {
    let node = Node::start(options("here").network(network)).unwrap();
    let subscription = node.subscription::<Imu>("/there", Qos::reliable()).unwrap();
    let publisher = node.publisher::<Imu>("/here", Qos::reliable()).unwrap();
    let (mut here, begun) = (0, Instant::now());
    loop {
        publisher.publish(&Imu::default()).unwrap();
        let message = subscription.recv_timeout(Duration::from_millis(20));
        here += u64::from(message.unwrap().is_some());
        let (there, multicast) = other.counts();
        let lasted = begun.elapsed();
        if here >= 20 && there >= 20 && lasted > AT_LEAST || lasted > at_most {
            println!("after {lasted:?}: {here} here, {there} there, {multicast} by multicast");
            return (here, there, multicast);
        }
    }
}

#[test]
fn named_hosts_find_each_other_without_multicast_and_others_do_not() {
    in_private_network(
        "named_hosts_find_each_other_without_multicast_and_others_do_not",
        || {
            if !is_private() {
                println!("skipped: no network namespaces here");
                return;
            }
            let naming = |peers: &[Ipv4Addr]| Network {
                peers: peers.to_vec(),
                ..Network::default()
            };
            for multicast in ["off", "on"] {
                let peers = format!("{NOBODY}; {HERE}");
                let mut other = OtherHost::join("LOCALHOST", &peers, multicast);
                let (here, there, announced) = exchange(naming(&[NOBODY, THERE]), &mut other, LONG);
                assert!(here >= 20 && there >= 20, "{here}, {there}");
                assert_eq!(announced, 0, "multicast {multicast}");
            }
            // Whom only one side names is not heard by the other.
            for (named_there, named_here) in [(NOBODY, THERE), (HERE, NOBODY)] {
                let mut other = OtherHost::join("LOCALHOST", &named_there.to_string(), "off");
                let (here, there, _) = exchange(naming(&[named_here]), &mut other, QUIET);
                assert_eq!((here, there), (0, 0));
            }
            // Those who look in the network find named hosts alone as well.
            for (named_there, named_here) in [(HERE, THERE), (NOBODY, NOBODY)] {
                let mut other = OtherHost::join("SUBNET", &named_there.to_string(), "on");
                let network = Network {
                    range: DiscoveryRange::Subnet,
                    ..naming(&[named_here])
                };
                let crosses = named_there == HERE;
                let at_most = if crosses { LONG } else { QUIET };
                let (here, there, announced) = exchange(network, &mut other, at_most);
                assert_eq!(here >= 20 && there >= 20, crosses, "{here}, {there}");
                assert_eq!(announced, 0);
            }
        },
    );
}
