//! The tree of frames.

use crate::geometry_msgs::TransformStamped;

ros_message! {
    "tf2_msgs/msg/TFMessage", "../std/tf2_msgs/msg/TFMessage.msg", Message;
    /// Edges of the tree of frames, as on `/tf` and `/tf_static`.
    #[derive(Default)]
    pub struct TFMessage {
        /// The edges.
        pub transforms: Vec<TransformStamped>,
    }
}
