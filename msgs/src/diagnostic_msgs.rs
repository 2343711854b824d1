//! Diagnostics.

use crate::std_msgs::Header;

ros_message! {
    "diagnostic_msgs/msg/KeyValue", "../std/diagnostic_msgs/msg/KeyValue.msg", Message;
    /// One named finding.
    #[derive(Default, Eq)]
    pub struct KeyValue {
        /// What was looked at, such as `gap, m/s2`.
        pub key: String,
        /// What was found.
        pub value: String,
    }
}

ros_message! {
    "diagnostic_msgs/msg/DiagnosticStatus", "../std/diagnostic_msgs/msg/DiagnosticStatus.msg", Message;
    /// The state of one component.
    #[derive(Default, Eq)]
    pub struct DiagnosticStatus {
        /// One of [`Self::OK`], [`Self::WARN`], [`Self::ERROR`], [`Self::STALE`].
        pub level: u8 as Byte,
        /// Name of the component.
        pub name: String,
        /// What is the matter.
        pub message: String,
        /// Serial number or the like of the device; may be empty.
        pub hardware_id: String,
        /// Findings in numbers and words.
        pub values: Vec<KeyValue>,
    }
    /// All is well.
    const OK: u8 = 0;
    /// Works, with something to be looked at.
    const WARN: u8 = 1;
    /// Does not work.
    const ERROR: u8 = 2;
    /// No news for too long.
    const STALE: u8 = 3;
}

ros_message! {
    "diagnostic_msgs/msg/DiagnosticArray", "../std/diagnostic_msgs/msg/DiagnosticArray.msg", Message;
    /// The states of several components at one time.
    #[derive(Default, Eq)]
    pub struct DiagnosticArray {
        /// When the states were so.
        pub header: Header,
        /// One for each component.
        pub status: Vec<DiagnosticStatus>,
    }
}
