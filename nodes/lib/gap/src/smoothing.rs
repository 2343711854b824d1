//! Whether the reference was smoothed before it came here.

use std::sync::Arc;

use cromosim_imu::{EffectKind, EffectSet, PerChannel};

use crate::axes::{larger, smaller, sum_over_channels};
use crate::fit::FitModel;
use crate::noise_model::NoiseModel;
use crate::policy::smoothing::{
    BESIDE, CLOSER, LEAST_GAIN_NATS, LEAST_SHARE, NOT_FARTHER, SUSPICIOUS,
};
use crate::search::{ScoredEffectSet, excess, score, search};
use crate::trace::{names, trace};

/// Cutoffs that are tried first, Hz. Beyond the last nothing is undone but noise.
const CUTOFFS_HZ: [f64; 9] = [1.5, 2.0, 2.6, 3.4, 4.4, 5.7, 7.4, 9.6, 12.5];
/// Factor between neighbouring cutoffs of the first refinement; each that follows has its root.
const REFINEMENT: f64 = 1.12;
/// Refinements of the best cutoff.
const REFINEMENTS: usize = 4;

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
    if !starts.contains(&scored.fit.set) {
        sets.push(scored.fit.set.clone());
    }
    let trial = Trial {
        plain: evidence(&model, &scored),
        model: &model,
        start: &starts[0],
        sets: &sets,
    };
    let Some(cutoff_hz) = trial.best_cutoff() else {
        return (model, scored);
    };
    let undone = with_undone_smoothing(&model, &starts[0], cutoff_hz);
    // A cutoff that no motion reaches explains nothing; this search decides whether something
    // beside it does.
    let searched = search(&undone, &sets, library, BESIDE);
    let gained = evidence(&undone, &searched);
    trace(|| {
        eprintln!(
            "  smoothing {cutoff_hz:.2} Hz with {:?}: {gained:.1}",
            names(&searched.fit.set),
        )
    });
    if cutoff_hz > CUTOFFS_HZ[CUTOFFS_HZ.len() - 1] {
        return (model, scored);
    }
    let needed = trial.plain + LEAST_GAIN_NATS + LEAST_SHARE * excess(&model, &scored.fit);
    if gained > needed && comes_closer(&model, &scored, &searched) {
        (undone, searched)
    } else {
        (model, scored)
    }
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
    /// The cutoff with the most evidence, from the grid and around its best.
    fn best_cutoff(&self) -> Option<f64> {
        let mut best = CUTOFFS_HZ
            .into_iter()
            .filter_map(|cutoff_hz| self.evidence_at(cutoff_hz))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut factor = REFINEMENT;
        for _ in 0..REFINEMENTS {
            for cutoff_hz in [best.1 / factor, best.1 * factor] {
                if let Some(other) = self.evidence_at(cutoff_hz)
                    && other.0 > best.0
                {
                    best = other;
                }
            }
            factor = f64::sqrt(factor);
        }
        Some(best.1)
    }

    /// Evidence of a cutoff with the best of the starting sets, nats, and the cutoff.
    fn evidence_at(&self, cutoff_hz: f64) -> Option<(f64, f64)> {
        let undone = with_undone_smoothing(self.model, self.start, cutoff_hz);
        let found = self
            .sets
            .iter()
            .map(|set| score(&undone, set.clone()))
            .max_by(|a, b| a.score.total_cmp(&b.score))?;
        let evidence = evidence(&undone, &found);
        trace(|| {
            eprintln!(
                "  smoothing {cutoff_hz:.2} Hz: {evidence:.1} against {:.1} {:.2?}",
                self.plain,
                found.fit.held_out_ratio()
            )
        });
        Some((evidence, cutoff_hz))
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

/// The model in which a smoothing of this cutoff is undone.
fn with_undone_smoothing<'a>(
    model: &FitModel<'a>,
    set: &EffectSet,
    cutoff_hz: f64,
) -> FitModel<'a> {
    let prepared = model.prepared;
    let estimate = prepared.estimate.undoing(cutoff_hz);
    let track = prepared.track(&estimate);
    let residual = prepared.residual(&prepared.predict(&track, set).readings);
    let mut basis = model.basis.clone();
    basis.estimate = Arc::new(estimate);
    basis.undone_hz = Some(cutoff_hz);
    let noise = NoiseModel::new(prepared, &basis, &residual);
    FitModel::new(prepared, track, basis, noise)
}

/// Whether the simulation itself comes closer in one channel, and in none moves away: what is
/// undone must not cost more than it gives.
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
