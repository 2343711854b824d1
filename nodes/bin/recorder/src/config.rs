//! Parameters of the node.

use cromosim_ros::node_config;

node_config! {
    /// ROS parameters of `recorder`.
    pub struct Config {
        /// The rosbag2 directory to make; it must not exist yet. Empty: `rosbag2_` and the time of
        /// the start.
        pub bag_path: String = String::new(),
        /// Topics to record; empty: all, as they appear.
        pub topics: Vec<String> = Vec::new(),
        /// Topics to leave out.
        pub exclude: Vec<String> = Vec::new(),
        /// Record topics of services and parameters too (`/rosout`, `/parameter_events`).
        pub include_infrastructure: bool = false,
        /// What has been received is on its way to the disk after so many seconds at the latest.
        pub flush_seconds: f64 = 0.25,
        /// Wait for the disk at every flush: safe against power loss, slower.
        pub sync: bool = false,
        /// Messages that a subscription holds while the disk is busy.
        pub depth: i64 = 1000,
        /// Compress chunks: none or zstd.
        pub compression: String = "none".to_owned(),
        /// Topic of std_msgs/msg/String whose last message becomes the attachment
        /// `placements.yaml`.
        pub placements_topic: String = "virtual_imu/placements".to_owned(),
        /// What else the bag's metadata is to say of the run: the settings of the other nodes, say.
        pub run: String = String::new(),
        /// Written into the bag's metadata, so that the run can be repeated.
        pub seed: i64 = 0,
    }
}
