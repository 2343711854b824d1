//! Whether the reference was smoothed before it came here.

use cromosim_imu::{Effect, EffectKind, EffectSet, PerChannel};
use cromosim_spatial::{SmoothingKernel, ZeroPhaseSmoothing};

use crate::axes::{larger, smaller, sum_over_channels};
use crate::fit::FitModel;
use crate::noise_updates::with_estimate;
use crate::plausibility::told_from_smoothing;
use crate::policy::smoothing::{
    BESIDE, BEST_RATIO, CLOSER, LEAST_GAIN_NATS, LEAST_SHARE, MUCH_FARTHER, NOT_FARTHER,
    SHORTEST_DELAY_S, SUSPICIOUS, TRIAL_STEPS,
};
use crate::search::{ScoredEffectSet, excess, score, score_after, search_down_to_noise};
use crate::trace::{names, trace};

/// Cutoffs that are tried first, Hz. Beyond the last nothing is undone but noise.
const CUTOFFS_HZ: [f64; 9] = [1.5, 2.0, 2.6, 3.4, 4.4, 5.7, 7.4, 9.6, 12.5];
/// A Gaussian's cutoffs that are tried first, as parts of the best one of Butterworth's filter: its half
/// power lies below that one's half amplitude.
const GAUSSIAN_PARTS: [f64; 3] = [0.55, 0.7, 0.85];
/// Factors between the best cutoff and those next to it that tell the kernels apart.
const COARSE: [f64; 2] = [1.12, 1.06];
/// And those that refine the better kernel's.
const FINE: [f64; 2] = [1.03, 1.015];

/// The better of `model` and models in which a smoothing of the reference is undone, each with the
/// best set of effects.
pub(crate) fn try_smoothing<'a>(
    model: FitModel<'a>,
    scored: ScoredEffectSet,
    starts: &[EffectSet],
    library: &[EffectKind],
) -> (FitModel<'a>, ScoredEffectSet) {
    if larger(scored.fit.held_out_ratio()) < SUSPICIOUS {
        return (model, scored);
    }
    let found = told_from_smoothing(&scored.fit.set);
    let plain = evidence(&model, &scored);
    let without_smoothing = if found == scored.fit.set {
        plain
    } else {
        evidence(&model, &score(&model, found.clone()))
    };
    let sets = starting_sets(starts, found, library);
    let needed = plain + LEAST_GAIN_NATS + LEAST_SHARE * excess(&model, &scored.fit);
    let of_plain = |set: &EffectSet| residual_norms(&model, &score(&model, set.clone()));
    let trial = Trial {
        plain_norms: sets.iter().map(of_plain).collect(),
        plain,
        without_smoothing,
        needed,
        plain_ratio: scored.fit.held_out_ratio(),
        model: &model,
        start: &starts[0],
        sets: &sets,
    };
    let Some(Tried { smoothing, set, .. }) = trial.best_smoothing() else {
        return (model, scored);
    };
    if reaches_no_motion(&smoothing, 1.0) {
        return (model, scored);
    }
    let undone = with_undone_smoothing(&model, &starts[0], smoothing);
    let searched = search_down_to_noise(&undone, &sets, library, BESIDE);
    let (undone, searched) = if names(&searched.fit.set) == names(&set) {
        (undone, searched)
    } else {
        trial.sharpened(undone, searched, smoothing, library)
    };
    let gained = evidence(&undone, &searched);
    trace(|| {
        eprintln!(
            "  {smoothing:?} with {:?}: {gained:.1}",
            names(&searched.fit.set),
        )
    });
    let beside = score(&model, searched.fit.set.clone());
    if gained > needed && comes_closer(&model, &beside, &searched) {
        (undone, searched)
    } else {
        (model, scored)
    }
}

/// Beside what was found without it, that with the delay of a filter, and alone.
fn starting_sets(starts: &[EffectSet], found: EffectSet, library: &[EffectKind]) -> Vec<EffectSet> {
    let mut sets = starts.to_vec();
    sets.extend(with_all_delay_by_filter(&found, library));
    if !starts.contains(&found) {
        sets.push(found);
    }
    sets
}

/// Whether a cutoff is above all that explain something, and would be were it lower by a factor.
fn reaches_no_motion(smoothing: &ZeroPhaseSmoothing, factor: f64) -> bool {
    smoothing.cutoff_hz > factor * CUTOFFS_HZ[CUTOFFS_HZ.len() - 1]
}

/// What cutoffs are tried beside.
struct Trial<'t, 'a> {
    model: &'t FitModel<'a>,
    /// What is certain from the start.
    start: &'t EffectSet,
    sets: &'t [EffectSet],
    /// Evidence of the reference as it is, nats.
    plain: f64,
    /// The same without effects that cannot be told from a smoothing.
    without_smoothing: f64,
    /// Evidence from which on a smoothing is believed.
    needed: f64,
    /// Held-out mean square of the whitened residual of the reference as it is.
    plain_ratio: PerChannel<f64>,
    /// How far the reference as it is is off with each of the sets.
    plain_norms: Vec<PerChannel<f64>>,
}

/// A smoothing that was tried.
struct Tried {
    evidence: f64,
    smoothing: ZeroPhaseSmoothing,
    /// The best of the starting sets beside it.
    set: EffectSet,
}

impl<'a> Trial<'_, 'a> {
    /// A smoothing beside what was found once it was undone: its cutoff had made up for that.
    fn sharpened(
        &self,
        undone: FitModel<'a>,
        searched: ScoredEffectSet,
        smoothing: ZeroPhaseSmoothing,
        library: &[EffectKind],
    ) -> (FitModel<'a>, ScoredEffectSet) {
        let mut sets = vec![searched.fit.set.clone()];
        sets.extend(with_all_delay_by_filter(&sets[0], library));
        let of_plain =
            |set: &EffectSet| residual_norms(self.model, &score(self.model, set.clone()));
        let beside = Trial {
            sets: &sets,
            plain_norms: sets.iter().map(of_plain).collect(),
            ..*self
        };
        let begun = Tried {
            evidence: evidence(&undone, &searched),
            smoothing,
            set: sets[0].clone(),
        };
        let sharp = beside.refined(beside.refined(begun, &COARSE), &FINE);
        if sharp.smoothing == smoothing {
            return (undone, searched);
        }
        let undone = with_undone_smoothing(self.model, self.start, sharp.smoothing);
        let searched = search_down_to_noise(&undone, &[sharp.set], library, BESIDE);
        (undone, searched)
    }

    /// The smoothing with the most evidence: Butterworth's from a grid, a Gaussian from around it,
    /// the better one refined.
    fn best_smoothing(&self) -> Option<Tried> {
        let butterworth = self.best_of(SmoothingKernel::Butterworth, &CUTOFFS_HZ)?;
        let butterworth = self.refined(butterworth, &COARSE);
        let parts = GAUSSIAN_PARTS.map(|part| part * butterworth.smoothing.cutoff_hz);
        let gaussian = self
            .best_of(SmoothingKernel::Gaussian, &parts)
            .map(|gaussian| self.refined(gaussian, &COARSE))
            .filter(|gaussian| gaussian.evidence > butterworth.evidence);
        let better = gaussian.unwrap_or(butterworth);
        // Then nothing finer does, either.
        if reaches_no_motion(&better.smoothing, FINE.iter().product()) {
            return None;
        }
        Some(self.refined(better, &FINE))
    }

    /// The cutoff with the most evidence; none where none has more than the reference as it is, without what passes for a
    /// smoothing: of one that is there even a cutoff next to it explains far more.
    fn best_of(&self, kernel: SmoothingKernel, cutoffs_hz: &[f64]) -> Option<Tried> {
        cutoffs_hz
            .iter()
            .filter_map(|&cutoff_hz| self.tried(ZeroPhaseSmoothing { cutoff_hz, kernel }))
            .max_by(|a, b| a.evidence.total_cmp(&b.evidence))
            .filter(|best| best.evidence > self.without_smoothing)
    }

    /// The best of a smoothing and those whose cutoffs lie on either side of it by some factors.
    fn refined(&self, mut best: Tried, factors: &[f64]) -> Tried {
        for factor in factors {
            let middle = best.smoothing;
            for cutoff_hz in [middle.cutoff_hz / factor, middle.cutoff_hz * factor] {
                let other = self.tried(ZeroPhaseSmoothing {
                    cutoff_hz,
                    ..middle
                });
                best = other
                    .filter(|other| other.evidence > best.evidence)
                    .unwrap_or(best);
            }
        }
        best
    }

    /// A smoothing with the best of the starting sets; none where the noise that undoing it brings lets no set
    /// have the evidence that is needed. That noise covers what a cutoff that is too low leaves, so that one with which the
    /// simulation is far farther off does not count.
    fn tried(&self, smoothing: ZeroPhaseSmoothing) -> Option<Tried> {
        let undone = with_undone_smoothing(self.model, self.start, smoothing);
        let most = -sum_over_channels(|channel| {
            let whitener = &undone.whitener;
            let best_ratio = self.plain_ratio[channel].min(BEST_RATIO);
            whitener.count[channel] * (0.5 * best_ratio + whitener.log_scale[channel])
        });
        if most < self.needed {
            return None;
        }
        let found = self
            .sets
            .iter()
            .zip(&self.plain_norms)
            .map(|(set, plain)| (score_after(&undone, set.clone(), TRIAL_STEPS), plain))
            .filter(|(found, plain)| {
                let norms = residual_norms(&undone, found);
                larger(over(norms, **plain)) <= MUCH_FARTHER
            })
            .map(|(found, _)| found)
            .max_by(|a, b| a.score.total_cmp(&b.score))?;
        let evidence = evidence(&undone, &found);
        trace(|| {
            eprintln!(
                "  {smoothing:?}: {evidence:.1} against {:.1} {:.2?}",
                self.plain,
                found.fit.held_out_ratio()
            )
        });
        Some(Tried {
            evidence,
            smoothing,
            set: found.fit.set,
        })
    }
}

/// A set in which a filter alone makes the readings late, where an offset does, or both: beside a cutoff of the smoothing
/// that is not quite right each takes up what of the other it leaves.
fn with_all_delay_by_filter(set: &EffectSet, library: &[EffectKind]) -> Option<EffectSet> {
    let offset_s = set.get(EffectKind::TimeOffset).map(|_| set.time_offset())?;
    let filter = set.get(EffectKind::LowPass);
    let all_s = offset_s + filter.and_then(Effect::low_pass_delay).unwrap_or(0.0);
    let filter = Effect::low_pass_with_delay(all_s).ok()?;
    let may_be = library.contains(&EffectKind::LowPass) && SHORTEST_DELAY_S < all_s;
    may_be.then(|| set.without(EffectKind::TimeOffset).with(filter))
}

/// Held-out log-likelihood with the predicted noise's own volume: models with other noise become
/// comparable.
fn evidence(model: &FitModel, scored: &ScoredEffectSet) -> f64 {
    scored.score
        - sum_over_channels(|channel| {
            model.whitener.count[channel] * model.whitener.log_scale[channel]
        })
}

/// The model in which a smoothing is undone.
pub(crate) fn with_undone_smoothing<'a>(
    model: &FitModel<'a>,
    set: &EffectSet,
    smoothing: ZeroPhaseSmoothing,
) -> FitModel<'a> {
    let estimate = model.prepared.estimate.undoing(smoothing);
    let mut undone = with_estimate(model, estimate, set);
    undone.basis.undone_smoothing = Some(smoothing);
    undone
}

/// Whether the simulation itself comes closer in one channel than with the same effects alone, and in
/// none moves away: what is undone must not cost more than it gives.
fn comes_closer(model: &FitModel, plain: &ScoredEffectSet, undone: &ScoredEffectSet) -> bool {
    let ratio = distance(model, plain, undone);
    trace(|| eprintln!("  smoothing comes closer by {ratio:.3?}"));
    smaller(ratio) < CLOSER && larger(ratio) < NOT_FARTHER
}

/// Root mean squares of the residuals of what is undone, over those of what is not.
fn distance(
    model: &FitModel,
    plain: &ScoredEffectSet,
    undone: &ScoredEffectSet,
) -> PerChannel<f64> {
    over(residual_norms(model, undone), residual_norms(model, plain))
}

fn residual_norms(model: &FitModel, scored: &ScoredEffectSet) -> PerChannel<f64> {
    let readings = &scored.fit.prediction.readings;
    model.prepared.residual_norms(readings)
}

fn over(one: PerChannel<f64>, other: PerChannel<f64>) -> PerChannel<f64> {
    PerChannel::from_fn(|channel| one[channel] / other[channel].max(1e-30))
}
