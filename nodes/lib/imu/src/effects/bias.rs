//! `accel_bias`, `gyro_bias`: constant errors.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelBias,
    name: "accel_bias",
    stage: Stage::Linear,
    summary: "A constant is added to the specific force: the residual has a mean in sensor axes that does not turn with the segment.",
    remedy: "Calibrate the accelerometer at rest in six positions and subtract the bias.",
    parameters: &[ParameterSpec {
        name: "bias",
        unit: "m/s2",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -100.0,
        upper: 100.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts: |view| starts(view, Channel::Accelerometer),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroBias,
    name: "gyro_bias",
    stage: Stage::Linear,
    summary: "A constant is added to the angular velocity: the residual has a mean, also at rest.",
    remedy: "Average the gyroscope at rest and subtract the mean.",
    parameters: &[ParameterSpec {
        name: "bias",
        unit: "rad/s",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -100.0,
        upper: 100.0,
        step: 1e-6,
    }],
    random: false,
    continuous: true,
    starts: |view| starts(view, Channel::Gyroscope),
};

fn starts(view: &ResidualView, channel: Channel) -> Vec<Vec<f64>> {
    vec![view.mean_residual(channel).as_slice().to_vec()]
}
