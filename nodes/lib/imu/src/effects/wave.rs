//! A sinusoid of both channels, each axis with amplitude and phase of its own.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::Effect;
use super::clock_drift::Clock;
use crate::{Channel, PerChannel, Reading};

/// `amplitude sin(2 pi hz (t - t0) + phase)` of each axis and channel, parsed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralLine {
    /// Frequency, Hz.
    pub hz: f64,
    /// Of the channels, in sensor axes.
    pub waves: PerChannel<Wave>,
}

/// One frequency on three axes: `sine sin(2 pi hz (t - t0)) + cosine cos(2 pi hz (t - t0))`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wave {
    /// In the channel's unit.
    pub sine: Vector3<f64>,
    /// In the channel's unit.
    pub cosine: Vector3<f64>,
}

impl Wave {
    /// `amplitude sin(x + phase) = amplitude cos(phase) sin(x) + amplitude sin(phase) cos(x)`.
    fn from_polar(amplitude: &Vector3<f64>, phase: &Vector3<f64>) -> Self {
        Self {
            sine: amplitude.zip_map(phase, |amplitude, phase| amplitude * phase.cos()),
            cosine: amplitude.zip_map(phase, |amplitude, phase| amplitude * phase.sin()),
        }
    }

    /// Amplitudes, and phases from 0 to 2 pi.
    fn polar(&self) -> [Vector3<f64>; 2] {
        [
            self.sine.zip_map(&self.cosine, f64::hypot),
            self.sine.zip_map(&self.cosine, |sine, cosine| {
                cosine.atan2(sine).rem_euclid(TAU)
            }),
        ]
    }

    /// Mean square, summed over the axes.
    fn power(&self) -> f64 {
        0.5 * (self.sine.norm_squared() + self.cosine.norm_squared())
    }

    fn filtered(&self, gain: f64, phase: f64) -> Self {
        let (sin, cos) = phase.sin_cos();
        Self {
            sine: (self.sine * cos - self.cosine * sin) * gain,
            cosine: (self.cosine * cos + self.sine * sin) * gain,
        }
    }
}

impl SpectralLine {
    /// Of a vibration's values.
    pub(super) fn from_effect(effect: &Effect) -> Self {
        let wave = |first| Wave::from_polar(&effect.vector(first), &effect.vector(first + 3));
        Self {
            hz: effect.scalar(0),
            waves: PerChannel {
                accelerometer: wave(1),
                gyroscope: wave(7),
            },
        }
    }

    /// A vibration's values.
    pub(super) fn values(&self) -> Vec<f64> {
        let polar = Channel::ALL.map(|channel| self.waves[channel].polar());
        let values = polar.iter().flatten().flat_map(|vector| vector.iter());
        std::iter::once(self.hz).chain(values.copied()).collect()
    }

    /// What it adds to both channels at seconds since the epoch.
    #[inline]
    pub(super) fn at(&self, seconds: f64) -> Reading {
        let (sin, cos) = (TAU * self.hz * seconds).sin_cos();
        let [specific_force, angular_velocity] = Channel::ALL.map(|channel| {
            let wave = &self.waves[channel];
            wave.sine * sin + wave.cosine * cos
        });
        Reading {
            specific_force,
            angular_velocity,
        }
    }

    /// Mean square of a channel, summed over the axes, m2/s4 or rad2/s2.
    pub fn power(&self, channel: Channel) -> f64 {
        self.waves[channel].power()
    }

    /// The same at the same stamps, by another clock.
    pub(super) fn by_clock(&self, own: Clock, other: Clock) -> Self {
        let slowed = (1.0 + other.ppm * 1e-6) / (1.0 + own.ppm * 1e-6);
        let turned = TAU * self.hz * (other.offset - own.offset) / (1.0 + own.ppm * 1e-6);
        Self {
            hz: self.hz * slowed,
            waves: PerChannel::from_fn(|channel| self.waves[channel].filtered(1.0, turned)),
        }
    }

    /// What each channel's filter, of this gain and phase, leaves of it.
    pub(super) fn filtered(self, responses: PerChannel<Option<(f64, f64)>>) -> Self {
        let left = |channel| match responses[channel] {
            Some((gain, phase)) => self.waves[channel].filtered(gain, phase),
            None => self.waves[channel],
        };
        Self {
            waves: PerChannel::from_fn(left),
            ..self
        }
    }
}
