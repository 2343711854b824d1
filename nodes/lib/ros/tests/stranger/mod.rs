//! Another host, joined by a cable, that sends by hand what discovery would not let through. For the
//! tests that say `mod stranger`, in whatever crate.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, UdpSocket};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::{DiscoveryRange, Network, Node, NodeOptions, Parameters, Qos, RosArgs};
use socket2::{Domain, Protocol, Socket, Type};

const HERE: Ipv4Addr = Ipv4Addr::new(10, 9, 8, 1);
const THERE: Ipv4Addr = Ipv4Addr::new(10, 9, 8, 2);
const STRANGER: &str = "CROMOSIM_TEST_STRANGER";

fn shell(script: &str) {
    let status = Command::new("bash").args(["-ec", script]).status().unwrap();
    assert!(status.success(), "{script}");
}

pub fn start(name: &str, range: DiscoveryRange) -> Node {
    let options = NodeOptions::new(name, &RosArgs::default(), &Parameters::new()).unwrap();
    let network = Network {
        range,
        ..Network::default()
    };
    Node::start(options.network(network)).unwrap()
}

/// An UDP datagram as a packet socket sees it.
struct Datagram<'a> {
    from: Ipv4Addr,
    from_port: u16,
    port: u16,
    payload: &'a [u8],
}

/// Without the link's header; none for what is not UDP over IPv4, or a fragment.
fn datagram(packet: &[u8]) -> Option<Datagram<'_>> {
    let address = |at: usize| {
        Some(Ipv4Addr::from(
            <[u8; 4]>::try_from(packet.get(at..at + 4)?).ok()?,
        ))
    };
    let number = |at: usize| Some(u16::from_be_bytes(packet.get(at..at + 2)?.try_into().ok()?));
    let header = 4 * usize::from(packet.first()? & 15);
    let udp = packet.first()? >> 4 == 4 && *packet.get(9)? == 17 && number(6)? & 0x3fff == 0;
    udp.then_some(())?;
    Some(Datagram {
        from: address(12)?,
        from_port: number(header)?,
        port: number(header + 2)?,
        payload: packet.get(header + 8..usize::from(number(2)?))?,
    })
}

/// What the stranger has counted.
#[derive(Default)]
struct Counts {
    /// UDP datagrams of the other host that came over the cable.
    heard: AtomicU64,
    /// Datagrams sent there by hand.
    sent: AtomicU64,
}

/// As if it were meant for whoever gets it: RTPS's INFO_DST submessages name nobody.
fn to_anybody(rtps: &[u8]) -> Vec<u8> {
    const INFO_DST: u8 = 0x0e;
    let mut rtps = rtps.to_vec();
    let mut at = 20;
    while let Some(&[id, flags, a, b]) = rtps.get(at..at + 4) {
        let length = if flags & 1 == 1 {
            u16::from_le_bytes([a, b])
        } else {
            u16::from_be_bytes([a, b])
        };
        if id == INFO_DST && rtps.len() >= at + 16 {
            rtps[at + 4..at + 16].fill(0);
        }
        at += 4 + usize::from(length);
    }
    rtps
}

/// Sends all that the nodes of this host say to each other to the other host's ports.
fn relay(counts: &Counts) {
    const ALL_PROTOCOLS: u16 = 3;
    // Without the links' headers.
    let protocol = Protocol::from(i32::from(ALL_PROTOCOLS.to_be()));
    let mut packets = Socket::new(Domain::PACKET, Type::DGRAM, Some(protocol)).unwrap();
    let hand = UdpSocket::bind((THERE, 0)).unwrap();
    let hand_port = hand.local_addr().unwrap().port();
    let mut buffer = vec![0; 65_536];
    loop {
        let length = packets.read(&mut buffer).unwrap();
        let Some(datagram) = datagram(&buffer[..length]) else {
            continue;
        };
        if datagram.from == HERE {
            counts.heard.fetch_add(1, Ordering::SeqCst);
        } else if datagram.port != hand_port && datagram.from_port != hand_port {
            let rtps = to_anybody(datagram.payload);
            // RTPS's ports of domain 0: multicast, and unicast of the first participants.
            for port in [7400, 7401].into_iter().chain(7410..7418) {
                // Refused while nobody listens there.
                let _ = hand.send_to(&rtps, (HERE, port));
                counts.sent.fetch_add(1, Ordering::SeqCst);
            }
        }
    }
}

/// Not a test: the other host. Publishes on /imu without end, and answers each line of its input
/// with its counts.
#[test]
#[ignore = "run by the other tests"]
fn stranger() {
    if std::env::var_os(STRANGER).is_none() {
        return;
    }
    println!("\nhere");
    let mut lines = std::io::stdin().lines().map(Result::unwrap);
    assert_eq!(lines.next().as_deref(), Some("joined"));
    shell(&format!(
        "ip link set lo up; ip addr add {THERE}/24 dev veth1; ip link set veth1 up; ip route add 224.0.0.0/4 dev veth1"
    ));
    let counts = Arc::new(Counts::default());
    let counting = Arc::clone(&counts);
    std::thread::spawn(move || relay(&counting));
    std::thread::spawn(|| {
        let node = start("stranger", DiscoveryRange::Subnet);
        let publisher = node
            .publisher::<Imu>("/imu", Qos::reliable().depth(1))
            .unwrap();
        loop {
            let _ = publisher.publish(&Imu::default());
            std::thread::sleep(Duration::from_millis(20));
        }
    });
    // Somebody who listens as the other host's node does: what is said to it is what that node
    // would have to hear. Told again and again, since it is told of publishers once.
    std::thread::spawn(|| {
        loop {
            let node = start("listener", DiscoveryRange::Subnet);
            let _subscription = node.subscription::<Imu>("/imu", Qos::reliable()).unwrap();
            std::thread::sleep(Duration::from_secs(2));
        }
    });
    for _ in lines {
        let count = |of: &AtomicU64| of.load(Ordering::SeqCst);
        println!("{} {}", count(&counts.heard), count(&counts.sent));
    }
}

/// Another host; gone when this is dropped.
pub struct Stranger {
    child: Child,
    input: ChildStdin,
    lines: BufReader<ChildStdout>,
}

impl Stranger {
    pub fn join() -> Self {
        let mut child = Command::new("unshare")
            .arg("-n")
            .arg(std::env::current_exe().unwrap())
            .args(["--exact", "stranger::stranger", "--nocapture", "--ignored"])
            .env(STRANGER, "1")
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
            "ip link add veth0 type veth peer name veth1; ip link set veth1 netns {}; \
             ip addr add {HERE}/24 dev veth0; ip link set veth0 up",
            child.id()
        ));
        let input = child.stdin.take().unwrap();
        let mut stranger = Self {
            child,
            input,
            lines,
        };
        writeln!(stranger.input, "joined").unwrap();
        stranger
    }

    /// Datagrams that came there from this host, and those sent here by hand.
    pub fn counts(&mut self) -> (u64, u64) {
        writeln!(self.input, "counts").unwrap();
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        let (heard, sent) = line.trim().split_once(' ').unwrap();
        (heard.parse().unwrap(), sent.parse().unwrap())
    }
}

impl Drop for Stranger {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
