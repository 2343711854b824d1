//! Nodes beside another host, joined by a cable.
#![allow(clippy::unwrap_used)]

mod stranger;

use std::time::{Duration, Instant};

use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{in_private_network, is_private};
use cromosim_ros::{DiscoveryRange, Qos};

use crate::stranger::{Stranger, start};

const LONG: Duration = Duration::from_secs(120);

/// What came over the cable.
#[derive(Debug, Default, PartialEq)]
struct Crossed {
    /// Messages of the other host that were taken.
    messages: usize,
    /// Whether the graph knows its publisher.
    known: bool,
    /// Datagrams that came to it from here.
    datagrams: u64,
}

impl Crossed {
    fn everything(&self) -> bool {
        self.messages >= 20 && self.known && self.datagrams > 0
    }
}

/// Listens while the stranger sends at least a thousand datagrams by hand, and tells its node's
/// stand-in of its publisher anew three times; no longer than until everything has crossed.
fn listen(range: DiscoveryRange, stranger: &mut Stranger) -> Crossed {
    let (heard, sent) = stranger.counts();
    let node = start("listener", range);
    let subscription = node.subscription::<Imu>("/imu", Qos::reliable()).unwrap();
    // Something to tell others about.
    let _publisher = node.publisher::<Imu>("/other", Qos::reliable()).unwrap();
    let (mut crossed, started) = (Crossed::default(), Instant::now());
    loop {
        let message = subscription
            .recv_timeout(Duration::from_millis(50))
            .unwrap();
        crossed.messages += usize::from(message.is_some());
        let (heard_now, sent_now) = stranger.counts();
        crossed.datagrams = heard_now - heard;
        crossed.known |= node.publishers().iter().any(|one| one.topic == "/imu");
        let sent = sent_now - sent;
        let silent = range != DiscoveryRange::Subnet;
        let long_enough = sent >= 1000 && started.elapsed() > Duration::from_secs(6);
        if crossed.everything() || silent && long_enough {
            return crossed;
        }
        assert!(
            started.elapsed() < LONG,
            "{range:?}: {crossed:?}, {sent} datagrams by hand"
        );
    }
}

#[test]
fn nothing_of_another_host_is_taken_and_nothing_leaves_but_in_a_subnet() {
    in_private_network(
        "nothing_of_another_host_is_taken_and_nothing_leaves_but_in_a_subnet",
        || {
            if !is_private() {
                println!("skipped: no network namespaces here");
                return;
            }
            let mut stranger = Stranger::join();
            for range in [DiscoveryRange::Localhost, DiscoveryRange::Off] {
                let crossed = listen(range, &mut stranger);
                assert_eq!(crossed, Crossed::default(), "{range:?}");
            }
            // The other way round it would be silence that passes.
            let crossed = listen(DiscoveryRange::Subnet, &mut stranger);
            assert!(crossed.everything());
        },
    );
}
