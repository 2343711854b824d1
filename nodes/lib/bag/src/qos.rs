//! Quality of service as rosbag2 writes it down.

use serde::{Deserialize, Serialize};

/// What one publisher offered: the entries of `offered_qos_profiles`, in rosbag2's names.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct QosProfile {
    /// `keep_last` or `keep_all`.
    pub history: String,
    /// How many messages `keep_last` keeps.
    pub depth: u32,
    /// `reliable` or `best_effort`.
    pub reliability: String,
    /// `volatile` or `transient_local`.
    pub durability: String,
    /// The longest gap between messages.
    pub deadline: QosTime,
    /// How long a message lives.
    pub lifespan: QosTime,
    /// `automatic` or `manual_by_topic`.
    pub liveliness: String,
    /// How often the publisher says that it lives.
    pub liveliness_lease_duration: QosTime,
    /// Whether the topic's name stays as it is.
    pub avoid_ros_namespace_conventions: bool,
}

/// A span of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct QosTime {
    /// Whole seconds.
    pub sec: u64,
    /// Nanoseconds beyond the whole seconds.
    pub nsec: u64,
}

impl QosTime {
    /// What ROS 2 writes for "no limit": the largest 64-bit number of nanoseconds.
    pub const INFINITE: Self = Self {
        sec: 9_223_372_036,
        nsec: 854_775_807,
    };
}

impl QosProfile {
    /// Reliable, volatile, the last `depth` messages: what publishers of ROS 2 offer where nobody
    /// says otherwise.
    pub fn reliable(depth: u32) -> Self {
        Self {
            history: "keep_last".to_owned(),
            depth,
            reliability: "reliable".to_owned(),
            durability: "volatile".to_owned(),
            deadline: QosTime::INFINITE,
            lifespan: QosTime::INFINITE,
            liveliness: "automatic".to_owned(),
            liveliness_lease_duration: QosTime::INFINITE,
            avoid_ros_namespace_conventions: false,
        }
    }

    /// The profile with best effort in place of reliability.
    #[must_use]
    pub fn best_effort(self) -> Self {
        Self {
            reliability: "best_effort".to_owned(),
            ..self
        }
    }

    /// The profile with late subscribers served.
    #[must_use]
    pub fn transient_local(self) -> Self {
        Self {
            durability: "transient_local".to_owned(),
            ..self
        }
    }

    /// What a topic of this name is usually offered with: `/tf_static` transient local, `/clock`
    /// best effort, depth 1; the others reliable, depth 10 (100 for `/tf`).
    pub fn usual(topic: &str) -> Self {
        match topic {
            "/tf_static" => Self::reliable(1).transient_local(),
            "/tf" => Self::reliable(100),
            "/clock" => Self::reliable(1).best_effort(),
            _ => Self::reliable(10),
        }
    }
}
