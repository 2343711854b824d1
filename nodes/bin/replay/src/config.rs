//! Parameters of the node.

use cromosim_ros::node_config;

node_config! {
    /// ROS parameters of `replay`.
    pub struct Config {
        /// Motion file (BVH, ASF/AMC, MVNX, C3D, TRC, SMPL parameters) to play; empty, with no bag
        /// either: the embedded walk.
        pub motion: String = String::new(),
        /// Recording to play: everything in it, with its times; a .mcap file or a rosbag2
        /// directory, or as one a trajectory (TUM, EuRoC, table), an IMU's series, or a data set's
        /// recording (TotalCapture, PAMAP2, RealWorld, BROAD, phone and watch).
        pub bag: String = String::new(),
        /// Topics of the bag to play; empty: all.
        pub topics: Vec<String> = Vec::new(),
        /// Speed factor, positive. May change at run time.
        pub rate: f64 = 1.0,
        /// Begin again at the end. Between two rounds lies a second of silence. May change at run
        /// time.
        pub r#loop: bool = false,
        /// Begin so many seconds after the beginning.
        pub start_seconds: f64 = 0.0,
        /// Play so many seconds; 0: to the end.
        pub duration_seconds: f64 = 0.0,
        /// Publish /clock so often, Hz, and stamp messages with the recording's time; a bag's own
        /// /clock is left out then. 0: no /clock, and stamps are those of now.
        pub clock_rate_hz: f64 = 0.0,
        /// Wait for `~/resume` before the first message.
        pub start_paused: bool = false,
        /// The up axis of the motion file: auto, x, y or z.
        pub up_axis: String = "auto".to_owned(),
        /// Metres of one unit of the motion file; 0: found out from the skeleton's size.
        pub unit_m: f64 = 0.0,
        /// Body model file that the motion's person is fitted to: the one that smpl_state and
        /// virtual_imu have; empty: the embedded body.
        pub body: String = String::new(),
        /// A skeleton map of one's own (YAML); empty: the one that fits the file's joint names.
        pub skeleton_map: String = String::new(),
        /// An AMC file's skeleton (ASF); empty: the one beside it.
        pub skeleton: String = String::new(),
        /// Frames per second of a motion file that does not say it, Hz; 0: 120 for AMC, 30 for
        /// video estimates.
        pub motion_rate_hz: f64 = 0.0,
        /// Which marker is where: plug_in_gait, or a YAML file; empty: plug_in_gait.
        pub marker_set: String = String::new(),
        /// Whose markers are taken, where the labels name several people.
        pub subject: String = String::new(),
        /// Take markers to be stuck exactly where the marker set says.
        pub placements_as_given: bool = false,
        /// Which person of a file of several; empty: who is in it for the longest time. `all`, or
        /// names with commas between: each as `person_NAME/smpl/pose`, in step; run the other nodes
        /// once for each, with `-r __ns:=/person_NAME -p prefix:=person_NAME`.
        pub person: String = String::new(),
        /// Where the body's shape comes from: detect, file (an error where the file's betas are
        /// another body's), fit (to bone lengths) or mean.
        pub shape: String = "detect".to_owned(),
        /// The body file that the motion's betas are for, to fit another body to that person's
        /// bones; empty: none.
        pub source_body: String = String::new(),
        /// Tells several people apart; each has the file's own name where `person` asks for
        /// several.
        pub body_id: String = "0".to_owned(),
        /// Frame of the root pose.
        pub frame_id: String = "world".to_owned(),
        /// The node is ready, and begins, when every topic has so many subscriptions; -1: when
        /// somebody listens to any, and nobody new has come for half a second; 0: at once.
        pub ready_subscriptions: i64 = -1,
        /// Begin after so many seconds even where subscriptions are missing.
        pub ready_timeout_seconds: f64 = 10.0,
    }
}

/// # Errors
/// Where the factor is not positive.
pub fn check_rate(rate: f64) -> Result<(), String> {
    if rate.is_finite() && rate > 0.0 {
        return Ok(());
    }
    Err(format!(
        "parameter 'rate': expected a positive factor, found {rate}"
    ))
}
