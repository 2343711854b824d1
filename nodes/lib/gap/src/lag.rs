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
/// The same of a lag below [`LOOP_S`]: motion that is played again and again correlates as well a loop later, and
/// noise decides between them by some thousandths (tests/withheld/other_origin.py, seed 8: by 0.0025).
const WITHIN_LOOP_BONUS: f64 = 0.01;
/// Shorter than what is played again and again, s; no source.
const LOOP_S: f64 = 2.0;
/// A best correlation below this tells no lag.
const LEAST_CORRELATION: f64 = 0.3;

/// Length of the pieces whose lags tell a drift of the clocks, s; no source.
const PIECE_S: f64 = 20.0;
/// Fewest pieces that do.
const LEAST_PIECES: usize = 6;
/// How far the lag of a piece may be from that of the whole, s: it drifts by as much at most in either direction.
const REACH_S: f64 = 2.0;
/// A best correlation of a piece below this tells no lag.
const LEAST_OF_PIECE: f64 = 0.6;
/// Distance of a piece's lag from the line of the drift, s, within which it lies on it: half of a quarter turn of motion
/// at 4 Hz.
const ON_LINE_S: f64 = 0.03;
/// Drift over the recording from which on fits from one lag may not reach it, s: as of a lag.
const LEAST_DRIFT_S: f64 = 0.1;

/// How the lag grows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Drift {
    /// Of the first message, s.
    pub lag_s: f64,
    pub per_second: f64,
}

/// The line on which the lags of pieces of the recording lie around that of the whole; none where it is level, or most
/// of them lie elsewhere.
pub(crate) fn drift_of_angular_speeds(
    prepared: &PreparedPlacement,
    track: &KinematicTrack,
    lag_s: f64,
) -> Option<Drift> {
    let rate_hz = prepared.rate_hz;
    let piece = (PIECE_S * rate_hz) as usize;
    let count = prepared.length / piece.max(1);
    if count < LEAST_PIECES {
        return None;
    }
    let measured = measured_speeds(prepared);
    let reference = reference_speeds(track, rate_hz);
    let is_known = is_known(prepared, track, reference.len());
    let shift = (prepared.epoch - track.start) * rate_hz;
    let reach = REACH_S * rate_hz;
    let lag_of = |index: usize| {
        let from = index * piece;
        // Where the reference is to be found, one reach further on either side.
        let there = from as f64 + shift - lag_s * rate_hz;
        let first = (there - 2.0 * reach).max(0.0) as usize;
        let last = ((there + piece as f64 + 2.0 * reach).max(0.0) as usize).min(reference.len());
        if last < first + piece {
            return None;
        }
        let of_piece = &measured[from..from + piece];
        let correlations =
            Correlations::of_known(of_piece, &reference[first..last], &is_known[first..last]);
        // Entry k of the piece is at entry k + from + shift - first of this part when nothing is late.
        let nothing_late = from as f64 + shift - first as f64;
        let middle = lag_s * rate_hz - nothing_late;
        let offsets = (middle - reach) as i64..(middle + reach) as i64;
        let peak = correlations.peak(offsets, |_| 0.0)?;
        let lag = (peak.offset + nothing_late) / rate_hz;
        let seconds = (from as f64 + 0.5 * piece as f64) / rate_hz;
        (peak.correlation >= LEAST_OF_PIECE).then_some((seconds, lag))
    };
    let lags: Vec<(f64, f64)> = (0..count).filter_map(lag_of).collect();
    let drift = line_of_most(&lags)?;
    let is_on_line = |(seconds, lag): &&(f64, f64)| {
        (lag - drift.lag_s - drift.per_second * seconds).abs() < ON_LINE_S
    };
    let on_line = lags.iter().filter(is_on_line).count();
    let seconds = measured.len() as f64 / rate_hz;
    let is_steady = on_line >= LEAST_PIECES && 2 * on_line > lags.len();
    (is_steady && drift.per_second.abs() * seconds > LEAST_DRIFT_S).then_some(drift)
}

/// The line with the median slope of all pairs (Theil and Sen), and the median of what is above it.
fn line_of_most(points: &[(f64, f64)]) -> Option<Drift> {
    let median = |mut values: Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let after = |k: usize| points[k + 1..].iter();
    let slopes = points
        .iter()
        .enumerate()
        .flat_map(|(k, one)| after(k).map(move |other| (other.1 - one.1) / (other.0 - one.0)));
    let per_second = median(slopes.collect())?;
    let above = points
        .iter()
        .map(|(seconds, lag)| lag - per_second * seconds);
    let lag_s = median(above.collect())?;
    Some(Drift { lag_s, per_second })
}

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
    let bonus = |offset: i64| match seconds(offset as f64).abs() {
        near_s if near_s < NEAR_S => NEAR_BONUS,
        near_s if near_s < LOOP_S => WITHIN_LOOP_BONUS,
        _ => 0.0,
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
