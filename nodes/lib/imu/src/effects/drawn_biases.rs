//! Biases that are drawn at random: at the start of a run, and on the way.

use cromosim_spatial::Stamp;
use nalgebra::Vector3;
use rand_chacha::ChaCha12Rng;

use super::{Effect, EffectKind, EffectSet};
use crate::random::{DRAWN_BIAS_CHANNEL, normal_pair, stream};
use crate::{Channel, PerChannel, Reading};

/// Turn-on biases, bias instability and bias walk of both channels, for readings in order of time;
/// one sequence of numbers by seed, placement, channel and kind, live and offline.
///
/// Between readings `dt` apart each process is exact, so that neither the rate nor lost messages
/// change it:
/// ```text
/// instability  b <- b exp(-dt / T) + s sqrt(1 - exp(-2 dt / T)) n        begins with s n
/// walk         b <- b + k sqrt(dt) n                                     begins with 0
/// ```
#[derive(Clone, Debug)]
pub struct DrawnBiases {
    channels: PerChannel<ChannelBias>,
    last: Option<Stamp>,
    seconds: f64,
}

#[derive(Clone, Debug, Default)]
struct ChannelBias {
    turn_on: Vector3<f64>,
    instability: Option<Wandering>,
    walk: Option<Walking>,
}

#[derive(Clone, Debug)]
struct Wandering {
    deviation: f64,
    time_constant: f64,
    value: Vector3<f64>,
    random: ChaCha12Rng,
}

#[derive(Clone, Debug)]
struct Walking {
    density: f64,
    value: Vector3<f64>,
    random: ChaCha12Rng,
}

/// The kinds of a channel: turn-on bias, instability, walk.
fn kinds(channel: Channel) -> [EffectKind; 3] {
    use EffectKind as Kind;
    match channel {
        Channel::Accelerometer => [
            Kind::AccelTurnOnBias,
            Kind::AccelBiasInstability,
            Kind::AccelBiasWalk,
        ],
        Channel::Gyroscope => [
            Kind::GyroTurnOnBias,
            Kind::GyroBiasInstability,
            Kind::GyroBiasWalk,
        ],
    }
}

impl DrawnBiases {
    /// Those that the effects state, drawn by seed and placement; none where they state none.
    pub fn new(effects: &EffectSet, seed: u64, placement: &str) -> Option<Self> {
        let stated = |channel| kinds(channel).into_iter();
        let is_there = |channel| stated(channel).any(|kind| effects.contains(kind));
        if !Channel::ALL.into_iter().any(is_there) {
            return None;
        }
        Some(Self {
            channels: PerChannel::from_fn(|channel| {
                ChannelBias::new(effects, channel, (seed, placement))
            }),
            last: None,
            seconds: 0.0,
        })
    }

    /// Adds them to the next reading.
    pub fn add_to(&mut self, reading: &mut Reading, stamp: Stamp) {
        let elapsed = self.last.map(|last| (stamp - last).max(0.0));
        self.last = Some(stamp);
        self.seconds += elapsed.unwrap_or_default();
        for channel in Channel::ALL {
            reading[channel] += self.channels[channel].next(elapsed);
        }
    }

    /// From the first reading to the last one, s.
    pub(crate) fn seconds(&self) -> f64 {
        self.seconds
    }
}

impl ChannelBias {
    fn new(effects: &EffectSet, channel: Channel, (seed, placement): (u64, &str)) -> Self {
        let random = |kind: u64| {
            let number = DRAWN_BIAS_CHANNEL + 2 * kind + channel.index() as u64;
            stream(seed, placement, number)
        };
        let [turn_on, instability, walk] = kinds(channel).map(|kind| effects.get(kind));
        let drawn = |effect: &Effect| draw(&mut random(0)).component_mul(&effect.vector(0));
        let wandering = |effect: &Effect| Wandering {
            deviation: effect.scalar(0),
            time_constant: effect.scalar(1),
            value: Vector3::zeros(),
            random: random(1),
        };
        let walking = |effect: &Effect| Walking {
            density: effect.scalar(0),
            value: Vector3::zeros(),
            random: random(2),
        };
        Self {
            turn_on: turn_on.map(drawn).unwrap_or_default(),
            instability: instability.map(wandering),
            walk: walk.map(walking),
        }
    }

    /// The bias of a reading so long after the one before, s; of the first for none.
    fn next(&mut self, elapsed: Option<f64>) -> Vector3<f64> {
        let mut bias = self.turn_on;
        if let Some(process) = &mut self.instability {
            let drawn = draw(&mut process.random) * process.deviation;
            process.value = match elapsed {
                None => drawn,
                Some(seconds) => {
                    let kept = (-seconds / process.time_constant).exp();
                    // 1 - kept^2, without the loss of digits where little is forgotten.
                    let fresh = -(-2.0 * seconds / process.time_constant).exp_m1();
                    process.value * kept + drawn * fresh.sqrt()
                }
            };
            bias += process.value;
        }
        if let Some(process) = &mut self.walk {
            let drawn = draw(&mut process.random) * process.density;
            process.value += drawn * elapsed.unwrap_or_default().sqrt();
            bias += process.value;
        }
        bias
    }
}

/// Three independent standard normal numbers.
fn draw(random: &mut ChaCha12Rng) -> Vector3<f64> {
    let [x, y] = normal_pair(random);
    let [z, _] = normal_pair(random);
    Vector3::new(x, y, z)
}

/// What drawn biases leave whoever does not know the draw.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StatedBiases {
    /// Variance per axis of turn-on bias (mean over the axes) and instability, SI units squared.
    pub steady: PerChannel<f64>,
    /// What the walk adds to it per second.
    pub per_second: PerChannel<f64>,
}

impl StatedBiases {
    pub(crate) fn new(effects: &EffectSet) -> Self {
        let of = |channel| kinds(channel).map(|kind| effects.get(kind));
        let squared = |effect: Option<&Effect>| effect.map_or(0.0, |it| it.scalar(0).powi(2));
        let steady = |channel| {
            let [turn_on, instability, _] = of(channel);
            let turn_on = turn_on.map_or(0.0, |it| it.vector(0).norm_squared() / 3.0);
            turn_on + squared(instability)
        };
        Self {
            steady: PerChannel::from_fn(steady),
            per_second: PerChannel::from_fn(|channel| squared(of(channel)[2])),
        }
    }
}

#[cfg(test)]
#[path = "drawn_biases_tests.rs"]
mod tests;
