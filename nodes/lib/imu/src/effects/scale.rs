//! `accel_scale`, `gyro_scale`: gain of each axis.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelScale,
    name: "accel_scale",
    stage: Stage::Linear,
    summary: "The accelerometer's axes have gains: each axis' residual is proportional to what it reads.",
    remedy: "Calibrate the accelerometer's gains at rest in six positions.",
    parameters: &[ParameterSpec {
        name: "scale",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[1.0; 3],
        lower: 0.01,
        upper: 100.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroScale,
    name: "gyro_scale",
    stage: Stage::Linear,
    summary: "The gyroscope's axes have gains: each axis' residual is proportional to what it reads.",
    remedy: "Calibrate the gyroscope's gains on a turntable or by turns of a known angle.",
    parameters: &[ParameterSpec {
        name: "scale",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[1.0; 3],
        lower: 0.01,
        upper: 100.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![1.0; 3]]
}
