//! `gyro_g_sensitivity`: the gyroscope feels specific force, `w += G f`.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::GyroGSensitivity,
    name: "gyro_g_sensitivity",
    stage: Stage::Sensor,
    summary: "The gyroscope feels specific force: its residual is linear in the force, gravity included, so that it turns with the sensor.",
    remedy: "Calibrate the gyroscope at rest in six positions, or damp shocks at the mount.",
    parameters: &[ParameterSpec {
        name: "matrix",
        unit: "(rad/s)/(m/s2)",
        shape: Shape::Matrix3,
        neutral: &[0.0; 9],
        lower: -10.0,
        upper: 10.0,
        step: 1e-6,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![0.0; 9]]
}
