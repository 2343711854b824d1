//! Regressions of a residual on what it might depend on.

use std::ops::Range;

use cromosim_imu::{Channel, Dependence, Reading};
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use crate::axes::{axes_of_channel, channel_of_axis, value_on_axis};
use crate::findings::Findings;
use crate::fit::{Fit, FitModel, slices};
use crate::gram::Linear;
use crate::policy::unknown::REGRESSION_NATS;
use crate::whiten::Whitener;

/// Root mean square of a regressor, in units of the white noise, below which it is left out.
const LEAST_MOTION: f64 = 0.02;

/// Standard deviation of a prediction, in units of the white noise, from which on a sensor moves.
const MOVING: f64 = 2.0;

/// Price of each column of a regression, nats.
const COLUMN_NATS: f64 = 2.0;
/// 1 / variance of the weak prior of a coefficient.
const PRIOR_WEIGHT: f64 = 1e-6;
/// Knots of slow changes over a recording, its ends among them.
const KNOTS_OVER_TIME: usize = 9;
/// Quantiles of a channel's prediction between which its curves have their knots.
const CURVE_QUANTILES: [f64; 7] = [0.01, 0.15, 0.35, 0.5, 0.65, 0.85, 0.99];

/// One family of regressors of one channel, whitened, and what it gains.
#[derive(Clone, Debug)]
pub(crate) struct ResidualRegression {
    pub dependence: Dependence,
    pub channel: Channel,
    /// Empty where it gains too little for anything to be judged beside it: those of a long recording
    /// fill a gigabyte.
    pub columns: Vec<Vec<f64>>,
    /// Held-out gain beside the fit, nats, less the price of its columns.
    pub gain: f64,
}

/// A regressor: its axis and its value for each message.
type Column = (usize, Vec<f64>);

/// Every family, tried beside the fit.
pub(crate) fn residual_regressions(findings: &Findings) -> Vec<ResidualRegression> {
    let (model, fit) = (&findings.model, &findings.scored.fit);
    let families = Channel::ALL
        .into_iter()
        .flat_map(|channel| Dependence::ALL.map(|dependence| (dependence, channel)));
    let try_family = |(dependence, channel)| residual_regression(model, fit, dependence, channel);
    families.filter_map(try_family).collect()
}

/// One family, tried beside a fit; none where it cannot be there: at rest nothing can depend on the motion, and
/// time is all that passes.
pub(crate) fn residual_regression(
    model: &FitModel,
    fit: &Fit,
    dependence: Dependence,
    channel: Channel,
) -> Option<ResidualRegression> {
    let moving = || {
        Channel::ALL
            .into_iter()
            .all(|channel| moves(model, fit, channel))
    };
    if dependence != Dependence::Time && !moving() {
        return None;
    }
    let predicted = &fit.prediction.readings;
    let columns = all_whitened(
        model,
        &regressors(model, fit, predicted, dependence, channel),
    );
    let gain = gain(model, fit, &columns);
    Some(ResidualRegression {
        dependence,
        channel,
        columns: if gain > REGRESSION_NATS {
            columns
        } else {
            Vec::new()
        },
        gain,
    })
}

/// What a residual gains by a family of the readings themselves, nats. Their prediction holds the reference's errors, and so
/// does the residual: it goes with their second differences, and with the other channel, whatever the device does. The
/// readings hold none of them. Their own noise, which the residual holds as well, is kept out as far as the
/// reference's filters keep out all beyond the motion's band.
pub(crate) fn gain_by_measured(
    model: &FitModel,
    fit: &Fit,
    dependence: Dependence,
    channel: Channel,
) -> f64 {
    let columns = regressors(model, fit, &model.prepared.measured, dependence, channel);
    let whitener = model.whitener_behind_reference();
    let columns = columns.iter();
    let columns = columns.map(|column| whitened(model, &whitener, column));
    gain(model, fit, &columns.collect())
}

/// Held-out gain of columns beside a fit, nats, less their price.
fn gain(model: &FitModel, fit: &Fit, columns: &Vec<Vec<f64>>) -> f64 {
    with_regressions(model, fit, &[columns]).held_out
        - fit.linear.held_out
        - COLUMN_NATS * columns.len() as f64
}

/// What a residual depends on, in the words of diagnosis.json.
pub(crate) fn dependence_name(dependence: Dependence, channel: Channel) -> &'static str {
    match (dependence, channel) {
        (Dependence::OwnReading, Channel::Accelerometer)
        | (Dependence::OtherChannel, Channel::Gyroscope) => "specific force",
        (Dependence::OwnReading, Channel::Gyroscope)
        | (Dependence::OtherChannel, Channel::Accelerometer) => "angular rate",
        (Dependence::OtherChannelSquared, Channel::Accelerometer) => "angular rate squared",
        (Dependence::OtherChannelSquared, Channel::Gyroscope) => "specific force squared",
        (Dependence::Orientation, _) => "orientation",
        (Dependence::OtherAxes, _) => "other axes",
        (Dependence::RateOfChange, _) => "rate of change",
        (Dependence::Time, _) => "time",
        (Dependence::GainOverTime, _) => "gain over time",
        (Dependence::DelayOverTime, _) => "delay over time",
        (Dependence::MountOverTime, _) => "mount over time",
    }
}

/// Whether the prediction of a channel varies by more than its white noise.
fn moves(model: &FitModel, fit: &Fit, channel: Channel) -> bool {
    let readings = &fit.prediction.readings;
    let count = readings.len() as f64;
    let variance: f64 = axes_of_channel(channel)
        .map(|axis| {
            let mean = readings
                .iter()
                .map(|reading| value_on_axis(reading, axis))
                .sum::<f64>()
                / count;
            readings
                .iter()
                .map(|reading| (value_on_axis(reading, axis) - mean).powi(2))
                .sum::<f64>()
                / count
        })
        .sum();
    variance > 3.0 * (MOVING * model.basis.sigma[channel]).powi(2)
}

/// A fit's linear step with regressions beside its own values.
pub(crate) fn with_regressions(model: &FitModel, fit: &Fit, families: &[&Vec<Vec<f64>>]) -> Linear {
    let columns: Vec<&[f64]> = families
        .iter()
        .flat_map(|columns| slices(columns))
        .collect();
    let prior = vec![PRIOR_WEIGHT; columns.len()];
    model.extended(fit, None, &columns, &prior).solve()
}

fn all_whitened(model: &FitModel, columns: &[Column]) -> Vec<Vec<f64>> {
    let columns = columns.iter();
    let whitened = columns.map(|column| whitened(model, &model.whitener, column));
    whitened.collect()
}

/// Scaled to a root mean square of the axis' white noise.
fn whitened(model: &FitModel, whitener: &Whitener, (axis, values): &Column) -> Vec<f64> {
    let rms = (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64)
        .sqrt()
        .max(1e-12);
    let sigma = model.basis.sigma[channel_of_axis(*axis)];
    // What hardly moves tells nothing, however much it is magnified.
    let factor = if rms > LEAST_MOTION * sigma {
        sigma / rms
    } else {
        0.0
    };
    let axes = std::array::from_fn(|other| other == *axis);
    whitener.apply(&model.prepared.scattered(axes, |k, _| values[k] * factor))
}

/// The regressors of one family of predicted or measured readings, before they are whitened.
fn regressors(
    model: &FitModel,
    fit: &Fit,
    readings: &[Reading],
    dependence: Dependence,
    channel: Channel,
) -> Vec<Column> {
    let axes = axes_of_channel(channel);
    match dependence {
        Dependence::OwnReading => curves(readings, axes),
        Dependence::OtherChannel => other_channel(readings, channel),
        Dependence::OtherChannelSquared => other_channel_squared(readings, channel),
        Dependence::Orientation => orientation(model, axes),
        Dependence::OtherAxes => all_axes(readings, channel),
        Dependence::RateOfChange => changes(readings, axes),
        Dependence::Time => over_time(fit, axes, &|_, _| 1.0),
        Dependence::GainOverTime => {
            over_time(fit, axes, &|axis, k| value_on_axis(&readings[k], axis))
        }
        Dependence::DelayOverTime => over_time(fit, axes, &|axis, k| change(readings, axis, k)),
        Dependence::MountOverTime => mount_over_time(fit, channel),
    }
}

fn column(readings: &[Reading], axis: usize, value: impl Fn(&Reading) -> f64) -> Column {
    (axis, readings.iter().map(value).collect())
}

pub(crate) fn other(channel: Channel) -> Channel {
    match channel {
        Channel::Accelerometer => Channel::Gyroscope,
        Channel::Gyroscope => Channel::Accelerometer,
    }
}

/// Of each axis a constant and the three values of the other channel.
fn other_channel(readings: &[Reading], channel: Channel) -> Vec<Column> {
    let mut columns = Vec::new();
    for axis in axes_of_channel(channel) {
        columns.push(column(readings, axis, |_| 1.0));
        for i in 0..3 {
            columns.push(column(readings, axis, |reading| reading[other(channel)][i]));
        }
    }
    columns
}

/// Of each axis a constant and the six products of the other channel's values.
fn other_channel_squared(readings: &[Reading], channel: Channel) -> Vec<Column> {
    let mut columns = Vec::new();
    for axis in axes_of_channel(channel) {
        columns.push(column(readings, axis, |_| 1.0));
        for i in 0..3 {
            for j in i..3 {
                columns.push(column(readings, axis, |reading| {
                    let vector = reading[other(channel)];
                    vector[i] * vector[j]
                }));
            }
        }
    }
    columns
}

/// Of each axis the three values of its own channel.
fn all_axes(readings: &[Reading], channel: Channel) -> Vec<Column> {
    axes_of_channel(channel)
        .flat_map(|axis| (0..3).map(move |i| column(readings, axis, |reading| reading[channel][i])))
        .collect()
}

/// Curves of the channel's own prediction: hats between its quantiles.
fn curves(readings: &[Reading], axes: Range<usize>) -> Vec<Column> {
    let mut columns = Vec::new();
    for axis in axes {
        let mut sorted: Vec<f64> = readings
            .iter()
            .map(|reading| value_on_axis(reading, axis))
            .collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let quantile = |q: &f64| sorted[(q * (sorted.len() - 1) as f64) as usize];
        let knots: Vec<f64> = CURVE_QUANTILES.iter().map(quantile).collect();
        for k in 0..knots.len() {
            columns.push((
                axis,
                readings
                    .iter()
                    .map(|reading| hat(&knots, k, value_on_axis(reading, axis)))
                    .collect(),
            ));
        }
    }
    columns
}

/// Up in the axes of the reference, for each stamp.
pub(crate) fn up_in_segment(model: &FitModel, stamps: &[Stamp]) -> Vec<Vector3<f64>> {
    let track = &model.track;
    let up = |stamp: &Stamp| {
        let entry = ((*stamp - track.start) * track.rate_hz)
            .clamp(0.0, (track.len() - 1) as f64)
            .round() as usize;
        track.world_from_segment[entry].inverse() * Vector3::z()
    };
    stamps.iter().map(up).collect()
}

/// Up as the sensor sees it.
fn orientation(model: &FitModel, axes: Range<usize>) -> Vec<Column> {
    let up = up_in_segment(model, &model.prepared.stamps);
    let of = |axis: usize, i: usize| (axis, up.iter().map(|up| up[i]).collect());
    axes.flat_map(|axis| (0..3).map(move |i| (axis, i)))
        .map(|(axis, i)| of(axis, i))
        .collect()
}

/// First and second differences of the prediction, or of the readings themselves: delays and filters.
fn changes(readings: &[Reading], axes: Range<usize>) -> Vec<Column> {
    let second = |axis: usize, k: usize| {
        let at = |k: usize| value_on_axis(&readings[k.min(readings.len() - 1)], axis);
        at(k + 1) - 2.0 * at(k) + at(k.saturating_sub(1))
    };
    let count = readings.len();
    axes.flat_map(|axis| {
        [
            (
                axis,
                (0..count).map(|k| change(readings, axis, k)).collect(),
            ),
            (axis, (0..count).map(|k| second(axis, k)).collect()),
        ]
    })
    .collect()
}

/// Central difference.
fn change(readings: &[Reading], axis: usize, k: usize) -> f64 {
    value_on_axis(&readings[(k + 1).min(readings.len() - 1)], axis)
        - value_on_axis(&readings[k.saturating_sub(1)], axis)
}

fn knots_over_time(count: usize) -> Vec<f64> {
    let last = KNOTS_OVER_TIME - 1;
    (0..=last)
        .map(|k| (k * (count - 1)) as f64 / last as f64)
        .collect()
}

/// Slow changes of the strength of something: hats over time.
fn over_time(fit: &Fit, axes: Range<usize>, of: &dyn Fn(usize, usize) -> f64) -> Vec<Column> {
    let count = fit.prediction.readings.len();
    let knots = knots_over_time(count);
    let mut columns = Vec::new();
    for axis in axes {
        let values: Vec<f64> = (0..count).map(|k| of(axis, k)).collect();
        for knot in 0..knots.len() {
            columns.push((
                axis,
                values
                    .iter()
                    .enumerate()
                    .map(|(k, value)| value * hat(&knots, knot, k as f64))
                    .collect(),
            ));
        }
    }
    columns
}

/// Small turns of the channel that change over time: what each axis would see of the two others.
fn mount_over_time(fit: &Fit, channel: Channel) -> Vec<Column> {
    let readings = &fit.prediction.readings;
    let knots = knots_over_time(readings.len());
    let first = axes_of_channel(channel).start;
    let mut columns = Vec::new();
    for i in 0..3 {
        for j in (0..3).filter(|j| *j != i) {
            for knot in (0..knots.len()).step_by(2) {
                let wide: Vec<f64> = knots.iter().step_by(2).copied().collect();
                let value = |k: usize, reading: &Reading| {
                    value_on_axis(reading, first + j) * hat(&wide, knot / 2, k as f64)
                };
                columns.push((
                    first + i,
                    readings
                        .iter()
                        .enumerate()
                        .map(|(k, reading)| value(k, reading))
                        .collect(),
                ));
            }
        }
    }
    columns
}

/// Piecewise linear: 1 at its knot, 0 at its neighbours; the outermost go on level.
fn hat(knots: &[f64], k: usize, x: f64) -> f64 {
    if k > 0 && x < knots[k] {
        let width = knots[k] - knots[k - 1];
        return if width > 0.0 {
            (1.0 - (knots[k] - x) / width).max(0.0)
        } else {
            0.0
        };
    }
    if k + 1 < knots.len() && x > knots[k] {
        let width = knots[k + 1] - knots[k];
        return if width > 0.0 {
            (1.0 - (x - knots[k]) / width).max(0.0)
        } else {
            0.0
        };
    }
    1.0
}
