//! Which effects are reported as causes: fitted ones beyond what is ordinary, and those that are
//! read off the readings, the stamps and the reference.

use cromosim_imu::{
    Channel, Dependence, Effect, EffectKind, EffectSet, Ordinary, PerChannel, ReadOff, Rounding,
    Search,
};
use cromosim_spatial::PoseNoise;

use crate::axes::{axes_of_channel, larger, value_on_axis};
use crate::digital::Digital;
use crate::fit::{Fit, FitModel};
use crate::library::Library;
use crate::policy::report::{
    COARSE_STEPS, DOUBTFUL_EXCESS_NOISE, EXCESS_NOISE, MANY_MISSING,
    ORDINARY_BESIDE_REFERENCE_NOISE, ORDINARY_BESIDE_SMOOTHING, OUTWEIGHING_NATS,
    OUTWEIGHING_SMOOTHING_NATS, REFERENCE_NOISE, REFERENCE_UNCERTAINTY, ROUNDING_SIGMAS,
    ROUNDING_UNCERTAINTY, SMOOTHING_EXPLAINS, STEP,
};
use crate::resolved_noise::ResolvedNoise;
use crate::sensor_noise::UPPER_BANDS;
use crate::trace::trace;

/// What readings and residual show without a fit.
pub(crate) struct Observations<'a> {
    pub digital: &'a PerChannel<Digital>,
    /// Factors of the device's units.
    pub units: PerChannel<f64>,
    /// White noise per sample of the residual, in SI units.
    pub found_noise: PerChannel<f64>,
    /// Whether the top of the residual's spectrum is level.
    pub is_white: PerChannel<bool>,
    /// Whether its noise is there at all times.
    pub is_steady: PerChannel<bool>,
    /// Whether it scatters farther than noise does now and then.
    pub has_tails: PerChannel<bool>,
    /// Whether the top of the readings' own spectrum is level.
    pub readings_are_level: PerChannel<bool>,
    /// White noise where the reference resolves the motion.
    pub resolved_noise: PerChannel<Option<ResolvedNoise>>,
    /// Whether the noise found may be motion that folds over.
    pub may_fold_over: PerChannel<bool>,
}

/// The causes: fitted effects beyond what is ordinary, and those that are read off.
pub(crate) fn reportable_effects(
    model: &FitModel,
    fit: &Fit,
    observations: &Observations,
    library: &Library,
) -> EffectSet {
    let mut set = fit.set.filtered(|effect| {
        let is_ordinary = is_ordinary(effect, ordinary_factor(model, effect.kind()))
            && (is_ordinary(effect, 1.0) || !outweighs_reference(effect, model, fit));
        !is_ordinary && !is_rounding(effect, model)
    });
    set.take_values_of(&fit.set);
    for kind in EffectKind::ALL {
        let Search::ReadOff(search) = kind.spec().search else {
            continue;
        };
        let values = read_off(model, observations, search.from).filter(|_| library.allows(kind));
        if let Some(effect) = values.and_then(|values| Effect::new(kind, values).ok()) {
            set.insert(effect);
        }
    }
    set
}

/// Whether a reference scatters so much that this is a cause.
fn is_noisy(noise: PoseNoise) -> bool {
    noise.position >= REFERENCE_NOISE.position || noise.rotation >= REFERENCE_NOISE.rotation
}

/// Whether the reference scatters as much, or seems to: poses and frames that are too slow for the motion do.
fn is_reference_poor(model: &FitModel) -> bool {
    is_noisy(model.prepared.estimate.scatter())
}

/// Whether it does: noise of frames shows in the poses between them too, and noise behind them on the chords.
fn is_reference_noisy(model: &FitModel) -> bool {
    let prepared = model.prepared;
    let interpolated = prepared.interpolated.as_ref();
    is_noisy(prepared.estimate.noise())
        && interpolated.is_none_or(|poses| is_noisy(poses.noise()))
        && prepared.noise_behind_frames.is_none_or(is_noisy)
}

/// Whether an effect explains more than could pass for it: noise of the reference, or a smoothing's shape that is a little off
/// where what is left is hardly more than noise.
fn outweighs_reference(effect: &Effect, model: &FitModel, fit: &Fit) -> bool {
    let values: f64 = effect
        .kind()
        .spec()
        .channels
        .iter()
        .map(|channel| model.whitener.count[*channel])
        .sum();
    let gained = fit.linear.held_out - fit.held_out_without(effect.kind());
    if model.basis.undone_smoothing.is_none() {
        gained > OUTWEIGHING_NATS * values
    } else {
        larger(fit.held_out_ratio()) < SMOOTHING_EXPLAINS
            && gained > OUTWEIGHING_SMOOTHING_NATS * values
    }
}

/// Factor on what is ordinary of an effect: what is fitted to a poor reference is that much poorer.
pub(crate) fn ordinary_factor(model: &FitModel, kind: EffectKind) -> f64 {
    if is_reference_poor(model) {
        ORDINARY_BESIDE_REFERENCE_NOISE
    } else if model.basis.undone_smoothing.is_some() && !is_late_or_grows(kind) {
        ORDINARY_BESIDE_SMOOTHING
    } else {
        1.0
    }
}

/// Whether an effect shows as nothing but what depends on time alone, or as a delay: a smoothing without phase leaves neither,
/// however wrong its kernel is. (A bias shows where turns that it made too small leave one.)
fn is_late_or_grows(kind: EffectKind) -> bool {
    let Search::Fitted(search) = kind.spec().search else {
        return false;
    };
    let shown = search.special_case_of;
    let is_of_time = |one: &Dependence| matches!(one, Dependence::Time | Dependence::DelayOverTime);
    !shown.is_empty() && shown.iter().all(is_of_time)
}

/// Whether an effect is no larger than what every recording has, times a factor.
pub(crate) fn is_ordinary(effect: &Effect, factor: f64) -> bool {
    let Search::Fitted(search) = effect.kind().spec().search else {
        return false;
    };
    match search.ordinary {
        None => false,
        Some(Ordinary::EachValue(ordinary)) => {
            let neutral = effect.kind().spec().neutral();
            let size = effect
                .values()
                .iter()
                .zip(&neutral)
                .map(|(value, neutral)| (value - neutral).abs())
                .fold(0.0, f64::max);
            size < factor * ordinary
        }
        Some(Ordinary::Change(ordinary)) => {
            let squares: f64 = effect.values()[1..].iter().map(|value| value * value).sum();
            squares.sqrt() < factor * ordinary
        }
    }
}

/// Whether an offset or ramp may come from a coarse rounding alone: below half a step, slow motion dwells
/// on one side of it. Readings that go on from step to step round anew with each, by step / sqrt(12); so many
/// of them leave an offset of that over the root of their number, and over a recording a ramp of sqrt(12)
/// times as much.
fn is_rounding(effect: &Effect, model: &FitModel) -> bool {
    let spec = effect.kind().spec();
    let Search::Fitted(search) = spec.search else {
        return false;
    };
    let seconds = model.prepared.length as f64 / model.prepared.rate_hz;
    let (factor, of_rounding) = match search.rounding {
        None => return false,
        Some(Rounding::Offset) => (1.0, 12.0_f64.sqrt().recip()),
        Some(Rounding::Ramp) => (seconds, 1.0),
    };
    let passes = |channel: Channel| {
        let step = coarse_step(model, channel);
        let axes = axes_of_channel(channel).zip(effect.values());
        step > 0.0
            && axes.into_iter().all(|(axis, value)| {
                let size = factor * value.abs();
                let by_chance = of_rounding * step / (steps_taken(model, axis, step) as f64).sqrt();
                size < 0.5 * step && size < ROUNDING_SIGMAS * by_chance
            })
    };
    spec.channels.iter().any(|channel| passes(*channel))
}

/// How often an axis goes on by more than a step, and 1: noise that takes it to and fro between two
/// neighbours rounds nothing anew.
fn steps_taken(model: &FitModel, axis: usize, step: f64) -> usize {
    let (mut count, mut last) = (1, f64::NEG_INFINITY);
    for reading in &model.prepared.measured {
        let value = value_on_axis(reading, axis);
        if (value - last).abs() > 1.5 * step {
            count += usize::from(last.is_finite());
            last = value;
        }
    }
    count
}

/// Step of a coarse rounding in SI units; 0 where the rounding is none or fine.
fn coarse_step(model: &FitModel, channel: Channel) -> f64 {
    let steps = model.basis.steps[channel];
    if steps > COARSE_STEPS {
        steps * model.basis.sigma[channel]
    } else {
        0.0
    }
}

/// Values of an effect that is read off; none where it is not there.
fn read_off(model: &FitModel, observations: &Observations, from: ReadOff) -> Option<Vec<f64>> {
    let prepared = model.prepared;
    let declared =
        |channel: Channel| prepared.declared[channel].unwrap_or(observations.found_noise[channel]);
    match from {
        ReadOff::ClippedReadings(channel) => {
            let limit = observations.digital[channel].limit?;
            Some(vec![limit / observations.units[channel]])
        }
        ReadOff::Lattice(channel) => {
            let step = observations.step(channel);
            (step > STEP * declared(channel) && step > 0.0).then(|| vec![step])
        }
        ReadOff::ExcessNoise(channel) => {
            let density = excess_noise(model, observations, channel)?;
            Some(vec![density])
        }
        ReadOff::UnitFactor(channel) => {
            let factor = observations.units[channel];
            (factor != 1.0).then(|| vec![factor])
        }
        ReadOff::ReferenceLength => {
            let units = prepared.report.length_units;
            (units != 1.0).then(|| vec![units])
        }
        ReadOff::ReferenceFrames => {
            let frames = prepared.report.frames?;
            Some(vec![frames.rate_hz()])
        }
        ReadOff::MissingMessages => {
            let missing = prepared.missing;
            (missing.fraction > 0.0).then(|| vec![missing.fraction, missing.mean_burst.max(1.0)])
        }
        ReadOff::ReferenceScatter => {
            let noise = prepared.estimate.noise();
            is_reference_noisy(model).then(|| vec![noise.position, noise.rotation])
        }
        ReadOff::ReferenceSpectrum => {
            let smoothing = model.basis.undone_smoothing?;
            let effect = Effect::reference_smoothing(&smoothing).ok()?;
            Some(effect.values().to_vec())
        }
    }
}

/// Density of the white noise beyond the declared, where it is a cause.
fn excess_noise(model: &FitModel, observations: &Observations, channel: Channel) -> Option<f64> {
    let prepared = model.prepared;
    let declared = prepared.declared[channel]?.powi(2);
    // Rounding adds step^2 / 12 of noise of its own.
    let of_rounding = observations.step(channel).powi(2) / 12.0;
    let factor = excess_factor(model, observations, channel);
    let rate_hz = prepared.rate_hz;
    let density = |variance: f64, of_reference: f64| {
        let beyond = variance - of_rounding - declared;
        let needed = factor * declared
            + ROUNDING_UNCERTAINTY * of_rounding
            + REFERENCE_UNCERTAINTY * of_reference;
        (beyond > needed).then(|| (beyond / rate_hz).sqrt())
    };
    // At 25 Hz the reference's error folds over into all bands.
    let of_reference = model
        .basis
        .least_reference_error(prepared, channel, &UPPER_BANDS);
    let found = observations.found_noise[channel].powi(2);
    let resolved = observations.resolved_noise[channel]
        .filter(|_| !observations.has_tails[channel] && of_rounding == 0.0);
    let is_white = observations.is_white[channel];
    let is_steady = observations.is_steady[channel];
    let may_fold_over = observations.may_fold_over[channel];
    trace(|| {
        eprintln!(
            "noise of {channel:?}: found {found:.3e}, declared {declared:.3e} times {factor}, reference {of_reference:.3e}, white {is_white} steady {is_steady} tails {} folds {may_fold_over}, {resolved:?}",
            observations.has_tails[channel]
        );
    });
    let of_all = || density(found - of_reference, of_reference);
    let of_resolved = || resolved.and_then(|noise| density(noise.variance, noise.of_reference));
    let white = is_white.then(of_all).flatten();
    white
        .or_else(of_resolved)
        .filter(|_| is_steady && !may_fold_over)
}

/// Variance of white noise beyond the declared, in units of the declared, from which on it is a cause.
fn excess_factor(model: &FitModel, observations: &Observations, channel: Channel) -> f64 {
    // What a smoothed reference lacks, or missing messages, is broad enough to pass for noise where the readings hold it,
    // and so are blows.
    let may_lack_motion =
        model.basis.undone_smoothing.is_some() || model.prepared.missing.fraction > MANY_MISSING;
    let is_doubtful = (may_lack_motion && !observations.readings_are_level[channel])
        || observations.has_tails[channel];
    if is_doubtful {
        DOUBTFUL_EXCESS_NOISE
    } else {
        EXCESS_NOISE
    }
}

impl Observations<'_> {
    /// Step of the rounding, in SI units; 0 without.
    fn step(&self, channel: Channel) -> f64 {
        self.digital[channel].step(self.units[channel])
    }
}
