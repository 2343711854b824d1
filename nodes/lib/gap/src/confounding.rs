//! Which fitted effects only pass for something unknown.

use std::collections::BTreeMap;

use cromosim_imu::{Channel, Dependence, EffectKind, EffectSet, Kept, Search};

use crate::findings::Findings;
use crate::policy::confounded::{
    ALL_BUT_LITTLE, CHANGES_OVER_TIME, MAIN_PART, NEARLY_ALL, OWN_GAIN, REGRESSIONS, STRONG_PART,
};
use crate::residual_regressions::{ResidualRegression, with_regressions};
use crate::search::{score, score_without};
use crate::trace::trace;

/// What becomes of a fitted effect beside something unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// Only passes for it.
    Confounded,
    /// Stands beside it.
    Sound,
    /// Neither is certain.
    Open,
}

/// Of the members of a fitted set.
pub(crate) type Standings = BTreeMap<EffectKind, Standing>;

/// The suspects among the fitted effects that are confounded with what the strongest regressions
/// describe, and the special cases of these. `strong` are those of `all` that tell, the strongest
/// first. What is known of members is not judged anew, and what is judged becomes known. Where little is explained, all
/// that are named: what explains it is rather the part of the unknown that the library can follow.
pub(crate) fn confounded_effects(
    findings: &Findings,
    strong: &[&ResidualRegression],
    all: &[ResidualRegression],
    is_suspect: impl Fn(EffectKind) -> bool,
    known: &mut Standings,
) -> Vec<EffectKind> {
    let members = findings.scored.fit.set.iter().map(|effect| effect.kind());
    let suspects: Vec<EffectKind> = members.filter(|kind| is_suspect(*kind)).collect();
    if findings.is_hardly_explained {
        let is_named = |kind: &EffectKind| findings.reportable.contains(*kind);
        return suspects.into_iter().filter(is_named).collect();
    }
    judge_members(findings, strong, &suspects, known);
    let is = |kind: &EffectKind, standing| known.get(kind) == Some(&standing);
    let mut confounded = suspects;
    confounded.retain(|kind| is(kind, Standing::Confounded));
    let most = strong.first().map_or(0.0, |regression| regression.gain);
    for regression in strong.iter().filter(|regression| {
        regression.gain > STRONG_PART * most && changes_over_time(regression, all)
    }) {
        let cases = special_cases(regression);
        confounded.extend(cases.filter(|kind| is_suspect(*kind) && !is(kind, Standing::Sound)));
    }
    confounded
}

/// Whether an effect is one that every sensor has to be calibrated for.
pub(crate) fn is_calibration(kind: EffectKind) -> bool {
    matches!(kind.spec().search, Search::Fitted(search) if search.kept == Kept::AsCalibration)
}

/// Whether a family over time says more than the same without time.
fn changes_over_time(regression: &ResidualRegression, all: &[ResidualRegression]) -> bool {
    let steady = match regression.dependence {
        Dependence::DelayOverTime => Dependence::RateOfChange,
        Dependence::MountOverTime => Dependence::OtherAxes,
        _ => return true,
    };
    let other = all
        .iter()
        .find(|other| other.channel == regression.channel && other.dependence == steady);
    other.is_none_or(|other| regression.gain > CHANGES_OVER_TIME * other.gain)
}

/// Effects that are special cases of what the residual depends on: they say no more than it does.
fn special_cases(regression: &ResidualRegression) -> impl Iterator<Item = EffectKind> + use<> {
    let (dependence, channel) = (regression.dependence, regression.channel);
    EffectKind::ALL
        .into_iter()
        .filter(move |kind| match kind.spec().search {
            Search::Fitted(search) => {
                search.special_case_of.contains(&dependence)
                    && kind.spec().channels.contains(&channel)
            }
            Search::Choice | Search::ReadOff(_) | Search::Given => false,
        })
}

/// Judges those of some members of which nothing is known: those which beside the strongest
/// regressions gain less than a tenth of what they gain without them are confounded, those that
/// explain nearly all that the regressions in their place would are sound.
fn judge_members(
    findings: &Findings,
    strong: &[&ResidualRegression],
    members: &[EffectKind],
    known: &mut Standings,
) {
    let (model, fit) = (&findings.model, &findings.scored.fit);
    let chosen: Vec<&Vec<Vec<f64>>> = Channel::ALL
        .into_iter()
        .flat_map(|channel| {
            strong
                .iter()
                .filter(move |regression| {
                    regression.channel == channel
                        && regression.dependence != Dependence::RateOfChange
                })
                .take(REGRESSIONS)
        })
        .map(|regression| &regression.columns)
        .collect();
    let open = members.iter().copied();
    let open: Vec<EffectKind> = open.filter(|kind| !known.contains_key(kind)).collect();
    if chosen.is_empty() || open.is_empty() {
        return;
    }
    let together = with_regressions(model, fit, &chosen).held_out;
    let nominal = score(model, EffectSet::new());
    let explained = together - nominal.fit.linear.held_out;
    for kind in open {
        let smaller = score_without(model, fit, kind);
        let instead = with_regressions(model, &smaller.fit, &chosen).held_out;
        let alone = fit.linear.held_out - smaller.fit.linear.held_out;
        let gain_of_regressions = instead - smaller.fit.linear.held_out;
        trace(|| {
            eprintln!(
                "   member {} alone {alone:.0}, regressions instead {gain_of_regressions:.0}, beside {:.0} of {explained:.0}",
                kind.name(),
                together - instead
            )
        });
        let needed = if is_calibration(kind) {
            NEARLY_ALL
        } else {
            ALL_BUT_LITTLE
        };
        let standing = if findings.is_mostly_explained && alone > needed * gain_of_regressions {
            Standing::Sound
        } else if alone < MAIN_PART * explained && together - instead < OWN_GAIN * alone {
            // What explains much of the gap by itself does not pass for what little is left.
            Standing::Confounded
        } else {
            Standing::Open
        };
        known.insert(kind, standing);
    }
}
