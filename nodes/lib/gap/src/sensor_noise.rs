//! The white noise of a sensor, as its readings and residuals show it.

use cromosim_imu::{Channel, PerChannel, ReadOff};
use cromosim_spatial::{
    FOURTH_DIFFERENCE_GAIN, ROUNDED_MEDIAN_OF_SQUARE, fourth_difference, white_noise_variance,
};

use crate::axes::{axes_of_channel, value_on_axis};
use crate::digital::Digital;
use crate::library::Library;
use crate::policy::sensor_noise::{
    LEAST_OF_STEP, LEVEL, LEVEL_READINGS, OF_LOWER_BANDS, OF_QUIET_DIFFERENCES, QUIET_PART, STEADY,
    STEADY_BLOCK_S, TAILS, TAILS_OF_READINGS,
};
use crate::prepared::PreparedPlacement;

/// Runs of five neighbours below which fourth differences say nothing.
const LEAST_RUNS: usize = 300;
/// A quantile of their sizes, and where a standard normal number has it.
const QUIET_QUANTILE: f64 = 0.2;
const QUIET_SIGMAS: f64 = 0.253_347_1;
/// Bands in the upper half of a spectrum, in units of the Nyquist frequency.
pub(crate) const UPPER_BANDS: [(f64, f64); 4] =
    [(0.5, 0.62), (0.62, 0.74), (0.74, 0.86), (0.86, 0.97)];
/// And below it, where a reference resolves more of the motion.
pub(crate) const LOWER_BANDS: [(f64, f64); 5] = [
    (0.03, 0.06),
    (0.06, 0.12),
    (0.12, 0.2),
    (0.2, 0.32),
    (0.32, 0.5),
];

/// The declared noise in SI units. Whether a device in other units declares its covariances in them
/// is nowhere said: what is nearer to the noise of the readings holds. Readings that stay on a step of their rounding
/// show none; they may have what such steps hide.
pub(crate) fn declared_in_si(
    prepared: &PreparedPlacement,
    units: PerChannel<f64>,
) -> PerChannel<Option<f64>> {
    let series = prepared.on_sample_grid(|k, axis| value_on_axis(&prepared.measured[k], axis));
    PerChannel::from_fn(|channel| {
        let declared = prepared.declared[channel]?;
        let found = fourth_differences(prepared, &series, channel)
            .unwrap_or(0.0)
            .sqrt()
            .max(prepared.steps[channel] / 12f64.sqrt())
            .max(1e-12);
        let off = |sigma: f64| (sigma / found).ln().abs();
        Some(if off(declared / units[channel]) < off(declared) {
            declared / units[channel]
        } else {
            declared
        })
    })
}

/// White noise per sample that residuals are divided by: what is found, unless the cause of more
/// than the declared is excluded; never less than a small part of the step that readings are rounded to.
pub(crate) fn white_noise(
    prepared: &PreparedPlacement,
    found: PerChannel<f64>,
    digital: &PerChannel<Digital>,
    library: &Library,
) -> PerChannel<f64> {
    PerChannel::from_fn(|channel| {
        let may_exceed = library.allows_read_off(ReadOff::ExcessNoise(channel))
            && !digital[channel].rounding_is_excluded;
        let sigma = match prepared.declared[channel] {
            None => found[channel],
            Some(declared) if may_exceed => declared.max(found[channel]),
            Some(declared) => declared,
        };
        sigma.max(LEAST_OF_STEP * prepared.steps[channel])
    })
}

/// White noise per sample of each channel: the least of four bands in the upper half of the
/// residual's spectrum and of fourth differences of neighbours, or with a margin of bands below
/// ([`OF_LOWER_BANDS`]) and of the least of these differences and the readings' own ([`OF_QUIET_DIFFERENCES`]);
/// whatever else is there only adds to each.
pub(crate) fn found_noise(
    prepared: &PreparedPlacement,
    residual: &[Vec<f64>],
    digital: &PerChannel<Digital>,
) -> PerChannel<f64> {
    let measured = prepared.on_sample_grid(|k, axis| value_on_axis(&prepared.measured[k], axis));
    PerChannel::from_fn(|channel| {
        let lower = band_variances(prepared, residual, channel, &LOWER_BANDS);
        let found = noise_variances(prepared, residual, channel)
            .chain(lower.map(|variance| OF_LOWER_BANDS * variance))
            .fold(f64::INFINITY, f64::min);
        // What is rounded is quieter than its noise wherever it stays on a step. Where nothing is declared there
        // is no excess to be sure of.
        let is_asked = prepared.declared[channel].is_some() && digital[channel].lsb.is_none();
        let quiet = [residual, &measured]
            .into_iter()
            .filter(|_| is_asked)
            .filter_map(|series| quiet_differences(prepared, series, channel));
        quiet.fold(found, f64::min).sqrt()
    })
}

/// The largest of the same: what a device has at most, where it declares more.
pub(crate) fn most_noise(prepared: &PreparedPlacement, residual: &[Vec<f64>]) -> PerChannel<f64> {
    PerChannel::from_fn(|channel| {
        let found = noise_variances(prepared, residual, channel).fold(0.0, f64::max);
        found.sqrt()
    })
}

/// The variance of white noise as each band and the fourth differences have it.
fn noise_variances(
    prepared: &PreparedPlacement,
    residual: &[Vec<f64>],
    channel: Channel,
) -> impl Iterator<Item = f64> {
    band_variances(prepared, residual, channel, &UPPER_BANDS)
        .chain(fourth_differences(prepared, residual, channel))
}

pub(crate) fn band_variances<'a>(
    prepared: &PreparedPlacement,
    residual: &[Vec<f64>],
    channel: Channel,
    bands: &'a [(f64, f64)],
) -> impl Iterator<Item = f64> + use<'a> {
    let spectrum = prepared.channel_spectrum(residual, channel);
    let nyquist_hz = prepared.rate_hz / 2.0;
    bands.iter().filter_map(move |(a, b)| {
        let density = spectrum.median(a * nyquist_hz, b * nyquist_hz)?;
        Some(density * nyquist_hz)
    })
}

/// Whether the noise of a channel is there at all times: impacts are broad and read at 25 or 50 Hz
/// as level as noise, but a body that is struck rests too.
pub(crate) fn is_steady(prepared: &PreparedPlacement, residual: &[Vec<f64>]) -> PerChannel<bool> {
    let block = (STEADY_BLOCK_S * prepared.rate_hz).max(1.0) as usize;
    PerChannel::from_fn(|channel| {
        let mut of_blocks: Vec<Vec<f64>> = vec![Vec::new(); prepared.length / block + 1];
        for (entry, difference) in differences(prepared, residual, channel) {
            of_blocks[entry / block].push(difference);
        }
        let most = of_blocks.iter().map(Vec::len).max().unwrap_or(0);
        let mut variances: Vec<f64> = of_blocks
            .iter_mut()
            .filter(|block| 2 * block.len() > most)
            .filter_map(|block| white_noise_variance(block, ROUNDED_MEDIAN_OF_SQUARE))
            .collect();
        variances.sort_unstable_by(f64::total_cmp);
        let at = |part: f64| variances.get((part * variances.len() as f64) as usize);
        match (at(QUIET_PART), at(0.5)) {
            (Some(quiet), Some(median)) => *quiet > STEADY * median,
            _ => true,
        }
    })
}

/// Whether a channel's residual has tails that no normal noise has, or its readings have much longer ones: blows
/// that a slow device cannot follow lift all bands alike, and come and go.
pub(crate) fn has_tails(prepared: &PreparedPlacement, residual: &[Vec<f64>]) -> PerChannel<bool> {
    let measured = prepared.on_sample_grid(|k, axis| value_on_axis(&prepared.measured[k], axis));
    PerChannel::from_fn(|channel| {
        let has_longer = |series: &[Vec<f64>], most: f64| {
            let differences = differences(prepared, series, channel);
            let mut differences: Vec<f64> = differences.map(|(_, difference)| difference).collect();
            let squares: f64 = differences.iter().map(|value| value * value).sum();
            let mean = squares / differences.len().max(1) as f64 / FOURTH_DIFFERENCE_GAIN;
            white_noise_variance(&mut differences, ROUNDED_MEDIAN_OF_SQUARE)
                .is_some_and(|variance| mean > most * variance)
        };
        has_longer(residual, TAILS) || has_longer(&measured, TAILS_OF_READINGS)
    })
}

/// Whether a channel's spectrum is level: motion that the reference does not resolve falls steeply at its
/// top, and is not in the lower bands, where the reference resolves it.
pub(crate) fn is_white(prepared: &PreparedPlacement, residual: &[Vec<f64>]) -> PerChannel<bool> {
    PerChannel::from_fn(|channel| {
        let least = |bands| {
            band_variances(prepared, residual, channel, bands).fold(f64::INFINITY, f64::min)
        };
        let is_everywhere = least(&LOWER_BANDS) > LEVEL * least(&UPPER_BANDS);
        let spectrum = prepared.channel_spectrum(residual, channel);
        let level = |from: f64, to: f64| {
            spectrum
                .median(from * prepared.rate_hz / 2.0, to * prepared.rate_hz / 2.0)
                .unwrap_or(0.0)
        };
        is_everywhere && level(0.70, 0.83) < 1.5 * level(0.84, 0.97)
    })
}

/// Whether the upper half of the readings' own spectrum is level, at no more than was found (standard deviations): what a
/// reference lacks of the motion is not in them, nor is motion.
pub(crate) fn readings_are_level(
    prepared: &PreparedPlacement,
    found: PerChannel<f64>,
) -> PerChannel<bool> {
    let measured = prepared.on_sample_grid(|k, axis| value_on_axis(&prepared.measured[k], axis));
    PerChannel::from_fn(|channel| {
        let levels = || band_variances(prepared, &measured, channel, &UPPER_BANDS);
        let least = levels().fold(f64::INFINITY, f64::min);
        levels().fold(0.0, f64::max) < LEVEL_READINGS * least.min(found[channel].powi(2))
    })
}

/// Variance of white noise from fourth differences of five neighbours that are all there; none where
/// there are too few.
fn fourth_differences(
    prepared: &PreparedPlacement,
    residual: &[Vec<f64>],
    channel: Channel,
) -> Option<f64> {
    let mut sizes = enough_differences(prepared, residual, channel)?;
    white_noise_variance(&mut sizes, ROUNDED_MEDIAN_OF_SQUARE)
}

/// The same by a low quantile of them, with a margin: blows that come every half second are in most of them at
/// 25 Hz, errors of the reference are in all of the residual's, and noise is in all.
fn quiet_differences(
    prepared: &PreparedPlacement,
    residual: &[Vec<f64>],
    channel: Channel,
) -> Option<f64> {
    let mut sizes = enough_differences(prepared, residual, channel)?;
    let place = (QUIET_QUANTILE * sizes.len() as f64) as usize;
    let quiet = *sizes.select_nth_unstable_by(place, f64::total_cmp).1;
    Some(OF_QUIET_DIFFERENCES * (quiet / QUIET_SIGMAS).powi(2) / FOURTH_DIFFERENCE_GAIN)
}

/// Fourth differences of a channel; none where they are too few to say anything.
fn enough_differences(
    prepared: &PreparedPlacement,
    residual: &[Vec<f64>],
    channel: Channel,
) -> Option<Vec<f64>> {
    let sizes = differences(prepared, residual, channel).map(|(_, difference)| difference);
    let sizes: Vec<f64> = sizes.collect();
    (sizes.len() >= LEAST_RUNS).then_some(sizes)
}

/// Fourth differences of five neighbours that are all there, each with the entry of the sample grid where it begins.
fn differences<'a>(
    prepared: &'a PreparedPlacement,
    residual: &'a [Vec<f64>],
    channel: Channel,
) -> impl Iterator<Item = (usize, f64)> + 'a {
    axes_of_channel(channel).flat_map(move |axis| {
        let firsts = 0..prepared.grid_index.len().saturating_sub(4);
        firsts.filter_map(move |first| {
            let entry = prepared.grid_index[first];
            let whole = prepared.grid_index[first + 4] == entry + 4
                && (first..first + 5).all(|k| prepared.usable[k][axis]);
            whole.then(|| {
                let x = &residual[axis][entry..];
                (entry, fourth_difference([x[0], x[1], x[2], x[3], x[4]]))
            })
        })
    })
}
