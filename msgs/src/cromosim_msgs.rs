//! Our own messages: poses and states of SMPL bodies.

use crate::geometry_msgs::{Pose, Quaternion};
use crate::std_msgs::Header;

ros_message! {
    "cromosim_msgs/msg/SmplPose", "../msg/SmplPose.msg", Message;
    /// Pose of one person as a source says it, in the joints of SMPL.
    #[derive(Default)]
    pub struct SmplPose {
        /// Time, and the frame of `world_from_pelvis`.
        pub header: Header,
        /// Tells several people apart.
        pub body_id: String,
        /// `neutral`, `female` or `male`.
        pub gender: String,
        /// Shape coefficients; empty where unknown.
        pub betas: Vec<f64>,
        /// Whose shapes they tell: `smpl`, `smplx` or `cromosim`.
        pub shape_space: String,
        /// Pose of the pelvis joint, m.
        pub world_from_pelvis: Pose,
        /// Element 0 repeats `world_from_pelvis.orientation`, the others are parent_from_joint, in
        /// SMPL's order of joints.
        pub local_rotations: [Quaternion; 24],
        /// 0 to 1; 1 or NaN where the source cannot say.
        pub confidence: f64,
    }
}

ros_message! {
    "cromosim_msgs/msg/SmplState", "../msg/SmplState.msg", Message;
    /// State of one body in the world (z up), with a settled shape.
    #[derive(Default)]
    pub struct SmplState {
        /// Time, and the world frame.
        pub header: Header,
        /// Tells several people apart.
        pub body_id: String,
        /// `neutral`, `female` or `male`.
        pub gender: String,
        /// Shape coefficients.
        pub betas: Vec<f64>,
        /// Whose shapes they tell: `smpl`, `smplx` or `cromosim`.
        pub shape_space: String,
        /// Pose of the pelvis joint, m.
        pub world_from_pelvis: Pose,
        /// Element 0 repeats `world_from_pelvis.orientation`, the others are parent_from_joint, in
        /// SMPL's order of joints.
        pub local_rotations: [Quaternion; 24],
        /// 0 to 1; 1 or NaN where the source cannot say.
        pub confidence: f64,
    }
}
