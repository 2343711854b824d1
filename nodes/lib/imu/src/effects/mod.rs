//! Effects: what lies between an ideal IMU on the reference frame and a real one, one file an
//! effect.
//!
//! With R, a, w the orientation, acceleration and angular velocity of the reference frame at the
//! true time t, and the epoch t0, the stages ([`Stage`]) are, in the order of [`Stage::ORDER`]:
//! ```text
//! Segment  f = R^T (a + alpha x l + w x (w x l) - g)                 lever_arm; reference_tilt, reference_scale, reference_units, gravity_convention
//! Tissue   f <- -(wn^2 d + 2 z wn d'), where                         soft_tissue
//!          d'' = -wn^2 d - 2 z wn d' - f - 2 w x d' - alpha x d - w x (w x d)
//! Sensor   f, w <- M R_mount^T f, M R_mount^T w                      mount_rotation, mount_slip, axis_convention
//!          f, w += amplitude sin(2 pi hz (t - t0) + phase)           vibration
//!          w += G f                                                  gyro_g_sensitivity
//!          second-order Butterworth                                  low_pass of both channels, or accel_low_pass, gyro_low_pass
//! Timing   w(t) <- w(t - seconds)                                    channel_delay
//!          stamp = t0 + (t - t0) (1 + ppm 1e-6) + seconds            clock_drift, time_offset; dropped_samples
//! Linear   x <- diag(scale) (I + upper) x + bias + rate (t - t0)     scale, misalignment, bias, bias_drift
//!          x += per_kelvin rise (1 - exp(-(t - t0) / time_constant)) warm_up
//! Digital  x += drawn biases + white noise, clip, round, times factor  turn_on_bias, bias_instability, bias_walk, noise; saturation, quantization, units
//! ```
//! [`SensorModel`] runs them over a whole recording, [`crate::StreamingEffects`] over live samples.
//! A recording adds the vibration with the timing, in closed form and as the low-pass leaves it, so
//! that a fit of its parameters repeats nothing on the grid; its effect therefore has
//! [`Stage::Timing`]. Errors of a reading go by its own true time, so that stamps may come before
//! them.

mod axis_convention;
mod bias;
mod bias_drift;
mod bias_instability;
mod bias_walk;
mod catalogue;
mod channel_delay;
mod channel_low_pass;
mod clock_drift;
mod drawn_biases;
mod dropped_samples;
mod effect;
mod file;
mod filter;
mod gravity_convention;
mod gyro_g_sensitivity;
mod kind;
mod lever_arm;
mod low_pass;
mod misalignment;
mod model;
mod mount_rotation;
mod mount_slip;
mod noise;
mod number;
mod quantization;
mod readout;
mod reference_errors;
mod reference_interpolation;
mod reference_noise;
mod reference_scale;
mod reference_smoothing;
mod reference_tilt;
mod reference_units;
mod residual_view;
mod response_file;
mod sampling;
mod saturation;
mod scale;
mod search;
mod sensor_axes;
mod serde_impl;
mod soft_tissue;
mod spec;
mod spectral_line;
mod stages;
mod streaming;
mod time_offset;
mod timing;
mod tissue;
mod turn_on_bias;
mod units;
mod vibration;
mod warm_up;
mod wave;

#[cfg(test)]
mod effect_tests;
#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod start_tests;

pub use crate::channel::Reading;
pub use axis_convention::{AXIS_ORDERS, nearest_signed_permutation};
pub(crate) use channel_delay::DelayLine;
pub use drawn_biases::DrawnBiases;
pub(crate) use drawn_biases::StatedBiases;
pub use dropped_samples::Dropouts;
pub use effect::{Effect, EffectSet};
pub use file::{
    DeclaredNoise, EffectsFile, Lateness, OtherSession, PlacementEffects, UnexplainedErrors,
};
pub(crate) use file::{RawUnexplained, write_effects, write_unexplained};
pub use gravity_convention::GravityMode;
pub use kind::EffectKind;
pub use model::{GridTrace, SensorModel};
pub use noise::white_noise_density;
pub(crate) use number::number;
pub use quantization::lattice_spacing;
pub use reference_units::length_factors;
pub use residual_view::ResidualView;
pub use saturation::{ClippingLimit, clipping_limit};
pub use search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, ReadOff, ReadOffSearch,
    Rounding, Search,
};
pub use spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
pub use spectral_line::strongest_line;
pub use stages::{MeasurementInput, StagedReadings};
pub use streaming::StreamingEffects;
pub use units::unit_factors;
pub(crate) use warm_up::Thermometer;
pub use wave::{SpectralLine, Wave};
