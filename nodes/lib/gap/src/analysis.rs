//! The analysis of one recording of a placement, from its start to what was found.

use cromosim_imu::{Effect, EffectKind, EffectSet, ReadOff, Search};

use crate::axes::smaller;
use crate::axes_choice::with_chosen_axes;
use crate::beside_response::pruned_beside_response;
use crate::confounding::is_calibration;
use crate::findings::Findings;
use crate::fit::FitModel;
use crate::library::Library;
use crate::noise_updates::{first_model, with_rest_as_noise, with_updated_noise};
use crate::policy::confounded::HARDLY_EXPLAINED;
use crate::policy::report::MOSTLY_EXPLAINED;
use crate::policy::search::{FIT_STEPS, MOST, MOST_AT_FIRST, NOISE_OVERSTATED, ROUNDS};
use crate::progress::{self, Progress, THINNED};
use crate::reportable::{Observations, is_ordinary, reportable_effects};
use crate::resolved_noise::{may_fold_over, resolved_noise};
use crate::search::{
    ScoredEffectSet, excess, exchanged, score, score_after, score_as_it_is, search,
    search_down_to_noise,
};
use crate::sensor_noise::{
    found_noise, has_tails, is_steady, is_white, most_noise, readings_are_level,
};
use crate::session::Session;
use crate::smoothing::{try_smoothing, with_undone_smoothing};
use crate::thinned::{is_folded, thinned};
use crate::trace::{names, trace};

/// The analysis of one recording with a library of effects.
pub(crate) struct Analysis<'a> {
    pub session: &'a Session,
    pub library: &'a Library,
    pub progress: Progress,
}

impl<'a> Analysis<'a> {
    /// The smallest set of effects, and the model of the noise that it was found with. Readings at a
    /// high rate are searched at a lower one, and what is found is fitted to all of them.
    pub fn best_set(&self) -> (FitModel<'a>, ScoredEffectSet) {
        let thinned = thinned(self.session);
        if let Some(refined) = thinned.and_then(|session| self.refined(&session)) {
            return refined;
        }
        let fitted = self.library.fitted();
        let (mut model, scored) = self.searched(&fitted);
        self.progress.reached(progress::ROUNDS.end);
        let found = names(&scored.fit.set);
        let mut scored = exchanged(&model, scored, &fitted);
        // What did not grow beside the wrong member may grow beside the right one; what was left out would come again.
        let are_others = names(&scored.fit.set) != found;
        if are_others && scored.fit.set.len() >= found.len() {
            let updated = with_updated_noise(&model, &scored, &self.session.digital, self.library);
            let set = std::slice::from_ref(&scored.fit.set);
            let grown = search(&updated, set, &fitted, MOST);
            trace_scored("exchanged and grown", &grown);
            if grown.fit.set.len() > scored.fit.set.len() {
                model = updated;
                scored = exchanged(&model, grown, &fitted);
            }
        }
        let scored = pruned_beside_response(&model, scored, &fitted);
        let scored = with_chosen_axes(&model, scored, self.library);
        self.progress.reached(1.0);
        (model, scored)
    }

    /// What a set means: which of its effects are causes, and what is read off beside them.
    pub fn findings(&self, model: FitModel<'a>, scored: ScoredEffectSet) -> Findings<'a> {
        let Session {
            prepared,
            digital,
            units,
            ..
        } = self.session;
        let residual = prepared.residual(&scored.fit.prediction.readings);
        let found_noise = found_noise(prepared, &residual, digital);
        let reportable = reportable_effects(
            &model,
            &scored.fit,
            &Observations {
                digital,
                units: *units,
                found_noise,
                is_white: is_white(prepared, &residual),
                is_steady: is_steady(prepared, &residual),
                has_tails: has_tails(prepared, &residual),
                readings_are_level: readings_are_level(prepared, found_noise),
                resolved_noise: resolved_noise(prepared, &model.basis, &residual),
                may_fold_over: may_fold_over(prepared, &model.basis, found_noise),
            },
            self.library,
        );
        let nominal = excess(&model, &score(&model, EffectSet::new()).fit);
        let left = excess(&model, &scored.fit) / nominal;
        trace(|| eprintln!("left {left:.3} of what is to be gained"));
        Findings {
            model,
            scored,
            digital: *digital,
            found_noise,
            most_noise: most_noise(prepared, &residual),
            struck: Vec::new(),
            kept: None,
            library: self.library.clone(),
            unknown: None,
            is_loud: false,
            is_mostly_explained: left < MOSTLY_EXPLAINED,
            is_hardly_explained: left > HARDLY_EXPLAINED && !is_read_off_undone(&reportable),
            reportable,
        }
    }

    /// The best set of the thinned recording, fitted to the whole one; none where it is not sound
    /// there, or where a line may be a vibration that is another one in the thinned recording.
    fn refined(&self, thinned: &Session) -> Option<(FitModel<'a>, ScoredEffectSet)> {
        let searched = Analysis {
            session: thinned,
            library: self.library,
            progress: self.progress.part(&THINNED),
        };
        let (coarse, found) = searched.best_set();
        let mut model = self.first_model();
        let digital = &self.session.digital;
        if let Some(smoothing) = coarse.basis.undone_smoothing {
            model = with_undone_smoothing(&model, &self.session.starts[0], smoothing);
        }
        // What the noise is taken from needs no change sharper than the thinned one.
        let scored = score_after(&model, found.fit.set, FIT_STEPS);
        model = with_updated_noise(&model, &scored, digital, self.library);
        let scored = score(&model, scored.fit.set);
        trace_scored("at the full rate", &scored);
        self.progress.reached(1.0);
        let margins = found.margins;
        let is_sound = scored.score.is_finite() && !self.holds_folded_line(&model, &scored);
        is_sound.then_some((model, ScoredEffectSet { margins, ..scored }))
    }

    /// Whether an effect that is a line of the spectrum earns a place, whose line is another one in the
    /// thinned recording.
    fn holds_folded_line(&self, model: &FitModel, scored: &ScoredEffectSet) -> bool {
        let is_line = |kind: &EffectKind| Effect::neutral(*kind).spectral_line().is_some();
        let lines: Vec<EffectKind> = self.library.fitted().into_iter().filter(is_line).collect();
        let is_folded = |hz: f64| is_folded(self.session, hz);
        model.basis.line_hz.is_some_and(is_folded) && {
            let found = search(model, std::slice::from_ref(&scored.fit.set), &lines, 1);
            found
                .fit
                .set
                .iter()
                .any(|effect| lines.contains(&effect.kind()))
        }
    }

    fn first_model(&self) -> FitModel<'a> {
        let Session {
            prepared,
            starts,
            digital,
            track,
            ..
        } = self.session;
        first_model(prepared, track.clone(), &starts[0], digital, self.library)
    }

    /// The first search, a smoothing of the reference where one is believed, and rounds of search,
    /// each with the noise that the one before leaves.
    fn searched(&self, fitted: &[EffectKind]) -> (FitModel<'a>, ScoredEffectSet) {
        let Session {
            starts, digital, ..
        } = self.session;
        let mut model = self.first_model();
        let mut scored = search_down_to_noise(&model, starts, fitted, MOST_AT_FIRST);
        trace_scored("first", &scored);
        if smaller(scored.fit.held_out_ratio()) < NOISE_OVERSTATED {
            // What was found since had passed for noise, which may cover more.
            model = with_updated_noise(&model, &scored, digital, self.library);
            let found = scored.fit.set.clone();
            scored = search_down_to_noise(&model, &[found], fitted, MOST_AT_FIRST);
            trace_scored("beside the noise that is left", &scored);
        }
        self.progress.reached(progress::ROUNDS.start);
        if self.library.allows_read_off(ReadOff::ReferenceSpectrum) {
            (model, scored) = try_smoothing(model, scored, starts, fitted);
        }
        let rounds = self.progress.part(&progress::ROUNDS);
        for round in 0..ROUNDS {
            model = with_updated_noise(&model, &scored, digital, self.library);
            let before = scored.fit.set.clone();
            let start = std::slice::from_ref(&before);
            scored = if round + 1 < ROUNDS {
                search_down_to_noise(&model, start, fitted, MOST)
            } else {
                search(&model, start, fitted, MOST)
            };
            trace_scored(&format!("round {round}"), &scored);
            rounds.one_of(round, ROUNDS).reached(1.0);
            if names(&before) == names(&scored.fit.set) {
                break;
            }
        }
        (model, scored)
    }
}

/// Fits once more, each frequency in units of what is left there: else what is unexplained pulls at
/// the values. Calibrations that help then are taken up.
pub(crate) fn refit_beside_unknown(findings: &mut Findings) {
    let Some(unknown) = &findings.unknown else {
        return;
    };
    if !findings.is_mostly_explained {
        return;
    }
    let calibrations: Vec<EffectKind> = findings
        .library
        .fitted()
        .into_iter()
        .filter(|kind| is_calibration(*kind) && !unknown.confounded_effects.contains(kind))
        .collect();
    let model = with_rest_as_noise(&findings.model, &findings.scored);
    let set = &findings.scored.fit.set;
    let most = EffectKind::ALL
        .into_iter()
        .filter(|kind| is_calibration(*kind))
        .count();
    let found = search(&model, std::slice::from_ref(set), &calibrations, most);
    let found = with_chosen_axes(&model, found, &findings.library);
    trace(|| {
        eprintln!(
            "beside unknown: {:?} -> {:?}",
            set.iter().collect::<Vec<_>>(),
            found.fit.set.iter().collect::<Vec<_>>()
        )
    });
    take_over(&mut findings.reportable, set, &found.fit.set);
    let margins = std::mem::take(&mut findings.scored.margins);
    // The values are no surer than what is left there allows.
    let covariance = model.covariance_by_blocks(&found.fit, &findings.reportable);
    findings.scored = ScoredEffectSet {
        margins,
        ..score_as_it_is(&findings.model, found.fit.set)
    };
    findings.scored.fit.linear.covariance = covariance;
}

/// Whether the nominal simulation that fits are compared with has more of the gap explained than a set without
/// effects: units, frames, a smoothing and steps that are read off are taken into account before anything is fitted.
fn is_read_off_undone(reportable: &EffectSet) -> bool {
    reportable.iter().any(|effect| {
        let Search::ReadOff(search) = effect.kind().spec().search else {
            return false;
        };
        matches!(
            search.from,
            ReadOff::Lattice(_)
                | ReadOff::UnitFactor(_)
                | ReadOff::ReferenceLength
                | ReadOff::ReferenceSpectrum
                | ReadOff::ReferenceFrames
        )
    })
}

/// Brings the reported effects from one fitted set to the next.
fn take_over(reportable: &mut EffectSet, before: &EffectSet, after: &EffectSet) {
    for kind in EffectKind::ALL {
        match (before.get(kind), after.get(kind)) {
            (Some(_), None) => {
                reportable.remove(kind);
            }
            (None, Some(effect)) if !is_ordinary(effect, 1.0) => {
                reportable.insert(Effect::clone(effect));
            }
            (Some(_), Some(effect)) if reportable.contains(kind) => {
                reportable.insert(effect.clone());
            }
            _ => {}
        }
    }
    reportable.take_values_of(after);
}

fn trace_scored(step: &str, scored: &ScoredEffectSet) {
    trace(|| {
        eprintln!(
            "{step}: {:?} {:.2?}",
            names(&scored.fit.set),
            scored.fit.held_out_ratio()
        )
    });
}
