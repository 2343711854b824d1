//! What one window says.

use std::fmt;

use cromosim_imu::{Channel, EffectKind, PerChannel, Search};

use super::candidates::candidates;
use super::lag::Lag;
use super::pairs::Pairs;
use super::reading::{ImuReading, pace};
use super::scene::{MonitorOptions, Scene};
use crate::diagnosis::UNKNOWN;

/// Fewer pairs than these say nothing.
const LEAST_PAIRS: usize = 30;
/// A whitened mean square up to here is noise.
const NOISE_RATIO: f64 = 1.3;
/// What a value of an effect costs, as a share of the gap.
const VALUE_COST: f64 = 0.004;
/// The first cause explains at least this much.
const LEAST_SHARE: f64 = 0.25;
/// Messages missing, as a fraction, from which on that is a cause of its own where there is no
/// other.
const DROPPED_FRACTION: f64 = 0.01;

/// What explains most of a window's gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirstCause {
    /// The residual is as small as the noise.
    None,
    /// No effect explains a quarter of the gap.
    Unknown,
    /// This effect.
    Effect(EffectKind),
}

/// `none`, `unknown`, or the effect's name.
impl fmt::Display for FirstCause {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::None => "none",
            Self::Unknown => UNKNOWN,
            Self::Effect(kind) => kind.name(),
        })
    }
}

/// An effect that was tried alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tried {
    /// Which.
    pub effect: EffectKind,
    /// Share of the gap beyond the noise that it explains, 0 to 1.
    pub share: f64,
}

impl Tried {
    /// Its share less the price of its values; a choice of a convention counts as one value.
    fn score(&self) -> f64 {
        let spec = self.effect.spec();
        let values = match spec.search {
            Search::Choice => 1,
            Search::Fitted(_) | Search::ReadOff(_) | Search::Given => spec.value_count(),
        };
        self.share - VALUE_COST * values as f64
    }
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
    pub sigmas: PerChannel<f64>,
    /// Whitened mean square of each channel: 1 is noise alone.
    pub whitened: PerChannel<f64>,
    /// What explains most of the gap.
    pub first_cause: FirstCause,
    /// Share of the gap beyond the noise that the first cause explains alone; 0 for
    /// [`FirstCause::None`], the best share for [`FirstCause::Unknown`].
    pub first_cause_share: f64,
    /// How late the measured stamps are, s; none where the motion does not tell.
    pub lag_s: Option<f64>,
    /// All that was tried, the best first.
    pub tried: Vec<Tried>,
}

/// Compares a window of both streams, each in order of its stamps; none where fewer than 30 stamps
/// are common.
///
/// The simulated stream is interpolated at the measured stamps: by a cubic through four neighbours,
/// or linearly where only two are there, and not over gaps of more than three periods.
///
/// The residual r = measured - simulated is whitened by the noise floor of each channel. Every
/// effect that has a closed form is tried alone, by one weighted least-squares step:
/// ```text
/// E       = sum |r_accel|^2 / sigma_accel^2 + sum |r_gyro|^2 / sigma_gyro^2     6 N for noise alone
/// share   = (E - E_effect) / (E - 6 N)
/// score   = share - 0.004 per value of the effect                               the largest one names the first cause
/// ```
pub fn assess(
    measured: &[ImuReading],
    simulated: &[ImuReading],
    options: &MonitorOptions,
) -> Option<Assessment> {
    let pairs = Pairs::at_lag(measured, simulated, 0.0)?;
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let scene = Scene::new(measured, simulated, &pairs, options);
    let count = pairs.len() as f64;
    let sums = pairs.squared_residuals();
    let whitened = PerChannel::from_fn(|channel| {
        sums[channel] / (3.0 * count * scene.sigmas[channel].powi(2))
    });
    let is_noise = Channel::ALL
        .into_iter()
        .all(|channel| whitened[channel] < NOISE_RATIO);
    let lag = Lag::find(&scene);
    let (first_cause, first_cause_share, tried) = if is_noise {
        let (cause, share) = without_gap(measured);
        (cause, share, Vec::new())
    } else {
        let tried = tried(&scene, lag, whitened);
        let (cause, share) = first_of(&tried);
        (cause, share, tried)
    };
    Some(Assessment {
        compared: pairs.len(),
        accel_rmse: (sums.accelerometer / count).sqrt(),
        gyro_rmse: (sums.gyroscope / count).sqrt(),
        sigmas: scene.sigmas,
        whitened,
        first_cause,
        first_cause_share,
        lag_s: lag.map(|lag| lag.seconds),
        tried,
    })
}

/// The first cause, and its share, where the readings that are there show no gap: messages that are
/// not there are then the whole difference.
fn without_gap(measured: &[ImuReading]) -> (FirstCause, f64) {
    let dropped = pace(measured).dropped as f64;
    if dropped > DROPPED_FRACTION * (dropped + measured.len() as f64) {
        (FirstCause::Effect(EffectKind::DroppedSamples), 1.0)
    } else {
        (FirstCause::None, 0.0)
    }
}

/// Every effect that has a closed form, the best first.
fn tried(scene: &Scene, lag: Option<Lag>, whitened: PerChannel<f64>) -> Vec<Tried> {
    let count = scene.pairs.len() as f64;
    let excess = 3.0 * count * (whitened.accelerometer + whitened.gyroscope) - 6.0 * count;
    let mut tried: Vec<Tried> = candidates(scene, lag)
        .into_iter()
        .map(|candidate| Tried {
            effect: candidate.effect,
            share: (candidate.reduction / excess.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
        })
        .collect();
    tried.sort_by(|one, other| other.score().total_cmp(&one.score()));
    tried
}

/// The first cause by what was tried, and its share.
fn first_of(tried: &[Tried]) -> (FirstCause, f64) {
    match tried.first() {
        Some(best) if best.share >= LEAST_SHARE => (FirstCause::Effect(best.effect), best.share),
        Some(best) => (FirstCause::Unknown, best.share),
        None => (FirstCause::None, 0.0),
    }
}
