//! Effects: what lies between an ideal IMU on the reference frame and a real one, one file an
//! effect.
//!
//! With R, a, w the orientation, acceleration and angular velocity of the reference frame at the
//! true time t, and the epoch t0, the stages ([`Stage`]) are, in the order of [`Stage::ORDER`]:
//! ```text
//! Segment  f = R^T (a + alpha x l + w x (w x l) - g)                 lever_arm; reference_tilt, reference_scale, gravity_convention
//! Tissue   f <- H f                                                  soft_tissue
//! Sensor   f, w <- M R_mount^T f, M R_mount^T w                      mount_rotation, mount_slip, axis_convention
//!          f += amplitude sin(2 pi hz (t - t0) + phase)              vibration
//!          w += G f                                                  gyro_g_sensitivity
//!          second-order Butterworth, both channels                   low_pass
//! Timing   stamp = t0 + (t - t0) (1 + ppm 1e-6) + seconds            clock_drift, time_offset; dropped_samples
//! Linear   x <- diag(scale) (I + upper) x + bias + rate (t - t0)     scale, misalignment, bias, bias_drift
//! Digital  white noise, clip, round, times factor                    noise, saturation, quantization, units
//! ```
//! [`SensorModel`] runs them over a whole recording, [`crate::StreamingEffects`] over live samples.
//! A recording adds the vibration with the timing, in closed form and as the low-pass leaves it, so
//! that a fit of its parameters repeats nothing on the grid; its effect therefore has
//! [`Stage::Timing`].

mod axis_convention;
mod bias;
mod bias_drift;
mod clock_drift;
mod dropped_samples;
mod effect;
mod file;
mod filter;
mod gravity_convention;
mod gyro_g_sensitivity;
mod lever_arm;
mod low_pass;
mod misalignment;
mod model;
mod mount_rotation;
mod mount_slip;
mod noise;
mod quantization;
mod readout;
mod reference_noise;
mod reference_scale;
mod reference_smoothing;
mod reference_tilt;
mod residual_view;
mod sampling;
mod saturation;
mod scale;
mod search;
mod serde_impl;
mod soft_tissue;
mod spec;
mod stages;
mod streaming;
mod time_offset;
mod units;
mod vibration;

#[cfg(test)]
mod effect_tests;
#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod start_tests;

use std::fmt;

use nalgebra::Vector3;

pub use axis_convention::nearest_signed_permutation;
pub use dropped_samples::Dropouts;
pub use effect::{Effect, EffectSet};
pub use file::{DeclaredNoise, EffectsFile, PlacementEffects};
pub use gravity_convention::GravityMode;
pub use model::{GridTrace, SensorModel};
pub use noise::white_noise_density;
pub use quantization::lattice_spacing;
pub use residual_view::ResidualView;
pub use saturation::clipping_limit;
pub use search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Ordinary, ReadOff, ReadOffSearch,
    Rounding, Search,
};
pub use spec::{EffectSpec, ParameterFit, ParameterSpec, Shape, Stage};
pub use stages::{MeasurementInput, StagedReadings};
pub use streaming::StreamingEffects;
pub use units::unit_factors;
pub use vibration::{SpectralLine, strongest_line};

/// One reading of both channels, in the axes of its stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Specific force, m/s2.
    pub specific_force: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident => $spec:path,)*) => {
        /// The effects that the library names.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum EffectKind {
            $($(#[$doc])* $kind,)*
        }

        impl EffectKind {
            /// All of them, in order.
            pub const ALL: [Self; [$(Self::$kind),*].len()] = [$(Self::$kind),*];

            /// What the library knows about it.
            pub fn spec(self) -> &'static EffectSpec {
                match self {
                    $(Self::$kind => &$spec,)*
                }
            }
        }
    };
}

kinds! {
    /// Scatter of the reference.
    ReferenceNoise => reference_noise::SPEC,
    /// A reference that was low-passed.
    ReferenceSmoothing => reference_smoothing::SPEC,
    /// A world of the reference that is not level.
    ReferenceTilt => reference_tilt::SPEC,
    /// A reference in wrong units of length.
    ReferenceScale => reference_scale::SPEC,
    /// A sensor turned on its segment.
    MountRotation => mount_rotation::SPEC,
    /// A sensor beside the reference frame.
    LeverArm => lever_arm::SPEC,
    /// A mount that turns once.
    MountSlip => mount_slip::SPEC,
    /// A sensor on soft tissue.
    SoftTissue => soft_tissue::SPEC,
    /// Stamps late by a constant.
    TimeOffset => time_offset::SPEC,
    /// A clock of another rate.
    ClockDrift => clock_drift::SPEC,
    /// Messages lost.
    DroppedSamples => dropped_samples::SPEC,
    /// Constant error of the specific force.
    AccelBias => bias::ACCEL,
    /// Constant error of the angular velocity.
    GyroBias => bias::GYRO,
    /// Gain of the accelerometer's axes.
    AccelScale => scale::ACCEL,
    /// Gain of the gyroscope's axes.
    GyroScale => scale::GYRO,
    /// Accelerometer axes that are not orthogonal.
    AccelMisalignment => misalignment::ACCEL,
    /// Gyroscope axes that are not orthogonal.
    GyroMisalignment => misalignment::GYRO,
    /// White noise of the accelerometer beyond the declared.
    AccelNoise => noise::ACCEL,
    /// White noise of the gyroscope beyond the declared.
    GyroNoise => noise::GYRO,
    /// Accelerometer bias that grows with time.
    AccelBiasDrift => bias_drift::ACCEL,
    /// Gyroscope bias that grows with time.
    GyroBiasDrift => bias_drift::GYRO,
    /// Range of the accelerometer.
    AccelSaturation => saturation::ACCEL,
    /// Range of the gyroscope.
    GyroSaturation => saturation::GYRO,
    /// Resolution of the accelerometer.
    AccelQuantization => quantization::ACCEL,
    /// Resolution of the gyroscope.
    GyroQuantization => quantization::GYRO,
    /// The device's own low-pass.
    LowPass => low_pass::SPEC,
    /// Gyroscope that feels specific force.
    GyroGSensitivity => gyro_g_sensitivity::SPEC,
    /// A vibration at the sensor.
    Vibration => vibration::SPEC,
    /// Axes named otherwise.
    AxisConvention => axis_convention::SPEC,
    /// Accelerometer in other units.
    AccelUnits => units::ACCEL,
    /// Gyroscope in other units.
    GyroUnits => units::GYRO,
    /// Gravity left out or negated.
    GravityConvention => gravity_convention::SPEC,
}

impl EffectKind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// The effect of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

impl fmt::Display for EffectKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}
