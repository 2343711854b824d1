//! `time_offset`: the IMU's stamps are late by a constant.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::TimeOffset,
    name: "time_offset",
    stage: Stage::Timing,
    summary: "The IMU's stamps are late (positive) or early: the residual of both channels is proportional to their time derivative.",
    remedy: "Synchronise the clocks (hardware trigger, PTP), or shift the IMU's stamps by this offset.",
    parameters: &[ParameterSpec {
        name: "seconds",
        unit: "s",
        shape: Shape::Scalar,
        neutral: &[0.0],
        lower: -10.0,
        upper: 10.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

/// Farthest shift that is looked at, s.
const REACH: f64 = 1.0;

/// No offset, and the shift at which the measured angular velocity's magnitude follows the
/// simulated one best.
fn starts(view: &ResidualView) -> Vec<Vec<f64>> {
    let (measured, simulated): (Vec<f64>, Vec<f64>) = view
        .pairs(Channel::Gyroscope)
        .map(|(m, s)| (m.norm(), s.norm()))
        .unzip();
    let reach = ((REACH * view.rate_hz) as usize).min(measured.len() / 4);
    let correlation = |shift: isize| {
        let middle = reach..measured.len() - reach;
        let pairs = middle.map(|k| (measured[k], simulated[(k as isize - shift) as usize]));
        let (n, m, s, mm, ss, ms) = pairs.fold(
            (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            |(n, a, b, aa, bb, ab), (m, s)| {
                (n + 1.0, a + m, b + s, aa + m * m, bb + s * s, ab + m * s)
            },
        );
        (ms - m * s / n) / ((mm - m * m / n) * (ss - s * s / n)).sqrt()
    };
    let reach = reach as isize;
    let best = (-reach..=reach)
        .map(|shift| (correlation(shift), shift))
        .filter(|(r, _)| r.is_finite())
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts = vec![vec![0.0]];
    if let Some((_, shift)) = best.filter(|(_, shift)| *shift != 0) {
        starts.push(vec![shift as f64 / view.rate_hz]);
    }
    starts
}
