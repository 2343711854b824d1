//! `low_pass`: the device's own second-order Butterworth filter, on both channels.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::LowPass,
    name: "low_pass",
    stage: Stage::Sensor,
    summary: "The device smooths both channels: fast motion is weaker and everything comes late by 0.225 / cutoff_hz.",
    remedy: "Raise the device's bandwidth setting, or put the same filter into the simulation.",
    parameters: &[ParameterSpec {
        name: "cutoff_hz",
        unit: "Hz",
        shape: Shape::Scalar,
        neutral: &[1e4],
        lower: 0.1,
        upper: 1e4,
        step: 1e-3,
    }],
    random: false,
    continuous: true,
    starts,
};

/// Damping ratio of the Butterworth filter: Q = 1/sqrt(2).
pub(super) const DAMPING_RATIO: f64 = std::f64::consts::FRAC_1_SQRT_2;

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    [4.0, 8.0, 14.0, 25.0, 40.0]
        .map(|cutoff_hz| vec![cutoff_hz])
        .to_vec()
}

/// Gain and phase (rad, negative is late) at a frequency.
pub(super) fn response(cutoff_hz: f64, hz: f64) -> (f64, f64) {
    let ratio = hz / cutoff_hz;
    // 1 / (1 - r^2 + 2 i z r)
    let (real, imaginary) = (1.0 - ratio * ratio, 2.0 * DAMPING_RATIO * ratio);
    (real.hypot(imaginary).recip(), -imaginary.atan2(real))
}
