//! `accel_misalignment`, `gyro_misalignment`: axes that are not orthogonal.

use nalgebra::{Matrix3, Vector3};

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelMisalignment,
    name: "accel_misalignment",
    stage: Stage::Linear,
    summary: "The accelerometer's axes are not orthogonal: an axis' residual is proportional to what its neighbours read.",
    remedy: "Calibrate the accelerometer's cross-axis terms at rest in many positions.",
    parameters: &[ParameterSpec {
        name: "upper",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -1.0,
        upper: 1.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroMisalignment,
    name: "gyro_misalignment",
    stage: Stage::Linear,
    summary: "The gyroscope's axes are not orthogonal: an axis' residual is proportional to what its neighbours read.",
    remedy: "Calibrate the gyroscope's cross-axis terms on a turntable.",
    parameters: &[ParameterSpec {
        name: "upper",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -1.0,
        upper: 1.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![0.0; 3]]
}

/// `I + upper` from the cross terms xy, xz, yz.
pub(super) fn matrix(upper: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(1.0, upper.x, upper.y, 0.0, 1.0, upper.z, 0.0, 0.0, 1.0)
}
