//! Parameters of the node.

use cromosim_ros::node_config;

node_config! {
    /// ROS parameters of `virtual_imu`.
    pub struct Config {
        /// Sensor placements (YAML); empty: left_wrist, right_ankle, pelvis, sternum and head.
        pub placements: String = String::new(),
        /// Body model file (SMPL, SMPL-H, SMPL-X; npz or pickle); empty: the embedded body.
        pub body: String = String::new(),
        /// Scheme of the derivatives for every placement; empty: the one that each placement names.
        pub scheme: String = String::new(),
        /// Messages per second for every placement, Hz; 0: the rate that each placement names.
        pub rate_hz: f64 = 0.0,
        /// Rate of the states, Hz; 0: found out from the first ones. It sets the schemes' delay.
        pub state_rate_hz: f64 = 0.0,
        /// Where the states' poses come from, which says what noise the adaptive spline expects of
        /// them and what of their errors it cannot see: `tracked` (optical capture), `fitted` (fitted
        /// to markers and smoothed before, as AMASS), `inertial_suit`, `video`. Empty: tracked, as no
        /// message says it.
        pub pose_source: String = String::new(),
        /// Add the random part of the device's errors: white noise and lost samples. Without it
        /// biases and all other effects stay. May change at run time.
        pub noise: bool = true,
        /// Seed of the noise and of lost samples. May change at run time.
        pub seed: i64 = 0,
        /// Folder of streaming networks, as `cromosim train` writes it, that correct acceleration
        /// and angular velocity before the device's effects; placements then run at 100 Hz, at most
        /// 90 ms and two states behind. Empty: none. May change at run time.
        pub learned: String = String::new(),
        /// Distribution mapping (YAML), as `cromosim map` writes it, applied last to the placements
        /// that it names. Empty: none. May change at run time.
        pub mapping: String = String::new(),
        /// The magnetic field that devices with a magnetometer read, as `imu/NAME/mag`: a vector
        /// in T and world axes (0,1.9e-5,-4.5e-5), a place and a day (52.52N,13.41E,2026-11-24;
        /// World Magnetic Model, x east) or a YAML file with disturbances. Empty: no `imu/NAME/mag`.
        pub magnetic_field: String = String::new(),
        /// Where the orientation of `imu/NAME/data` comes from: `truth`, `vqf`, `madgwick` or
        /// `mahony` (fused from the device's own readings), or `none`. May change at run time.
        pub orientation: String = "truth".to_owned(),
        /// Device of every placement, in the place of its own: a built-in one's name or a YAML file.
        /// Empty: as the placements say. May change at run time.
        pub device: String = String::new(),
        /// Put before every frame but the world's, with a slash; as for smpl_state.
        pub prefix: String = String::new(),
        /// Publish the site's pose of every state as `reference/NAME` too.
        pub publish_reference: bool = false,
        /// How long errors of the poses hold, s: their correlation is exp(-(dt / this)^2 / 2). 0:
        /// they are new with each pose, the worst case; the covariances that follow from
        /// SmplState's confidence are then far too large for poses that were smoothed.
        pub pose_error_correlation_s: f64 = 0.0,
        /// Silence of the states after which the schemes begin anew, s.
        pub gap_seconds: f64 = 0.25,
        /// How often /diagnostics is published, Hz; 0: never.
        pub diagnostics_rate_hz: f64 = 1.0,
        /// The node is ready when every `imu/NAME/data_raw` has so many subscriptions.
        pub ready_subscriptions: i64 = 0,
    }
}

impl Config {
    /// The name of a frame of this body.
    pub fn frame(&self, name: &str) -> String {
        if self.prefix.is_empty() {
            name.to_owned()
        } else {
            format!("{}/{name}", self.prefix)
        }
    }
}
