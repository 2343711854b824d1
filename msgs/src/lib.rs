//! ROS 2 messages as plain Rust structs, with their schema text and type hashes; no middleware.
//!
//! One module for each ROS package. A struct's fields stand in wire order, so that any serde CDR
//! encoder writes what ROS 2 reads. The interface files (`msg/` for our own, `std/` for those of
//! ROS) are the schema text; tests compare them with the structs.
//!
//! ```
//! use cromosim_msgs::{RosMessage, sensor_msgs::Imu};
//! assert_eq!(Imu::TYPE_NAME, "sensor_msgs/msg/Imu");
//! assert!(Imu::type_hash().starts_with("RIHS01_"));
//! ```

#[macro_use]
mod macros;

pub mod builtin_interfaces;
mod convert;
pub mod cromosim_msgs;
mod definition;
pub mod diagnostic_msgs;
pub mod geometry_msgs;
pub mod nav_msgs;
mod printable;
pub mod rosbag2_interfaces;
pub mod rosgraph_msgs;
pub mod sensor_msgs;
pub mod std_msgs;
pub mod tf2_msgs;

pub use convert::{NotABody, NotARotation};
pub use cromosim_msgs::{SmplPose, SmplState};
pub use definition::{
    Arity, Element, Field, FieldType, MessageType, Part, RosElement, RosField, RosMessage,
    RosService,
};
pub use printable::printable;

/// Every message type of this crate, the halves of services included, by name: for recorders that
/// meet a type at run time.
pub fn known_types() -> &'static [&'static MessageType] {
    KNOWN
}

/// The type of this name (`sensor_msgs/msg/Imu`), where this crate has it.
pub fn known_type(type_name: &str) -> Option<&'static MessageType> {
    KNOWN.iter().copied().find(|known| known.name == type_name)
}

macro_rules! types {
    ($($path:path),* $(,)?) => { &[$(<$path as RosMessage>::TYPE),*] };
}

static KNOWN: &[&MessageType] = types![
    builtin_interfaces::Duration,
    builtin_interfaces::Time,
    cromosim_msgs::SmplPose,
    cromosim_msgs::SmplState,
    diagnostic_msgs::DiagnosticArray,
    diagnostic_msgs::DiagnosticStatus,
    diagnostic_msgs::KeyValue,
    geometry_msgs::Point,
    geometry_msgs::Pose,
    geometry_msgs::PoseStamped,
    geometry_msgs::PoseWithCovariance,
    geometry_msgs::PoseWithCovarianceStamped,
    geometry_msgs::Quaternion,
    geometry_msgs::Transform,
    geometry_msgs::TransformStamped,
    geometry_msgs::Twist,
    geometry_msgs::TwistWithCovariance,
    geometry_msgs::Vector3,
    nav_msgs::Odometry,
    rosbag2_interfaces::BurstRequest,
    rosbag2_interfaces::BurstResponse,
    rosbag2_interfaces::GetRateRequest,
    rosbag2_interfaces::GetRateResponse,
    rosbag2_interfaces::IsPausedRequest,
    rosbag2_interfaces::IsPausedResponse,
    rosbag2_interfaces::PauseRequest,
    rosbag2_interfaces::PauseResponse,
    rosbag2_interfaces::PlayRequest,
    rosbag2_interfaces::PlayResponse,
    rosbag2_interfaces::PlayNextRequest,
    rosbag2_interfaces::PlayNextResponse,
    rosbag2_interfaces::ResumeRequest,
    rosbag2_interfaces::ResumeResponse,
    rosbag2_interfaces::SeekRequest,
    rosbag2_interfaces::SeekResponse,
    rosbag2_interfaces::SetRateRequest,
    rosbag2_interfaces::SetRateResponse,
    rosbag2_interfaces::SnapshotRequest,
    rosbag2_interfaces::SnapshotResponse,
    rosbag2_interfaces::StopRequest,
    rosbag2_interfaces::StopResponse,
    rosbag2_interfaces::TogglePausedRequest,
    rosbag2_interfaces::TogglePausedResponse,
    rosgraph_msgs::Clock,
    sensor_msgs::Imu,
    sensor_msgs::MagneticField,
    sensor_msgs::Temperature,
    std_msgs::Header,
    std_msgs::String,
    tf2_msgs::TFMessage,
];
