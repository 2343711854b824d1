//! What a diagnosis says: the form of diagnosis.json (schema cromosim/diagnosis/1).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The schema's name.
pub const SCHEMA: &str = "cromosim/diagnosis/1";

/// Name of the cause that stands for structure outside the library.
pub const UNKNOWN: &str = "unknown";

/// A recording's diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// [`SCHEMA`].
    pub schema: String,
    /// By placement.
    pub placements: BTreeMap<String, PlacementDiagnosis>,
}

/// What is said of one placement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlacementDiagnosis {
    /// One sentence for people.
    pub verdict: String,
    /// How far measured and simulated lie apart.
    pub gap: Gap,
    /// Where the gap of the nominal simulation lies.
    #[serde(rename = "where")]
    pub location: GapLocation,
    /// By share of the gap, the largest first.
    pub causes: Vec<Cause>,
    /// What this motion cannot tell.
    pub unidentifiable: Vec<Unidentifiable>,
    /// What no cause explains.
    pub unexplained: Unexplained,
}

/// Before and after all named causes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Of the nominal simulation.
    pub before: Metrics,
    /// With all named causes added.
    pub after: Metrics,
}

/// Distances of measured and simulated readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Root mean square of the vector residual, m/s2.
    pub accel_rmse: f64,
    /// Root mean square of the vector residual, rad/s.
    pub gyro_rmse: f64,
    /// Root mean square over frequency of the difference of Welch spectra, dB.
    pub accel_log_spectral_distance_db: f64,
    /// The same of the gyroscope.
    pub gyro_log_spectral_distance_db: f64,
    /// First Wasserstein distance of the distributions, mean over axes, m/s2.
    pub accel_wasserstein: f64,
    /// The same of the gyroscope, rad/s.
    pub gyro_wasserstein: f64,
    /// Negative log-likelihood, nats per sample of six values.
    pub nll_per_sample: f64,
}

/// Shares of the whitened squared residual beyond the predicted noise; each list adds up to 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GapLocation {
    /// `accel`, `gyro`.
    #[serde(default)]
    pub channels: BTreeMap<String, f64>,
    /// `accel_x` to `gyro_z`.
    #[serde(default)]
    pub axes: BTreeMap<String, f64>,
    /// By frequency, Hz.
    #[serde(default)]
    pub bands_hz: Vec<Interval>,
    /// By time, s since the first IMU message.
    #[serde(default)]
    pub intervals_s: Vec<Interval>,
}

/// A range and its share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Share of the gap.
    pub share: f64,
}

/// One cause of the gap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// The effect's name, or `unknown`.
    pub effect: String,
    /// That this cause is there.
    pub probability: f64,
    /// By name, in SI: number, list, rows of a matrix, or word. Of `unknown`: channel, axes,
    /// band_hz, intervals_s, depends_on.
    pub parameters: BTreeMap<String, Value>,
    /// In the form of the parameters; absent where a parameter is not an estimate.
    pub standard_errors: BTreeMap<String, Value>,
    /// Share of the whitened squared residual that it explains; with `unexplained.share` they add
    /// up to 1.
    pub gap_share: f64,
    /// With this cause and those above it.
    pub after: Metrics,
}

/// An effect that this motion cannot show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unidentifiable {
    /// Its name.
    pub effect: String,
    /// The motion or recording that would tell.
    pub would_tell: String,
}

/// What is left.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Whether the rest holds structure.
    pub significant: bool,
    /// Share of the gap.
    pub share: f64,
    /// Where the rest lies.
    #[serde(rename = "where")]
    pub location: GapLocation,
}
