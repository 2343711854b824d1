//! `accel_saturation`, `gyro_saturation`: the range of a sensor.

use super::EffectKind;
use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelSaturation,
    name: "accel_saturation",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The accelerometer clips: the residual appears where the simulated force exceeds the limit, and the readings stand still at it.",
    remedy: "Choose a larger range (g setting) of the accelerometer.",
    parameters: &[ParameterSpec {
        name: "limit",
        unit: "m/s2",
        shape: Shape::Scalar,
        neutral: &[1e9],
        is_optional: false,
        lower: 1e-9,
        upper: 1e9,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ClippedReadings(Channel::Accelerometer),
        probability: 0.98,
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroSaturation,
    name: "gyro_saturation",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The gyroscope clips: the residual appears where the simulated rate exceeds the limit, and the readings stand still at it.",
    remedy: "Choose a larger range (deg/s setting) of the gyroscope.",
    parameters: &[ParameterSpec {
        name: "limit",
        unit: "rad/s",
        shape: Shape::Scalar,
        neutral: &[1e9],
        is_optional: false,
        lower: 1e-9,
        upper: 1e9,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ClippedReadings(Channel::Gyroscope),
        probability: 0.98,
    }),
};

/// Values at the largest magnitude that make it a limit.
const LEAST_REPEATS: usize = 4;
/// The same of values on a lattice, whose tail thins out from step to step.
const LEAST_REPEATS_ON_LATTICE: usize = 12;
/// Values at the limit, in units of those one step of the lattice below.
const MORE_THAN_BELOW: usize = 3;
/// Separate times at the limit, as a slow peak dwells on one step of a lattice.
const LEAST_EPISODES: usize = 3;
/// Values without the limit that separate two times at it: twenty readings.
const EPISODE_GAP: usize = 60;

/// The value at which the readings of a channel clip; none where they do not. `values` are those of
/// all axes, reading after reading; `lsb` is the lattice that they lie on, where there is one.
pub fn clipping_limit(values: &[f64], lsb: Option<f64>) -> Option<f64> {
    let pile = Pile::new(values, lsb);
    let piles_up = if lsb.is_some() {
        pile.may_clip_on_lattice() && pile.repeats > MORE_THAN_BELOW * pile.below
    } else {
        pile.repeats >= LEAST_REPEATS
    };
    (piles_up && pile.largest > 0.0).then_some(pile.largest)
}

/// A value on a lattice at which readings may clip, or may only have their peaks: more stand at it
/// than one step below, but not as many more as [`clipping_limit`] asks for. A simulation tells.
pub fn doubtful_clipping_limit(values: &[f64], lsb: f64) -> Option<f64> {
    let pile = Pile::new(values, Some(lsb));
    let doubtful = pile.may_clip_on_lattice()
        && (pile.below + 1..=MORE_THAN_BELOW * pile.below).contains(&pile.repeats);
    (doubtful && pile.largest > 0.0).then_some(pile.largest)
}

/// The values of largest magnitude.
struct Pile {
    largest: f64,
    /// Values of that magnitude.
    repeats: usize,
    /// Values one step of the lattice below, where there is one.
    below: usize,
    /// Separate times.
    episodes: usize,
}

impl Pile {
    fn new(values: &[f64], lsb: Option<f64>) -> Self {
        let largest = values
            .iter()
            .fold(0.0_f64, |most, value| most.max(value.abs()));
        let is_below =
            |value: &&f64| lsb.is_some_and(|lsb| (value.abs() - largest + lsb).abs() < 0.5 * lsb);
        let clipped: Vec<usize> = values
            .iter()
            .enumerate()
            .filter(|(_, value)| value.abs() >= largest * (1.0 - 1e-9))
            .map(|(at, _)| at)
            .collect();
        let gaps = clipped
            .windows(2)
            .filter(|pair| pair[1] > pair[0] + EPISODE_GAP);
        Self {
            largest,
            repeats: clipped.len(),
            below: values.iter().filter(is_below).count(),
            episodes: 1 + gaps.count(),
        }
    }

    fn may_clip_on_lattice(&self) -> bool {
        self.repeats >= LEAST_REPEATS_ON_LATTICE && self.episodes >= LEAST_EPISODES
    }
}

/// Clips one value at +-limit.
#[inline]
pub(super) fn clip(value: f64, limit: f64) -> f64 {
    value.clamp(-limit, limit)
}
