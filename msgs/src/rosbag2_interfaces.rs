//! Services of players and recorders, with the names and fields of ROS 2 Jazzy.

use crate::builtin_interfaces::{Duration, Time};

ros_service! {
    /// Pauses playback or recording.
    "rosbag2_interfaces/srv/Pause", Pause, PauseRequest, PauseResponse
}

ros_message! {
    "rosbag2_interfaces/srv/Pause_Request", "../std/rosbag2_interfaces/srv/Pause.srv", Request;
    /// Request of [`Pause`].
    #[derive(Default)]
    pub struct PauseRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/Pause_Response", "../std/rosbag2_interfaces/srv/Pause.srv", Response;
    /// Response of [`Pause`].
    #[derive(Default)]
    pub struct PauseResponse {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_service! {
    /// Goes on after a pause.
    "rosbag2_interfaces/srv/Resume", Resume, ResumeRequest, ResumeResponse
}

ros_message! {
    "rosbag2_interfaces/srv/Resume_Request", "../std/rosbag2_interfaces/srv/Resume.srv", Request;
    /// Request of [`Resume`].
    #[derive(Default)]
    pub struct ResumeRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/Resume_Response", "../std/rosbag2_interfaces/srv/Resume.srv", Response;
    /// Response of [`Resume`].
    #[derive(Default)]
    pub struct ResumeResponse {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_service! {
    /// Pauses where running, goes on where paused.
    "rosbag2_interfaces/srv/TogglePaused", TogglePaused, TogglePausedRequest, TogglePausedResponse
}

ros_message! {
    "rosbag2_interfaces/srv/TogglePaused_Request", "../std/rosbag2_interfaces/srv/TogglePaused.srv", Request;
    /// Request of [`TogglePaused`].
    #[derive(Default)]
    pub struct TogglePausedRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/TogglePaused_Response", "../std/rosbag2_interfaces/srv/TogglePaused.srv", Response;
    /// Response of [`TogglePaused`].
    #[derive(Default)]
    pub struct TogglePausedResponse {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_service! {
    /// Whether playback or recording is paused.
    "rosbag2_interfaces/srv/IsPaused", IsPaused, IsPausedRequest, IsPausedResponse
}

ros_message! {
    "rosbag2_interfaces/srv/IsPaused_Request", "../std/rosbag2_interfaces/srv/IsPaused.srv", Request;
    /// Request of [`IsPaused`].
    #[derive(Default)]
    pub struct IsPausedRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/IsPaused_Response", "../std/rosbag2_interfaces/srv/IsPaused.srv", Response;
    /// Response of [`IsPaused`].
    #[derive(Default)]
    pub struct IsPausedResponse {
        /// True while nothing is played or recorded.
        pub paused: bool,
    }
}

ros_service! {
    /// How fast playback is.
    "rosbag2_interfaces/srv/GetRate", GetRate, GetRateRequest, GetRateResponse
}

ros_message! {
    "rosbag2_interfaces/srv/GetRate_Request", "../std/rosbag2_interfaces/srv/GetRate.srv", Request;
    /// Request of [`GetRate`].
    #[derive(Default)]
    pub struct GetRateRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/GetRate_Response", "../std/rosbag2_interfaces/srv/GetRate.srv", Response;
    /// Response of [`GetRate`].
    #[derive(Default)]
    pub struct GetRateResponse {
        /// Recording seconds per second.
        pub rate: f64,
    }
}

ros_service! {
    /// Sets how fast playback is.
    "rosbag2_interfaces/srv/SetRate", SetRate, SetRateRequest, SetRateResponse
}

ros_message! {
    "rosbag2_interfaces/srv/SetRate_Request", "../std/rosbag2_interfaces/srv/SetRate.srv", Request;
    /// Request of [`SetRate`].
    #[derive(Default)]
    pub struct SetRateRequest {
        /// Recording seconds per second.
        pub rate: f64,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/SetRate_Response", "../std/rosbag2_interfaces/srv/SetRate.srv", Response;
    /// Response of [`SetRate`].
    #[derive(Default)]
    pub struct SetRateResponse {
        /// False: not a positive number.
        pub success: bool,
    }
}

ros_service! {
    /// Goes on from another time.
    "rosbag2_interfaces/srv/Seek", Seek, SeekRequest, SeekResponse
}

ros_message! {
    "rosbag2_interfaces/srv/Seek_Request", "../std/rosbag2_interfaces/srv/Seek.srv", Request;
    /// Request of [`Seek`].
    #[derive(Default)]
    pub struct SeekRequest {
        /// In the time of the recording.
        pub time: Time,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/Seek_Response", "../std/rosbag2_interfaces/srv/Seek.srv", Response;
    /// Response of [`Seek`].
    #[derive(Default)]
    pub struct SeekResponse {
        /// False: outside the recording.
        pub success: bool,
    }
}

ros_service! {
    /// Plays one message while paused.
    "rosbag2_interfaces/srv/PlayNext", PlayNext, PlayNextRequest, PlayNextResponse
}

ros_message! {
    "rosbag2_interfaces/srv/PlayNext_Request", "../std/rosbag2_interfaces/srv/PlayNext.srv", Request;
    /// Request of [`PlayNext`].
    #[derive(Default)]
    pub struct PlayNextRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/PlayNext_Response", "../std/rosbag2_interfaces/srv/PlayNext.srv", Response;
    /// Response of [`PlayNext`].
    #[derive(Default)]
    pub struct PlayNextResponse {
        /// False: not paused, or at the end.
        pub success: bool,
    }
}

ros_service! {
    /// Plays several messages at once while paused.
    "rosbag2_interfaces/srv/Burst", Burst, BurstRequest, BurstResponse
}

ros_message! {
    "rosbag2_interfaces/srv/Burst_Request", "../std/rosbag2_interfaces/srv/Burst.srv", Request;
    /// Request of [`Burst`].
    #[derive(Default)]
    pub struct BurstRequest {
        /// How many; 0 for all that are left.
        pub num_messages: u64,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/Burst_Response", "../std/rosbag2_interfaces/srv/Burst.srv", Response;
    /// Response of [`Burst`].
    #[derive(Default)]
    pub struct BurstResponse {
        /// How many were played.
        pub actually_burst: u64,
    }
}

ros_service! {
    /// Starts playback again, from a time that may be given.
    "rosbag2_interfaces/srv/Play", Play, PlayRequest, PlayResponse
}

ros_message! {
    "rosbag2_interfaces/srv/Play_Request", "../std/rosbag2_interfaces/srv/Play.srv", Request;
    /// Request of [`Play`].
    #[derive(Default)]
    pub struct PlayRequest {
        /// Counted from the start of the recording.
        pub start_offset: Time,
        /// Negative: to the end.
        pub playback_duration: Duration,
        /// Negative: to the end.
        pub playback_until_timestamp: Time,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/Play_Response", "../std/rosbag2_interfaces/srv/Play.srv", Response;
    /// Response of [`Play`].
    #[derive(Default)]
    pub struct PlayResponse {
        /// Whether it started.
        pub success: bool,
    }
}

ros_service! {
    /// Ends playback or recording.
    "rosbag2_interfaces/srv/Stop", Stop, StopRequest, StopResponse
}

ros_message! {
    "rosbag2_interfaces/srv/Stop_Request", "../std/rosbag2_interfaces/srv/Stop.srv", Request;
    /// Request of [`Stop`].
    #[derive(Default)]
    pub struct StopRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/Stop_Response", "../std/rosbag2_interfaces/srv/Stop.srv", Response;
    /// Response of [`Stop`].
    #[derive(Default)]
    pub struct StopResponse {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_service! {
    /// Writes what the recorder holds in memory.
    "rosbag2_interfaces/srv/Snapshot", Snapshot, SnapshotRequest, SnapshotResponse
}

ros_message! {
    "rosbag2_interfaces/srv/Snapshot_Request", "../std/rosbag2_interfaces/srv/Snapshot.srv", Request;
    /// Request of [`Snapshot`].
    #[derive(Default)]
    pub struct SnapshotRequest {
        /// On the wire because CDR knows no empty structure; always 0.
        pub structure_needs_at_least_one_member: u8,
    }
}

ros_message! {
    "rosbag2_interfaces/srv/Snapshot_Response", "../std/rosbag2_interfaces/srv/Snapshot.srv", Response;
    /// Response of [`Snapshot`].
    #[derive(Default)]
    pub struct SnapshotResponse {
        /// Whether it was written.
        pub success: bool,
    }
}
