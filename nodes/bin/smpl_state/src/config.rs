//! Parameters of the node.

use cromosim_ros::node_config;

node_config! {
    /// ROS parameters of `smpl_state`.
    pub struct Config {
        /// Body model file (SMPL, SMPL-H, SMPL-X; npz or pickle); empty: the embedded body.
        pub body: String = String::new(),
        /// The body file that betas of another shape space are for: this node's body is then fitted
        /// to that person's bones; empty: such betas are refused.
        pub source_body: String = String::new(),
        /// Name of the world frame (z up).
        pub world_frame: String = "world".to_owned(),
        /// Prefix of every frame but the world's: `alice` makes `alice/pelvis`.
        pub prefix: String = String::new(),
        /// Origin of the source's frame in the world, m.
        pub source_position: [f64; 3] = [0.0; 3],
        /// Turn of the source's frame in the world: axis times angle, rad.
        pub source_rotvec: [f64; 3] = [0.0; 3],
        /// Low-pass of the poses, Hz; 0: off. It delays by 1 / (2 pi f).
        pub smoothing_cutoff_hz: f64 = 0.0,
        /// How often /diagnostics is published, Hz; 0: never.
        pub diagnostics_rate_hz: f64 = 1.0,
        /// The node reports that it is ready once `smpl/state` has this many subscriptions.
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
