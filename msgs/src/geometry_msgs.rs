//! Vectors, rotations and poses.

use crate::std_msgs::Header;

ros_message! {
    "geometry_msgs/msg/Vector3", "../std/geometry_msgs/msg/Vector3.msg", Message;
    /// Three components in the frame of the header; the unit is said where it is used.
    #[derive(Copy, Default)]
    pub struct Vector3 {
        /// First component.
        pub x: f64,
        /// Second component.
        pub y: f64,
        /// Third component.
        pub z: f64,
    }
}

ros_message! {
    "geometry_msgs/msg/Point", "../std/geometry_msgs/msg/Point.msg", Message;
    /// A position, m.
    #[derive(Copy, Default)]
    pub struct Point {
        /// First component.
        pub x: f64,
        /// Second component.
        pub y: f64,
        /// Third component.
        pub z: f64,
    }
}

ros_message! {
    "geometry_msgs/msg/Quaternion", "../std/geometry_msgs/msg/Quaternion.msg", Message;
    /// A rotation as a unit quaternion. The default is the identity, as in ROS.
    #[derive(Copy)]
    pub struct Quaternion {
        /// First vector component.
        pub x: f64,
        /// Second vector component.
        pub y: f64,
        /// Third vector component.
        pub z: f64,
        /// Scalar part.
        pub w: f64,
    }
}

impl Default for Quaternion {
    fn default() -> Self {
        Self {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        }
    }
}

ros_message! {
    "geometry_msgs/msg/Pose", "../std/geometry_msgs/msg/Pose.msg", Message;
    /// Position and orientation.
    #[derive(Copy, Default)]
    pub struct Pose {
        /// Position, m.
        pub position: Point,
        /// Rotation from the body to the frame of the header.
        pub orientation: Quaternion,
    }
}

ros_message! {
    "geometry_msgs/msg/PoseStamped", "../std/geometry_msgs/msg/PoseStamped.msg", Message;
    /// A pose with its time and frame.
    #[derive(Default)]
    pub struct PoseStamped {
        /// Time and frame.
        pub header: Header,
        /// The pose in that frame.
        pub pose: Pose,
    }
}

ros_message! {
    "geometry_msgs/msg/Transform", "../std/geometry_msgs/msg/Transform.msg", Message;
    /// Takes points from one frame into another.
    #[derive(Copy, Default)]
    pub struct Transform {
        /// Applied second, m.
        pub translation: Vector3,
        /// Applied first.
        pub rotation: Quaternion,
    }
}

ros_message! {
    "geometry_msgs/msg/TransformStamped", "../std/geometry_msgs/msg/TransformStamped.msg", Message;
    /// parent_from_child at one time.
    #[derive(Default)]
    pub struct TransformStamped {
        /// Time, and the parent frame.
        pub header: Header,
        /// The child frame.
        pub child_frame_id: String,
        /// parent_from_child.
        pub transform: Transform,
    }
}

ros_message! {
    "geometry_msgs/msg/PoseWithCovariance", "../std/geometry_msgs/msg/PoseWithCovariance.msg", Message;
    /// A pose, and how far it may be off.
    #[derive(Copy, Default)]
    pub struct PoseWithCovariance {
        /// The pose.
        pub pose: Pose,
        /// Of position along x, y, z (m2) and rotation about the fixed axes (rad2).
        pub covariance: [[f64; 6]; 6],
    }
}

ros_message! {
    "geometry_msgs/msg/PoseWithCovarianceStamped", "../std/geometry_msgs/msg/PoseWithCovarianceStamped.msg", Message;
    /// An estimated pose with its time and frame.
    #[derive(Default)]
    pub struct PoseWithCovarianceStamped {
        /// Time and frame.
        pub header: Header,
        /// The pose in that frame.
        pub pose: PoseWithCovariance,
    }
}

ros_message! {
    "geometry_msgs/msg/Twist", "../std/geometry_msgs/msg/Twist.msg", Message;
    /// A velocity.
    #[derive(Copy, Default)]
    pub struct Twist {
        /// m/s.
        pub linear: Vector3,
        /// rad/s.
        pub angular: Vector3,
    }
}

ros_message! {
    "geometry_msgs/msg/TwistWithCovariance", "../std/geometry_msgs/msg/TwistWithCovariance.msg", Message;
    /// A velocity, and how far it may be off.
    #[derive(Copy, Default)]
    pub struct TwistWithCovariance {
        /// The velocity.
        pub twist: Twist,
        /// Of the linear (m2/s2) and the angular velocity (rad2/s2).
        pub covariance: [[f64; 6]; 6],
    }
}
