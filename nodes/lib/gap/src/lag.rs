//! The lag of the IMU's stamps from the magnitudes of the angular velocity: no axes, units or
//! gravity enter.

use cromosim_spatial::{KinematicTrack, Stamp};

use crate::correlation::Correlations;
use crate::prepared::PreparedPlacement;

/// Bonus on the correlation of a lag below [`NEAR_S`]: a distant lag has to correlate better by
/// more than this.
const NEAR_BONUS: f64 = 0.03;
/// A lag of ordinary clocks, s.
const NEAR_S: f64 = 0.3;
/// A best correlation below this tells no lag.
const LEAST_CORRELATION: f64 = 0.3;

/// Lag at which the angular speeds correlate best, s (stamps late when positive); 0 where the
/// motion does not tell.
pub(crate) fn lag_of_angular_speeds(prepared: &PreparedPlacement, track: &KinematicTrack) -> f64 {
    let rate_hz = prepared.rate_hz;
    let measured = measured_speeds(prepared);
    let reference = reference_speeds(track, rate_hz);
    let is_known = is_known(prepared, track, reference.len());
    // Entry k of the measured sample grid is at the reference's entry k + shift when nothing is
    // late.
    let shift = (prepared.epoch - track.start) * rate_hz;
    let seconds = |offset: f64| (offset + shift) / rate_hz;
    let bonus = |offset: i64| {
        if seconds(offset as f64).abs() < NEAR_S {
            NEAR_BONUS
        } else {
            0.0
        }
    };
    let offsets = -(reference.len() as i64) + 1..measured.len() as i64;
    Correlations::of_known(&measured, &reference, &is_known)
        .peak(offsets, bonus)
        .filter(|peak| peak.correlation >= LEAST_CORRELATION)
        .map_or(0.0, |peak| seconds(peak.offset))
}

/// Magnitudes of the measured angular velocity on the sample grid, rad/s; usable where its first
/// axis is.
fn measured_speeds(prepared: &PreparedPlacement) -> Vec<f64> {
    prepared
        .on_sample_grid(|k, axis| {
            if axis == 3 {
                prepared.measured[k].angular_velocity.norm()
            } else {
                0.0
            }
        })
        .swap_remove(3)
}

/// Magnitudes of the reference's angular velocity at the IMU's rate, rad/s.
fn reference_speeds(track: &KinematicTrack, rate_hz: f64) -> Vec<f64> {
    let seconds = (track.len() - 1) as f64 / track.rate_hz;
    (0..(seconds * rate_hz) as usize)
        .map(|k| {
            track.angular_velocity_in_segment
                [((k as f64 / rate_hz * track.rate_hz) as usize).min(track.len() - 1)]
            .norm()
        })
        .collect()
}

/// Whether each of so many entries at the IMU's rate lies where the reference has poses.
fn is_known(prepared: &PreparedPlacement, track: &KinematicTrack, count: usize) -> Vec<bool> {
    let mut is_known = vec![true; count];
    for (from, to) in prepared.estimate.gaps() {
        let entry = |stamp: Stamp| ((stamp - track.start) * prepared.rate_hz).max(0.0);
        let (from, to) = (entry(*from).ceil() as usize, entry(*to).ceil() as usize);
        is_known[from.min(count)..to.min(count)].fill(false);
    }
    is_known
}
