//! The plain calibration (clock, mount, lever arm, biases): a simulation takes it over wherever it
//! helps, whether it is named as a cause or not. So it does with the device's gains, axes and delay where
//! these stand beside something unknown.

use cromosim_imu::{Effect, EffectKind, EffectSet, Kept, Rounding, Search};

use crate::confounding::is_calibration;
use crate::findings::Findings;
use crate::fit::{Fit, FitModel};
use crate::gauss_newton::fit_together;
use crate::noise_updates::with_rest_as_noise;
use crate::parts_of_time::{Part, PartsOfTime, Rises};
use crate::policy::calibration::{LEAST_FALL, MANY_POSTURES, MOST_RISE};
use crate::policy::search::FIT_STEPS;
use crate::search::{price_of_effect, rises};
use crate::trace::{names, trace};

/// Adds to each recording what is no cause, but lowers the gap on time that it was not fitted to: calibrations that
/// are too small to be named, or beside something unknown that they might pass for, and then what was found of the
/// device and taken out for that something.
pub(crate) fn keep_calibrations(findings: &mut [Findings]) {
    let (calibrations, struck) = (candidates(findings), struck(findings));
    if calibrations.is_empty() && struck.is_empty() {
        return;
    }
    let models: Vec<FitModel> = findings.iter().map(model_of).collect();
    let models: Vec<&FitModel> = models.iter().collect();
    let named = findings.iter().map(named_and_fitted).collect();
    let is_calibration = |kind: EffectKind| calibrations.contains(&kind);
    let has_unknown = findings.iter().any(|one| one.unknown.is_some());
    let recordings = Recordings {
        models: &models,
        parts: has_unknown.then(|| models.iter().map(|model| PartsOfTime::of(model)).collect()),
        has_to_fall: has_unknown && findings.iter().all(|one| one.is_hardly_explained),
    };
    let mut best = recordings.grown(named, &calibrations, is_calibration);
    if !struck.is_empty() {
        // A clock's offset, named or not, is another one beside a channel's delay.
        let is_free = |kind: EffectKind| {
            is_calibration(kind) || struck.contains(&kind) || kind == EffectKind::TimeOffset
        };
        let sets = best.iter().map(|fit| fit.set.clone()).collect();
        let with_struck = recordings.grown(sets, &struck, is_free);
        if struck.iter().any(|kind| with_struck[0].moves(*kind)) {
            best = with_struck;
        }
    }
    for (one, fit) in findings.iter_mut().zip(best) {
        trace(|| {
            eprintln!(
                "kept beside {:?}: {:?}",
                names(&one.reportable),
                names(&fit.set)
            )
        });
        one.reportable.take_values_of(&fit.set);
        one.kept = Some(fit);
    }
}

/// The recordings that members of a set have to help in.
struct Recordings<'m, 'a> {
    models: &'m [&'m FitModel<'a>],
    /// Of each; none where nothing is unknown.
    parts: Option<Vec<PartsOfTime>>,
    /// Whether what is unknown is so much that a little less of it is no sign of a calibration.
    has_to_fall: bool,
}

impl Recordings<'_, '_> {
    /// Fits of sets, with those of some candidates that help on time that they were not fitted to, the best first.
    /// Values of kinds that are not free stay.
    fn grown(
        &self,
        sets: Vec<EffectSet>,
        candidates: &[EffectKind],
        is_free: impl Fn(EffectKind) -> bool,
    ) -> Vec<Fit> {
        let models = self.models;
        let fitted = |sets: Vec<EffectSet>| fit_together(models, sets, FIT_STEPS, &is_free);
        let mut best = fitted(sets);
        let mut left = candidates.to_vec();
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
                .filter(|(gain, kind, fits)| *gain > 0.0 && !self.does_harm(*kind, &best, fits))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, kind, fits)) = next else {
                return best;
            };
            left.retain(|other| *other != kind);
            best = fits;
        }
    }

    /// Whether a channel's residual rises with a member. What is unknown may pass for a calibration on the
    /// whole: a true one does no harm at the end and in most postures, a bias in the calm neither.
    fn does_harm(&self, kind: EffectKind, without: &[Fit], with: &[Fit]) -> bool {
        let parts = self.parts.as_ref().filter(|_| is_calibration(kind));
        let hardly_falls = || !rises(self.models, with, without, LEAST_FALL.recip());
        rises(self.models, without, with, MOST_RISE)
            || (self.has_to_fall && is_calibration(kind) && hardly_falls())
            || parts.is_some_and(|parts| {
                let rises = Rises::between(self.models, parts, without, with);
                rises.share(Part::End) > 0.0
                    || rises.share(Part::Posture) >= MANY_POSTURES
                    || (is_offset(kind) && rises.share(Part::Calm) > 0.0)
            })
    }
}

/// Whether an effect's values are an offset.
fn is_offset(kind: EffectKind) -> bool {
    matches!(kind.spec().search, Search::Fitted(search) if search.rounding == Some(Rounding::Offset))
}

/// What was taken out for something unknown and may be kept.
fn struck(findings: &[Findings]) -> Vec<EffectKind> {
    let is_kept = |kind: &EffectKind| {
        let search = kind.spec().search;
        matches!(search, Search::Fitted(search) if search.kept == Kept::BesideUnknown)
            && findings.iter().any(|one| one.struck.contains(kind))
            && !findings.iter().any(|one| one.reportable.contains(*kind))
    };
    EffectKind::ALL.into_iter().filter(is_kept).collect()
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
pub(crate) fn model_of<'a>(findings: &Findings<'a>) -> FitModel<'a> {
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
