//! The clock.

use crate::builtin_interfaces::Time;

ros_message! {
    "rosgraph_msgs/msg/Clock", "../std/rosgraph_msgs/msg/Clock.msg", Message;
    /// The time that nodes with `use_sim_time` live by.
    #[derive(Copy, Default, Eq)]
    pub struct Clock {
        /// Now.
        pub clock: Time,
    }
}
