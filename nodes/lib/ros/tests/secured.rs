//! Secured nodes hear each other, plain ones hear nothing of them, and they nothing of plain ones.
#![cfg(feature = "security")]
#![allow(clippy::unwrap_used)]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cromosim_msgs::std_msgs::String as Text;
use cromosim_ros::testing::{in_private_network, is_private, network};
use cromosim_ros::{
    Node, NodeOptions, Parameters, Publisher, Qos, RosArgs, Security, Subscription,
};

const LONG: Duration = Duration::from_secs(30);

/// A keystore as `ros2 security create_keystore` and `create_enclave` make it, by OpenSSL's
/// command line; CROMOSIM_KEYSTORE names one that ROS made, with these enclaves.
fn keystore(folder: &Path) -> PathBuf {
    if let Some(made) = std::env::var_os("CROMOSIM_KEYSTORE") {
        return made.into();
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/keystore.sh");
    let output = Command::new("bash")
        .args([script, "keystore", "/talker", "/listener"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    folder.join("keystore")
}

fn start(name: &str, security: Security) -> Node {
    let mut options = NodeOptions::new(name, &RosArgs::default(), &Parameters::new()).unwrap();
    options.security = security;
    Node::start(options.network(network())).unwrap()
}

/// What a subscription hears while each publisher sends texts of all lengths, for a while.
fn heard(publisher: &Publisher<Text>, subscription: &Subscription<Text>) -> Vec<String> {
    let mut heard = Vec::new();
    for length in 0..40 {
        let data = "x".repeat(length);
        publisher.publish(&Text { data }).unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }
    let until = Instant::now() + Duration::from_secs(2);
    while Instant::now() < until {
        let message = subscription
            .recv_timeout(Duration::from_millis(100))
            .unwrap();
        heard.extend(message.map(|received| received.message.data));
    }
    heard
}

#[test]
fn secured_nodes_hear_each_other_and_plain_ones_nothing() {
    in_private_network(
        "secured_nodes_hear_each_other_and_plain_ones_nothing",
        || {
            if !is_private() {
                println!("skipped: no network namespaces here");
                return;
            }
            let folder = tempfile::tempdir().unwrap();
            let keystore = keystore(folder.path());
            let enclave = |name: &str| Security::Enclave(keystore.join("enclaves").join(name));
            let qos = Qos::reliable().depth(100);
            let talker = start("talker", enclave("talker"));
            let publisher = talker.publisher::<Text>("/text", qos).unwrap();
            let plain_talker = start("plain_talker", Security::Clear);
            let plain_publisher = plain_talker.publisher::<Text>("/text", qos).unwrap();
            let listener = start("listener", enclave("listener"));
            let subscription = listener.subscription::<Text>("/text", qos).unwrap();
            let plain_listener = start("plain_listener", Security::Clear);
            let plain_subscription = plain_listener.subscription::<Text>("/text", qos).unwrap();

            assert!(publisher.wait_for_subscriptions(1, LONG), "no secured peer");
            assert!(
                plain_publisher.wait_for_subscriptions(1, LONG),
                "no plain peer"
            );
            let sent: Vec<String> = (0..40).map(|length| "x".repeat(length)).collect();
            assert_eq!(heard(&publisher, &subscription), sent);
            assert_eq!(heard(&publisher, &plain_subscription), [""; 0]);
            assert_eq!(heard(&plain_publisher, &plain_subscription), sent);
            let secured = heard(&plain_publisher, &subscription);
            // What the secured talker sent meanwhile to the plain subscription's deaf ears.
            assert_eq!(
                secured, sent,
                "of the secured talker, once, and none of the plain one"
            );
        },
    );
}

/// A participant of Fast DDS, which CROMOSIM_FASTDDS_PEER names (tests/interop/fastdds_peer.cpp).
struct FastDds(Child);

impl FastDds {
    /// `enclave`: its folder, or - for the clear.
    fn start(peer: &Path, does: &str, enclave: &Path) -> Self {
        let mut command = Command::new(peer);
        command.arg(does).arg(enclave);
        let streams = command.stdin(Stdio::piped()).stdout(Stdio::piped());
        Self(streams.spawn().unwrap())
    }

    /// Ends it; the lengths of the texts that it heard.
    fn lengths(mut self) -> Vec<usize> {
        drop(self.0.stdin.take());
        let lines = BufReader::new(self.0.stdout.take().unwrap()).lines();
        let lengths = lines.map(|line| line.unwrap().parse().unwrap()).collect();
        assert!(self.0.wait().unwrap().success());
        lengths
    }
}

impl Drop for FastDds {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What comes until there is nothing for two seconds.
fn all_of(subscription: &Subscription<Text>) -> Vec<usize> {
    let mut lengths = Vec::new();
    let mut patience = LONG;
    while let Some(received) = subscription.recv_timeout(patience).unwrap() {
        lengths.push(received.message.data.len());
        patience = Duration::from_secs(2);
    }
    lengths
}

#[test]
fn fast_dds_and_secured_nodes_hear_each_other() {
    let Some(peer) = std::env::var_os("CROMOSIM_FASTDDS_PEER").map(PathBuf::from) else {
        println!("skipped: CROMOSIM_FASTDDS_PEER names no Fast DDS peer");
        return;
    };
    in_private_network("fast_dds_and_secured_nodes_hear_each_other", || {
        if !is_private() {
            println!("skipped: no network namespaces here");
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let keystore = keystore(folder.path());
        let folder_of = |name: &str| keystore.join("enclaves").join(name);
        let clear = Path::new("-");
        let qos = Qos::reliable().depth(100);

        let talker = start("talker", Security::Enclave(folder_of("talker")));
        let publisher = talker.publisher::<Text>("/text", qos).unwrap();
        let secured = FastDds::start(&peer, "hear", &folder_of("listener"));
        let plain = FastDds::start(&peer, "hear", clear);
        assert!(publisher.wait_for_subscriptions(1, LONG), "no secured peer");
        for length in 0..40 {
            let data = "x".repeat(length);
            publisher.publish(&Text { data }).unwrap();
        }
        std::thread::sleep(Duration::from_secs(2));
        assert_eq!(secured.lengths(), (0..40).collect::<Vec<_>>());
        assert_eq!(plain.lengths(), [0; 0]);
        drop((publisher, talker));

        let listener = start("listener", Security::Enclave(folder_of("listener")));
        let subscription = listener.subscription::<Text>("/text", qos).unwrap();
        let plain = FastDds::start(&peer, "say", clear);
        let secured = FastDds::start(&peer, "say", &folder_of("talker"));
        let sent: Vec<usize> = (3..160).step_by(4).collect();
        assert_eq!(all_of(&subscription), sent, "of the secured one, and once");
        drop((plain, secured));
    });
}
