//! Joint fits of sets of effects on whitened residuals.

use std::sync::Arc;

use cromosim_imu::{
    Channel, Effect, EffectKind, EffectSet, FirstGuess, ParameterFit, PerChannel, Reading, Search,
};
use cromosim_spatial::KinematicTrack;
use nalgebra::DVector;

use crate::axes::{channel_of_axis, sum_over_channels, value_on_axis};
use crate::gram::{Gram, Linear, Series, channel_likelihood, dot};
use crate::noise_model::{NoiseBasis, NoiseModel};
use crate::policy::report::STANDARD_ERROR_FACTOR;
use crate::prepared::{FOLDS, Prediction, PreparedPlacement};
use crate::whiten::Whitener;

/// A prepared placement with one kinematic track and one model of the noise.
#[derive(Clone, Debug)]
pub(crate) struct FitModel<'a> {
    pub prepared: &'a PreparedPlacement,
    pub track: Arc<KinematicTrack>,
    pub basis: NoiseBasis,
    pub noise: NoiseModel,
    pub whitener: Whitener,
    /// Which part of time each entry of the sample grid belongs to.
    pub folds: Vec<usize>,
    /// Number of values compared, by part of time.
    pub counts: Vec<PerChannel<f64>>,
}

/// A set of effects with fitted values. Copies share its series, which fill much memory.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub set: EffectSet,
    /// The fitted values: effect and index among its values.
    pub layout: Vec<(EffectKind, usize)>,
    pub prediction: Arc<Prediction>,
    /// Whitened residual, flat.
    pub residual: Arc<Vec<f64>>,
    /// Change of the whitened prediction per unit of each value.
    pub columns: Arc<Vec<Vec<f64>>>,
    /// Of these columns and the residual.
    pub gram: Gram,
    pub linear: Linear,
}

/// A value that a fit moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeValue {
    /// Among all values of its effect.
    pub index: usize,
    pub lower: f64,
    pub upper: f64,
    pub fit: ParameterFit,
}

impl FreeValue {
    /// 1 / variance of the weak prior.
    pub fn prior_weight(&self) -> f64 {
        self.fit.prior_deviation.powi(-2)
    }
}

/// Values of an effect that a fit moves.
pub(crate) fn free_values(kind: EffectKind) -> Vec<FreeValue> {
    let mut first = 0;
    let mut free = Vec::new();
    for parameter in kind.spec().parameters {
        let own = first..first + parameter.shape.count();
        first = own.end;
        free.extend(parameter.fit.into_iter().flat_map(|fit| {
            own.clone().map(move |index| FreeValue {
                index,
                lower: parameter.lower,
                upper: parameter.upper,
                fit,
            })
        }));
    }
    free
}

/// 1 / variance of the weak prior of each free value.
pub(crate) fn prior_weights(kind: EffectKind) -> Vec<f64> {
    free_values(kind)
        .iter()
        .map(FreeValue::prior_weight)
        .collect()
}

/// A set with one value changed, kept within its bounds; none where the effect refuses it.
fn changed(set: &EffectSet, kind: EffectKind, value: &FreeValue, change: f64) -> Option<EffectSet> {
    let effect = set.get(kind)?;
    let mut values = effect.values().to_vec();
    values[value.index] = (values[value.index] + change).clamp(value.lower, value.upper);
    let mut next = set.clone();
    next.insert(effect.with_values(values).ok()?);
    Some(next)
}

/// Whether one value of several may be where no such effect has it, while the others are not.
fn may_be_implausible(kind: EffectKind, value: &FreeValue) -> bool {
    free_values(kind).len() > 1
        && matches!(kind.spec().search, Search::Fitted(search) if matches!(search.first_guess, FirstGuess::Neutral))
        && [value.lower, value.upper]
            .into_iter()
            .any(|bound| !is_plausible_at(&EffectSet::new(), kind, value, bound))
}

/// An effect with those of its values neutral that alone are where no such effect has them.
pub(crate) fn with_plausible_values(set: &EffectSet, kind: EffectKind) -> EffectSet {
    let mut next = set.clone();
    let Some(effect) = set.get(kind) else {
        return next;
    };
    let neutral = kind.spec().neutral();
    let mut values = effect.values().to_vec();
    for value in free_values(kind) {
        if may_be_implausible(kind, &value)
            && !is_plausible_at(set, kind, &value, values[value.index])
        {
            values[value.index] = neutral[value.index];
        }
    }
    if let Ok(effect) = effect.with_values(values) {
        next.insert(effect);
    }
    next
}

/// Whether an effect of a set is what such effects are, with one value at some place and the
/// others neutral.
fn is_plausible_at(set: &EffectSet, kind: EffectKind, value: &FreeValue, at: f64) -> bool {
    let Search::Fitted(search) = kind.spec().search else {
        return true;
    };
    let effect = Effect::neutral(kind);
    let mut values = effect.values().to_vec();
    values[value.index] = at.clamp(value.lower, value.upper);
    effect
        .with_values(values)
        .is_ok_and(|effect| (search.is_plausible)(&effect, set))
}

/// A set with a part of a step along several values; a change that an effect refuses is left out.
pub(crate) fn stepped(
    set: &EffectSet,
    layout: &[(EffectKind, usize)],
    step: &DVector<f64>,
    part: f64,
) -> EffectSet {
    let mut next = set.clone();
    for (&(kind, index), change) in layout.iter().zip(step.iter()) {
        let value = free_values(kind).into_iter().find(|own| own.index == index);
        if let Some(moved) = value.and_then(|value| changed(&next, kind, &value, part * change)) {
            next = moved;
        }
    }
    next
}

/// The free values of one effect, as a fit lists them.
pub(crate) fn layout_of(kind: EffectKind) -> impl Iterator<Item = (EffectKind, usize)> {
    free_values(kind)
        .into_iter()
        .map(move |value| (kind, value.index))
}

/// Axes on which any of the readings differ.
fn changed_axes(readings: &[Reading], others: &[Reading]) -> [bool; 6] {
    std::array::from_fn(|axis| {
        let mut pairs = readings.iter().zip(others);
        pairs.any(|(one, other)| value_on_axis(one, axis) != value_on_axis(other, axis))
    })
}

/// Columns as [`FitModel::extended`] takes them.
pub(crate) fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

impl<'a> FitModel<'a> {
    pub fn new(
        prepared: &'a PreparedPlacement,
        track: Arc<KinematicTrack>,
        basis: NoiseBasis,
        noise: NoiseModel,
    ) -> Self {
        let whitener = Whitener::new(prepared, &noise);
        let folds: Vec<usize> = (0..prepared.length)
            .map(|entry| prepared.fold(entry))
            .collect();
        let mut counts = vec![PerChannel::<f64>::default(); FOLDS];
        for axis in 0..6 {
            for (entry, weight) in whitener.weight[axis].iter().enumerate() {
                counts[folds[entry]][channel_of_axis(axis)] += weight * weight;
            }
        }
        Self {
            prepared,
            track,
            basis,
            noise,
            whitener,
            folds,
            counts,
        }
    }

    /// The whitener behind the reference's filters, which keep out what lies beyond the motion's band.
    pub fn whitener_behind_reference(&self) -> Whitener {
        let spacing_hz = self.noise.spacing_hz;
        let passed = PerChannel::from_fn(|channel| {
            let count = self.noise.power[channel].len();
            let through = (0..count).map(|k| self.basis.estimate.filter_at(k as f64 * spacing_hz));
            let own = |(position, rotation, _): (f64, f64, f64)| match channel {
                Channel::Accelerometer => position,
                Channel::Gyroscope => rotation,
            };
            through.map(own).collect::<Vec<f64>>()
        });
        self.whitener.behind(&passed)
    }

    /// Whitened measured less predicted.
    pub fn residual(&self, readings: &[Reading]) -> Vec<f64> {
        self.whitener
            .apply(&self.prepared.scattered_residual(readings))
    }

    /// Columns of the free values of one effect of `set`, whose prediction is `base`.
    pub fn columns(&self, set: &EffectSet, base: &Prediction, kind: EffectKind) -> Vec<Vec<f64>> {
        free_values(kind)
            .iter()
            .map(|value| self.column(set, base, kind, value, false))
            .collect()
    }

    /// The same for a fit: nothing of values that alone would lie where no such effect has them, so that they stay. A gain
    /// of an axis on which there is no motion is zero by the reference's noise there, which the readings do not have.
    pub fn columns_to_fit(
        &self,
        set: &EffectSet,
        base: &Prediction,
        kind: EffectKind,
    ) -> Vec<Vec<f64>> {
        free_values(kind)
            .iter()
            .map(|value| self.column(set, base, kind, value, true))
            .collect()
    }

    fn column(
        &self,
        set: &EffectSet,
        base: &Prediction,
        kind: EffectKind,
        value: &FreeValue,
        holds: bool,
    ) -> Vec<f64> {
        let now = set
            .get(kind)
            .map_or(0.0, |effect| effect.values()[value.index]);
        // Away from a bound.
        let size = if (value.lower..=value.upper).contains(&(now + value.fit.step)) {
            value.fit.step
        } else {
            -value.fit.step
        };
        let Some(moved) = changed(set, kind, value, size) else {
            return vec![0.0; 6 * self.prepared.length];
        };
        let readings = self.prepared.predict_from(&self.track, base, &moved, kind);
        let changes = changed_axes(&readings, &base.readings);
        if holds && may_be_implausible(kind, value) {
            let alone = now + size * self.part_of_residual(base, &readings, changes);
            if !is_plausible_at(set, kind, value, alone) {
                return vec![0.0; 6 * self.prepared.length];
            }
        }
        let difference = self.prepared.scattered(changes, |k, axis| {
            (value_on_axis(&readings[k], axis) - value_on_axis(&base.readings[k], axis)) / size
        });
        self.whitener.apply(&difference)
    }

    /// How many times a change of the readings is in the residual, by least squares.
    fn part_of_residual(&self, base: &Prediction, changed: &[Reading], axes: [bool; 6]) -> f64 {
        let (mut product, mut square) = (0.0, 0.0);
        let measured = self.prepared.measured.iter();
        for (measured, (changed, base)) in measured.zip(changed.iter().zip(&base.readings)) {
            for axis in (0..6).filter(|&axis| axes[axis]) {
                let own = value_on_axis(base, axis);
                let change = value_on_axis(changed, axis) - own;
                product += change * (value_on_axis(measured, axis) - own);
                square += change * change;
            }
        }
        if square > 0.0 { product / square } else { 0.0 }
    }

    /// Normal equations of columns against a residual.
    pub fn gram(&self, columns: &[&[f64]], residual: &[f64], prior: Vec<f64>) -> Gram {
        Gram::new(&self.series(columns, residual), prior)
    }

    /// The same against another residual, without another pass over the columns.
    pub fn gram_of_residual(
        &self,
        gram: &Gram,
        columns: &[&[f64]],
        residual: &[f64],
        prior: Vec<f64>,
    ) -> Gram {
        gram.extended(&self.series(columns, residual), prior, false)
    }

    fn series<'s>(&'s self, columns: &'s [&'s [f64]], residual: &'s [f64]) -> Series<'s> {
        Series {
            columns,
            residual,
            length: self.prepared.length,
            fold_of: &self.folds,
            counts: &self.counts,
        }
    }

    fn cost(&self, residual: &[f64]) -> f64 {
        let half = 3 * self.prepared.length;
        let (accelerometer, gyroscope) = residual.split_at(half);
        let squares = PerChannel {
            accelerometer: dot(accelerometer, accelerometer),
            gyroscope: dot(gyroscope, gyroscope),
        };
        -sum_over_channels(|channel| {
            channel_likelihood(self.whitener.count[channel], squares[channel])
        })
    }

    /// What a set predicts, and what it costs.
    pub fn evaluated(&self, set: EffectSet) -> Evaluated {
        let prediction = self.prepared.predict(&self.track, &set);
        let residual = self.residual(&prediction.readings);
        let cost = self.cost(&residual);
        Evaluated {
            set,
            prediction,
            residual,
            cost,
        }
    }

    /// Normal equations of columns beside those of a fit, against its residual or another.
    pub fn extended(
        &self,
        fit: &Fit,
        residual: Option<&[f64]>,
        extra: &[&[f64]],
        extra_prior: &[f64],
    ) -> Gram {
        let own = fit.columns.iter().map(Vec::as_slice);
        let slices: Vec<&[f64]> = own.chain(extra.iter().copied()).collect();
        let prior = fit.prior().chain(extra_prior.iter().copied()).collect();
        let series = self.series(&slices, residual.unwrap_or(&fit.residual));
        fit.gram.extended(&series, prior, residual.is_none())
    }
}

/// A set with what it predicts and costs.
pub(crate) struct Evaluated {
    pub set: EffectSet,
    pub prediction: Prediction,
    /// Whitened, flat.
    pub residual: Vec<f64>,
    /// Negative log-likelihood, nats.
    pub cost: f64,
}

impl Fit {
    /// Mean square of the whitened residual by channel, on data that each part of the fit did not
    /// see.
    pub fn held_out_ratio(&self) -> PerChannel<f64> {
        self.linear.held_out_ratio
    }

    /// What one linear step says of the held-out log-likelihood without an effect.
    pub fn held_out_without(&self, kind: EffectKind) -> f64 {
        self.held_out_in_place_of(kind, &self.gram)
    }

    /// And what it says where the columns of a Gram matrix beside the fit's own stand in its place.
    pub fn held_out_in_place_of(&self, kind: EffectKind, extended: &Gram) -> f64 {
        let linear = self.linear_in_place_of(kind, extended);
        linear.map_or(self.linear.held_out, |linear| linear.held_out)
    }

    /// None where the effect is not in the set.
    fn linear_in_place_of(&self, kind: EffectKind, extended: &Gram) -> Option<Linear> {
        let effect = self.set.get(kind)?;
        let neutral = kind.spec().neutral();
        let own = self.layout.iter().enumerate();
        let (columns, moves): (Vec<usize>, Vec<f64>) = own
            .filter(|(_, (other, _))| *other == kind)
            .map(|(column, &(_, index))| (column, neutral[index] - effect.values()[index]))
            .unzip();
        Some(extended.solve_without(&columns, &moves))
    }

    /// The set without an effect, with the values that one linear step gives the others.
    pub fn set_without(&self, kind: EffectKind) -> EffectSet {
        let rest = self.set.without(kind);
        let others = self.layout.iter().copied().filter(|(own, _)| *own != kind);
        match self.linear_in_place_of(kind, &self.gram) {
            Some(linear) => stepped(&rest, &others.collect::<Vec<_>>(), &linear.step, 1.0),
            None => rest,
        }
    }

    /// Whether the values of an effect were fitted, not given.
    pub fn moves(&self, kind: EffectKind) -> bool {
        self.layout.iter().any(|(own, _)| *own == kind)
    }

    /// The set as it would be fitted without one part of time.
    pub fn excluding_fold(&self, fold: usize) -> EffectSet {
        stepped(&self.set, &self.layout, &self.linear.fold_steps[fold], 1.0)
    }

    /// 1 / variance of the weak prior of each fitted value.
    pub fn prior(&self) -> impl Iterator<Item = f64> {
        self.layout.iter().flat_map(|&(kind, index)| {
            let values = free_values(kind).into_iter();
            let own = values.filter(move |value| value.index == index);
            own.map(|value| value.prior_weight())
        })
    }

    /// Standard errors of an effect's values; 0 for those that are not fitted.
    pub fn standard_errors(&self, effect: &Effect) -> Vec<f64> {
        let mut errors = vec![0.0; effect.values().len()];
        for (position, &(kind, index)) in self.layout.iter().enumerate() {
            if kind == effect.kind() {
                let variance = self.linear.covariance[(position, position)].max(0.0);
                errors[index] = STANDARD_ERROR_FACTOR * variance.sqrt();
            }
        }
        errors
    }

    /// How many standard errors an effect's values are from the neutral ones, of the value that is the farthest;
    /// infinite where none is fitted.
    pub fn significance(&self, effect: &Effect) -> f64 {
        let errors = self.standard_errors(effect).into_iter();
        let neutral = effect.kind().spec().neutral();
        let distances = effect.values().iter().zip(&neutral);
        let fitted = distances.zip(errors).filter(|(_, error)| *error > 0.0);
        fitted
            .map(|((value, neutral), error)| (value - neutral).abs() / error)
            .reduce(f64::max)
            .unwrap_or(f64::INFINITY)
    }
}
