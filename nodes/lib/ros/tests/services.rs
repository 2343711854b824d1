//! Services, parameter services and simulated time over DDS.
#![allow(clippy::unwrap_used)]

use std::sync::{Arc, Mutex};
use std::time::Duration;

use cromosim_msgs::rosbag2_interfaces::{IsPaused, IsPausedRequest, IsPausedResponse};
use cromosim_msgs::{RosMessage, rosgraph_msgs};
use cromosim_ros::testing::{in_private_network, network};
use cromosim_ros::{Node, NodeOptions, Parameter, Parameters, Qos, RosArgs, RosError};
use cromosim_spatial::Stamp;
use serde::{Deserialize, Serialize};

const LONG: Duration = Duration::from_secs(20);

fn start(name: &str, parameters: &Parameters, line: &[&str]) -> Node {
    let args = RosArgs::parse(std::iter::once("--ros-args").chain(line.iter().copied())).unwrap();
    Node::start(
        NodeOptions::new(name, &args, parameters)
            .unwrap()
            .network(network()),
    )
    .unwrap()
}

#[test]
fn services_answer_each_client_its_own_request() {
    in_private_network("services_answer_each_client_its_own_request", || {
        let server = start("adder", &Parameters::new(), &["-r", "__ns:=/calc"]);
        let handler = |(a, b): (i64, i64)| a + b;
        let adding = server
            .serve_as("~/add", "example_interfaces/srv/AddTwoInts", handler)
            .unwrap();
        assert_eq!(adding.name(), "/calc/adder/add");
        let asker = start("asker", &Parameters::new(), &[]);
        let clients: Vec<_> = (0..3)
            .map(|_| {
                asker
                    .client_as::<(i64, i64), i64>(
                        "/calc/adder/add",
                        "example_interfaces/srv/AddTwoInts",
                    )
                    .unwrap()
            })
            .collect();
        std::thread::scope(|scope| {
            for (offset, client) in clients.iter().enumerate() {
                scope.spawn(move || {
                    for round in 0..20 {
                        let (a, b) = (offset as i64 * 1000, round);
                        assert_eq!(client.call(&(a, b), LONG).unwrap(), a + b);
                    }
                });
            }
        });
        drop(adding);
        assert!(asker.wait_for_graph(LONG, || !clients[0].is_available()));
        let nobody = clients[0].call(&(1, 1), Duration::from_millis(50));
        assert!(matches!(nobody, Err(RosError::ServiceTimeout { .. })));
    });
}

#[test]
fn typed_services_and_handlers_with_state_work() {
    in_private_network("typed_services_and_handlers_with_state_work", || {
        let node = start("player", &Parameters::new(), &[]);
        let asked = Arc::new(Mutex::new(0));
        let count = Arc::clone(&asked);
        let _server = node
            .serve::<IsPaused>("~/is_paused", move |_| {
                *count.lock().unwrap() += 1;
                IsPausedResponse { paused: true }
            })
            .unwrap();
        let client = node.client::<IsPaused>("player/is_paused").unwrap();
        assert!(
            client
                .call(&IsPausedRequest::default(), LONG)
                .unwrap()
                .paused
        );
        assert_eq!(*asked.lock().unwrap(), 1);
    });
}

/// `rcl_interfaces/msg/ParameterValue`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Value {
    kind: u8,
    boolean: bool,
    integer: i64,
    double: f64,
    string: String,
    bytes: Vec<u8>,
    booleans: Vec<bool>,
    integers: Vec<i64>,
    doubles: Vec<f64>,
    strings: Vec<String>,
}

/// `rcl_interfaces/msg/ParameterDescriptor`.
#[derive(Debug, Serialize, Deserialize)]
struct Descriptor {
    name: String,
    kind: u8,
    description: String,
    constraints: String,
    read_only: bool,
    dynamic: bool,
    double_range: Vec<(f64, f64, f64)>,
    integer_range: Vec<(i64, i64, u64)>,
}

type Named = (String, Value);
type Outcome = (bool, String);

fn double(double: f64) -> Value {
    Value {
        kind: 3,
        double,
        ..Value::default()
    }
}

#[test]
fn parameters_are_listed_read_described_and_set_by_the_standard_services() {
    in_private_network(
        "parameters_are_listed_read_described_and_set_by_the_standard_services",
        || {
            let parameters = Parameters::new();
            parameters
                .declare(
                    Parameter::new("noise.density", 0.5)
                        .about("White noise.")
                        .range(0.0, 1.0),
                )
                .unwrap();
            parameters
                .declare(Parameter::new("seed", 1_i64).range(0.0, 9.0).read_only())
                .unwrap();
            let node = start("target", &parameters, &["-p", "seed:=7"]);
            let asker = start("asker", &Parameters::new(), &[]);
            let events = asker
                .raw_subscription(
                    "/parameter_events",
                    "rcl_interfaces/msg/ParameterEvent",
                    Qos::recorder(),
                )
                .unwrap();
            let name = |service: &str| format!("/target/{service}");
            let strings = |names: &[&str]| {
                names
                    .iter()
                    .map(|name| (*name).to_owned())
                    .collect::<Vec<_>>()
            };

            let list = asker
                .client_as::<(Vec<String>, u64), (Vec<String>, Vec<String>)>(
                    &name("list_parameters"),
                    "rcl_interfaces/srv/ListParameters",
                )
                .unwrap();
            assert_eq!(
                list.call(&(vec![], 0), LONG).unwrap(),
                (
                    strings(&["noise.density", "seed", "use_sim_time"]),
                    strings(&["noise"])
                )
            );

            let get = asker
                .client_as::<Vec<String>, Vec<Value>>(
                    &name("get_parameters"),
                    "rcl_interfaces/srv/GetParameters",
                )
                .unwrap();
            let values = get
                .call(&strings(&["seed", "nowhere", "noise.density"]), LONG)
                .unwrap();
            assert_eq!(
                values,
                [
                    Value {
                        kind: 2,
                        integer: 7,
                        ..Value::default()
                    },
                    Value::default(),
                    double(0.5)
                ]
            );

            let types = asker
                .client_as::<Vec<String>, Vec<u8>>(
                    &name("get_parameter_types"),
                    "rcl_interfaces/srv/GetParameterTypes",
                )
                .unwrap();
            assert_eq!(
                types
                    .call(&strings(&["seed", "nowhere", "use_sim_time"]), LONG)
                    .unwrap(),
                [2, 0, 1]
            );

            let describe = asker
                .client_as::<Vec<String>, Vec<Descriptor>>(
                    &name("describe_parameters"),
                    "rcl_interfaces/srv/DescribeParameters",
                )
                .unwrap();
            let described = describe
                .call(&strings(&["noise.density", "seed"]), LONG)
                .unwrap();
            assert_eq!(
                (
                    described[0].description.as_str(),
                    described[0].read_only,
                    &described[0].double_range
                ),
                ("White noise.", false, &vec![(0.0, 1.0, 0.0)])
            );
            assert_eq!(
                (
                    described[1].kind,
                    described[1].read_only,
                    &described[1].integer_range
                ),
                (2, true, &vec![(0, 9, 1)])
            );

            let set = asker
                .client_as::<Vec<Named>, Vec<Outcome>>(
                    &name("set_parameters"),
                    "rcl_interfaces/srv/SetParameters",
                )
                .unwrap();
            let changes = [
                ("noise.density", double(0.25)),
                ("noise.density", double(2.0)),
                (
                    "seed",
                    Value {
                        kind: 2,
                        integer: 3,
                        ..Value::default()
                    },
                ),
            ];
            let outcomes = set
                .call(
                    &changes
                        .map(|(name, value)| (name.to_owned(), value))
                        .to_vec(),
                    LONG,
                )
                .unwrap();
            assert_eq!(
                outcomes.iter().map(|(good, _)| *good).collect::<Vec<_>>(),
                [true, false, false]
            );
            assert!(
                outcomes[1].1.contains("0 to 1") && outcomes[2].1.contains("read-only"),
                "{outcomes:?}"
            );
            assert_eq!(node.parameters().get::<f64>("noise.density"), Some(0.25));

            let atomically = asker
                .client_as::<Vec<Named>, Outcome>(
                    &name("set_parameters_atomically"),
                    "rcl_interfaces/srv/SetParametersAtomically",
                )
                .unwrap();
            let both = vec![
                ("noise.density".to_owned(), double(0.75)),
                ("seed".to_owned(), double(1.0)),
            ];
            assert!(!atomically.call(&both, LONG).unwrap().0);
            assert!(atomically.call(&both[..1].to_vec(), LONG).unwrap().0);
            assert_eq!(node.parameters().get::<f64>("noise.density"), Some(0.75));

            type Event = ((i32, u32), String, Vec<Named>, Vec<Named>, Vec<Named>);
            let changed = || {
                events
                    .recv_timeout(LONG)
                    .unwrap()
                    .unwrap()
                    .message
                    .decode::<Event>()
                    .unwrap()
            };
            for value in [0.25, 0.75] {
                let (_, from, new, changed, deleted) = changed();
                assert_eq!(
                    (from.as_str(), new.len(), changed, deleted.len()),
                    (
                        "/target",
                        0,
                        vec![("noise.density".to_owned(), double(value))],
                        0
                    )
                );
            }
        },
    );
}

#[test]
fn sim_time_is_followed_from_the_start_or_when_it_is_switched_on() {
    in_private_network(
        "sim_time_is_followed_from_the_start_or_when_it_is_switched_on",
        || {
            let replay = start("replay", &Parameters::new(), &[]);
            let clock = replay.clock_publisher().unwrap();
            let follower = start(
                "follower",
                &Parameters::new(),
                &["-p", "use_sim_time:=true"],
            );
            let late = start("late", &Parameters::new(), &[]);
            assert!(follower.clock().is_simulated() && !late.clock().is_simulated());
            assert_eq!(follower.now(), Stamp::from_nanos(0));
            let set = replay
                .client_as::<Vec<Named>, Vec<Outcome>>(
                    "/late/set_parameters",
                    "rcl_interfaces/srv/SetParameters",
                )
                .unwrap();
            let on = vec![(
                "use_sim_time".to_owned(),
                Value {
                    kind: 1,
                    boolean: true,
                    ..Value::default()
                },
            )];
            assert!(set.call(&on, LONG).unwrap()[0].0);
            assert!(clock.publisher().wait_for_subscriptions(2, LONG));
            let types: Vec<_> = replay
                .topics()
                .into_iter()
                .filter(|topic| topic.name == "/clock")
                .map(|topic| topic.type_name)
                .collect();
            assert_eq!(types, [rosgraph_msgs::Clock::TYPE_NAME]);
            let stamp = Stamp::from_nanos(1_234_567_890_123_456_789);
            let ticking = std::thread::spawn({
                let shutdown = replay.shutdown().clone();
                move || {
                    // Best effort: once is not enough.
                    while !shutdown.is_requested() {
                        clock.publish(stamp).unwrap();
                        std::thread::sleep(Duration::from_millis(10));
                    }
                }
            });
            assert!(follower.clock().sleep_until(stamp) && late.clock().sleep_until(stamp));
            assert_eq!((follower.now(), late.now()), (stamp, stamp));
            late.parameters().set("use_sim_time", false).unwrap();
            assert!(late.wait_for_graph(LONG, || {
                !late.clock().is_simulated()
                    && late
                        .subscriptions()
                        .iter()
                        .all(|s| s.topic != "/clock" || s.node.as_ref() != Some(late.name()))
            }));
            assert!(late.now() > stamp);
            replay.shutdown().request();
            ticking.join().unwrap();
        },
    );
}
