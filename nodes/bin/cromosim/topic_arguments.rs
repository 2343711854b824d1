//! Options that say which topics are whose, where these have names of their own.

use clap::Args;
use cromosim_recording::TopicMap;

/// Heading of the help.
const TOPICS: &str = "Topics with names of their own";

/// `--reference-topic` and `--imu-topic`.
#[derive(Args)]
pub struct TopicArguments {
    /// A reference on another topic than /reference/NAME; may be given again
    ///
    /// PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped, mocap4r2's RigidBodies with :BODY, TF with :FRAME or
    /// :FRAME@FIXED (default: the tree's root), such as gripper=/tf:tool0@map. Once given, these are all references.
    /// `cromosim inspect` lists what a bag has
    #[arg(long, hide_short_help = true, value_name = "[NAME=]TOPIC[:BODY]", help_heading = TOPICS)]
    reference_topic: Vec<String>,
    /// An IMU on another topic than /imu/NAME/data_raw; may be given again
    ///
    /// One reference and one IMU belong together; of several, those of the same NAME
    #[arg(long, hide_short_help = true, value_name = "[NAME=]TOPIC", help_heading = TOPICS)]
    imu_topic: Vec<String>,
}

impl TopicArguments {
    /// Which topics are whose.
    pub fn map(&self) -> anyhow::Result<TopicMap> {
        Ok(TopicMap::parse(&self.reference_topic, &self.imu_topic)?)
    }

    /// The first option that was given.
    pub fn given(&self) -> Option<&'static str> {
        match (self.reference_topic.is_empty(), self.imu_topic.is_empty()) {
            (false, _) => Some("--reference-topic"),
            (_, false) => Some("--imu-topic"),
            _ => None,
        }
    }
}
