//! Parameters of the node.

use cromosim_ros::node_config;

node_config! {
    /// ROS parameters of `viewer`.
    pub struct Config {
        /// Write a Rerun recording to this file (.rrd) rather than showing it live.
        pub recording: String = String::new(),
        /// Rerun viewer to show it in, as `127.0.0.1:9876`; used where `recording` is empty.
        pub connect: String = "127.0.0.1:9876".to_owned(),
        /// Body model file (SMPL, SMPL-H, SMPL-X; npz or pickle); empty: the embedded body.
        pub body: String = String::new(),
        /// Pictures of the body per second, Hz.
        pub mesh_rate_hz: f64 = 25.0,
        /// Seconds of curves shown up to the present, where it is live; a file shows all of them.
        pub curve_window_seconds: f64 = 10.0,
        /// Draw the skeleton too.
        pub skeleton: bool = false,
        /// Put before every frame but the world's, with a slash; as for smpl_state.
        pub prefix: String = String::new(),
    }
}
