//! The lag of the IMU's stamps from the magnitudes of the angular velocity: no axes, units or
//! gravity enter.

use cromosim_spatial::{Complex64, FourierPair, KinematicTrack};

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
    // Entry k of the measured sample grid is at the reference's entry k + shift when nothing is
    // late.
    let shift = (prepared.epoch - track.start) * rate_hz;
    let seconds = |offset: f64| (offset + shift) / rate_hz;
    let correlations = Correlations::new(&measured, &reference);
    let score = |offset: i64| correlations.at(offset);
    let bonus = |offset: i64| {
        if seconds(offset as f64).abs() < NEAR_S {
            NEAR_BONUS
        } else {
            0.0
        }
    };
    let range = -(reference.len() as i64) + 1..measured.len() as i64;
    let Some(best) = range.max_by(|&a, &b| (score(a) + bonus(a)).total_cmp(&(score(b) + bonus(b))))
    else {
        return 0.0;
    };
    if score(best) < LEAST_CORRELATION {
        return 0.0;
    }
    let (before, here, after) = (score(best - 1), score(best), score(best + 1));
    let bend = before - 2.0 * here + after;
    let fraction = if bend < 0.0 && bend.is_finite() {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    seconds(best as f64 + fraction)
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

/// Correlations of two series at every offset, by one Fourier transform.
struct Correlations {
    /// `sum measured[k] reference[k - offset]`, means taken out, circular.
    products: Vec<Complex64>,
    energy_measured: Vec<f64>,
    energy_reference: Vec<f64>,
    /// Entries that have to overlap.
    least: usize,
}

impl Correlations {
    fn new(measured: &[f64], reference: &[f64]) -> Self {
        let length = FourierPair::good_length(measured.len() + reference.len());
        let transform = FourierPair::new(length);
        let spectrum = |series: &[f64]| {
            let mean = series.iter().sum::<f64>() / series.len() as f64;
            let mut values: Vec<Complex64> = series
                .iter()
                .map(|value| Complex64::new(value - mean, 0.0))
                .collect();
            values.resize(length, Complex64::default());
            transform.forward(&mut values);
            values
        };
        let mut products: Vec<Complex64> = spectrum(reference)
            .iter()
            .zip(spectrum(measured))
            .map(|(a, b)| a.conj() * b)
            .collect();
        transform.inverse(&mut products);
        Self {
            products,
            energy_measured: cumulated_energy(measured),
            energy_reference: cumulated_energy(reference),
            least: measured.len().min(reference.len()) / 2,
        }
    }

    /// Of `measured[k]` with `reference[k - offset]`; minus infinity where too little overlaps.
    fn at(&self, offset: i64) -> f64 {
        let (measured, reference) = (
            self.energy_measured.len() as i64 - 1,
            self.energy_reference.len() as i64 - 1,
        );
        let from = offset.max(0);
        let to = measured.min(reference + offset);
        if to - from < self.least as i64 {
            return f64::NEG_INFINITY;
        }
        let between = |energy: &[f64], a: i64, b: i64| energy[b as usize] - energy[a as usize];
        let scale = (between(&self.energy_measured, from, to)
            * between(&self.energy_reference, from - offset, to - offset))
        .sqrt();
        if scale > 0.0 {
            self.products[offset.rem_euclid(self.products.len() as i64) as usize].re / scale
        } else {
            f64::NEG_INFINITY
        }
    }
}

/// Sums of the squared deviations from the mean of the first 0, 1, 2, ... entries.
fn cumulated_energy(series: &[f64]) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(series.iter().map(|value| {
            sum += (value - mean).powi(2);
            sum
        }))
        .collect()
}
