//! What the readings' digits show: clipping and rounding.

use cromosim_imu::{
    Channel, EffectSet, PerChannel, ReadOff, Reading, clipping_limit, lattice_spacing,
};
use cromosim_spatial::KinematicTrack;

use crate::axes::{axes_of_channel, value_on_axis};
use crate::library::Library;
use crate::policy::clipping::{LEAST_STEPS, STANDARD_ERRORS, STEPS_BELOW};
use crate::prepared::PreparedPlacement;

/// A value at which a channel clips, and the common distance of its values, in the device's units.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Digital {
    pub limit: Option<f64>,
    /// One that a simulation may show to be a limit ([`settle_limits`]).
    doubtful: Option<DoubtfulLimit>,
    pub lsb: Option<f64>,
    /// Whether there is rounding that may not be named.
    pub rounding_is_excluded: bool,
}

/// A value on a lattice at which readings clip or the motion has its peaks, in the device's units.
#[derive(Clone, Copy, Debug)]
struct DoubtfulLimit {
    value: f64,
    lsb: f64,
}

impl Digital {
    /// Step of the rounding where the device's unit is so many to the SI unit; 0 without.
    pub fn step(&self, units: f64) -> f64 {
        self.lsb.map_or(0.0, |lsb| lsb / units)
    }

    /// Whether the readings lie on a lattice, named or not.
    pub fn has_lattice(&self) -> bool {
        self.lsb.is_some() || self.rounding_is_excluded
    }

    /// Of a channel's measured readings. What the library excludes stays in the readings, to be
    /// found as something unknown.
    pub fn read_off(measured: &[Reading], channel: Channel, library: &Library) -> Self {
        let values: Vec<f64> = measured
            .iter()
            .flat_map(|reading| reading[channel].iter().copied())
            .collect();
        let lsb = lattice_spacing(&mut values.clone());
        let limit = clipping_limit(&values, lsb)
            .filter(|_| library.allows_read_off(ReadOff::ClippedReadings(channel)));
        let rounding_is_allowed = library.allows_read_off(ReadOff::Lattice(channel));
        let doubtful = limit.zip(lsb).filter(|(limit, _)| !limit.is_certain);
        Self {
            limit: limit
                .filter(|limit| limit.is_certain)
                .map(|limit| limit.value),
            doubtful: doubtful.map(|(limit, lsb)| DoubtfulLimit {
                value: limit.value,
                lsb,
            }),
            lsb: lsb.filter(|_| rounding_is_allowed),
            rounding_is_excluded: lsb.is_some() && !rounding_is_allowed,
        }
    }
}

/// Finds out by a simulation under `start` whether readings clip where their digits leave it open: where
/// they stand at the limit, it is farther beyond them than where they are a few steps below. A bias and
/// peaks of the motion are the same there, and a gain nearly so. `units` are the device's for one SI unit.
pub(crate) fn settle_limits(
    digital: &mut PerChannel<Digital>,
    prepared: &PreparedPlacement,
    track: &KinematicTrack,
    start: &EffectSet,
    units: PerChannel<f64>,
) {
    if Channel::ALL
        .into_iter()
        .all(|channel| digital[channel].doubtful.is_none())
    {
        return;
    }
    let simulated = prepared.predict(track, start).readings;
    for channel in Channel::ALL {
        let Some(doubtful) = digital[channel].doubtful else {
            continue;
        };
        let readings = prepared.measured.iter().zip(&simulated).enumerate();
        let compared = readings.flat_map(|(k, (measured, simulated))| {
            let axes = axes_of_channel(channel).filter(move |axis| prepared.usable[k][*axis]);
            axes.map(move |axis| {
                let expected = value_on_axis(simulated, axis) * units[channel];
                (value_on_axis(measured, axis), expected)
            })
        });
        if goes_beyond(compared, doubtful.value, doubtful.lsb) {
            digital[channel].limit = Some(doubtful.value);
        }
    }
}

/// Whether what is expected of readings at a limit lies farther beyond them than of those a few steps of
/// the lattice below.
fn goes_beyond(compared: impl Iterator<Item = (f64, f64)>, limit: f64, lsb: f64) -> bool {
    let (mut at, mut below) = (Moments::default(), Moments::default());
    for (read, expected) in compared {
        let beyond = (read.signum() * expected - read.abs()) / lsb;
        let steps = ((limit - read.abs()) / lsb).round();
        if steps < 0.5 {
            at.add(beyond);
        } else if steps <= STEPS_BELOW {
            below.add(beyond);
        }
    }
    let farther = at.mean() - below.mean();
    at.count > 1.0
        && below.count > 1.0
        && farther > LEAST_STEPS
        && farther > STANDARD_ERRORS * (at.squared_error() + below.squared_error()).sqrt()
}

/// Of numbers.
#[derive(Default)]
pub(crate) struct Moments {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    pub fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    pub fn variance(&self) -> f64 {
        self.squares / self.count - self.mean().powi(2)
    }

    /// Of the mean, as of independent numbers.
    fn squared_error(&self) -> f64 {
        self.variance() / (self.count - 1.0)
    }
}

/// Takes clipped values out of the comparison: they tell only that the true one lies beyond.
pub(crate) fn mask_clipped(prepared: &mut PreparedPlacement, channel: Channel, digital: &Digital) {
    let Some(limit) = digital.limit else { return };
    for (k, reading) in prepared.measured.iter().enumerate() {
        for axis in axes_of_channel(channel) {
            if value_on_axis(reading, axis).abs() >= limit * (1.0 - 1e-9) {
                prepared.usable[k][axis] = false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LSB: f64 = 0.4;

    /// Peaks of 18.3 and 6 of a slow motion, as read beyond a limit and as expected with a gain and errors.
    fn compared(limit: f64, gain: f64) -> Vec<(f64, f64)> {
        let motion = (0..6000).map(|k| {
            let phase = f64::from(k) * 0.02;
            18.3 * phase.sin() + 6.0 * (7.3 * phase).sin()
        });
        let read = |value: f64| (value.clamp(-limit, limit) / LSB).round() * LSB;
        let error = |value: f64| 0.5 * (137.0 * value).sin();
        motion
            .map(|value| (read(value), gain * value + error(value)))
            .collect()
    }

    fn clips(limit: f64, gain: f64) -> bool {
        let compared = compared(limit, gain);
        let largest = compared
            .iter()
            .fold(0.0, |most: f64, (read, _)| most.max(read.abs()));
        goes_beyond(compared.into_iter(), largest, LSB)
    }

    #[test]
    fn a_limit_is_where_the_simulation_goes_on() {
        for gain in [0.9, 1.0, 1.1] {
            assert!(clips(20.0, gain), "{gain}");
            assert!(!clips(100.0, gain), "{gain}");
        }
        // What is expected of other axes tells nothing.
        let turned = compared(20.0, 1.0);
        let others = turned.iter().map(|(read, _)| *read);
        let expected = turned.iter().skip(700).map(|(_, expected)| *expected);
        assert!(!goes_beyond(others.zip(expected), 20.0, LSB));
    }
}
