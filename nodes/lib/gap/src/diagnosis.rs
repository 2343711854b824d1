//! What a diagnosis says: the form of diagnosis.json (schema cromosim/diagnosis/1).

use std::collections::BTreeMap;

use cromosim_spatial::MotionResponse;
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
    /// Calibrations that are no causes, but lower the gap on held-out time, and gains, misalignments and a delay that
    /// may only pass for something unknown: effects.yaml holds them beside the causes, and `gap.after` counts on them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub calibration: Vec<KeptCalibration>,
    /// What the readings hold of the motion that the reference shows, by frequency; no cause, but in effects.yaml and
    /// counted on by `gap.after`. None where it is all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_response: Option<ReferenceResponse>,
    /// What this motion cannot tell.
    pub unidentifiable: Vec<Unidentifiable>,
    /// What no cause explains.
    pub unexplained: Unexplained,
    /// Of each recording, where several were diagnosed together; the fields above then speak of all
    /// of them (the location of the gap, what is unknown, and values that are a session's own, of one).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<RecordingDiagnosis>,
    /// Where stamps go on somewhere else; what lies between is diagnosed in parts, which
    /// `recordings` holds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clock_jumps: Vec<ClockJump>,
    /// Of its magnetometer, where the recording has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub magnetometer: Option<MagnetometerDiagnosis>,
}

/// What is said of a placement's magnetometer: `m = S A R_SW(t - delay) B + h`, S of determinant 1, so that
/// B has the strength with which this device measures it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MagnetometerDiagnosis {
    /// For people.
    pub verdict: String,
    /// On time that was not fitted to; none where nothing could be compared.
    pub gap: Option<MagneticGap>,
    /// `hard_iron` (h, T), `soft_iron` (S, rows), `delay` (s), `axes` (A, a signed permutation), by share of
    /// the gap; each under its own name among the parameters.
    pub causes: Vec<MagneticCause>,
    /// What this motion cannot tell.
    pub unidentifiable: Vec<Unidentifiable>,
    /// B, T, in the reference's world; of several recordings the last one's.
    pub field_in_world: Option<[f64; 3]>,
    /// Of B, T.
    pub field_standard_errors: Option<[f64; 3]>,
    /// White noise by fourth differences, T/sqrt(Hz).
    pub noise_density: f64,
    /// Root mean square of the residual vector beyond that noise, T: a field that is not the same
    /// everywhere, for one.
    pub beyond_noise: f64,
}

/// Root mean square of the vector residual, T: of a magnetometer without error in the field that fits best,
/// and with all causes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MagneticGap {
    /// Without causes.
    pub before: f64,
    /// With them.
    pub after: f64,
}

/// A magnetometer's effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MagneticCause {
    /// Its name.
    pub effect: String,
    /// Held-out log-likelihood that is lost without it, nats.
    pub gain_nats: f64,
    /// By its own name, in SI.
    pub parameters: BTreeMap<String, Value>,
    /// In the form of the parameters.
    pub standard_errors: BTreeMap<String, Value>,
    /// Of the mean square that the causes explain, in proportion to what is lost without each; with what
    /// stays they add up to 1.
    pub gap_share: f64,
}

/// A clock that was set, or stamps that it never had.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClockJump {
    /// Whose: `imu`, `reference`.
    pub clock: String,
    /// The last stamp before it, s.
    pub at: f64,
    /// How far the stamps jump beyond what was due, s.
    pub by: f64,
    /// Messages (of a reference: poses) after it, up to the next one.
    pub messages: usize,
    /// Whether these are diagnosed, the jump undone; else they are left out.
    pub diagnosed: bool,
    /// The recording, where there are several.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub recording: String,
}

/// What is said of one of several recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordingDiagnosis {
    /// Its file.
    pub recording: String,
    /// How far measured and simulated lie apart.
    pub gap: Gap,
    /// The gap with the device's effects as the other recordings alone show them; what is the
    /// session's own is fitted to it.
    pub left_out: Metrics,
    /// Where the gap of the nominal simulation lies.
    #[serde(rename = "where")]
    pub location: GapLocation,
    /// Its causes, the largest share first.
    pub causes: Vec<RecordingCause>,
}

/// A cause in one of several recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordingCause {
    /// The effect's name.
    pub effect: String,
    /// By name, in SI.
    pub parameters: BTreeMap<String, Value>,
    /// In the form of the parameters.
    pub standard_errors: BTreeMap<String, Value>,
    /// Share of this recording's gap.
    pub gap_share: f64,
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

impl Metrics {
    /// Of several recordings together, each with its number of samples: of root mean squares the
    /// root of the mean square, else the mean.
    pub(crate) fn pooled(parts: &[(f64, Self)]) -> Self {
        if let [(_, alone)] = parts {
            return *alone;
        }
        let samples: f64 = parts.iter().map(|(samples, _)| samples).sum();
        let mean = |of: &dyn Fn(&Self) -> f64| {
            let sum: f64 = parts.iter().map(|(count, part)| count * of(part)).sum();
            sum / samples.max(1.0)
        };
        Self {
            accel_rmse: mean(&|part| part.accel_rmse.powi(2)).sqrt(),
            gyro_rmse: mean(&|part| part.gyro_rmse.powi(2)).sqrt(),
            accel_log_spectral_distance_db: mean(&|part| part.accel_log_spectral_distance_db),
            gyro_log_spectral_distance_db: mean(&|part| part.gyro_log_spectral_distance_db),
            accel_wasserstein: mean(&|part| part.accel_wasserstein),
            gyro_wasserstein: mean(&|part| part.gyro_wasserstein),
            nll_per_sample: mean(&|part| part.nll_per_sample),
        }
    }
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
    /// The same by the margin over the best answer without it alone, see
    /// `tests/withheld/calibrate.py`.
    #[serde(default)]
    pub probability_by_margin: f64,
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

/// An effect that is taken over without being a cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptCalibration {
    /// The effect's name.
    pub effect: String,
    /// By name, in SI.
    pub parameters: BTreeMap<String, Value>,
    /// In the form of the parameters.
    pub standard_errors: BTreeMap<String, Value>,
}

/// Factors on the reference's motion, by frequency: below 1 where a part of what it shows is no motion of the
/// sensor, above 1 where it shows less than there is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceResponse {
    /// Hz; straight lines in between.
    pub hz: Vec<f64>,
    /// Of the position, as the accelerometer shows it.
    pub accel: Vec<f64>,
    /// Of the rotation, as the gyroscope shows it.
    pub gyro: Vec<f64>,
}

impl From<&MotionResponse> for ReferenceResponse {
    fn from(response: &MotionResponse) -> Self {
        Self {
            hz: response.hz.clone(),
            accel: response.position.clone(),
            gyro: response.rotation.clone(),
        }
    }
}

impl ReferenceResponse {
    /// `accel 0.48 at 14.5 Hz to 1.00; gyro 1.00 to 1.09 at 14.5 Hz`: the extremes of what is not 1 throughout.
    pub fn in_words(&self) -> String {
        let channels = [("accel", &self.accel), ("gyro", &self.gyro)];
        let of = |(name, factors): (&str, &Vec<f64>)| {
            let pairs = || factors.iter().copied().zip(self.hz.iter().copied());
            let least = pairs().min_by(|a, b| a.0.total_cmp(&b.0))?;
            let most = pairs().max_by(|a, b| a.0.total_cmp(&b.0))?;
            let place = |(factor, hz): (f64, f64)| {
                if factor == 1.0 {
                    "1.00".to_owned()
                } else {
                    format!("{factor:.2} at {hz} Hz")
                }
            };
            (least.0 < most.0).then(|| format!("{name} {} to {}", place(least), place(most)))
        };
        let said: Vec<String> = channels.into_iter().filter_map(of).collect();
        said.join("; ")
    }
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
