//! `accel_bias_drift`, `gyro_bias_drift`: biases that grow with time.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelBiasDrift,
    name: "accel_bias_drift",
    stage: Stage::Linear,
    summary: "The accelerometer's bias grows with time: the residual's mean is a ramp that is zero at the epoch.",
    remedy: "Let the device warm up, compensate for temperature, or calibrate again during the session.",
    parameters: &[ParameterSpec {
        name: "rate",
        unit: "m/s3",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -10.0,
        upper: 10.0,
        step: 1e-6,
    }],
    random: false,
    continuous: true,
    starts,
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroBiasDrift,
    name: "gyro_bias_drift",
    stage: Stage::Linear,
    summary: "The gyroscope's bias grows with time: the residual's mean is a ramp that is zero at the epoch.",
    remedy: "Let the device warm up, compensate for temperature, or average the gyroscope at rest again during the session.",
    parameters: &[ParameterSpec {
        name: "rate",
        unit: "rad/s2",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -10.0,
        upper: 10.0,
        step: 1e-7,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![0.0; 3]]
}
