//! The recordings of one placement, analysed alone or together.

use cromosim_imu::{Effect, EffectKind, EffectSet, Owner};

use crate::analysis::{Analysis, refit_beside_unknown};
use crate::calibration::{keep_calibrations, model_of};
use crate::findings::Findings;
use crate::fit::{Fit, FitModel};
use crate::gauss_newton::fit_together;
use crate::joint_search::{owned_by, search_together};
use crate::library::{Library, without_all};
use crate::policy::search::FIT_STEPS;
use crate::progress::{ALONE, JUDGEMENT, Progress, SEARCH, TOGETHER};
use crate::screen::sharpen_change_point;
use crate::session::Session;
use crate::unknown::{Rest, Suspects, detect_unmodelled_structure};

/// What was found in each recording.
pub(crate) fn analysed<'a>(
    sessions: &'a [Session],
    library: &'a Library,
    progress: &Progress,
) -> Vec<Findings<'a>> {
    let searching = progress.part(&SEARCH);
    let alone = if sessions.len() == 1 {
        searching.clone()
    } else {
        searching.part(&ALONE)
    };
    let analyses: Vec<Analysis<'a>> = sessions
        .iter()
        .enumerate()
        .map(|(index, session)| Analysis {
            session,
            library,
            progress: alone.one_of(index, sessions.len()),
        })
        .collect();
    let (models, found): (Vec<_>, Vec<_>) = analyses.iter().map(Analysis::best_set).unzip();
    let best = search_together(&models, &found, &searching.part(&TOGETHER));
    let mut findings: Vec<Findings> = analyses
        .iter()
        .zip(models.into_iter().zip(best))
        .map(|(analysis, (model, scored))| analysis.findings(model, scored))
        .collect();
    agree_on_device(&mut findings);
    judge_rest(&mut findings, &progress.part(&JUDGEMENT));
    for one in &mut findings {
        one.scored.fit.linear.covariance = one
            .model
            .covariance_by_blocks(&one.scored.fit, &one.reportable);
    }
    if let [alone] = findings.as_mut_slice() {
        refit_beside_unknown(alone);
    }
    progress.reached(JUDGEMENT.end);
    keep_calibrations(&mut findings);
    progress.reached(1.0);
    findings
}

/// Whether so many of all recordings speak for the device.
fn is_enough(count: usize, all: usize) -> bool {
    count > 0 && 2 * count >= all
}

/// What is said of the device is said of all its recordings or of none: what half of them show. A
/// value that is read off is the median of theirs.
fn agree_on_device(findings: &mut [Findings]) {
    let kinds = EffectKind::ALL.into_iter();
    for kind in kinds.filter(|kind| kind.spec().owner == Owner::Device) {
        let reported: Vec<Effect> = findings
            .iter()
            .filter_map(|one| one.reportable.get(kind).cloned())
            .collect();
        let agreed = is_enough(reported.len(), findings.len())
            .then(|| median_effect(&reported))
            .flatten();
        for one in findings.iter_mut() {
            match &agreed {
                Some(effect) => {
                    one.reportable.insert(effect.clone());
                }
                None => {
                    one.reportable.remove(kind);
                }
            }
        }
    }
}

/// The effect whose first value is the median; fitted ones of a device are all the same.
fn median_effect(effects: &[Effect]) -> Option<Effect> {
    let mut sorted: Vec<&Effect> = effects.iter().collect();
    sorted.sort_by(|a, b| {
        let first = |effect: &Effect| effect.values().first().copied().unwrap_or_default();
        first(a).total_cmp(&first(b))
    });
    sorted
        .get(effects.len() / 2)
        .map(|effect| Effect::clone(effect))
}

/// Looks for what no named effect explains, and takes out what only passes for it. Half of the
/// recordings have to show it.
fn judge_rest(findings: &mut [Findings], progress: &Progress) {
    let passes = [Suspects::Others, Suspects::All];
    let is_alone = findings.len() == 1;
    let mut known: Option<Rest> = None;
    for (index, suspects) in passes.into_iter().enumerate() {
        for one in findings.iter_mut() {
            let mut rest = known.take().unwrap_or_else(|| Rest::of(one));
            one.is_loud = rest.is_loud(&one.model);
            one.unknown = detect_unmodelled_structure(one, &mut rest, suspects);
            // Those of several recordings would fill much memory.
            known = is_alone.then_some(rest);
        }
        let count = findings.iter().filter(|one| one.unknown.is_some()).count();
        if !is_enough(count, findings.len()) {
            findings.iter_mut().for_each(|one| one.unknown = None);
            return;
        }
        if let Some(sets) = without_confounded_effects(findings) {
            known = None;
            refit(findings, sets);
        }
        progress.one_of(index, passes.len()).reached(1.0);
    }
}

/// Takes out the effects that only pass for what is unknown (of the device's, in half of the
/// recordings); the sets that are to be fitted then, where there were any in the fits.
fn without_confounded_effects(findings: &mut [Findings]) -> Option<Vec<EffectSet>> {
    let suspected: Vec<Vec<EffectKind>> = findings
        .iter()
        .map(|one| {
            let unknown = one.unknown.as_ref();
            unknown.map_or_else(Vec::new, |unknown| unknown.confounded_effects.clone())
        })
        .collect();
    let is_out = |session: usize, kind: EffectKind| match kind.spec().owner {
        Owner::Session => suspected[session].contains(&kind),
        Owner::Device => {
            let count = suspected.iter().filter(|own| own.contains(&kind)).count();
            is_enough(count, suspected.len())
        }
    };
    let mut sets = Vec::new();
    for (session, one) in findings.iter_mut().enumerate() {
        let out: Vec<EffectKind> = EffectKind::ALL
            .into_iter()
            .filter(|kind| is_out(session, *kind))
            .collect();
        one.reportable = without_all(&one.reportable, &out);
        let members = one.scored.fit.set.iter().map(|effect| effect.kind());
        one.struck.extend(members.filter(|kind| out.contains(kind)));
        sets.push(without_all(&one.scored.fit.set, &out));
    }
    let mut pairs = findings.iter().zip(&sets);
    let changed = pairs.any(|(one, set)| one.scored.fit.set != *set);
    changed.then_some(sets)
}

/// Fits other sets to all recordings.
fn refit(findings: &mut [Findings], sets: Vec<EffectSet>) {
    let models: Vec<&FitModel> = findings.iter().map(|one| &one.model).collect();
    let mut fits = fit_together(&models, sets, FIT_STEPS, |_| true);
    if let [model] = models[..] {
        fits = vec![sharpen_change_point(model, fits.swap_remove(0))];
    }
    for (one, fit) in findings.iter_mut().zip(fits) {
        one.scored.fit = fit;
        one.take_fitted_values();
    }
}

/// What is reported of one recording where the device's values are those that all the others show:
/// its session's values are fitted to it.
pub(crate) fn reported_by_the_others(findings: &[Findings], index: usize) -> EffectSet {
    let own = &findings[index];
    let others: Vec<&Findings> = [&findings[..index], &findings[index + 1..]]
        .into_iter()
        .flatten()
        .collect();
    let models: Vec<&FitModel> = others.iter().map(|one| &one.model).collect();
    let sets = others.iter().map(|one| one.scored.fit.set.clone());
    let of_others = fit_together(&models, sets.collect(), FIT_STEPS, |_| true);
    let set = with_device_of(&of_others, own.scored.fit.set.clone());
    let fits = fit_together(&[&own.model], vec![set], FIT_STEPS, is_of_session);
    let mut reported = own.reportable.clone();
    for fit in &fits {
        reported.take_values_of(&fit.set);
    }
    if let Some(kept) = kept_by_the_others(own, &others, &of_others, &reported) {
        reported.extend(&kept);
    }
    reported
}

/// What a simulation of one recording takes over beside what is reported of it, in the same way.
fn kept_by_the_others(
    own: &Findings,
    others: &[&Findings],
    of_others: &[Fit],
    reported: &EffectSet,
) -> Option<EffectSet> {
    let kept = own.kept.as_ref()?;
    let is_free = |kind: EffectKind| kept.moves(kind);
    let models: Vec<FitModel> = others.iter().map(|one| model_of(one)).collect();
    let models: Vec<&FitModel> = models.iter().collect();
    let set_of_other = |(one, fit): (&&Findings, &Fit)| {
        let mut set = one.kept.as_ref()?.set.clone();
        set.take_values_of(&fit.set);
        Some(set)
    };
    let sets: Option<Vec<EffectSet>> = others.iter().zip(of_others).map(set_of_other).collect();
    let kept_of_others = fit_together(&models, sets?, FIT_STEPS, is_free);
    let mut set = kept.set.clone();
    set.take_values_of(reported);
    let set = with_device_of(&kept_of_others, set);
    let is_free = |kind: EffectKind| is_free(kind) && is_of_session(kind);
    let fits = fit_together(&[&model_of(own)], vec![set], FIT_STEPS, is_free);
    fits.into_iter().next().map(|fit| fit.set)
}

/// A set with the device's effects of fits to other recordings.
fn with_device_of(fits: &[Fit], mut set: EffectSet) -> EffectSet {
    for fit in fits {
        set.extend(&owned_by(Owner::Device, &fit.set));
    }
    set
}

fn is_of_session(kind: EffectKind) -> bool {
    kind.spec().owner == Owner::Session
}
