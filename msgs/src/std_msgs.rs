//! Header and text.

use crate::builtin_interfaces::Time;

ros_message! {
    "std_msgs/msg/Header", "../std/std_msgs/msg/Header.msg", Message;
    /// When a message was true, and in which frame.
    #[derive(Default, Eq)]
    pub struct Header {
        /// When what the message says was so.
        pub stamp: Time,
        /// Name of the frame.
        pub frame_id: std::string::String,
    }
}

ros_message! {
    "std_msgs/msg/String", "../std/std_msgs/msg/String.msg", Message;
    /// Plain text.
    #[derive(Default, Eq)]
    pub struct String {
        /// UTF-8, without a bound on its length.
        pub data: std::string::String,
    }
}

impl Header {
    /// The header of a stamp in nanoseconds and a frame.
    pub fn new(stamp_nanos: i64, frame_id: impl Into<std::string::String>) -> Self {
        Self {
            stamp: Time::from_nanos(stamp_nanos),
            frame_id: frame_id.into(),
        }
    }
}
