//! The search for the smallest set of effects.

use cromosim_imu::{Channel, EffectKind, EffectSet, PerChannel, Search};

use crate::axes::{larger, sum_over_channels};
use crate::fit::{Evaluated, Fit, FitModel, free_values};
use crate::plausibility::{is_sound, may_be_told, plausible_members};
use crate::policy::price;
use crate::policy::search::{
    BEAM, EXCHANGES, FAR_BEHIND, FAR_LOWER, MOST_LOSS_NATS, MOST_MEMBERS, MOST_RISE,
    NEAR_BEST_NATS, PART_OF_BEST_PREDICTION, PART_OF_LOSS_AT_A_DISTANCE, REFITS, RIVALS,
    SURE_PRICES,
};
use crate::screen::{Beside, Candidate, Substitutes, screen, sharpen_change_point, starts_neutral};
use crate::trace::{names, trace};

/// A fitted set and its worth.
#[derive(Clone, Debug)]
pub(crate) struct ScoredEffectSet {
    pub fit: Fit,
    /// Held-out log-likelihood less the price of the effects.
    pub score: f64,
    /// By how much each member beats the best set without it, nats.
    pub margins: Vec<(EffectKind, f64)>,
    /// What the library looks like beside it, where a search ended with that.
    pub screened: Vec<Beside>,
}

impl ScoredEffectSet {
    pub fn new(fit: Fit, score: f64) -> Self {
        Self {
            fit,
            score,
            margins: Vec::new(),
            screened: Vec::new(),
        }
    }
}

/// What a set costs.
fn price_of(model: &FitModel, set: &EffectSet) -> f64 {
    set.iter()
        .map(|effect| price_of_effect(model, effect.kind()))
        .sum()
}

/// What an effect costs. Coarse rounding and a smoothing whose shape is only guessed leave errors
/// that are no white noise, and are fitted by many effects: everything costs more.
pub(crate) fn price_of_effect(model: &FitModel, kind: EffectKind) -> f64 {
    let steps = larger(model.basis.steps);
    let factor = (1.0 + steps / price::DOUBLING_STEPS)
        * if model.basis.undone_smoothing.is_some() {
            price::UNDONE_SMOOTHING_FACTOR
        } else {
            1.0
        };
    match kind.spec().search {
        Search::Choice => price::EFFECT_NATS + price::CHOICE_NATS,
        Search::Fitted(_) | Search::ReadOff(_) | Search::Given => {
            let values = free_values(kind).len() as f64;
            factor * (price::EFFECT_NATS + price::VALUE_NATS * values)
        }
    }
}

/// The fitted set and its worth; what no such effect looks like is worth nothing, wherever it comes
/// from.
pub(crate) fn score(model: &FitModel, set: EffectSet) -> ScoredEffectSet {
    score_from(model, model.evaluated(set))
}

fn score_from(model: &FitModel, start: Evaluated) -> ScoredEffectSet {
    let fit = sharpen_change_point(model, model.fit_from(start));
    of_fit(model, fit)
}

/// A fit without one of its effects.
pub(crate) fn score_without(model: &FitModel, fit: &Fit, kind: EffectKind) -> ScoredEffectSet {
    let rest = fit.set.without(kind);
    if !starts_neutral(kind) {
        return score(model, rest);
    }
    // Far from the neutral values a step from the values that the others have may be the shorter way.
    let [moved, rest] = [fit.set_without(kind), rest].map(|set| model.evaluated(set));
    // The series of the other one fill much memory.
    let start = if moved.cost < rest.cost {
        drop(rest);
        moved
    } else {
        drop(moved);
        rest
    };
    score_from(model, start)
}

/// [`score`] after at most so many steps.
pub(crate) fn score_after(model: &FitModel, set: EffectSet, steps: usize) -> ScoredEffectSet {
    of_fit(model, model.fit_steps(set, steps))
}

fn of_fit(model: &FitModel, fit: Fit) -> ScoredEffectSet {
    let score = if is_sound(model, &fit) {
        fit.linear.held_out - price_of(model, &fit.set)
    } else {
        f64::NEG_INFINITY
    };
    ScoredEffectSet::new(fit, score)
}

/// A set with the values that it has.
pub(crate) fn score_as_it_is(model: &FitModel, set: EffectSet) -> ScoredEffectSet {
    let fit = model.fit_steps(set, 0);
    let score = fit.linear.held_out - price_of(model, &fit.set);
    ScoredEffectSet::new(fit, score)
}

/// Log-likelihood that is still to be gained: of the held-out residual down to noise alone.
pub(crate) fn excess(model: &FitModel, fit: &Fit) -> f64 {
    let noise = sum_over_channels(|channel| -0.5 * model.whitener.count[channel]);
    (noise - fit.linear.held_out).max(0.0)
}

/// Grows and prunes from several starting sets; adds at most so many effects.
pub(crate) fn search(
    model: &FitModel,
    starts: &[EffectSet],
    library: &[EffectKind],
    most: usize,
) -> ScoredEffectSet {
    searched(model, starts, library, most, |_| false)
}

/// As [`search`], but adds no more to what leaves no more than noise: for a search that another one follows, with
/// the noise that this one leaves.
pub(crate) fn search_down_to_noise(
    model: &FitModel,
    starts: &[EffectSet],
    library: &[EffectKind],
    most: usize,
) -> ScoredEffectSet {
    let is_noise = |fit: &Fit| larger(fit.held_out_ratio()) <= 1.0;
    searched(model, starts, library, most, is_noise)
}

fn searched(
    model: &FitModel,
    starts: &[EffectSet],
    library: &[EffectKind],
    most: usize,
    is_enough: impl Fn(&Fit) -> bool,
) -> ScoredEffectSet {
    let mut beam: Vec<ScoredEffectSet> =
        starts.iter().map(|set| score(model, set.clone())).collect();
    sort(&mut beam);
    beam.dedup_by(|a, b| names(&a.fit.set) == names(&b.fit.set));
    let mut best = pruned(model, beam[0].clone());
    beam[0] = best.clone();
    for grown_before in 0..most {
        if best.fit.set.len() >= MOST_MEMBERS {
            break;
        }
        let mut grown_sets: Vec<ScoredEffectSet> = Vec::new();
        // One after the other is let go: the series of a fit fill much memory. The best comes first.
        let far_behind = FAR_BEHIND * excess(model, &best.fit);
        for (place, scored) in beam.into_iter().enumerate() {
            if grown_before > 0 && best.score - scored.score > far_behind {
                trace(|| eprintln!("  far behind: {:?}", names(&scored.fit.set)));
                continue;
            }
            let screened = grow(model, &scored, library, &mut grown_sets);
            if place == 0 {
                best.screened = screened;
            }
        }
        trace_grown(&grown_sets);
        let Some(first) = grown_sets.first() else {
            break;
        };
        let needed = price::LEAST_SHARE * excess(model, &best.fit);
        if first.score < best.score + needed {
            break;
        }
        best = pruned(model, first.clone());
        if is_enough(&best.fit) {
            break;
        }
        grown_sets[0] = best.clone();
        beam = grown_sets;
    }
    best
}

/// Candidates beside a set, each with its predicted score, the best first.
fn candidates(model: &FitModel, fit: &Fit, library: &[EffectKind]) -> Vec<(f64, Candidate)> {
    let mut candidates: Vec<_> = library
        .iter()
        .filter(|kind| fit.set.get(**kind).is_none() && may_be_told(model, **kind))
        .flat_map(|kind| screen(model, fit, *kind, library))
        .map(|candidate| {
            (
                candidate.predicted_gain - price_of(model, &candidate.set),
                candidate,
            )
        })
        .collect();
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    candidates
}

/// The set with one more effect, for the candidates that promise most. Only the best of all are kept
/// in `grown_sets`: the series of a fit fill much memory. What the library looks like beside the set.
fn grow(
    model: &FitModel,
    scored: &ScoredEffectSet,
    library: &[EffectKind],
    grown_sets: &mut Vec<ScoredEffectSet>,
) -> Vec<Beside> {
    let candidates = candidates(model, &scored.fit, library);
    trace(|| {
        let list: Vec<String> = candidates
            .iter()
            .take(6)
            .map(|(predicted, candidate)| {
                format!(
                    "{:?}:{:.0}",
                    names(&candidate.set),
                    predicted - scored.score
                )
            })
            .collect();
        eprintln!("  screen {:?}: {}", names(&scored.fit.set), list.join(" "));
    });
    let needed = |best: f64| {
        (PART_OF_BEST_PREDICTION * best)
            .min(best - NEAR_BEST_NATS)
            .max(-MOST_LOSS_NATS)
    };
    let mut screened = Vec::new();
    // The best of those that are what they look like: a steady motion, of which a vibration would explain most, hides no delay.
    let mut best = None;
    let mut tried = 0;
    for (predicted, mut candidate) in candidates {
        screened.extend(candidate.beside.take());
        let gain = predicted - scored.score;
        if tried >= REFITS || gain <= needed(*best.get_or_insert(gain)) {
            continue;
        }
        let grown = grown_to(model, candidate.begin(model), &scored.fit.set);
        let is_possible = grown.score > f64::NEG_INFINITY;
        if is_possible {
            grown_sets.push(grown);
            sort(grown_sets);
            grown_sets.dedup_by(|a, b| names(&a.fit.set) == names(&b.fit.set));
            grown_sets.truncate(BEAM);
        }
        if is_possible || tried > 0 {
            tried += 1;
        } else {
            best = None;
        }
    }
    screened
}

/// A set that has grown from another, without what lost its sense beside the new effect: a member may have stood
/// for that one, as a filter does for a drift that blurs.
fn grown_to(model: &FitModel, set: EffectSet, from: &EffectSet) -> ScoredEffectSet {
    let grown = score(model, set);
    let rest = plausible_members(&grown.fit.set);
    if rest == grown.fit.set || names(&rest) == names(from) {
        return grown;
    }
    score(model, rest)
}

/// Whether an effect earns its place by so much that no fit without it is needed to see it: one
/// linear step from its values to the neutral ones tells, where it begins at these.
fn surely_earns_its_place(model: &FitModel, fit: &Fit, kind: EffectKind) -> bool {
    starts_neutral(kind) && {
        let loss = fit.linear.held_out - fit.held_out_without(kind);
        loss > SURE_PRICES * price_of_effect(model, kind)
    }
}

/// Without the effects that do not earn their place beside the others.
fn pruned(model: &FitModel, mut scored: ScoredEffectSet) -> ScoredEffectSet {
    loop {
        let smaller = scored
            .fit
            .set
            .iter()
            .filter(|effect| !surely_earns_its_place(model, &scored.fit, effect.kind()))
            .map(|effect| score_without(model, &scored.fit, effect.kind()));
        let Some(best) = smaller.max_by(|a, b| a.score.total_cmp(&b.score)) else {
            return scored;
        };
        if best.score < scored.score {
            return scored;
        }
        scored = best;
    }
}

/// Tries every member against every effect outside, and leaves out members that make a channel worse
/// in the end; by how much each member beats the best set without it.
pub(crate) fn exchanged(
    model: &FitModel,
    mut scored: ScoredEffectSet,
    library: &[EffectKind],
) -> ScoredEffectSet {
    for _ in 0..EXCHANGES {
        let members: Vec<EffectKind> = scored.fit.set.iter().map(|effect| effect.kind()).collect();
        let mut best: Option<ScoredEffectSet> = None;
        let mut without_harm: Option<ScoredEffectSet> = None;
        scored.margins.clear();
        let kept = scored.clone();
        let substitutes = match &kept.screened[..] {
            [] => Substitutes::new(model, &kept.fit, library),
            screened => Substitutes::of_screen(&kept.fit, screened),
        };
        for kind in members {
            let smaller = score_without(model, &scored.fit, kind);
            let rival = best_rival(model, &scored, &smaller, kind, library, &substitutes);
            let rival_score = rival
                .as_ref()
                .map_or(smaller.score, |rival| rival.score.max(smaller.score));
            scored.margins.push((kind, scored.score - rival_score));
            let best_score = best.as_ref().map_or(scored.score, |best| best.score);
            best = rival.filter(|rival| rival.score > best_score).or(best);
            // Beside a better one it is not looked at; the series of a fit fill much memory.
            if best.is_some() {
                without_harm = None;
            } else if does_harm(model, kind, &smaller.fit, &scored.fit) {
                without_harm = without_harm
                    .filter(|other| other.score >= smaller.score)
                    .or(Some(smaller));
            }
        }
        match (best, without_harm) {
            (Some(better), _) => scored = pruned(model, better),
            // What it gained is not looked for elsewhere: the next best would stand in as well.
            (None, Some(smaller)) => {
                let margins = std::mem::take(&mut scored.margins);
                return ScoredEffectSet { margins, ..smaller };
            }
            (None, None) => break,
        }
    }
    scored
}

/// The best of the sets in which another effect stands in the place of one member, and leaves neither
/// channel worse off.
fn best_rival(
    model: &FitModel,
    scored: &ScoredEffectSet,
    smaller: &ScoredEffectSet,
    member: EffectKind,
    library: &[EffectKind],
    substitutes: &Substitutes,
) -> Option<ScoredEffectSet> {
    let price = |kind| price_of_effect(model, kind);
    // By the same linear step as the substitutes' gains.
    let loss = scored.fit.linear.held_out - scored.fit.held_out_without(member) - price(member);
    let may_stand_in = |other: EffectKind| {
        let gain = substitutes.gain(member, other, price);
        gain.is_none_or(|gain| gain >= PART_OF_LOSS_AT_A_DISTANCE * loss)
    };
    let others: Vec<EffectKind> = library
        .iter()
        .copied()
        .filter(|other| *other != member && may_stand_in(*other))
        .collect();
    let needed = smaller.score + PART_OF_BEST_PREDICTION * (scored.score - smaller.score);
    candidates(model, &smaller.fit, &others)
        .into_iter()
        .take(RIVALS)
        .filter(|(predicted, _)| *predicted >= needed)
        .map(|(_, candidate)| score(model, candidate.begin(model)))
        .filter(|rival| !makes_worse(model, &scored.fit, &rival.fit))
        .max_by(|a, b| a.score.total_cmp(&b.score))
}

/// Whether a channel's residual rises where a member is added. What far lowers all the channels that it acts on is not to
/// blame for another, in which it is the other members that give way.
fn does_harm(model: &FitModel, kind: EffectKind, without: &Fit, with: &Fit) -> bool {
    let norms = |fit: &Fit| model.prepared.residual_norms(&fit.prediction.readings);
    let (before, after) = (norms(without), norms(with));
    let far_lowers = |channel: &Channel| after[*channel] < FAR_LOWER * before[*channel];
    makes_worse(model, without, with) && !kind.spec().channels.iter().all(far_lowers)
}

/// Whether a channel's residual rises from one fit to another.
fn makes_worse(model: &FitModel, from: &Fit, to: &Fit) -> bool {
    let [from, to] = [from, to].map(std::slice::from_ref);
    rises(&[model], from, to, MOST_RISE)
}

/// Whether the norm of a channel's residual, over all recordings, rises by more than a factor from some
/// fits to others.
pub(crate) fn rises(models: &[&FitModel], from: &[Fit], to: &[Fit], most: f64) -> bool {
    let squares = |fits: &[Fit]| {
        let pairs = models.iter().zip(fits);
        pairs.fold(PerChannel::<f64>::default(), |sum, (model, fit)| {
            let norms = model.prepared.residual_norms(&fit.prediction.readings);
            PerChannel::from_fn(|channel| sum[channel] + norms[channel].powi(2))
        })
    };
    let (before, after) = (squares(from), squares(to));
    Channel::ALL
        .into_iter()
        .any(|channel| after[channel] > most.powi(2) * before[channel])
}

fn sort(scored_sets: &mut [ScoredEffectSet]) {
    scored_sets.sort_by(|a, b| b.score.total_cmp(&a.score));
}

fn trace_grown(grown: &[ScoredEffectSet]) {
    trace(|| {
        for scored in grown {
            eprintln!(
                "  grown {:?} score {:.1} ratio {:.2?}",
                names(&scored.fit.set),
                scored.score,
                scored.fit.held_out_ratio()
            );
        }
    });
}
