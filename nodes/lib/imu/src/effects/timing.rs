//! [`super::Stage::Timing`]: from the grid of true time to the stamps of the device.

use std::f64::consts::TAU;
use std::ops::Range;

use cromosim_spatial::Stamp;
use nalgebra::{Matrix3, Vector3};

use super::filter::SecondOrder;
use super::model::{GridTrace, SensorModel};
use super::sampling::{self, GridPosition};
use super::wave::SpectralLine;
use super::{Reading, low_pass};
use crate::{Channel, PerChannel};

/// Of a low-passed signal's decay after a slip nothing is left when its phase has come so far, rad: ten time constants.
const FORGOTTEN: f64 = 60.0;

impl SensorModel {
    /// Readings at the true times of the stamps, those of the gyroscope earlier by its delay, with the
    /// vibration in closed form; `trace` is that of [`SensorModel::sensor`]. Before and after the grid
    /// its ends are held.
    pub(super) fn sample(&self, trace: &GridTrace, stamps: &[Stamp]) -> Vec<Reading> {
        let sampler = Sampler::new(self, trace);
        let read = |stamp: &Stamp| {
            let seconds = self.clock.true_seconds(*stamp - self.epoch);
            if self.channel_delay == 0.0 {
                return sampler.both(seconds);
            }
            Reading {
                specific_force: sampler.one(Channel::Accelerometer, seconds),
                angular_velocity: sampler.one(Channel::Gyroscope, seconds - self.channel_delay),
            }
        };
        stamps.iter().map(read).collect()
    }

    /// The same of one channel beside what the other reads, which no effect of this channel changes.
    pub(super) fn sample_one(
        &self,
        channel: Channel,
        trace: &GridTrace,
        stamps: &[Stamp],
        others: &[Reading],
    ) -> Vec<Reading> {
        let sampler = Sampler::new(self, trace);
        let delay = match channel {
            Channel::Accelerometer => 0.0,
            Channel::Gyroscope => self.channel_delay,
        };
        let read = |(stamp, other): (&Stamp, &Reading)| {
            let mut seconds = self.clock.true_seconds(*stamp - self.epoch);
            if delay != 0.0 {
                seconds -= delay;
            }
            let mut reading = *other;
            reading[channel] = sampler.one(channel, seconds);
            reading
        };
        stamps.iter().zip(others).map(read).collect()
    }

    /// Of stamps in their order, those whose readings may be others where the mount slips when it does in another model.
    pub(super) fn between_slips(&self, other: &Self, stamps: &[Stamp]) -> Range<usize> {
        let slips = || [self, other].into_iter().filter_map(|model| model.slip);
        let forgets_s = |filter: &SecondOrder| FORGOTTEN / (TAU * filter.natural_hz);
        let memory_s = Channel::ALL
            .into_iter()
            .filter_map(|channel| self.low_pass[channel].as_ref().map(forgets_s))
            .fold(0.0, f64::max);
        let delay_s = self.channel_delay.abs();
        let first_s = slips().map(|(at, _)| at).fold(f64::INFINITY, f64::min) - delay_s;
        let last_s =
            slips().map(|(at, _)| at).fold(f64::NEG_INFINITY, f64::max) + memory_s + delay_s;
        let before = |seconds: f64| {
            stamps.partition_point(|stamp| self.clock.true_seconds(*stamp - self.epoch) < seconds)
        };
        // A stamp more to both sides, for the roundings of times.
        let (first, last) = (before(first_s).saturating_sub(1), before(last_s) + 1);
        first.min(last)..last.min(stamps.len())
    }

    /// The vibration as it comes out of the low-pass.
    fn filtered_vibration(&self) -> Option<SpectralLine> {
        self.vibration.map(|line| {
            line.filtered(PerChannel::from_fn(|channel| {
                self.low_pass[channel].map(|filter| low_pass::response(filter.natural_hz, line.hz))
            }))
        })
    }
}

/// Readings between the entries of a grid.
struct Sampler<'a> {
    model: &'a SensorModel,
    trace: &'a GridTrace,
    /// Of the grid, seconds since the epoch.
    start: f64,
    vibration: Option<SpectralLine>,
    slip: Option<Slip>,
}

impl<'a> Sampler<'a> {
    fn new(model: &'a SensorModel, trace: &'a GridTrace) -> Self {
        let start = trace.start - model.epoch;
        let slip = model.slip;
        Self {
            model,
            trace,
            start,
            vibration: model.filtered_vibration(),
            slip: slip.map(|(at, after)| Slip::new(model, trace, start, at, after)),
        }
    }

    /// Both channels at one time.
    #[inline]
    fn both(&self, seconds: f64) -> Reading {
        let position = (seconds - self.start) * self.trace.rate_hz;
        let (force, velocity) = (&self.trace.specific_force, &self.trace.angular_velocity);
        let mut reading = match GridPosition::at(position, force.len().min(velocity.len())) {
            Some(nodes) => Reading {
                specific_force: nodes.interpolate(force),
                angular_velocity: nodes.interpolate(velocity),
            },
            None => Reading {
                specific_force: sampling::interpolate(force, position),
                angular_velocity: sampling::interpolate(velocity, position),
            },
        };
        if let Some(slip) = &self.slip {
            reading = slip.turn(self.model, &reading, seconds);
        }
        if let Some(line) = &self.vibration {
            self.model.shake(line, &mut reading, seconds);
        }
        reading
    }

    /// One of them. Where the mount slips, a gyroscope that feels the specific force takes both.
    #[inline]
    fn one(&self, channel: Channel, seconds: f64) -> Vector3<f64> {
        if self.slip.is_some() && channel == Channel::Gyroscope && self.model.coupling.is_some() {
            return self.both(seconds).angular_velocity;
        }
        let series = match channel {
            Channel::Accelerometer => &self.trace.specific_force,
            Channel::Gyroscope => &self.trace.angular_velocity,
        };
        let position = (seconds - self.start) * self.trace.rate_hz;
        let mut value = sampling::interpolate(series, position);
        if let Some(slip) = &self.slip {
            value = slip.turn_one(channel, value, seconds);
        }
        if let Some(line) = &self.vibration {
            let mut reading = Reading::default();
            reading[channel] = value;
            self.model.shake(line, &mut reading, seconds);
            value = reading[channel];
        }
        value
    }
}

/// A slip while sampling. The low-pass y of `u_1` before and `u_2` after the slip is that of `u_2`
/// plus the decay of `y_1 - y_2`, both of which are the low-passed segment's in other axes.
struct Slip {
    at: f64,
    before: Matrix3<f64>,
    after: Matrix3<f64>,
    /// Low-passed reading at the slip in segment axes, and its derivative per second.
    memory: Option<(PerChannel<Option<SecondOrder>>, Reading, Reading)>,
}

impl Slip {
    fn new(
        model: &SensorModel,
        trace: &GridTrace,
        start: f64,
        at: f64,
        after: Matrix3<f64>,
    ) -> Self {
        let position = ((at - start) * trace.rate_hz)
            .clamp(0.0, trace.specific_force.len().saturating_sub(1) as f64);
        let of = |sample: fn(&[Vector3<f64>], f64) -> Vector3<f64>, factor: f64| Reading {
            specific_force: sample(&trace.specific_force, position) * factor,
            angular_velocity: sample(&trace.angular_velocity, position) * factor,
        };
        let filters = model.low_pass;
        let is_filtered = Channel::ALL
            .iter()
            .any(|channel| filters[*channel].is_some());
        let memory = is_filtered.then(|| {
            (
                filters,
                of(sampling::interpolate, 1.0),
                of(sampling::derivative, trace.rate_hz),
            )
        });
        Self {
            at,
            before: model.sensor_from_segment.unwrap_or_else(Matrix3::identity),
            after,
            memory,
        }
    }

    fn turn(&self, model: &SensorModel, reading: &Reading, seconds: f64) -> Reading {
        if seconds < self.at {
            return model.turned(Some(&self.before), reading);
        }
        let mut turned = model.turned(Some(&self.after), reading);
        if let Some((filters, value, derivative)) = &self.memory {
            let since = seconds - self.at;
            let mut decay = Reading::default();
            let mut is_left = false;
            for channel in Channel::ALL {
                if let Some(filter) = &filters[channel]
                    && since * TAU * filter.natural_hz < FORGOTTEN
                {
                    is_left = true;
                    decay[channel] =
                        filter.homogeneous(since, &value[channel], &derivative[channel]);
                }
            }
            if is_left {
                let (old, new) = (
                    model.turned(Some(&self.before), &decay),
                    model.turned(Some(&self.after), &decay),
                );
                turned.specific_force += old.specific_force - new.specific_force;
                turned.angular_velocity += old.angular_velocity - new.angular_velocity;
            }
        }
        turned
    }

    /// The same of one channel that does not feel the other.
    #[inline]
    fn turn_one(&self, channel: Channel, value: Vector3<f64>, seconds: f64) -> Vector3<f64> {
        if seconds < self.at {
            return self.before * value;
        }
        let turned = self.after * value;
        let Some((filters, value, derivative)) = &self.memory else {
            return turned;
        };
        let since = seconds - self.at;
        match &filters[channel] {
            Some(filter) if since * TAU * filter.natural_hz < FORGOTTEN => {
                let decay = filter.homogeneous(since, &value[channel], &derivative[channel]);
                turned + (self.before * decay - self.after * decay)
            }
            _ => turned,
        }
    }
}
