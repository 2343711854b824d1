//! Topics over DDS: loss, late subscriptions, remaps, bytes, restarts, many participants.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{in_private_network, network};
use cromosim_ros::{Node, NodeOptions, Parameters, Qos, RawMessage, RosArgs};

const LONG: Duration = Duration::from_secs(20);

fn node(name: &str, line: &[&str]) -> Node {
    let args = RosArgs::parse(std::iter::once("--ros-args").chain(line.iter().copied())).unwrap();
    Node::start(
        NodeOptions::new(name, &args, &Parameters::new())
            .unwrap()
            .network(network()),
    )
    .unwrap()
}

fn imu(index: usize) -> Imu {
    let mut imu = Imu::default();
    imu.header.frame_id = format!("sensor_{index}");
    imu.linear_acceleration.z = index as f64;
    imu
}

#[test]
fn two_thousand_messages_arrive_typed_and_raw() {
    in_private_network("two_thousand_messages_arrive_typed_and_raw", || {
        const COUNT: usize = 2000;
        let (talker, listener) = (node("talker", &[]), node("listener", &[]));
        let publisher = talker.publisher::<Imu>("imu", Qos::reliable()).unwrap();
        let typed = listener
            .subscription::<Imu>("imu", Qos::recorder().depth(COUNT as u32))
            .unwrap();
        let recorder = node("recorder", &[]);
        let raw = recorder
            .raw_subscription("imu", Imu::TYPE_NAME, Qos::recorder().depth(COUNT as u32))
            .unwrap();
        assert!(publisher.wait_for_subscriptions(2, LONG));
        let sender = std::thread::spawn(move || {
            (0..COUNT).for_each(|index| publisher.publish(&imu(index)).unwrap());
            publisher.wait_for_acknowledgments(LONG)
        });
        for index in 0..COUNT {
            let received = typed
                .recv_timeout(LONG)
                .unwrap()
                .unwrap_or_else(|| panic!("only {index} typed messages"));
            assert_eq!(received.message, imu(index));
            assert_eq!(received.sequence_number, index as i64 + 1);
            let source = received.source_stamp.unwrap();
            assert!(source <= received.received_stamp && received.received_stamp - source < 60.0);
        }
        for index in 0..COUNT {
            let received = raw.recv_timeout(LONG).unwrap().unwrap_or_else(|| {
                panic!(
                    "only {index} raw messages; then {:?}; acked {}",
                    raw.try_recv().map(|m| m.map(|m| m.sequence_number)),
                    sender.is_finished()
                )
            });
            assert_eq!(received.message, RawMessage::encode(&imu(index)).unwrap());
        }
        assert!(sender.join().unwrap());
        assert!(
            typed
                .recv_timeout(Duration::from_millis(50))
                .unwrap()
                .is_none()
        );
    });
}

#[test]
fn raw_messages_are_published_as_they_are() {
    in_private_network("raw_messages_are_published_as_they_are", || {
        let (talker, listener) = (node("talker", &[]), node("listener", &[]));
        let publisher = talker
            .raw_publisher("imu", Imu::TYPE_NAME, Qos::reliable())
            .unwrap();
        let subscription = listener
            .subscription::<Imu>("imu", Qos::reliable())
            .unwrap();
        assert!(
            publisher.wait_for_subscriptions(1, LONG) && subscription.wait_for_publishers(1, LONG)
        );
        publisher
            .publish(RawMessage::encode(&imu(7)).unwrap())
            .unwrap();
        assert_eq!(
            subscription.recv_timeout(LONG).unwrap().unwrap().message,
            imu(7)
        );
        let big_endian = RawMessage::from_cdr(vec![0, 0, 0, 0, 1]).unwrap();
        assert!(publisher.publish(big_endian).is_err());
    });
}

#[test]
fn a_late_subscription_gets_transient_local_messages_only() {
    in_private_network(
        "a_late_subscription_gets_transient_local_messages_only",
        || {
            let talker = node("talker", &[]);
            let kept = talker.publisher::<Imu>("kept", Qos::tf_static()).unwrap();
            let gone = talker.publisher::<Imu>("gone", Qos::reliable()).unwrap();
            kept.publish(&imu(1)).unwrap();
            gone.publish(&imu(1)).unwrap();
            let listener = node("listener", &[]);
            let late_kept = listener
                .subscription::<Imu>("kept", Qos::tf_static())
                .unwrap();
            let late_gone = listener
                .subscription::<Imu>("gone", Qos::reliable())
                .unwrap();
            assert_eq!(
                late_kept.recv_timeout(LONG).unwrap().unwrap().message,
                imu(1)
            );
            assert!(gone.wait_for_subscriptions(1, LONG));
            gone.publish(&imu(2)).unwrap();
            assert_eq!(
                late_gone.recv_timeout(LONG).unwrap().unwrap().message,
                imu(2)
            );
            // A second subscription in the same process shares a cache with the first, but not its
            // past.
            let later = listener
                .subscription::<Imu>("gone", Qos::reliable())
                .unwrap();
            assert!(gone.wait_for_subscriptions(2, LONG));
            gone.publish(&imu(3)).unwrap();
            assert_eq!(later.recv_timeout(LONG).unwrap().unwrap().message, imu(3));
        },
    );
}

#[test]
fn remaps_and_names_are_seen_by_peers() {
    in_private_network("remaps_and_names_are_seen_by_peers", || {
        let left = node(
            "virtual_imu",
            &[
                "-r",
                "__ns:=/left",
                "-r",
                "imu/data:=imu/renamed",
                "-p",
                "qos_overrides./left/imu/renamed.publisher.reliability:=best_effort",
            ],
        );
        let publisher = left.publisher::<Imu>("imu/data", Qos::reliable()).unwrap();
        assert_eq!(publisher.topic(), "/left/imu/renamed");
        let observer = node("observer", &["-r", "__node:=watcher"]);
        let found = observer.wait_for_graph(LONG, || {
            observer
                .publishers()
                .iter()
                .any(|p| p.gid == publisher.gid() && p.node.is_some())
        });
        assert!(found, "{:?}", observer.publishers());
        let seen = observer
            .publishers()
            .into_iter()
            .find(|p| p.gid == publisher.gid())
            .unwrap();
        assert_eq!(
            (seen.topic.as_str(), seen.type_name.as_str()),
            ("/left/imu/renamed", Imu::TYPE_NAME)
        );
        assert_eq!(seen.node.as_ref(), Some(left.name()));
        assert_eq!(seen.qos.reliability, cromosim_ros::Reliability::BestEffort);
        let nodes: BTreeSet<String> = observer.nodes().iter().map(ToString::to_string).collect();
        assert_eq!(
            nodes,
            ["/left/virtual_imu", "/watcher"].map(String::from).into()
        );
        let counts: BTreeMap<_, _> = observer
            .topics()
            .into_iter()
            .map(|t| (t.name, (t.publishers, t.subscriptions)))
            .collect();
        assert_eq!(counts["/left/imu/renamed"], (1, 0));
        assert_eq!(counts["/rosout"], (2, 0));
        drop(publisher);
        drop(left);
        assert!(observer.wait_for_graph(LONG, || {
            observer.nodes().len() == 1
                && observer
                    .topics()
                    .iter()
                    .all(|t| !t.name.starts_with("/left"))
        }));
    });
}

#[test]
fn callbacks_run_until_they_are_dropped() {
    in_private_network("callbacks_run_until_they_are_dropped", || {
        let node = node("self_talker", &[]);
        let (sender, receiver) = std::sync::mpsc::channel();
        let listening = node
            .listen::<Imu>("imu", Qos::reliable(), move |received| {
                sender.send(received.message).unwrap()
            })
            .unwrap();
        let publisher = node.publisher::<Imu>("imu", Qos::reliable()).unwrap();
        assert!(publisher.wait_for_subscriptions(1, LONG));
        publisher.publish(&imu(1)).unwrap();
        assert_eq!(receiver.recv_timeout(LONG).unwrap(), imu(1));
        drop(listening);
        assert!(node.wait_for_graph(LONG, || publisher.subscription_count() == 0));
    });
}

#[test]
fn a_shutdown_ends_every_wait() {
    in_private_network("a_shutdown_ends_every_wait", || {
        let node = node("sleeper", &[]);
        let subscription = node.subscription::<Imu>("imu", Qos::reliable()).unwrap();
        let shutdown = node.shutdown().clone();
        let waiting = std::thread::spawn(move || subscription.recv().unwrap().is_none());
        let publisher = node.publisher::<Imu>("other", Qos::reliable()).unwrap();
        let matching = std::thread::spawn(move || publisher.wait_for_subscriptions(1, LONG * 10));
        shutdown.request();
        assert!(waiting.join().unwrap());
        assert!(!matching.join().unwrap());
    });
}
