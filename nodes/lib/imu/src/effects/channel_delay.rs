//! `channel_delay`: the gyroscope is late against the accelerometer, `w(t) -> w(t - seconds)`.

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::EffectKind;
use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ChannelDelay,
    name: "channel_delay",
    stage: Stage::Timing,
    owner: Owner::Device,
    summary: "The gyroscope is late (positive) or early against the accelerometer under one stamp: its residual alone is proportional to its time derivative.",
    remedy: "Give both channels the same filter and output rate in the device's settings, or stamp them apart.",
    parameters: &[ParameterSpec {
        name: "seconds",
        unit: "s",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: -1.0,
        upper: 1.0,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 0.1,
        }),
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: Some(EffectKind::TimeOffset),
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(ORDINARY_S)),
        rounding: None,
        kept: Kept::BesideUnknown,
        special_case_of: &[Dependence::DelayOverTime],
        identifiability: Some(Identifiability {
            relevant_size: 0.005,
            values: 1,
            would_tell: "motion with changing angular velocity, 1 rad/s or more",
        }),
    }),
};

/// Delay between the channels that every device has, s: half a period of a gyroscope that runs at
/// 500 Hz. No measurement on record.
const ORDINARY_S: f64 = 1e-3;

/// A channel's values as they come, given out late: straight lines between the samples. What would be
/// early follows the last line on, as nothing of the future is known.
#[derive(Clone, Debug)]
pub(crate) struct DelayLine {
    delay_s: f64,
    /// Time, s, and value, in order.
    history: VecDeque<(f64, Vector3<f64>)>,
}

impl DelayLine {
    pub(crate) fn new(delay_s: f64) -> Self {
        Self {
            delay_s,
            history: VecDeque::new(),
        }
    }

    /// The value at `seconds` less the delay, given that at `seconds`; before the first one it is
    /// held.
    pub(crate) fn push(&mut self, seconds: f64, value: Vector3<f64>) -> Vector3<f64> {
        self.history.push_back((seconds, value));
        let wanted = seconds - self.delay_s;
        while self.history.len() > 2 && self.history[1].0 <= wanted {
            self.history.pop_front();
        }
        match (self.history.front(), self.history.get(1)) {
            (Some((from, before)), Some((to, after))) if wanted > *from => {
                before + (after - before) * ((wanted - from) / (to - from))
            }
            (Some((_, first)), _) => *first,
            _ => value,
        }
    }

    /// Begins anew with the next value.
    pub(crate) fn reset(&mut self) {
        self.history.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_comes_late_or_early_by_the_delay() {
        for delay_s in [-0.013, 0.0, 0.004, 0.033] {
            let mut line = DelayLine::new(delay_s);
            for k in 0..50 {
                let seconds = f64::from(k) * 0.01;
                let late = line.push(seconds, Vector3::x() * seconds);
                if k >= 5 {
                    assert!(
                        (late.x - (seconds - delay_s)).abs() < 1e-12,
                        "{delay_s} {k}"
                    );
                }
            }
        }
    }
}
