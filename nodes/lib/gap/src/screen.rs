//! Candidates beside a fit: one linear step for each, so that only the promising ones are fitted.

use cromosim_imu::{Effect, EffectKind, EffectSet, FirstGuess, PerChannel, Search, Stage};
use nalgebra::{Cholesky, DMatrix, Dyn, Matrix3, Vector3};

use crate::axes::channel_of_axis;
use crate::channel_lags::channel_lags;
use crate::fit::{Fit, FitModel, layout_of, prior_weights, slices, stepped, with_plausible_values};
use crate::gram::{Gram, dot};
use crate::prepared::Prediction;

/// Part of a recording at either end in which no change is looked for.
const END_PART: usize = 8;
/// Steps around the time of a change by which it is sharpened, in periods of the IMU.
const SHARPENING_PERIODS: [f64; 3] = [8.0, 2.0, 0.5];
/// Of each, the most to either side.
const SHARPENING_STEPS: u32 = 4;
/// And the most in a row that leave no less.
const SHARPENING_PATIENCE: u32 = 2;

/// A set to be fitted, with what one linear step predicts of it.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// After the step.
    pub set: EffectSet,
    /// Before it, where a tissue starts.
    start: Option<EffectSet>,
    /// Held-out log-likelihood after the step, nats.
    pub predicted_gain: f64,
    /// Normal equations of an effect's columns beside the fit's, where the step is from its neutral values.
    pub beside: Option<Beside>,
}

/// An effect, alone or with its companion, with their columns beside a fit's.
#[derive(Clone, Debug)]
pub(crate) struct Beside {
    kinds: Vec<EffectKind>,
    gram: Gram,
}

impl Beside {
    fn new(model: &FitModel, fit: &Fit, kinds: Vec<EffectKind>) -> Self {
        let starts: Vec<Effect> = kinds.iter().copied().map(Effect::neutral).collect();
        let mut set = fit.set.clone();
        set.extend(&starts);
        let gram = beside(model, fit, &set, &starts, None);
        Self { kinds, gram }
    }
}

/// The best start of one effect beside `fit`, and that together with its companion; none where it is
/// not fitted, or cannot be started.
pub(crate) fn screen(
    model: &FitModel,
    fit: &Fit,
    kind: EffectKind,
    library: &[EffectKind],
) -> Vec<Candidate> {
    let Search::Fitted(search) = kind.spec().search else {
        return Vec::new();
    };
    let starts = match search.first_guess {
        FirstGuess::Neutral => vec![Effect::neutral(kind)],
        FirstGuess::FromResidual(guess) => guess(&model.prepared.view(&fit.prediction.readings))
            .into_iter()
            .filter_map(|values| Effect::new(kind, values).ok())
            .map(|start| start.by_clock_of(&fit.set))
            .collect(),
        FirstGuess::ChangeOf(base) => change_point(model, fit, kind, base).into_iter().collect(),
    };
    let together = companion(kind, fit, library)
        .map(|companion| [kind, companion].map(Effect::neutral))
        .map(|pair| candidate(model, fit, &pair));
    let best = starts
        .into_iter()
        .map(|start| candidate(model, fit, &[start]))
        .max_by(|a, b| a.predicted_gain.total_cmp(&b.predicted_gain));
    let best = if kind == EffectKind::ChannelDelay {
        best.map(|near| farther_delay(model, fit, near))
    } else {
        best
    };
    best.into_iter().chain(together).collect()
}

/// A delay between the channels as they lag behind a simulation with an offset that was fitted to one of them, which is moved;
/// where one linear step promises more from there than from no delay. (Without one both may be late.)
fn farther_delay(model: &FitModel, fit: &Fit, near: Candidate) -> Candidate {
    if !fit.set.contains(EffectKind::TimeOffset) {
        return near;
    }
    let lags = channel_lags(model.prepared, &fit.prediction.readings);
    let delay_s = lags.gyroscope - lags.accelerometer;
    if delay_s == 0.0 {
        return near;
    }
    let moved = (
        Effect::time_offset(fit.set.time_offset() + lags.accelerometer),
        Effect::new(EffectKind::ChannelDelay, vec![delay_s]),
    );
    let (Ok(offset), Ok(delay)) = moved else {
        return near;
    };
    let mut set = fit.set.clone();
    set.insert(offset);
    let far = candidate_on(model, fit, set, &[delay]);
    if far.predicted_gain <= near.predicted_gain {
        return near;
    }
    Candidate {
        beside: near.beside,
        ..far
    }
}

/// One linear step of the fit's own values and those of more effects, from where they start.
fn candidate(model: &FitModel, fit: &Fit, starts: &[Effect]) -> Candidate {
    let mut set = fit.set.clone();
    take_delay_off(&mut set, starts);
    candidate_on(model, fit, set, starts)
}

/// The same where values of the fit's own effects are moved before.
fn candidate_on(model: &FitModel, fit: &Fit, mut set: EffectSet, starts: &[Effect]) -> Candidate {
    let are_neutral = starts
        .iter()
        .all(|start| *start == Effect::neutral(start.kind()));
    set.extend(starts);
    let (linear, beside) = if are_neutral {
        let kinds = starts.iter().map(Effect::kind).collect();
        let neutral = Beside::new(model, fit, kinds);
        (neutral.gram.solve(), Some(neutral))
    } else {
        let prediction = model.prepared.predict(&model.track, &set);
        let gram = beside(model, fit, &set, starts, Some(&prediction));
        (gram.solve(), None)
    };
    let layout: Vec<_> = fit
        .layout
        .iter()
        .copied()
        .chain(starts.iter().flat_map(|start| layout_of(start.kind())))
        .collect();
    Candidate {
        start: starts
            .iter()
            .any(|start| start.kind().spec().stage == Stage::Tissue)
            .then(|| set.clone()),
        set: starts
            .iter()
            .fold(stepped(&set, &layout, &linear.step, 1.0), |set, start| {
                with_plausible_values(&set, start.kind())
            }),
        predicted_gain: linear.held_out,
        beside,
    }
}

/// An offset of time that was fitted without a filter has its delay in it.
fn take_delay_off(set: &mut EffectSet, starts: &[Effect]) {
    let delay_s: f64 = starts.iter().filter_map(Effect::low_pass_delay).sum();
    if delay_s > 0.0
        && set.contains(EffectKind::TimeOffset)
        && let Ok(offset) = Effect::time_offset(set.time_offset() - delay_s)
    {
        set.insert(offset);
    }
}

impl Candidate {
    /// Where a fit of it begins: a whole step throws a tissue's resonance far off. Of other effects such a step leads out
    /// of local minima (a `low_pass` beside a `time_offset` that stands for it).
    pub fn begin(self, model: &FitModel) -> EffectSet {
        let cost = |set: &EffectSet| model.evaluated(set.clone()).cost;
        match self.start {
            Some(start) if cost(&start) < cost(&self.set) => start,
            _ => self.set,
        }
    }
}

/// Normal equations of the fit's own values and those of more effects of `set`, around what the fit
/// predicts or around another prediction.
fn beside(
    model: &FitModel,
    fit: &Fit,
    set: &EffectSet,
    starts: &[Effect],
    prediction: Option<&Prediction>,
) -> Gram {
    let kinds = || starts.iter().map(Effect::kind);
    let around = prediction.unwrap_or(&fit.prediction);
    let columns: Vec<Vec<f64>> = kinds()
        .flat_map(|kind| model.columns(set, around, kind))
        .collect();
    let prior: Vec<f64> = kinds().flat_map(prior_weights).collect();
    let residual = prediction.map(|prediction| model.residual(&prediction.readings));
    model.extended(fit, residual.as_deref(), &slices(&columns), &prior)
}

/// What one linear step around a fit says of effects outside it that stand in the place of a member:
/// one pass over the library serves all members.
pub(crate) struct Substitutes<'a> {
    fit: &'a Fit,
    beside: Vec<Beside>,
}

impl<'a> Substitutes<'a> {
    pub fn new(model: &FitModel, fit: &'a Fit, library: &[EffectKind]) -> Self {
        let outside = library.iter().filter(|kind| !fit.set.contains(**kind));
        let alone = outside.filter(|kind| starts_neutral(**kind));
        let sets = alone.flat_map(|&kind| {
            let together = companion(kind, fit, library).map(|other| vec![kind, other]);
            std::iter::once(vec![kind]).chain(together)
        });
        Self {
            fit,
            beside: sets.map(|kinds| Beside::new(model, fit, kinds)).collect(),
        }
    }

    /// The same from what a screen of the library around the fit had.
    pub fn of_screen(fit: &'a Fit, screened: &[Beside]) -> Self {
        let are_asked = |one: &&Beside| starts_neutral(one.kinds[0]);
        Self {
            fit,
            beside: screened.iter().filter(are_asked).cloned().collect(),
        }
    }

    /// What an effect, or it and its companion, gains in the place of a member, less its price; none
    /// where only a fit of its own can tell.
    pub fn gain(
        &self,
        member: EffectKind,
        other: EffectKind,
        price: impl Fn(EffectKind) -> f64,
    ) -> Option<f64> {
        if !starts_neutral(member) {
            return None;
        }
        let without = self.fit.held_out_without(member);
        let of_other = self.beside.iter().filter(|one| one.kinds[0] == other);
        of_other
            .map(|one| {
                let price: f64 = one.kinds.iter().map(|kind| price(*kind)).sum();
                self.fit.held_out_in_place_of(member, &one.gram) - without - price
            })
            .max_by(f64::total_cmp)
    }
}

/// Whether a fit of the effect begins at its neutral values.
pub(crate) fn starts_neutral(kind: EffectKind) -> bool {
    matches!(
        kind.spec().search,
        Search::Fitted(search) if matches!(search.first_guess, FirstGuess::Neutral)
    )
}

/// The effect that another is also tried together with, where it may be.
fn companion(kind: EffectKind, fit: &Fit, library: &[EffectKind]) -> Option<EffectKind> {
    let Search::Fitted(search) = kind.spec().search else {
        return None;
    };
    search
        .companion
        .filter(|companion| library.contains(companion) && !fit.set.contains(*companion))
}

/// The effect `kind` that changes the values of `base` at the time at which this helps most: its
/// values are the time and the three values of the change. All times are tried, by sums of the
/// columns of `base` from there on.
fn change_point(model: &FitModel, fit: &Fit, kind: EffectKind, base: EffectKind) -> Option<Effect> {
    let prepared = model.prepared;
    let mut set = fit.set.clone();
    if set.get(base).is_none() {
        set.insert(Effect::neutral(base));
    }
    let columns = model.columns(&set, &fit.prediction, base);
    let best = ChangeSearch::new(fit, &columns, prepared.length)?.best()?;
    let at = prepared
        .epoch
        .plus_seconds((best.entry as f64 - 0.5) / prepared.rate_hz);
    let at_s = at.as_seconds() - fit.set.time_offset();
    Effect::new(
        kind,
        vec![at_s, best.change.x, best.change.y, best.change.z],
    )
    .ok()
}

/// Sums over the sample grid from its end, with which a change at each entry is solved for in
/// closed form: the change's own normal matrix less what the fit's values take up of it.
struct ChangeSearch<'a> {
    fit: &'a Fit,
    columns: &'a [Vec<f64>],
    length: usize,
    /// Of each channel, 1 / its held-out mean square.
    weight: PerChannel<f64>,
    /// Of the fit's own normal matrix; none where it has no values.
    own_factor: Option<Cholesky<f64, Dyn>>,
}

/// A change of three values.
struct Change {
    gain: f64,
    entry: usize,
    change: Vector3<f64>,
}

impl<'a> ChangeSearch<'a> {
    fn new(fit: &'a Fit, columns: &'a [Vec<f64>], length: usize) -> Option<Self> {
        let weight = channel_weights(fit);
        let size = fit.columns.len();
        let mut own = DMatrix::zeros(size, size);
        for i in 0..size {
            for j in 0..=i {
                own[(i, j)] = weighted(&fit.columns[i], &fit.columns[j], weight);
                own[(j, i)] = own[(i, j)];
            }
            own[(i, i)] *= 1.0 + 1e-9;
        }
        let own_factor = if size > 0 {
            Some(own.cholesky()?)
        } else {
            None
        };
        Some(Self {
            fit,
            columns,
            length,
            weight,
            own_factor,
        })
    }

    fn best(&self) -> Option<Change> {
        let size = self.fit.columns.len();
        // Sums from the end: C'C, C'e, J'C, with C the change's columns, e the residual and J the
        // fit's own columns.
        let mut square = Matrix3::<f64>::zeros();
        let mut right = Vector3::<f64>::zeros();
        let mut mixed = DMatrix::<f64>::zeros(size, 3);
        let mut best: Option<Change> = None;
        let margin = self.length / END_PART;
        for entry in (0..self.length).rev() {
            for axis in 0..6 {
                let at = axis * self.length + entry;
                let plain = Vector3::from_fn(|row, _| self.columns[row][at]);
                let c = plain * self.weight[channel_of_axis(axis)];
                square += c * plain.transpose();
                right += c * self.fit.residual[at];
                for i in 0..size {
                    for j in 0..3 {
                        mixed[(i, j)] += self.fit.columns[i][at] * c[j];
                    }
                }
            }
            if entry < margin || entry > self.length - margin {
                continue;
            }
            let schur = match &self.own_factor {
                Some(factor) => {
                    let taken_up = mixed.transpose() * factor.solve(&mixed);
                    square - Matrix3::from_iterator(taken_up.iter().copied())
                }
                None => square,
            };
            if let Some(factor) = (schur + Matrix3::identity()).cholesky() {
                let change = factor.solve(&right);
                let gain = change.dot(&right);
                if gain > best.as_ref().map_or(0.0, |best| best.gain) {
                    best = Some(Change {
                        gain,
                        entry,
                        change,
                    });
                }
            }
        }
        best
    }
}

/// The time of a change to the sample: whichever of the times around leaves least. Fits without
/// one stay as they are.
pub(crate) fn sharpen_change_point(model: &FitModel, fit: Fit) -> Fit {
    let Some(change) = fit.set.iter().find(|effect| is_change(effect.kind())) else {
        return fit;
    };
    let weight = channel_weights(&fit);
    let squares_at = |at_s: f64| {
        let mut values = change.values().to_vec();
        values[0] = at_s;
        let mut set = fit.set.clone();
        if let Ok(effect) = change.with_values(values) {
            set.insert(effect);
        }
        let prepared = model.prepared;
        let readings = prepared.predict_with_other_slip(&fit.prediction, [&fit.set, &set]);
        let residual = model.residual(&readings);
        (weighted(&residual, &residual, weight), set)
    };
    let period = 1.0 / model.prepared.rate_hz;
    let start_s = change.values()[0];
    let squares = weighted(&fit.residual, &fit.residual, weight);
    let mut best = (squares, fit.set.clone(), start_s);
    for step in SHARPENING_PERIODS.map(|periods| periods * period) {
        let centre = best.2;
        for direction in [-step, step] {
            let mut farther = 0;
            for k in 1..=SHARPENING_STEPS {
                let at_s = centre + f64::from(k) * direction;
                let (squares, set) = squares_at(at_s);
                if squares < best.0 {
                    best = (squares, set, at_s);
                    farther = 0;
                } else {
                    farther += 1;
                }
                if farther == SHARPENING_PATIENCE {
                    break;
                }
            }
        }
    }
    if best.1 == fit.set {
        fit
    } else {
        model.fit(best.1)
    }
}

/// Whether the first of an effect's values is the time of a change.
pub(crate) fn is_change(kind: EffectKind) -> bool {
    matches!(
        kind.spec().search,
        Search::Fitted(search) if matches!(search.first_guess, FirstGuess::ChangeOf(_))
    )
}

/// 1 / held-out mean square of each channel's whitened residual, at most 1.
fn channel_weights(fit: &Fit) -> PerChannel<f64> {
    let ratio = fit.held_out_ratio();
    PerChannel::from_fn(|channel| ratio[channel].max(1.0).recip())
}

/// Inner product of flat whitened series, each channel with its weight.
fn weighted(a: &[f64], b: &[f64], weight: PerChannel<f64>) -> f64 {
    let half = a.len() / 2;
    weight.accelerometer * dot(&a[..half], &b[..half])
        + weight.gyroscope * dot(&a[half..], &b[half..])
}
