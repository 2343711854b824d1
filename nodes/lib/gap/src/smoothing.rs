//! Whether the reference was smoothed before it came here.

use cromosim_imu::{EffectKind, EffectSet, PerChannel};
use cromosim_spatial::{SmoothingKernel, ZeroPhaseSmoothing};

use crate::axes::{larger, smaller, sum_over_channels};
use crate::fit::FitModel;
use crate::noise_updates::with_estimate;
use crate::plausibility::told_from_smoothing;
use crate::policy::smoothing::{
    BESIDE, CLOSER, LEAST_GAIN_NATS, LEAST_SHARE, NOT_FARTHER, SUSPICIOUS,
};
use crate::search::{ScoredEffectSet, excess, score, search};
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
    // Beside what was found without it, and alone.
    let mut sets: Vec<EffectSet> = starts.to_vec();
    let found = told_from_smoothing(&scored.fit.set);
    if !starts.contains(&found) {
        sets.push(found);
    }
    let trial = Trial {
        plain: evidence(&model, &scored),
        model: &model,
        start: &starts[0],
        sets: &sets,
    };
    let Some(smoothing) = trial.best_smoothing() else {
        return (model, scored);
    };
    if reaches_no_motion(&smoothing, 1.0) {
        return (model, scored);
    }
    let undone = with_undone_smoothing(&model, &starts[0], smoothing);
    let searched = search(&undone, &sets, library, BESIDE);
    let gained = evidence(&undone, &searched);
    trace(|| {
        eprintln!(
            "  {smoothing:?} with {:?}: {gained:.1}",
            names(&searched.fit.set),
        )
    });
    let needed = trial.plain + LEAST_GAIN_NATS + LEAST_SHARE * excess(&model, &scored.fit);
    let beside = score(&model, searched.fit.set.clone());
    if gained > needed && comes_closer(&model, &beside, &searched) {
        (undone, searched)
    } else {
        (model, scored)
    }
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
}

impl Trial<'_, '_> {
    /// The smoothing with the most evidence: Butterworth's from a grid, a Gaussian from around it,
    /// the better one refined.
    fn best_smoothing(&self) -> Option<ZeroPhaseSmoothing> {
        let butterworth = self.best_of(SmoothingKernel::Butterworth, &CUTOFFS_HZ)?;
        let parts = GAUSSIAN_PARTS.map(|part| part * butterworth.1.cutoff_hz);
        let gaussian = self.best_of(SmoothingKernel::Gaussian, &parts)?;
        let better = if gaussian.0 > butterworth.0 {
            gaussian
        } else {
            butterworth
        };
        // Then nothing finer does, either.
        if reaches_no_motion(&better.1, FINE.iter().product()) {
            return None;
        }
        Some(self.refined(better, &FINE).1)
    }

    /// The cutoff with the most evidence, from some and around their best.
    fn best_of(
        &self,
        kernel: SmoothingKernel,
        cutoffs_hz: &[f64],
    ) -> Option<(f64, ZeroPhaseSmoothing)> {
        let best = cutoffs_hz
            .iter()
            .filter_map(|&cutoff_hz| self.evidence_of(ZeroPhaseSmoothing { cutoff_hz, kernel }))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(self.refined(best, &COARSE))
    }

    /// The best of a smoothing and those whose cutoffs lie on either side of it by some factors.
    fn refined(
        &self,
        mut best: (f64, ZeroPhaseSmoothing),
        factors: &[f64],
    ) -> (f64, ZeroPhaseSmoothing) {
        for factor in factors {
            let middle = best.1;
            for cutoff_hz in [middle.cutoff_hz / factor, middle.cutoff_hz * factor] {
                let other = self.evidence_of(ZeroPhaseSmoothing {
                    cutoff_hz,
                    ..middle
                });
                best = other.filter(|other| other.0 > best.0).unwrap_or(best);
            }
        }
        best
    }

    /// Evidence of a smoothing with the best of the starting sets, nats, and the smoothing.
    fn evidence_of(&self, smoothing: ZeroPhaseSmoothing) -> Option<(f64, ZeroPhaseSmoothing)> {
        let undone = with_undone_smoothing(self.model, self.start, smoothing);
        let found = self
            .sets
            .iter()
            .map(|set| score(&undone, set.clone()))
            .max_by(|a, b| a.score.total_cmp(&b.score))?;
        let evidence = evidence(&undone, &found);
        trace(|| {
            eprintln!(
                "  {smoothing:?}: {evidence:.1} against {:.1} {:.2?}",
                self.plain,
                found.fit.held_out_ratio()
            )
        });
        Some((evidence, smoothing))
    }
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
    let norms = |scored: &ScoredEffectSet| {
        let readings = &scored.fit.prediction.readings;
        model.prepared.residual_norms(readings)
    };
    let (undone, plain) = (norms(undone), norms(plain));
    let ratio = PerChannel::from_fn(|channel| undone[channel] / plain[channel].max(1e-30));
    trace(|| eprintln!("  smoothing comes closer by {ratio:.3?}"));
    smaller(ratio) < CLOSER && larger(ratio) < NOT_FARTHER
}
