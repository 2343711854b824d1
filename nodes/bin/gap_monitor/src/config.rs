//! Parameters of the node.

use anyhow::ensure;
use cromosim_ros::node_config;

node_config! {
    /// ROS parameters of `gap_monitor`.
    pub struct Config {
        /// Names of the placements to watch; at least one.
        pub placements: Vec<String> = Vec::new(),
        /// Topic of the real IMUs (sensor_msgs/msg/Imu); {name} stands for the placement.
        pub measured_topic: String = "/imu/{name}/data_raw".to_owned(),
        /// Topic of the virtual IMUs (sensor_msgs/msg/Imu); {name} stands for the placement.
        pub simulated_topic: String = "/virtual/{name}/data_raw".to_owned(),
        /// The last so many seconds are compared.
        pub window_s: f64 = 10.0,
        /// How often /diagnostics is published, Hz.
        pub rate_hz: f64 = 1.0,
        /// A stream without a message for so many seconds is stale.
        pub stale_after_s: f64 = 2.0,
        /// White noise below which a difference of the accelerometers is no gap, m/s2 per axis.
        pub accel_floor: f64 = 0.02,
        /// White noise below which a difference of the gyroscopes is no gap, rad/s per axis.
        pub gyro_floor: f64 = 0.002,
        /// A gap from here on is an error rather than a warning, m/s2 (root mean square of the
        /// vector).
        pub accel_error: f64 = 5.0,
        /// A gap from here on is an error rather than a warning, rad/s (root mean square of the
        /// vector).
        pub gyro_error: f64 = 1.0,
    }
}

/// What `{name}` stands for in a topic.
const NAME: &str = "{name}";

impl Config {
    /// Checks what types cannot say.
    ///
    /// # Errors
    /// One line that names the parameter.
    pub fn check(&self) -> anyhow::Result<()> {
        ensure!(
            !self.placements.is_empty(),
            "parameter 'placements': expected the names of one or more IMUs, found none; give them as placements:=[left_wrist, head]"
        );
        for (index, name) in self.placements.iter().enumerate() {
            ensure!(
                !name.is_empty(),
                "parameter 'placements': expected names, found an empty one"
            );
            ensure!(
                !self.placements[..index].contains(name),
                "parameter 'placements': '{name}' is there twice"
            );
        }
        for (parameter, topic) in [
            ("measured_topic", &self.measured_topic),
            ("simulated_topic", &self.simulated_topic),
        ] {
            ensure!(
                topic.contains(NAME) || self.placements.len() == 1,
                "parameter '{parameter}': expected {NAME} in it, as there are {} placements, found '{topic}'",
                self.placements.len()
            );
        }
        let same = self.measured_topic == self.simulated_topic;
        ensure!(
            !same,
            "parameter 'simulated_topic': expected another topic than measured_topic, found '{}' for both",
            self.simulated_topic
        );
        let positive = [
            ("window_s", self.window_s),
            ("rate_hz", self.rate_hz),
            ("stale_after_s", self.stale_after_s),
            ("accel_floor", self.accel_floor),
            ("gyro_floor", self.gyro_floor),
            ("accel_error", self.accel_error),
            ("gyro_error", self.gyro_error),
        ];
        for (parameter, value) in positive {
            ensure!(
                value.is_finite() && value > 0.0,
                "parameter '{parameter}': expected more than 0, found {value}"
            );
        }
        ensure!(
            self.window_s <= 600.0,
            "parameter 'window_s': expected at most 600, found {}",
            self.window_s
        );
        Ok(())
    }

    /// The topics of a placement: measured, simulated.
    pub fn topics(&self, placement: &str) -> [String; 2] {
        [
            self.measured_topic.replace(NAME, placement),
            self.simulated_topic.replace(NAME, placement),
        ]
    }
}
