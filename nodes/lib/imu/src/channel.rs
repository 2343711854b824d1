//! The two channels of an IMU, and a reading of both.

use std::ops::{Index, IndexMut};

use nalgebra::Vector3;

/// One of the two vectors that an IMU reads; each has three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Specific force, m/s2.
    Accelerometer,
    /// Angular velocity, rad/s.
    Gyroscope,
}

/// Names of the six values of a reading, as files and reports have them.
pub const AXES: [&str; 6] = [
    "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z",
];

impl Channel {
    /// Both, in the order in which a reading lists them.
    pub const ALL: [Self; 2] = [Self::Accelerometer, Self::Gyroscope];

    /// Position in [`Channel::ALL`]; the channel's values in [`AXES`] begin at three times this.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Full name, for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Accelerometer => "accelerometer",
            Self::Gyroscope => "gyroscope",
        }
    }

    /// What the names of its effects and of its axes begin with.
    pub const fn prefix(self) -> &'static str {
        match self {
            Self::Accelerometer => "accel",
            Self::Gyroscope => "gyro",
        }
    }

    /// SI unit of its values.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Accelerometer => "m/s2",
            Self::Gyroscope => "rad/s",
        }
    }
}

/// One value for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerChannel<T> {
    /// For the specific force.
    pub accelerometer: T,
    /// For the angular velocity.
    pub gyroscope: T,
}

impl<T> PerChannel<T> {
    /// The values that `value` gives for the channels.
    pub fn from_fn(mut value: impl FnMut(Channel) -> T) -> Self {
        Self {
            accelerometer: value(Channel::Accelerometer),
            gyroscope: value(Channel::Gyroscope),
        }
    }
}

impl<T> Index<Channel> for PerChannel<T> {
    type Output = T;

    fn index(&self, channel: Channel) -> &T {
        match channel {
            Channel::Accelerometer => &self.accelerometer,
            Channel::Gyroscope => &self.gyroscope,
        }
    }
}

impl<T> IndexMut<Channel> for PerChannel<T> {
    fn index_mut(&mut self, channel: Channel) -> &mut T {
        match channel {
            Channel::Accelerometer => &mut self.accelerometer,
            Channel::Gyroscope => &mut self.gyroscope,
        }
    }
}

/// One reading of both channels, in the axes of its stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Specific force, m/s2.
    pub specific_force: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
}

impl Index<Channel> for Reading {
    type Output = Vector3<f64>;

    fn index(&self, channel: Channel) -> &Vector3<f64> {
        match channel {
            Channel::Accelerometer => &self.specific_force,
            Channel::Gyroscope => &self.angular_velocity,
        }
    }
}

impl IndexMut<Channel> for Reading {
    fn index_mut(&mut self, channel: Channel) -> &mut Vector3<f64> {
        match channel {
            Channel::Accelerometer => &mut self.specific_force,
            Channel::Gyroscope => &mut self.angular_velocity,
        }
    }
}
