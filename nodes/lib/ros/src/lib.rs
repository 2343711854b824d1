//! ROS 2 nodes over DDS, without ROS: names and remaps, parameters, topics, services, time and the
//! graph.
//!
//! The one crate that names ros2-client and RustDDS. Bytes cross DDS; every typed publisher,
//! subscription and service encodes and decodes around them, so that a recorder of unknown types
//! and a node of known ones are the same thing.
//!
//! On ros2-client stand the context with the DDS participant, topics and their types, quality of
//! service, the words of `ros_discovery_info`, `/rosout` and the parameter services, and parameter
//! values. On RustDDS, which ros2-client stands on too, stands directly what ros2-client 0.12.1
//! lacks:
//!
//! | what | why |
//! |---|---|
//! | the participant's builder | ros2-client's options cannot keep it to this machine (nor RustDDS's wholly: `loopback.rs`), nor name other hosts (`peers.rs`) |
//! | publishers | ros2-client's hide `wait_for_acknowledgments`: the last messages of a process that ends would be lost |
//! | sending `ros_discovery_info` | ros2-client's `Node` announces only endpoints that it made, and never takes dropped ones back |
//! | subscriptions, services, their clients | only `Node` makes them, and its announcement would contradict ours, in which publishers are |
//! | received `ros_discovery_info` | ros2-client's type hides the endpoints |
//! | graph and matching | ros2-client's `Spinner` always reads `/clock` with a wrong type, and needs the `Node` |
//! | `epoll_wait` | RustDDS's threads end for good at the first wait that a signal interrupts (`uninterrupted.rs`) |
//! | stamps of received messages | ros2-client rounds down and loses a nanosecond |
//!
//! ```no_run
//! use cromosim_msgs::sensor_msgs::Imu;
//! use cromosim_ros::{Node, NodeOptions, Parameter, Parameters, Qos, RosArgs, Shutdown, init_logging};
//!
//! # fn main() -> Result<(), cromosim_ros::RosError> {
//! let args = RosArgs::from_env()?;
//! init_logging(&args.log_levels);
//! let parameters = Parameters::new();
//! parameters.declare(Parameter::new("rate_hz", 100.0).about("Output rate, Hz.").range(1.0, 1000.0).read_only())?;
//! let options = NodeOptions::new("doubler", &args, &parameters)?.shutdown(&Shutdown::on_signals()?);
//! let node = Node::start(options)?;
//! let publisher = node.publisher::<Imu>("imu/out", Qos::reliable())?;
//! let subscription = node.subscription::<Imu>("imu/in", Qos::reliable())?;
//! while let Some(received) = subscription.recv()? {
//!     publisher.publish(&received.message)?;
//! }
//! # Ok(())
//! # }
//! ```

mod args;
mod clock;
mod command;
mod core;
mod discovery;
mod error;
mod graph;
mod logging;
mod loopback;
mod names;
mod node;
mod node_options;
mod parameter;
mod participant_info;
mod peers;
mod publisher;
mod qos;
mod raw;
mod reader;
mod security;
mod service;
mod shutdown;
mod spin;
mod subscription;
#[cfg(feature = "testing")]
pub mod testing;
mod turns;
#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
mod uninterrupted;
mod wake;

pub use args::RosArgs;
pub use clock::Clock;
pub use command::{NodeConfig, Periodic, Prepared, announce_ready, prepare, say_error, say_ready};
pub use discovery::{DiscoveryRange, Network};
pub use error::{RosError, RosResult};
pub use graph::{Endpoint, TopicInfo};
pub use logging::{LogLevels, init_logging};
pub use names::{NodeName, dds_type_name, ros_type_name};
pub use node::{ClockPublisher, Node};
pub use node_options::NodeOptions;
pub use parameter::{Parameter, ParameterScalar, ParameterValue, Parameters};
pub use publisher::{Publisher, RawPublisher};
pub use qos::{Durability, History, Qos, Reliability};
pub use raw::{Gid, RawMessage, Received};
pub use security::Security;
pub use service::{ServiceClient, ServiceServer};
pub use shutdown::Shutdown;
pub use subscription::{Listening, RawSubscription, Subscription};
pub use wake::Bell;
