//! `clock_drift`: the IMU's clock runs at another rate; with `time_offset` it makes stamps of true
//! times.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ClockDrift,
    name: "clock_drift",
    stage: Stage::Timing,
    summary: "The IMU's clock runs fast (positive) or slow: the residual is proportional to the time derivative and grows with time.",
    remedy: "Discipline the clock (PTP, a common oscillator), or stretch the stamps by this rate.",
    parameters: &[ParameterSpec {
        name: "ppm",
        unit: "1e-6",
        shape: Shape::Scalar,
        neutral: &[0.0],
        lower: -1e5,
        upper: 1e5,
        step: 0.1,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![0.0]]
}

/// Stamps and true times: `stamp = t0 + (t - t0) (1 + ppm 1e-6) + seconds`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    pub offset: f64,
    pub ppm: f64,
}

impl Clock {
    /// True seconds since the epoch, of a stamp's seconds since the epoch.
    #[inline]
    pub(super) fn true_seconds(&self, stamp: f64) -> f64 {
        (stamp - self.offset) / (1.0 + self.ppm * 1e-6)
    }

    /// The inverse.
    pub(super) fn stamp_seconds(&self, seconds: f64) -> f64 {
        seconds * (1.0 + self.ppm * 1e-6) + self.offset
    }
}
