//! A sensor's filter that only keeps out noise of the reference.
//!
//! Noise that the reference's spectrum does not tell from motion (one with a memory) is in the simulation and not in the
//! readings. Whatever attenuates it helps, a `low_pass` too, whose delay a `time_offset` makes up for. But a filter leaves
//! readings that are weaker and still follow the simulation, and noise leaves some that do not follow it.

use std::f64::consts::{SQRT_2, TAU};

use cromosim_imu::{Channel, Effect, EffectKind, PerChannel};

use crate::axes::{axes_of_channel, sum_over_channels, value_on_axis};
use crate::fit::{Fit, FitModel};
use crate::gram::channel_likelihood;
use crate::library::Library;
use crate::policy::noise_filter::{LEFT_BY_NOISE, SHUT};
use crate::prepared::FOLDS;
use crate::response::{BANDS, Block, Bands, factors};
use crate::search::{ScoredEffectSet, score};
use crate::trace::trace;

/// The same set with a delay in the place of a `low_pass`, where noise of the reference explains as well what is
/// weaker.
pub(crate) fn without_noise_filter(
    model: &FitModel,
    scored: ScoredEffectSet,
    library: &Library,
) -> ScoredEffectSet {
    let set = &scored.fit.set;
    let Some(filter) = set.get(EffectKind::LowPass) else {
        return scored;
    };
    if !library.allows(EffectKind::TimeOffset) {
        return scored;
    }
    // Of a second-order Butterworth filter, for slow motion.
    let delay_s = SQRT_2 / (TAU * filter.values()[0]);
    let Ok(offset) = Effect::time_offset(set.time_offset() + delay_s) else {
        return scored;
    };
    let mut late = set.without(EffectKind::LowPass);
    late.insert(offset);
    let late = score(model, late);
    let [own, other] = [&scored, &late].map(|set| set.score + gained_by_noise(model, &set.fit));
    trace(|| {
        eprintln!(
            "  late rather than filtered: {:.1} for {:.1}, with noise of the reference {other:.1} for {own:.1}",
            late.score, scored.score
        );
    });
    if !other.is_finite() || other < own {
        return scored;
    }
    let margins = scored.margins.iter().copied();
    let margins = margins.filter(|(kind, _)| late.fit.set.contains(*kind));
    ScoredEffectSet {
        margins: margins.collect(),
        ..late
    }
}

/// By how much factors on the simulation raise the log-likelihood of the part of time that they were not learnt from,
/// where they can only be what noise in it leaves.
fn gained_by_noise(model: &FitModel, fit: &Fit) -> f64 {
    let prepared = model.prepared;
    let readings = &fit.prediction.readings;
    let simulated = prepared.on_sample_grid(|k, axis| value_on_axis(&readings[k], axis));
    let centred: Vec<Vec<f64>> = simulated
        .into_iter()
        .map(|series| {
            let mean = series.iter().sum::<f64>() / series.len().max(1) as f64;
            series.into_iter().map(|value| value - mean).collect()
        })
        .collect();
    let simulated = model.whitener.apply(&centred);
    let bands = Bands::new(prepared.rate_hz);
    let gained = PerChannel::from_fn(|channel| {
        let blocks = whitened_blocks(model, &bands, channel, &simulated, &fit.residual);
        let is_noise = of_noise(model, &bands, channel, &blocks);
        bands.squares_per_power() * held_out_gain(&blocks, &is_noise)
    });
    sum_over_channels(|channel| {
        let count = model.whitener.count[channel];
        let squares = fit.linear.held_out_ratio[channel] * count;
        channel_likelihood(count, squares - gained[channel]) - channel_likelihood(count, squares)
    })
}

/// Sums over a channel's windows in units of the predicted noise, by blocks of time.
fn whitened_blocks(
    model: &FitModel,
    bands: &Bands,
    channel: Channel,
    simulated: &[f64],
    residual: &[f64],
) -> Vec<Block> {
    let prepared = model.prepared;
    let axes = axes_of_channel(channel);
    let of_axis = |flat: &[f64], axis: usize, range: &std::ops::Range<usize>| {
        let first = axis * prepared.length;
        flat[first + range.start..first + range.end].to_vec()
    };
    bands.blocks(prepared, |range, block| {
        let weights = axes.clone().flat_map(|axis| &model.whitener.weight[axis][range.clone()]);
        if weights.clone().any(|weight| *weight == 0.0) {
            return;
        }
        for axis in axes.clone() {
            let [motion, rest] = [simulated, residual].map(|flat| of_axis(flat, axis, &range));
            bands.add(&motion, &rest, block);
        }
    })
}

/// In which bands a factor below one can only be what noise leaves: with X the simulation's power, and the readings a
/// factor g of it, noise leaves g (1 - g) X that no factor takes away, and a filter nothing but the sensor's own noise.
/// Where hardly anything passes, the one looks like the other.
fn of_noise(model: &FitModel, bands: &Bands, channel: Channel, blocks: &[Block]) -> [bool; BANDS] {
    let whole = factors(blocks, &[1.0; BANDS], None);
    let sum = |of: fn(&Block) -> &[f64; BANDS], band: usize| -> f64 {
        blocks.iter().map(|block| of(block)[band]).sum()
    };
    std::array::from_fn(|band| {
        let (factor, more) = (whole[band], whole[band] - 1.0);
        let power = sum(|block| &block.simulated, band);
        let left = sum(|block| &block.rest, band) - 2.0 * more * sum(|block| &block.both, band)
            + more * more * power;
        let white = sum(|block| &block.entries, band)
            * bands.power_of_one()
            * part_of_sensor(model, channel, bands.range_hz(band));
        factor < 1.0
            && (factor < SHUT || left - white > LEFT_BY_NOISE * factor * (1.0 - factor) * power)
    })
}

/// Mean part that the sensor's white noise has of the predicted noise between two frequencies.
fn part_of_sensor(model: &FitModel, channel: Channel, [from_hz, to_hz]: [f64; 2]) -> f64 {
    let variance = model.basis.sigma[channel].powi(2);
    let power = &model.noise.power[channel];
    let place = |hz: f64| ((hz / model.noise.spacing_hz) as usize).min(power.len() - 1);
    let own = &power[place(from_hz)..=place(to_hz)];
    own.iter().map(|power| (variance / power).min(1.0)).sum::<f64>() / own.len() as f64
}

/// What factors, learnt without each part of time, take off the residual's power there.
fn held_out_gain(blocks: &[Block], is_noise: &[bool; BANDS]) -> f64 {
    let excluding: Vec<[f64; BANDS]> = (0..FOLDS)
        .map(|fold| factors(blocks, &[1.0; BANDS], Some(fold)))
        .collect();
    let mut gain = 0.0;
    for block in blocks {
        for (band, factor) in excluding[block.fold].iter().enumerate() {
            let more = factor - 1.0;
            if is_noise[band] {
                gain += 2.0 * more * block.both[band] - more * more * block.simulated[band];
            }
        }
    }
    gain
}
