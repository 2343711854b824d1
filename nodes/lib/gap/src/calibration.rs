//! The plain calibration (clock, mount, lever arm, biases): a simulation takes it over wherever it
//! helps, whether it is named as a cause or not.

use cromosim_imu::{Effect, EffectKind, EffectSet, Search};

use crate::confounding::is_calibration;
use crate::findings::Findings;
use crate::fit::{Fit, FitModel};
use crate::gauss_newton::fit_together;
use crate::noise_updates::with_rest_as_noise;
use crate::policy::calibration::MOST_RISE;
use crate::policy::search::FIT_STEPS;
use crate::search::{price_of_effect, rises};
use crate::trace::{names, trace};

/// Adds to each recording the calibrations that are no causes, but lower the gap on time that they
/// were not fitted to: too small to be named, or beside something unknown that they might pass for.
pub(crate) fn keep_calibrations(findings: &mut [Findings]) {
    let candidates = candidates(findings);
    if candidates.is_empty() {
        return;
    }
    let models: Vec<FitModel> = findings.iter().map(model_of).collect();
    let models: Vec<&FitModel> = models.iter().collect();
    let is_free = |kind: EffectKind| candidates.contains(&kind);
    let fitted = |sets: Vec<EffectSet>| fit_together(&models, sets, FIT_STEPS, is_free);
    let mut best = fitted(findings.iter().map(named_and_fitted).collect());
    let mut left = candidates.clone();
    loop {
        let with = |kind: &EffectKind| {
            let sets = best
                .iter()
                .map(|fit| fit.set.clone().with(Effect::neutral(*kind)));
            let fits = fitted(sets.collect());
            let prices = models.iter().map(|model| price_of_effect(model, *kind));
            let gain = held_out(&fits) - held_out(&best) - prices.fold(0.0, f64::max);
            (gain, *kind, fits)
        };
        let next = left
            .iter()
            .map(with)
            .filter(|(gain, _, fits)| *gain > 0.0 && !rises(&models, &best, fits, MOST_RISE))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, kind, fits)) = next else {
            break;
        };
        left.retain(|other| *other != kind);
        best = fits;
    }
    for (one, fit) in findings.iter_mut().zip(best) {
        trace(|| {
            eprintln!(
                "kept beside {:?}: {:?}",
                names(&one.reportable),
                names(&fit.set)
            )
        });
        one.kept = Some(fit);
    }
}

/// Calibrations that may be kept: all of the library beside something unknown, else those that were
/// fitted; less those that are causes anyway. An offset of clocks beside an ordinary drift is that of
/// this recording's middle: it says nothing of another recording, whose reference's clock begins anew (it
/// made three of the withheld recordings of seed 1002 worse).
fn candidates(findings: &[Findings]) -> Vec<EffectKind> {
    let is_open = |kind: &EffectKind| {
        let is_named = findings.iter().any(|one| one.reportable.contains(*kind));
        let is_fitted =
            |one: &Findings| one.unknown.is_some() || one.scored.fit.set.contains(*kind);
        let is_of_drift = *kind == EffectKind::TimeOffset && findings.iter().any(drifts_ordinarily);
        is_calibration(*kind) && !is_named && !is_of_drift && findings.iter().any(is_fitted)
    };
    let library = &findings[0].library;
    library.fitted().into_iter().filter(is_open).collect()
}

/// Whether clocks drift apart by no more than is ordinary.
fn drifts_ordinarily(findings: &Findings) -> bool {
    let drift = EffectKind::ClockDrift;
    findings.scored.fit.set.contains(drift) && !findings.reportable.contains(drift)
}

/// Something unknown counts as noise: else it pulls at the values, and its size passes for evidence.
fn model_of<'a>(findings: &Findings<'a>) -> FitModel<'a> {
    match &findings.unknown {
        Some(_) => with_rest_as_noise(&findings.model, &findings.scored),
        None => findings.model.clone(),
    }
}

/// The causes that the forward model of the fits knows.
fn named_and_fitted(findings: &Findings) -> EffectSet {
    findings
        .reportable
        .filtered(|effect| !matches!(effect.kind().spec().search, Search::ReadOff(_)))
}

fn held_out(fits: &[Fit]) -> f64 {
    fits.iter().map(|fit| fit.linear.held_out).sum()
}
