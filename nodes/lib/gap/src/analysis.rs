//! The analysis of one recording of a placement, from its start to what was found.

use cromosim_imu::{Effect, EffectKind, EffectSet, ReadOff};

use crate::confounding::is_calibration;
use crate::findings::Findings;
use crate::fit::FitModel;
use crate::library::Library;
use crate::noise_updates::{first_model, with_rest_as_noise, with_updated_noise};
use crate::policy::report::MOSTLY_EXPLAINED;
use crate::policy::search::{MOST, MOST_AT_FIRST, ROUNDS};
use crate::reportable::{Observations, is_ordinary, reportable_effects};
use crate::search::{ScoredEffectSet, excess, exchanged, score, score_as_it_is, search};
use crate::sensor_noise::{found_noise, is_white};
use crate::session::Session;
use crate::smoothing::try_smoothing;
use crate::trace::{names, trace};

/// The analysis of one recording with a library of effects.
pub(crate) struct Analysis<'a> {
    pub session: &'a Session,
    pub library: &'a Library,
}

impl<'a> Analysis<'a> {
    /// The smallest set of effects, and the model of the noise that it was found with.
    pub fn best_set(&self) -> (FitModel<'a>, ScoredEffectSet) {
        let fitted = self.library.fitted();
        let (model, scored) = self.searched(&fitted);
        let scored = exchanged(&model, scored, &fitted);
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
        let found_noise = found_noise(prepared, &residual);
        let reportable = reportable_effects(
            &model,
            &scored.fit.set,
            &Observations {
                digital,
                units: *units,
                found_noise,
                is_white: is_white(prepared, &residual),
            },
            self.library,
        );
        let nominal = excess(&model, &score(&model, EffectSet::new()).fit);
        let is_mostly_explained = excess(&model, &scored.fit) < MOSTLY_EXPLAINED * nominal;
        Findings {
            model,
            scored,
            digital: *digital,
            found_noise,
            reportable,
            kept: None,
            library: self.library.clone(),
            unknown: None,
            is_mostly_explained,
        }
    }

    /// The first search, a smoothing of the reference where one is believed, and rounds of search,
    /// each with the noise that the one before leaves.
    fn searched(&self, fitted: &[EffectKind]) -> (FitModel<'a>, ScoredEffectSet) {
        let Session {
            prepared,
            starts,
            digital,
            units,
            track,
            ..
        } = self.session;
        let mut model = first_model(
            prepared,
            track.clone(),
            &starts[0],
            digital,
            *units,
            self.library,
        );
        let mut scored = search(&model, starts, fitted, MOST_AT_FIRST);
        trace_scored("first", &scored);
        if self.library.allows_read_off(ReadOff::ReferenceSpectrum) {
            (model, scored) = try_smoothing(model, scored, starts, fitted);
        }
        for round in 0..ROUNDS {
            model = with_updated_noise(&model, &scored, digital, self.library);
            let before = scored.fit.set.clone();
            scored = search(&model, std::slice::from_ref(&before), fitted, MOST);
            trace_scored(&format!("round {round}"), &scored);
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
    let covariance = found.fit.linear.covariance;
    findings.scored = ScoredEffectSet {
        margins,
        ..score_as_it_is(&findings.model, found.fit.set)
    };
    findings.scored.fit.linear.covariance = covariance;
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
