//! Parts of a recording that tell an error that is always there from one that comes and goes.

use cromosim_imu::{Channel, EffectSet, PerChannel, STANDARD_GRAVITY};

use crate::axes::axes_of_channel;
use crate::fit::{Fit, FitModel};
use crate::policy::calibration::{BLOCK_S, MOST_RISE_IN_PART, PART};

/// Of each part of a recording, which entries of the sample grid it has.
pub(crate) struct PartsOfTime(Vec<Vec<bool>>);

impl PartsOfTime {
    /// The last [`PART`] of a recording, and as many of its blocks of time: those that accelerate least, and those
    /// that turn least.
    pub fn of(model: &FitModel) -> Self {
        let length = model.prepared.length;
        let from = (1.0 - PART) * length as f64;
        let last = (0..length).map(|entry| entry as f64 >= from).collect();
        let calm = Channel::ALL.map(|channel| calm(model, channel));
        Self([last].into_iter().chain(calm).collect())
    }

    /// Sums of the squared residual by part and channel.
    fn squares(&self, model: &FitModel, fit: &Fit) -> Vec<PerChannel<f64>> {
        let residual = model.prepared.residual(&fit.prediction.readings);
        let of_part = |part: &Vec<bool>| {
            PerChannel::from_fn(|channel| {
                let axes = residual[axes_of_channel(channel)].iter();
                let own = axes.flat_map(|values| values.iter().zip(part));
                own.filter(|(_, is_in)| **is_in).map(|(e, _)| e * e).sum()
            })
        };
        self.0.iter().map(of_part).collect()
    }
}

/// The blocks of time in which a channel's motion is the least by the reference: squares of the angular velocity, or
/// of how far the specific force is from gravity's size.
fn calm(model: &FitModel, channel: Channel) -> Vec<bool> {
    let prepared = model.prepared;
    let block = |entry: usize| (entry as f64 / (BLOCK_S * prepared.rate_hz)) as usize;
    let nominal = prepared.predict(&model.track, &EffectSet::new()).readings;
    let mut sums = vec![(0.0, 0.0); block(prepared.length) + 1];
    for (reading, &entry) in nominal.iter().zip(&prepared.grid_index) {
        let (sum, count) = &mut sums[block(entry)];
        *count += 1.0;
        *sum += match channel {
            Channel::Accelerometer => (reading.specific_force.norm() - STANDARD_GRAVITY).powi(2),
            Channel::Gyroscope => reading.angular_velocity.norm_squared(),
        };
    }
    let means: Vec<f64> = sums.iter().map(|(sum, count)| sum / count).collect();
    let mut sorted: Vec<f64> = means
        .iter()
        .copied()
        .filter(|mean| !mean.is_nan())
        .collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let place = (PART * sorted.len() as f64) as usize;
    let limit = sorted.get(place).copied().unwrap_or(0.0);
    (0..prepared.length)
        .map(|entry| means[block(entry)] < limit)
        .collect()
}

/// Whether in any part the norm of a channel's residual, over all recordings, rises from some fits to others.
pub(crate) fn rises_in_part(
    models: &[&FitModel],
    parts: &[PartsOfTime],
    from: &[Fit],
    to: &[Fit],
) -> bool {
    let sums = |fits: &[Fit]| -> Vec<PerChannel<f64>> {
        let recordings = models.iter().zip(parts).zip(fits);
        let all = recordings.map(|((model, parts), fit)| parts.squares(model, fit));
        let added = |sum: Vec<PerChannel<f64>>, own: Vec<PerChannel<f64>>| {
            let pairs = sum.iter().zip(&own);
            pairs
                .map(|(sum, own)| PerChannel::from_fn(|channel| sum[channel] + own[channel]))
                .collect()
        };
        all.reduce(added).unwrap_or_default()
    };
    let (before, after) = (sums(from), sums(to));
    before.iter().zip(&after).any(|(before, after)| {
        Channel::ALL
            .into_iter()
            .any(|channel| after[channel] > MOST_RISE_IN_PART.powi(2) * before[channel])
    })
}
