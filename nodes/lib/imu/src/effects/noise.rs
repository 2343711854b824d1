//! `accel_noise`, `gyro_noise`: white noise beyond the declared.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage, median};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelNoise,
    name: "accel_noise",
    stage: Stage::Digital,
    summary: "The accelerometer scatters more than declared: white residual that no motion explains.",
    remedy: "State the true noise in the device file and the covariances, or use a quieter device or mode.",
    parameters: &[ParameterSpec {
        name: "density",
        unit: "(m/s2)/sqrt(Hz)",
        shape: Shape::Scalar,
        neutral: &[0.0],
        lower: 0.0,
        upper: 100.0,
        step: 1e-6,
    }],
    random: true,
    continuous: true,
    starts: |view| starts(view, Channel::Accelerometer),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroNoise,
    name: "gyro_noise",
    stage: Stage::Digital,
    summary: "The gyroscope scatters more than declared: white residual that no motion explains.",
    remedy: "State the true noise in the device file and the covariances, or use a quieter device or mode.",
    parameters: &[ParameterSpec {
        name: "density",
        unit: "(rad/s)/sqrt(Hz)",
        shape: Shape::Scalar,
        neutral: &[0.0],
        lower: 0.0,
        upper: 100.0,
        step: 1e-7,
    }],
    random: true,
    continuous: true,
    starts: |view| starts(view, Channel::Gyroscope),
};

/// Variance of the third differences, by their median so that smooth model errors and outliers
/// count little, less the declared.
fn starts(view: &ResidualView, channel: Channel) -> Vec<Vec<f64>> {
    let residual: Vec<_> = view.residual(channel).collect();
    let third = |w: &[nalgebra::Vector3<f64>]| w[3] - w[2] * 3.0 + w[1] * 3.0 - w[0];
    let mut differences: Vec<f64> = residual
        .windows(4)
        .flat_map(|w| <[f64; 3]>::from(third(w).abs()))
        .collect();
    // 1 + 9 + 9 + 1 = 20 variances; the median of |x| is 0.6745 sigma.
    let sigma = median(&mut differences) / 0.674_489_750_196_081_7 / 20f64.sqrt();
    let beyond = (sigma.powi(2) - view.sigma(channel).powi(2)).max(0.0);
    vec![vec![(beyond / view.rate_hz.max(1e-9)).sqrt()]]
}
