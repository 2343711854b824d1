//! What the readings' digits show: clipping and rounding.

use cromosim_imu::{Channel, ReadOff, Reading, clipping_limit, lattice_spacing};

use crate::axes::{axes_of_channel, value_on_axis};
use crate::library::Library;
use crate::prepared::PreparedPlacement;

/// A value at which a channel clips, and the common distance of its values, in the device's units.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Digital {
    pub limit: Option<f64>,
    pub lsb: Option<f64>,
    /// Whether there is rounding that may not be named.
    pub rounding_is_excluded: bool,
}

impl Digital {
    /// Step of the rounding where the device's unit is so many to the SI unit; 0 without.
    pub fn step(&self, units: f64) -> f64 {
        self.lsb.map_or(0.0, |lsb| lsb / units)
    }

    /// Of a channel's measured readings. What the library excludes stays in the readings, to be
    /// found as something unknown.
    pub fn read_off(measured: &[Reading], channel: Channel, library: &Library) -> Self {
        let values: Vec<f64> = measured
            .iter()
            .flat_map(|reading| reading[channel].iter().copied())
            .collect();
        let lsb = lattice_spacing(&mut values.clone());
        let limit = clipping_limit(&values, lsb);
        let rounding_is_allowed = library.allows_read_off(ReadOff::Lattice(channel));
        Self {
            limit: limit.filter(|_| library.allows_read_off(ReadOff::ClippedReadings(channel))),
            lsb: lsb.filter(|_| rounding_is_allowed),
            rounding_is_excluded: lsb.is_some() && !rounding_is_allowed,
        }
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
