//! Networks and a mapping live, over DDS in a private network namespace: the node says what
//! `cromosim simulate` computes of the same states.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::{CROMOSIM, succeed, write_networks};
use cromosim_bag::BagReader;
use cromosim_learned::Input;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{environment, in_private_network, network};
use cromosim_ros::{Node, NodeOptions, Parameters, Qos, RosArgs};

const PATIENCE: Duration = Duration::from_secs(30);
const PLACEMENTS: &str = "\
schema: cromosim/placements/1
defaults: {rate_hz: 100, scheme: richardson}
placements:
  left_wrist: {site: left_watch}
  right_shin: {site: right_shank_front}
  sternum: {site: sternum, scheme: spline}
";
/// Every channel of one placement bent at zero; the others stay as they are.
const MAPPING: &str = "\
schema: cromosim/mapping/1
placements:
  left_wrist:
    accel_x: &force {simulated: [-40.0, 0.0, 40.0], measured: [-30.0, 1.0, 50.0]}
    accel_y: *force
    accel_z: *force
    gyro_x: &rate {simulated: [-20.0, 0.0, 20.0], measured: [-25.0, 0.1, 16.0]}
    gyro_y: *rate
    gyro_z: *rate
";

/// Killed when the test ends.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Specific force and angular velocity by time, ns.
fn values(imu: &Imu) -> (i64, [f64; 6]) {
    let (force, rate) = (imu.linear_acceleration, imu.angular_velocity);
    (
        imu.header.stamp.nanos(),
        [force.x, force.y, force.z, rate.x, rate.y, rate.z],
    )
}

fn read(bag: &Path, placement: &str) -> BTreeMap<i64, [f64; 6]> {
    let messages = BagReader::open(bag)
        .unwrap()
        .read::<Imu>(&format!("/imu/{placement}/data_raw"))
        .unwrap();
    messages.iter().map(|(_, imu)| values(imu)).collect()
}

/// Largest difference of force (m/s2) and rate (rad/s) after the first second, and how many samples
/// both have from there on.
fn difference(one: &BTreeMap<i64, [f64; 6]>, other: &BTreeMap<i64, [f64; 6]>) -> (f64, f64, usize) {
    let begins = one.keys().next().unwrap() + 1_000_000_000;
    let both: Vec<_> = one
        .range(begins..)
        .filter_map(|(stamp, values)| Some((values, other.get(stamp)?)))
        .collect();
    let largest = |channels: std::ops::Range<usize>| {
        both.iter()
            .flat_map(|(a, b)| channels.clone().map(|k| (a[k] - b[k]).abs()))
            .fold(0.0, f64::max)
    };
    (largest(0..3), largest(3..6), both.len())
}

#[test]
fn the_node_says_what_simulate_computes_of_the_same_states() {
    in_private_network(
        "the_node_says_what_simulate_computes_of_the_same_states",
        || {
            let folder = tempfile::tempdir().unwrap();
            let here = folder.path();
            write_networks(Input::Streaming, &here.join("model"));
            fs::write(here.join("placements.yaml"), PLACEMENTS).unwrap();
            fs::write(here.join("map.yaml"), MAPPING).unwrap();
            let simulate = [
                "simulate",
                "--walk",
                "--placements",
                "placements.yaml",
                "--duration",
                "5",
                "--no-noise",
            ];
            succeed(here, &[&simulate[..], &["--out", "plain.mcap"]].concat());
            succeed(
                here,
                &[
                    &simulate[..],
                    &[
                        "--learned",
                        "model",
                        "--mapping",
                        "map.yaml",
                        "--out",
                        "offline.mcap",
                    ],
                ]
                .concat(),
            );
            let states = BagReader::open(&here.join("offline.mcap"))
                .unwrap()
                .read::<SmplState>("/smpl/state")
                .unwrap();

            let parameters = [
                "learned:=model",
                "mapping:=map.yaml",
                "placements:=placements.yaml",
                "noise:=false",
            ];
            let mut command = Command::new(CROMOSIM);
            command
                .args(["node", "virtual_imu", "--ros-args"])
                .args(parameters.iter().flat_map(|parameter| ["-p", *parameter]));
            command
                .current_dir(here)
                .envs(environment())
                .stdin(Stdio::null())
                .stdout(Stdio::null());
            let _virtual_imu = Process(command.spawn().unwrap());
            let args = RosArgs::parse(Vec::<String>::new()).unwrap();
            let node = Node::start(
                NodeOptions::new("observer", &args, &Parameters::new())
                    .unwrap()
                    .network(network()),
            )
            .unwrap();
            let publisher = node
                .publisher::<SmplState>("/smpl/state", Qos::reliable().depth(100))
                .unwrap();
            let names = ["left_wrist", "right_shin", "sternum"];
            let imus = names.map(|name| {
                node.subscription::<Imu>(&format!("/imu/{name}/data_raw"), Qos::recorder())
                    .unwrap()
            });
            assert!(
                publisher.wait_for_subscriptions(1, PATIENCE)
                    && imus.iter().all(|imu| imu.wait_for_publishers(1, PATIENCE))
            );

            let mut live = names.map(|_| BTreeMap::new());
            let mut collect = |patience: Duration| {
                for (live, imu) in live.iter_mut().zip(&imus) {
                    while let Some(received) = imu.recv_timeout(patience).unwrap() {
                        live.extend([values(&received.message)]);
                    }
                }
            };
            for (_, state) in &states {
                publisher.publish(state).unwrap();
                std::thread::sleep(Duration::from_millis(2));
                collect(Duration::ZERO);
            }
            collect(Duration::from_millis(500));

            for (name, live) in names.iter().zip(&live) {
                let (offline, plain) = (
                    read(&here.join("offline.mcap"), name),
                    read(&here.join("plain.mcap"), name),
                );
                let (force, rate, both) = difference(&offline, live);
                let (learned_force, learned_rate, _) = difference(&offline, &plain);
                println!(
                    "{name}: {force:.1e} m/s2, {rate:.1e} rad/s over {both} samples; changed by {learned_force:.2} and {learned_rate:.2}"
                );
                assert!(
                    both >= 385,
                    "{name}: {both} of 401 samples, less the scheme's delay"
                );
                // Stencils read the same frames live; the spline is fitted to the last 43 of them.
                let (most_force, most_rate) = if *name == "sternum" {
                    (0.02, 1e-4)
                } else {
                    (1e-5, 1e-5)
                };
                assert!(
                    force < most_force && rate < most_rate,
                    "{name}: {force:e} m/s2, {rate:e} rad/s"
                );
                assert!(
                    learned_force > 1.0 && learned_rate > 0.05,
                    "{name}: the networks say something"
                );
            }
        },
    );
}
