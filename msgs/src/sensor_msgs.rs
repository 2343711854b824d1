//! Sensors.

use crate::geometry_msgs::{Quaternion, Vector3};
use crate::std_msgs::Header;

ros_message! {
    "sensor_msgs/msg/Imu", "../std/sensor_msgs/msg/Imu.msg", Message;
    /// One sample of an inertial measurement unit, in sensor axes (REP-145).
    ///
    /// Covariances: row major 3x3. All zeros: unknown; element 0 = -1: the quantity is not
    /// reported.
    #[derive(Default)]
    pub struct Imu {
        /// Time, and the sensor's frame.
        pub header: Header,
        /// World from sensor.
        pub orientation: Quaternion,
        /// rad2.
        pub orientation_covariance: [f64; 9],
        /// Of the sensor against the world, rad/s.
        pub angular_velocity: Vector3,
        /// (rad/s)2.
        pub angular_velocity_covariance: [f64; 9],
        /// Specific force, m/s2: +g upwards at rest.
        pub linear_acceleration: Vector3,
        /// (m/s2)2.
        pub linear_acceleration_covariance: [f64; 9],
    }
}

ros_message! {
    "sensor_msgs/msg/MagneticField", "../std/sensor_msgs/msg/MagneticField.msg", Message;
    /// One sample of a magnetometer, in sensor axes.
    #[derive(Default)]
    pub struct MagneticField {
        /// Time, and the sensor's frame.
        pub header: Header,
        /// Flux density, T.
        pub magnetic_field: Vector3,
        /// T2, row major 3x3. All zeros: unknown.
        pub magnetic_field_covariance: [f64; 9],
    }
}

ros_message! {
    "sensor_msgs/msg/Temperature", "../std/sensor_msgs/msg/Temperature.msg", Message;
    /// One reading of a thermometer.
    #[derive(Default)]
    pub struct Temperature {
        /// Time, and where it is measured.
        pub header: Header,
        /// degC.
        pub temperature: f64,
        /// K2; 0: unknown.
        pub variance: f64,
    }
}
