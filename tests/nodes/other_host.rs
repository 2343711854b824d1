//! A recorder beside another host that sends it packets by hand.

use std::time::{Duration, Instant};

use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{in_private_network, is_private};
use cromosim_ros::{DiscoveryRange, Qos};

use crate::common::skipped;
use crate::process::Process;
use crate::stranger::{Stranger, start};

const LONG: Duration = Duration::from_secs(120);
/// Datagrams by hand that have to come to nothing.
const MANY: u64 = 1000;

/// Messages of a topic in a bag.
fn recorded(bag: &std::path::Path, topic: &str) -> usize {
    let reader = BagReader::open(bag).unwrap();
    let mut topics = reader.summary().topics.iter();
    let counted = topics.find(|counted| counted.topic.name == topic);
    counted.map_or(0, |counted| counted.message_count as usize)
}

#[test]
fn a_default_recorder_holds_nothing_of_another_host() {
    in_private_network(
        "other_host::a_default_recorder_holds_nothing_of_another_host",
        || {
            if !is_private() {
                return skipped("no network namespaces here");
            }
            let folder = tempfile::tempdir().unwrap();
            let mut stranger = Stranger::join();
            // The last one shows that the stranger can be heard.
            for range in ["", "LOCALHOST", "OFF", "SUBNET"] {
                let named = [("ROS_AUTOMATIC_DISCOVERY_RANGE", range.to_owned())];
                let variables = if range.is_empty() { &[][..] } else { &named };
                let name = format!("bag{range}");
                let path = format!("bag_path:={name}");
                let arguments = ["node", "recorder", "--ros-args", "-p", &path];
                let recorder = Process::start_with(folder.path(), &arguments, variables);
                // Somebody of this host, who is heard unless nobody is.
                let own_range = match range {
                    "SUBNET" => DiscoveryRange::Subnet,
                    _ => DiscoveryRange::Localhost,
                };
                let node = start("own", own_range);
                let own = node.publisher::<Imu>("/own", Qos::reliable()).unwrap();
                let (_, before) = stranger.counts();
                let begun = Instant::now();
                if range != "OFF" {
                    assert!(own.wait_for_subscriptions(1, LONG), "{range}");
                }
                let for_s = if range == "SUBNET" { 20 } else { 8 };
                while stranger.counts().1 - before < MANY
                    || begun.elapsed() < Duration::from_secs(for_s)
                {
                    own.publish(&Imu::default()).unwrap();
                    assert!(begun.elapsed() < LONG, "{range}: too few datagrams");
                    std::thread::sleep(Duration::from_millis(20));
                }
                recorder.interrupt();
                let bag = folder.path().join(&name);
                let (own, foreign) = (recorded(&bag, "/own"), recorded(&bag, "/imu"));
                println!("{range}: {own} messages of this host, {foreign} of the other");
                match range {
                    "SUBNET" => assert!(own > 0 && foreign >= 20, "{own}, {foreign}"),
                    "OFF" => assert_eq!(foreign, 0),
                    _ => assert!(own > 0 && foreign == 0, "{range}: {own}, {foreign}"),
                }
            }
        },
    );
}
