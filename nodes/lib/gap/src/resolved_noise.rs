//! The white noise of a sensor below the frequencies that its reference does not resolve.

use cromosim_imu::{Channel, PerChannel};

use crate::axes::value_on_axis;
use crate::noise_model::NoiseBasis;
use crate::policy::resolved_noise::{
    LEAST_BANDS, LEVEL, MOST_OF_REFERENCE, OF_UPPER_BANDS, READINGS,
};
use crate::prepared::PreparedPlacement;
use crate::sensor_noise::{LOWER_BANDS, UPPER_BANDS, band_variances};

/// White noise as the bands show it in which the reference resolves the motion, where these are level: motion beyond them
/// hides it there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ResolvedNoise {
    /// Per sample, without the reference's error.
    pub variance: f64,
    /// That error's, in the same bands.
    pub of_reference: f64,
}

/// A band in which little but noise should be left.
struct Band {
    width: f64,
    /// Without the reference's error.
    variance: f64,
    of_reference: f64,
}

/// Of a residual; none in a channel whose bands are not level from some frequency on (louder below, they hold what effects
/// leave), or whose upper half is quieter.
pub(crate) fn resolved_noise(
    prepared: &PreparedPlacement,
    basis: &NoiseBasis,
    residual: &[Vec<f64>],
) -> PerChannel<Option<ResolvedNoise>> {
    PerChannel::from_fn(|channel| {
        let bands = clear_bands(prepared, basis, residual, channel);
        let least = bands.iter().map(|band| band.variance);
        let most = LEVEL * least.fold(f64::INFINITY, f64::min);
        let first = bands.iter().position(|band| band.variance <= most)?;
        let level = &bands[first..];
        let is_level = level.iter().all(|band| band.variance <= most);
        if !is_level || level.len() < LEAST_BANDS || 2 * level.len() < bands.len() {
            return None;
        }
        let width: f64 = level.iter().map(|band| band.width).sum();
        let mean = |of: fn(&Band) -> f64| {
            level.iter().map(|band| band.width * of(band)).sum::<f64>() / width
        };
        let variance = mean(|band| band.variance);
        let upper = band_variances(prepared, residual, channel, &UPPER_BANDS);
        let is_everywhere = OF_UPPER_BANDS * upper.fold(f64::INFINITY, f64::min) > variance;
        is_everywhere.then(|| ResolvedNoise {
            variance,
            of_reference: mean(|band| band.of_reference),
        })
    })
}

/// The bands in which the reference resolves the motion and its error is a small part of the residual.
fn clear_bands(
    prepared: &PreparedPlacement,
    basis: &NoiseBasis,
    residual: &[Vec<f64>],
    channel: Channel,
) -> Vec<Band> {
    let errors = basis.reference_errors(prepared, channel, &LOWER_BANDS);
    let levels = LOWER_BANDS.iter().map(|band| {
        let mut variance = band_variances(prepared, residual, channel, std::slice::from_ref(band));
        (band.1 - band.0, variance.next())
    });
    let bands = levels.zip(errors).filter_map(|((width, level), error)| {
        let level = level?;
        let is_clear = error.is_resolved && error.variance < MOST_OF_REFERENCE * level;
        is_clear.then_some(Band {
            width,
            variance: level - error.variance,
            of_reference: error.variance,
        })
    });
    bands.collect()
}

/// Whether noise of some size (standard deviations) may be motion from beyond half of the IMU's rate that the reference
/// does not resolve: it folds over into all bands alike.
pub(crate) fn may_fold_over(
    prepared: &PreparedPlacement,
    basis: &NoiseBasis,
    sigma: PerChannel<f64>,
) -> PerChannel<bool> {
    let readings = quietest_upper_readings(prepared);
    PerChannel::from_fn(|channel| {
        let variance = sigma[channel].powi(2);
        let errors = basis.reference_errors(prepared, channel, &LOWER_BANDS);
        let resolved = errors.filter(|error| error.is_resolved);
        let lost = resolved.map(|error| error.of_lost_motion);
        let least_lost = lost.reduce(f64::min).unwrap_or(0.0);
        readings[channel] > READINGS * variance && least_lost > variance
    })
}

/// The least band of the upper half of the readings' own spectrum, as a variance per sample.
fn quietest_upper_readings(prepared: &PreparedPlacement) -> PerChannel<f64> {
    let measured = prepared.on_sample_grid(|k, axis| value_on_axis(&prepared.measured[k], axis));
    PerChannel::from_fn(|channel| {
        band_variances(prepared, &measured, channel, &UPPER_BANDS).fold(f64::INFINITY, f64::min)
    })
}
