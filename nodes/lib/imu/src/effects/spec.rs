//! What the library knows about each effect.

use cromosim_spatial::Stamp;
use nalgebra::{Matrix3, Vector3};

use super::EffectKind;
use crate::{Channel, Reading};

/// Where in the measurement an effect acts; effects of a stage leave the results of the stages
/// before it as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// In the reference, not in the device.
    Reference,
    /// Specific force of the rigid segment, on the grid (1).
    Segment,
    /// Soft tissue, on the grid (2).
    Tissue,
    /// Mount, axes, coupling and low-pass, on the grid (3, 5, 6).
    Sensor,
    /// Clock, and the vibration in closed form, while sampling (9, 4).
    Timing,
    /// Scale, misalignment, bias and drift of each reading (7).
    Linear,
    /// Noise, saturation, quantisation and units (8).
    Digital,
}

/// Form of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    Scalar,
    /// Three numbers.
    Vector3,
    /// Nine numbers, row after row.
    Matrix3,
    /// An absolute time, s; written with nine decimals.
    Time,
    /// One of these words; the value is its number.
    Choice(&'static [&'static str]),
}

impl Shape {
    /// Numbers that a parameter of this form takes.
    pub const fn len(self) -> usize {
        match self {
            Self::Scalar | Self::Time | Self::Choice(_) => 1,
            Self::Vector3 => 3,
            Self::Matrix3 => 9,
        }
    }

    /// Never.
    pub const fn is_empty(self) -> bool {
        false
    }
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Name in files.
    pub name: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Form.
    pub shape: Shape,
    /// Values that change nothing (for a choice: its number).
    pub neutral: &'static [f64],
    /// Least value of each entry.
    pub lower: f64,
    /// Greatest value of each entry.
    pub upper: f64,
    /// A sensible step for finite differences.
    pub step: f64,
}

/// One effect: name, parameters, and what a report says about it.
#[derive(Clone, Copy, Debug)]
pub struct EffectSpec {
    /// Which.
    pub kind: EffectKind,
    /// Name in files.
    pub name: &'static str,
    /// Where it acts.
    pub stage: Stage,
    /// What it is and what it leaves in a residual.
    pub summary: &'static str,
    /// What an engineer would do about it.
    pub remedy: &'static str,
    /// Parameters, in the order of the values.
    pub parameters: &'static [ParameterSpec],
    /// Noise-like: cannot be matched sample by sample, is judged by likelihood.
    pub random: bool,
    /// False for a discrete choice, and for what is read directly off the readings.
    pub continuous: bool,
    /// Initial guesses (flat values) from a residual.
    pub starts: fn(&ResidualView) -> Vec<Vec<f64>>,
}

impl EffectSpec {
    /// Numbers of all parameters.
    pub fn len(&self) -> usize {
        self.parameters
            .iter()
            .map(|parameter| parameter.shape.len())
            .sum()
    }

    /// Never: every effect has a parameter.
    pub fn is_empty(&self) -> bool {
        self.parameters.is_empty()
    }

    /// The values that change nothing.
    pub fn neutral(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .flat_map(|parameter| parameter.neutral.iter().copied())
            .collect()
    }
}

/// What was measured and what is simulated so far, at the same stamps.
#[derive(Clone, Copy, Debug)]
pub struct ResidualView<'a> {
    /// Stamps of the IMU's messages, by its own clock.
    pub stamps: &'a [Stamp],
    /// t0.
    pub epoch: Stamp,
    /// Rate of the messages, Hz.
    pub rate_hz: f64,
    /// What the device read.
    pub measured: &'a [Reading],
    /// What the model reads so far.
    pub simulated: &'a [Reading],
    /// White noise of a reading of the accelerometer, m/s2.
    pub accel_sigma: f64,
    /// White noise of a reading of the gyroscope, rad/s.
    pub gyro_sigma: f64,
}

impl ResidualView<'_> {
    pub(super) fn len(&self) -> usize {
        self.stamps
            .len()
            .min(self.measured.len())
            .min(self.simulated.len())
    }

    /// Pairs of measured and simulated vectors.
    pub(super) fn pairs(
        &self,
        channel: Channel,
    ) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        self.measured
            .iter()
            .zip(self.simulated)
            .take(self.len())
            .map(move |(m, s)| (m[channel], s[channel]))
    }

    /// Measured less simulated.
    pub(super) fn residual(&self, channel: Channel) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.pairs(channel).map(|(m, s)| m - s)
    }

    pub(super) fn sigma(&self, channel: Channel) -> f64 {
        match channel {
            Channel::Accelerometer => self.accel_sigma,
            Channel::Gyroscope => self.gyro_sigma,
        }
    }

    pub(super) fn mean_residual(&self, channel: Channel) -> Vector3<f64> {
        let count = self.len().max(1) as f64;
        self.residual(channel).sum::<Vector3<f64>>() / count
    }

    /// `m s^T` of both channels at one reading, each in units of its scatter, so that neither
    /// drowns the other.
    pub(super) fn outer_products(&self) -> impl Iterator<Item = Matrix3<f64>> + '_ {
        let weight = |channel| {
            let power: f64 = self.pairs(channel).map(|(_, s)| s.norm_squared()).sum();
            if power > 0.0 {
                self.len() as f64 / power
            } else {
                0.0
            }
        };
        let (accel, gyro) = (weight(Channel::Accelerometer), weight(Channel::Gyroscope));
        let accelerometer = self
            .pairs(Channel::Accelerometer)
            .map(move |(m, s)| m * s.transpose() * accel);
        accelerometer
            .zip(self.pairs(Channel::Gyroscope))
            .map(move |(sum, (m, s))| sum + m * s.transpose() * gyro)
    }
}

/// Median; 0 of nothing. Reorders.
pub(super) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
