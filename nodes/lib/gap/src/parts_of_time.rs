//! Parts of a recording that tell an error that is always there from one that comes and goes.

use cromosim_imu::{Channel, EffectSet, PerChannel, Reading, STANDARD_GRAVITY};

use crate::axes::axes_of_channel;
use crate::fit::{Fit, FitModel};
use crate::policy::calibration::{BLOCK_S, MOST_RISE_IN_PART, PART};

/// What a part of a recording is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// The last of it.
    End,
    /// Blocks of time that by the reference accelerate least, or turn least.
    Calm,
    /// Blocks of time whose specific force is by the reference the least, or the most, along an axis.
    Posture,
}

/// Of each part of a recording, which entries of the sample grid it has. Each is [`PART`] of it.
pub(crate) struct PartsOfTime(Vec<(Part, Vec<bool>)>);

impl PartsOfTime {
    /// Of the recording that a model is of.
    pub fn of(model: &FitModel) -> Self {
        let length = model.prepared.length;
        let from = (1.0 - PART) * length as f64;
        let end = (0..length).map(|entry| entry as f64 >= from).collect();
        let nominal = model.prepared.predict(&model.track, &EffectSet::new());
        let least = |of: &dyn Fn(&Reading) -> f64| least(model, &nominal.readings, of);
        let calm = [
            least(&|reading| (reading.specific_force.norm() - STANDARD_GRAVITY).powi(2)),
            least(&|reading| reading.angular_velocity.norm_squared()),
        ];
        let postures = (0..3).flat_map(|axis| {
            [1.0, -1.0].map(|sign: f64| least(&|reading| sign * reading.specific_force[axis]))
        });
        let calm = calm.into_iter().map(|entries| (Part::Calm, entries));
        let postures = postures.map(|entries| (Part::Posture, entries));
        let end = std::iter::once((Part::End, end));
        Self(end.chain(calm).chain(postures).collect())
    }

    /// Sums of the squared residual by channel, of each part.
    fn squares(&self, model: &FitModel, fit: &Fit) -> Vec<PerChannel<f64>> {
        let residual = model.prepared.residual(&fit.prediction.readings);
        let of_part = |entries: &Vec<bool>| {
            PerChannel::from_fn(|channel| {
                let axes = residual[axes_of_channel(channel)].iter();
                let own = axes.flat_map(|values| values.iter().zip(entries));
                own.filter(|(_, is_in)| **is_in).map(|(e, _)| e * e).sum()
            })
        };
        let parts = self.0.iter();
        parts.map(|(_, entries)| of_part(entries)).collect()
    }
}

/// In which parts the norm of a channel's residual, over all recordings, rises by more than
/// [`MOST_RISE_IN_PART`] from some fits to others.
pub(crate) struct Rises(Vec<(Part, bool)>);

impl Rises {
    /// Of the recordings that models and parts are of.
    pub fn between(models: &[&FitModel], parts: &[PartsOfTime], from: &[Fit], to: &[Fit]) -> Self {
        let (before, after) = (summed(models, parts, from), summed(models, parts, to));
        let limit = MOST_RISE_IN_PART.powi(2);
        let rises = before.iter().zip(&after).map(|(before, after)| {
            let mut channels = Channel::ALL.into_iter();
            channels.any(|channel| after[channel] > limit * before[channel])
        });
        let kinds = parts.iter().take(1).flat_map(|parts| &parts.0);
        Self(kinds.map(|(part, _)| *part).zip(rises).collect())
    }

    /// The share of a kind's parts that it rises in.
    pub fn share(&self, kind: Part) -> f64 {
        let own: Vec<bool> = self
            .0
            .iter()
            .filter(|(part, _)| *part == kind)
            .map(|(_, rises)| *rises)
            .collect();
        own.iter().filter(|rises| **rises).count() as f64 / own.len().max(1) as f64
    }
}

/// Sums of the squared residual of some fits over all recordings.
fn summed(models: &[&FitModel], parts: &[PartsOfTime], fits: &[Fit]) -> Vec<PerChannel<f64>> {
    let recordings = models.iter().zip(parts).zip(fits);
    let all = recordings.map(|((model, parts), fit)| parts.squares(model, fit));
    let added = |sum: Vec<PerChannel<f64>>, own: Vec<PerChannel<f64>>| {
        let pairs = sum.iter().zip(&own);
        pairs
            .map(|(sum, own)| PerChannel::from_fn(|channel| sum[channel] + own[channel]))
            .collect()
    };
    all.reduce(added).unwrap_or_default()
}

/// The blocks of time in which a value of the readings is the least.
fn least(model: &FitModel, readings: &[Reading], of: impl Fn(&Reading) -> f64) -> Vec<bool> {
    let prepared = model.prepared;
    let block = |entry: usize| (entry as f64 / (BLOCK_S * prepared.rate_hz)) as usize;
    let mut sums = vec![(0.0, 0.0); block(prepared.length) + 1];
    for (reading, &entry) in readings.iter().zip(&prepared.grid_index) {
        let (sum, count) = &mut sums[block(entry)];
        *count += 1.0;
        *sum += of(reading);
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
