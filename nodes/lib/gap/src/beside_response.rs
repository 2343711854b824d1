//! Members of a set that only make up for what the reference's filter lets through of its noise, or keeps out of the motion.
//!
//! Noise that the reference's spectrum does not tell from motion (one with a memory) is in the simulation and not in the
//! readings. Whatever attenuates it helps, a `low_pass` too, whose delay a `time_offset` makes up for. But a filter leaves
//! readings that are weaker and still follow the simulation, and noise leaves some that do not follow it. Motion that the
//! filter keeps out is in the readings and not in the simulation; what makes this stronger helps, a scale too, but a scale is
//! the same at frequencies where the filter is open.

use cromosim_imu::{Channel, Effect, EffectKind, EffectSet, PerChannel, Search};

use crate::axes::{axes_of_channel, sum_over_channels, value_on_axis};
use crate::fit::{Fit, FitModel};
use crate::gram::channel_likelihood;
use crate::policy::beside_response::{LEAST_GAIN_NATS, LEFT_BY_DELAY, LEFT_BY_NOISE, OPEN, SHUT};
use crate::policy::response::LARGEST_FACTOR;
use crate::prepared::FOLDS;
use crate::response::{BANDS, Bands, Block, EDGES_HZ, Edges, WINDOW_S, factors, held_out_gain};
use crate::search::{ScoredEffectSet, score};
use crate::trace::{names, trace};

/// Bands of motion that is slow beside its reference's noise, Hz.
const SLOW_EDGES_HZ: Edges = [
    0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 13.0, 20.0, 30.0, 40.0,
];
/// Length of their windows, s.
const SLOW_WINDOW_S: f64 = 4.0;

/// The set without the members that do not earn their place where factors on the simulation, by frequency, stand beside
/// both; a delay stands for a `low_pass`.
pub(crate) fn pruned_beside_response(
    model: &FitModel,
    scored: ScoredEffectSet,
    library: &[EffectKind],
) -> ScoredEffectSet {
    let gained = gained(model, &scored.fit);
    if gained < LEAST_GAIN_NATS {
        return scored;
    }
    let mut worth = scored.score + gained;
    let mut best = scored;
    let members: Vec<EffectKind> = best.fit.set.iter().map(|effect| effect.kind()).collect();
    for kind in members {
        let Some(set) = without(&best.fit.set, kind, library) else {
            continue;
        };
        let smaller = score(model, set);
        if smaller.score == f64::NEG_INFINITY {
            continue;
        }
        let beside = smaller.score + self::gained(model, &smaller.fit);
        trace(|| {
            eprintln!(
                "  beside a response {:?} {beside:.1} rather than {worth:.1}; alone {:.1} {:.1}",
                names(&smaller.fit.set),
                smaller.score,
                best.score
            );
        });
        let of_delay = if kind == EffectKind::LowPass {
            LEFT_BY_DELAY * (worth - smaller.score)
        } else {
            0.0
        };
        if beside >= worth - of_delay {
            let margins = best.margins.iter().copied();
            let margins = margins.filter(|(member, _)| *member != kind).collect();
            worth = beside;
            best = ScoredEffectSet { margins, ..smaller };
        }
    }
    best
}

/// A set without a member; none where it stays.
fn without(set: &EffectSet, kind: EffectKind, library: &[EffectKind]) -> Option<EffectSet> {
    if !matches!(kind.spec().search, Search::Fitted(_)) {
        return None;
    }
    let mut smaller = set.without(kind);
    if kind == EffectKind::LowPass {
        if !library.contains(&EffectKind::TimeOffset) {
            return None;
        }
        let delay_s = set.get(kind)?.low_pass_delay()?;
        smaller.insert(Effect::time_offset(set.time_offset() + delay_s).ok()?);
    }
    Some(smaller)
}

/// By how much factors on the simulation raise the log-likelihood of the part of time that they were not learnt from,
/// where they can be what the reference's filter does; in the bands that gain more.
fn gained(model: &FitModel, fit: &Fit) -> f64 {
    let simulated = whitened_simulation(model, fit);
    let rate_hz = model.prepared.rate_hz;
    [
        Bands::new(rate_hz, WINDOW_S, &EDGES_HZ),
        Bands::new(rate_hz, SLOW_WINDOW_S, &SLOW_EDGES_HZ),
    ]
    .iter()
    .map(|bands| gained_in(model, fit, bands, &simulated))
    .fold(f64::NEG_INFINITY, f64::max)
}

pub(crate) fn whitened_simulation(model: &FitModel, fit: &Fit) -> Vec<f64> {
    let readings = &fit.prediction.readings;
    let simulated = model
        .prepared
        .on_sample_grid(|k, axis| value_on_axis(&readings[k], axis));
    let centred: Vec<Vec<f64>> = simulated
        .into_iter()
        .map(|series| {
            let mean = series.iter().sum::<f64>() / series.len().max(1) as f64;
            series.into_iter().map(|value| value - mean).collect()
        })
        .collect();
    model.whitener.apply(&centred)
}

/// The same of factors in some bands, with the whitened simulation.
fn gained_in(model: &FitModel, fit: &Fit, bands: &Bands, simulated: &[f64]) -> f64 {
    let gained = PerChannel::from_fn(|channel| {
        let blocks = whitened_blocks(model, bands, channel, simulated, &fit.residual);
        let largest = largest_factors(model, bands, channel);
        let may_be = of_reference(model, bands, channel, (&blocks, &largest));
        let excluding: Vec<[f64; BANDS]> = (0..FOLDS)
            .map(|fold| {
                let own = factors(&blocks, &largest, Some(fold));
                std::array::from_fn(|band| if may_be[band] { own[band] } else { 1.0 })
            })
            .collect();
        bands.squares_per_power() * held_out_gain(&blocks, |fold| &excluding[fold])
    });
    sum_over_channels(|channel| {
        let count = model.whitener.count[channel];
        let squares = fit.linear.held_out_ratio[channel] * count;
        channel_likelihood(count, squares - gained[channel]) - channel_likelihood(count, squares)
    })
}

/// Sums over a channel's windows in units of the predicted noise, by blocks of time.
pub(crate) fn whitened_blocks(
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
        let weights = axes
            .clone()
            .flat_map(|axis| &model.whitener.weight[axis][range.clone()]);
        if weights.clone().any(|weight| *weight == 0.0) {
            return;
        }
        for axis in axes.clone() {
            let [motion, rest] = [simulated, residual].map(|flat| of_axis(flat, axis, &range));
            bands.add(&motion, &rest, block);
        }
    })
}

/// The largest factor in each band: one where the reference's filter lets all motion through.
fn largest_factors(model: &FitModel, bands: &Bands, channel: Channel) -> [f64; BANDS] {
    std::array::from_fn(|band| {
        let [from_hz, to_hz] = bands.range_hz(band);
        let (position, rotation, _) = model.basis.estimate.filter_at(0.5 * (from_hz + to_hz));
        let passed = match channel {
            Channel::Accelerometer => position,
            Channel::Gyroscope => rotation,
        };
        if passed < OPEN { LARGEST_FACTOR } else { 1.0 }
    })
}

/// In which bands a factor can be what the reference's filter does: above one all, and below one those of noise. With X
/// the simulation's power, and the readings a factor g of it, noise leaves g (1 - g) X that no factor takes away, and a
/// sensor's filter nothing but the sensor's own noise. Where hardly anything passes, the one looks like the other.
pub(crate) fn of_reference(
    model: &FitModel,
    bands: &Bands,
    channel: Channel,
    (blocks, largest): (&[Block], &[f64; BANDS]),
) -> [bool; BANDS] {
    let whole = factors(blocks, largest, None);
    let sum = |of: fn(&Block) -> &[f64; BANDS], band: usize| -> f64 {
        blocks.iter().map(|block| of(block)[band]).sum()
    };
    std::array::from_fn(|band| {
        let factor = whole[band];
        let power = sum(|block| &block.simulated, band);
        let left = left_behind(blocks, band, factor);
        let white = sum(|block| &block.entries, band)
            * bands.power_of_one()
            * part_of_sensor(model, channel, bands.range_hz(band));
        let is_told = (SHUT..=1.0).contains(&factor);
        !is_told || left - white > LEFT_BY_NOISE * factor * (1.0 - factor) * power
    })
}

/// The residual's power in a band behind a factor on the simulation.
pub(crate) fn left_behind(blocks: &[Block], band: usize, factor: f64) -> f64 {
    let more = factor - 1.0;
    let of = |block: &Block| {
        block.rest[band] - 2.0 * more * block.both[band] + more * more * block.simulated[band]
    };
    blocks.iter().map(of).sum()
}

/// Mean part that the sensor's white noise has of the predicted noise between two frequencies.
fn part_of_sensor(model: &FitModel, channel: Channel, [from_hz, to_hz]: [f64; 2]) -> f64 {
    let variance = model.basis.sigma[channel].powi(2);
    let power = &model.noise.power[channel];
    let place = |hz: f64| ((hz / model.noise.spacing_hz) as usize).min(power.len() - 1);
    let own = &power[place(from_hz)..=place(to_hz)];
    own.iter()
        .map(|power| (variance / power).min(1.0))
        .sum::<f64>()
        / own.len() as f64
}
