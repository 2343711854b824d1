//! Navigation.

use crate::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use crate::std_msgs::Header;

ros_message! {
    "nav_msgs/msg/Odometry", "../std/nav_msgs/msg/Odometry.msg", Message;
    /// An estimated pose of a frame, and its velocity.
    #[derive(Default)]
    pub struct Odometry {
        /// Time, and the frame that the pose is in.
        pub header: Header,
        /// The frame whose pose it is, and whose axes the velocity is in.
        pub child_frame_id: String,
        /// Of the child in the header's frame.
        pub pose: PoseWithCovariance,
        /// Of the child, in its own axes.
        pub twist: TwistWithCovariance,
    }
}
