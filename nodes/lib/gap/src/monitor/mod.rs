//! A quick look at the gap, again and again on a sliding window: how large it is, and which one
//! effect would explain most of it.
//!
//! The residual r = measured - simulated is whitened by the noise floor of each channel. Every
//! effect that has a closed form is tried alone, by one weighted least-squares step:
//! ```text
//! E       = sum |r_accel|^2 / sigma_accel^2 + sum |r_gyro|^2 / sigma_gyro^2     6 N for noise alone
//! share   = (E - E_effect) / (E - 6 N)
//! score   = share - 0.004 per parameter                                         the largest one names the first cause
//! ```
//! This is no diagnosis: one effect at a time, no held-out data, no probabilities. It says where to
//! look while a device is worn.

mod candidates;
mod columns;
mod pairs;
#[cfg(test)]
mod tests;

use cromosim_spatial::Stamp;

use pairs::Pairs;

/// First cause of a residual that is as small as the noise.
pub const NONE: &str = "none";
/// First cause of a residual of which no effect explains a quarter.
pub const UNKNOWN: &str = "unknown";

/// One message of an IMU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuReading {
    /// Its stamp.
    pub stamp: Stamp,
    /// Accelerometer [m/s2], gyroscope [rad/s], in sensor axes.
    pub values: [f64; 6],
}

/// What the monitor takes for noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorOptions {
    /// White noise of a measured reading as the device declares it, m/s2 and rad/s; none where
    /// unknown: then the noise that is found counts as declared.
    pub declared_sigmas: [Option<f64>; 2],
    /// What the reference is trusted to, m/s2 and rad/s: the noise floor is never taken to be
    /// lower.
    pub least_sigmas: [f64; 2],
    /// How far lags are looked for, s.
    pub largest_lag_s: f64,
}

impl Default for MonitorOptions {
    fn default() -> Self {
        Self {
            declared_sigmas: [None; 2],
            least_sigmas: [0.02, 0.002],
            largest_lag_s: 0.3,
        }
    }
}

/// How regularly messages come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pace {
    /// From the median interval, Hz; 0 for fewer than two messages.
    pub rate_hz: f64,
    /// Messages that are missing between others.
    pub dropped: usize,
}

/// What one window says.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// Readings that were compared.
    pub compared: usize,
    /// Root mean square of the vector residual, m/s2.
    pub accel_rmse: f64,
    /// The same of the gyroscope, rad/s.
    pub gyro_rmse: f64,
    /// Standard deviation per axis that noise alone would leave, m/s2 and rad/s.
    pub sigmas: [f64; 2],
    /// Whitened mean square of each channel: 1 is noise alone.
    pub whitened: [f64; 2],
    /// Name of an effect, [`NONE`] or [`UNKNOWN`].
    pub first_cause: &'static str,
    /// Share of the gap beyond the noise that the first cause explains alone; 0 for [`NONE`], the
    /// best share for [`UNKNOWN`].
    pub first_cause_share: f64,
    /// How late the measured stamps are, s; none where the motion does not tell.
    pub lag_s: Option<f64>,
    /// All that was tried, the best first: name, share, number of parameters.
    pub tried: Vec<(&'static str, f64, usize)>,
}

/// Fewer pairs than these say nothing.
const LEAST_PAIRS: usize = 30;
/// A whitened mean square up to here is noise.
const NOISE_RATIO: f64 = 1.3;
/// What a parameter costs, as a share of the gap.
const PARAMETER_COST: f64 = 0.004;
/// The first cause explains at least this much.
const LEAST_SHARE: f64 = 0.25;
/// Messages missing, as a fraction, from which on that is a cause of its own where there is no
/// other.
const DROPPED_FRACTION: f64 = 0.01;

/// Rate and missing messages of a stream in order of its stamps.
pub fn pace(readings: &[ImuReading]) -> Pace {
    let Some(period) = pairs::median_period(readings) else {
        return Pace::default();
    };
    let missing = |pair: &[ImuReading]| {
        (((pair[1].stamp - pair[0].stamp) / period).round() as usize).saturating_sub(1)
    };
    Pace {
        rate_hz: 1.0 / period,
        dropped: readings.windows(2).map(missing).sum(),
    }
}

/// White noise of a reading of both channels, m/s2 and rad/s, from the median of fourth
/// differences: these leave hardly anything of motion.
pub fn noise_floors(readings: &[ImuReading]) -> [f64; 2] {
    pairs::noise_floors(readings)
}

/// Compares a window of both streams, each in order of its stamps; none where fewer than 30 stamps
/// are common.
///
/// The simulated stream is interpolated at the measured stamps: by a cubic through four neighbours,
/// or linearly where only two are there, and not over holes of more than three periods.
pub fn assess(
    measured: &[ImuReading],
    simulated: &[ImuReading],
    options: &MonitorOptions,
) -> Option<Assessment> {
    let pairs = Pairs::at_lag(measured, simulated, 0.0)?;
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let found = pairs::noise_floors(measured);
    // Of a simulated noise, interpolation leaves only a part.
    let simulated_floors = pairs::noise_floors(simulated).map(|sigma| sigma * pairs.noise_gain);
    let declared: [f64; 2] =
        std::array::from_fn(|channel| options.declared_sigmas[channel].unwrap_or(found[channel]));
    let sigmas: [f64; 2] = std::array::from_fn(|channel| {
        declared[channel]
            .hypot(simulated_floors[channel])
            .max(options.least_sigmas[channel])
    });
    let count = pairs.len() as f64;
    let sums = pairs.squared_residuals();
    let whitened: [f64; 2] =
        std::array::from_fn(|channel| sums[channel] / (3.0 * count * sigmas[channel].powi(2)));

    let scene = candidates::Scene {
        measured,
        simulated,
        pairs: &pairs,
        sigmas,
        found,
        declared,
        largest_lag_s: options.largest_lag_s,
    };
    let lag = scene.lag();
    let mut assessment = Assessment {
        compared: pairs.len(),
        accel_rmse: (sums[0] / count).sqrt(),
        gyro_rmse: (sums[1] / count).sqrt(),
        sigmas,
        whitened,
        first_cause: NONE,
        first_cause_share: 0.0,
        lag_s: lag.map(|lag| lag.seconds),
        tried: Vec::new(),
    };
    if whitened.iter().all(|ratio| *ratio < NOISE_RATIO) {
        let dropped = pace(measured).dropped as f64;
        if dropped > DROPPED_FRACTION * (dropped + measured.len() as f64) {
            // Nothing else is wrong, so that this is the whole difference.
            (assessment.first_cause, assessment.first_cause_share) = ("dropped_samples", 1.0);
        }
        return Some(assessment);
    }
    let excess = (3.0 * count * (whitened[0] + whitened[1]) - 6.0 * count).max(f64::MIN_POSITIVE);
    let share = |reduction: f64| (reduction / excess).clamp(0.0, 1.0);
    let mut tried: Vec<_> = scene
        .reductions(lag)
        .into_iter()
        .map(|tried| (tried.effect, share(tried.reduction), tried.parameters))
        .collect();
    let score =
        |&(_, share, parameters): &(&str, f64, usize)| share - PARAMETER_COST * parameters as f64;
    tried.sort_by(|one, other| score(other).total_cmp(&score(one)));
    if let Some(&(effect, share, _)) = tried.first() {
        assessment.first_cause = if share >= LEAST_SHARE {
            effect
        } else {
            UNKNOWN
        };
        assessment.first_cause_share = share;
    }
    assessment.tried = tried;
    Some(assessment)
}
