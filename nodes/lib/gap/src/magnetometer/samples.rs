//! A magnetometer's readings beside the reference's motion.

use cromosim_imu::SensorModel;
use cromosim_spatial::{
    KinematicTrack, MEDIAN_OF_SQUARE, Stamp, fourth_difference, white_noise_variance,
};
use nalgebra::{Matrix3, Vector3};

use crate::findings::Findings;
use crate::period::median_period;
use crate::policy::magnetometer::{BESIDE_GAPS_S, BLOCK_S, ENDS_S, MOST_READINGS};
use crate::prepared::FOLDS;
use crate::record::MeasuredField;

/// The readings of one recording that the reference covers.
pub(crate) struct FieldSamples<'a> {
    model: SensorModel,
    track: &'a KinematicTrack,
    pub stamps: Vec<Stamp>,
    /// T, sensor axes.
    pub readings: Vec<Vector3<f64>>,
    /// Which part of time each is held out with.
    pub folds: Vec<usize>,
    /// Readings per second before they were thinned, Hz.
    pub rate_hz: f64,
    /// White noise per reading and axis, by fourth differences, T.
    pub white_sigma: f64,
}

impl<'a> FieldSamples<'a> {
    /// With mount, axes and clock as they were found; none where fewer than two readings are covered.
    pub fn new(findings: &'a Findings, measured: &MeasuredField) -> Option<Self> {
        let prepared = findings.model.prepared;
        let model = SensorModel::new(&findings.applied(), prepared.epoch);
        let estimate = &prepared.estimate;
        let (start, end) = (estimate.start(), estimate.end());
        let is_covered = |stamp: Stamp| {
            let at = model.true_time(stamp);
            let in_gap = estimate
                .gaps()
                .iter()
                .any(|(from, to)| at - *from > -BESIDE_GAPS_S && *to - at > -BESIDE_GAPS_S);
            at - start >= ENDS_S && end - at >= ENDS_S && !in_gap
        };
        let mut pairs: Vec<(Stamp, Vector3<f64>)> = measured
            .stamps
            .iter()
            .copied()
            .zip(measured.readings.iter().copied())
            .filter(|(stamp, reading)| {
                reading.iter().all(|value| value.is_finite()) && is_covered(*stamp)
            })
            .collect();
        pairs.sort_by_key(|(stamp, _)| *stamp);
        pairs.dedup_by_key(|(stamp, _)| *stamp);
        let period_s = median_period(pairs.iter().map(|(stamp, _)| *stamp))?;
        let white_sigma = white_sigma(&pairs);
        let every = pairs.len().div_ceil(MOST_READINGS).max(1);
        let (stamps, readings): (Vec<Stamp>, Vec<_>) = pairs.into_iter().step_by(every).unzip();
        let fold = |stamp: &Stamp| ((*stamp - stamps[0]) / BLOCK_S) as usize % FOLDS;
        Some(Self {
            folds: stamps.iter().map(fold).collect(),
            track: &findings.model.track,
            model,
            stamps,
            readings,
            rate_hz: 1.0 / period_s,
            white_sigma,
        })
    }

    /// How the sensor is turned at each reading, its delay before: from the reference's world into sensor
    /// axes.
    pub fn turns(&self, delay_s: f64) -> Vec<Matrix3<f64>> {
        self.model
            .sensor_from_world(self.track, &self.stamps, delay_s)
    }
}

/// Mean over the axes of what fourth differences show.
fn white_sigma(pairs: &[(Stamp, Vector3<f64>)]) -> f64 {
    let variance = |axis: usize| {
        let five = |window: &[(Stamp, Vector3<f64>)]| {
            fourth_difference(std::array::from_fn(|k| window[k].1[axis]))
        };
        let mut differences: Vec<f64> = pairs.windows(5).map(five).collect();
        white_noise_variance(&mut differences, MEDIAN_OF_SQUARE).unwrap_or_default()
    };
    ((0..3).map(variance).sum::<f64>() / 3.0).sqrt()
}
