//! The smallest set of effects for several recordings of one device: what is the device's is the same
//! in all of them, what is a session's is each recording's own.

use std::collections::BTreeSet;

use cromosim_imu::{Channel, Effect, EffectKind, EffectSet, Owner, PerChannel};

use crate::fit::{Fit, FitModel};
use crate::gauss_newton::fit_together;
use crate::plausibility::is_sound;
use crate::policy::price::LEAST_SHARE;
use crate::policy::search::{FIT_STEPS, MOST_RISE};
use crate::search::{ScoredEffectSet, excess, price_of_effect};
use crate::trace::{names, trace};

/// A member of the sets of several recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Member {
    /// In all of them.
    Device(EffectKind),
    /// In that of one recording.
    Session(usize, EffectKind),
}

/// Fits of all recordings, and their worth.
#[derive(Clone, Debug)]
struct JointFit {
    fits: Vec<Fit>,
    /// Held-out log-likelihood less the price of the effects.
    score: f64,
}

/// The recordings that are searched together.
struct JointSearch<'j, 'a> {
    models: Vec<&'j FitModel<'a>>,
}

/// The best sets for recordings of which each was searched alone before (`found`): all effects of the
/// device that any of them shows, less those that do not earn their place in all together, and of each
/// session its own. Beside the sets stands by how much each member beats the best sets without it.
pub(crate) fn search_together(
    models: &[FitModel],
    found: &[ScoredEffectSet],
) -> Vec<ScoredEffectSet> {
    let search = JointSearch {
        models: models.iter().collect(),
    };
    let mut devices: Vec<EffectSet> = vec![of_device_in_any(found)];
    for alone in found.iter().map(|found| of_device(&found.fit.set)) {
        if devices.iter().all(|other| names(other) != names(&alone)) {
            devices.push(alone);
        }
    }
    let starts = devices.iter().map(|device| {
        let with_own = |found: &ScoredEffectSet| merged(device, &of_session(&found.fit.set));
        search.scored(found.iter().map(with_own).collect())
    });
    let (mut best, _) = starts
        .map(|start| search.pruned(start))
        .max_by(|a, b| a.0.score.total_cmp(&b.0.score))
        .unwrap_or_else(|| search.pruned(search.scored(vec![EffectSet::new(); models.len()])));
    best = search.with_effects_of_other_sessions(best);
    let (best, margins) = search.pruned(best);
    let with_margins = |(session, fit): (usize, Fit)| ScoredEffectSet {
        fit,
        score: best.score,
        margins: margins
            .iter()
            .filter_map(|(member, margin)| match *member {
                Member::Device(kind) => Some((kind, *margin)),
                Member::Session(own, kind) => (own == session).then_some((kind, *margin)),
            })
            .collect(),
    };
    best.fits
        .iter()
        .cloned()
        .enumerate()
        .map(with_margins)
        .collect()
}

impl JointSearch<'_, '_> {
    /// Fits sets in which the device's effects have the same values.
    fn scored(&self, sets: Vec<EffectSet>) -> JointFit {
        let fits = fit_together(&self.models, sets, FIT_STEPS, |_| true);
        let is_sound = self
            .models
            .iter()
            .zip(&fits)
            .all(|(model, fit)| is_sound(model, fit));
        let held_out: f64 = fits.iter().map(|fit| fit.linear.held_out).sum();
        let score = if is_sound {
            held_out - self.price(&fits)
        } else {
            f64::NEG_INFINITY
        };
        trace(|| {
            let sets: Vec<_> = fits.iter().map(|fit| names(&fit.set)).collect();
            eprintln!("  together {sets:?} score {score:.1}");
        });
        JointFit { fits, score }
    }

    /// What is the device's is paid for once, wherever it costs most.
    fn price(&self, fits: &[Fit]) -> f64 {
        let of_member = |member: &Member| match *member {
            Member::Session(session, kind) => price_of_effect(self.models[session], kind),
            Member::Device(kind) => {
                let prices = self.models.iter().map(|model| price_of_effect(model, kind));
                prices.fold(0.0, f64::max)
            }
        };
        members(fits).iter().map(of_member).sum()
    }

    /// Without the members that do not earn their place, and those that make a channel worse; by how
    /// much each that is left beats the others without it.
    fn pruned(&self, mut now: JointFit) -> (JointFit, Vec<(Member, f64)>) {
        loop {
            let without = |member: &Member| self.scored(sets_without(&now.fits, *member));
            let members = members(&now.fits);
            let smaller: Vec<JointFit> = members.iter().map(without).collect();
            let best = smaller
                .iter()
                .enumerate()
                .max_by(|a, b| a.1.score.total_cmp(&b.1.score));
            let worst_member = best
                .filter(|(_, best)| best.score >= now.score)
                .map(|(index, _)| index)
                .or_else(|| smaller.iter().position(|smaller| self.rises(smaller, &now)));
            match worst_member {
                Some(index) => now = smaller.into_iter().nth(index).unwrap_or(now),
                None => {
                    let margin = |smaller: &JointFit| now.score - smaller.score;
                    let margins = members.into_iter().zip(smaller.iter().map(margin));
                    let margins = margins.collect();
                    return (now, margins);
                }
            }
        }
    }

    /// What one session shows of its own may be in the others too, too weak to be found there alone.
    fn with_effects_of_other_sessions(&self, mut now: JointFit) -> JointFit {
        loop {
            let left: f64 = self
                .models
                .iter()
                .zip(&now.fits)
                .map(|(model, fit)| excess(model, fit))
                .sum();
            let of_sessions: BTreeSet<EffectKind> = members(&now.fits)
                .into_iter()
                .filter_map(|member| match member {
                    Member::Device(_) => None,
                    Member::Session(_, kind) => Some(kind),
                })
                .collect();
            let mut best: Option<JointFit> = None;
            for session in 0..self.models.len() {
                for &kind in &of_sessions {
                    if now.fits[session].set.contains(kind) {
                        continue;
                    }
                    let mut sets: Vec<EffectSet> =
                        now.fits.iter().map(|fit| fit.set.clone()).collect();
                    sets[session].insert(Effect::neutral(kind));
                    let grown = self.scored(sets);
                    if best.as_ref().is_none_or(|best| grown.score > best.score) {
                        best = Some(grown);
                    }
                }
            }
            match best.filter(|best| best.score > now.score + LEAST_SHARE * left) {
                Some(better) => now = better,
                None => return now,
            }
        }
    }

    /// Whether the residual of a channel, over all recordings, rises from one to the other.
    fn rises(&self, from: &JointFit, to: &JointFit) -> bool {
        let squares = |joint: &JointFit| {
            let pairs = self.models.iter().zip(&joint.fits);
            pairs.fold(PerChannel::<f64>::default(), |sum, (model, fit)| {
                let norms = model.prepared.residual_norms(&fit.prediction.readings);
                PerChannel::from_fn(|channel| sum[channel] + norms[channel].powi(2))
            })
        };
        let (before, after) = (squares(from), squares(to));
        Channel::ALL
            .into_iter()
            .any(|channel| after[channel] > MOST_RISE.powi(2) * before[channel])
    }
}

/// The members of the sets, each once.
fn members(fits: &[Fit]) -> BTreeSet<Member> {
    let of = |(session, fit): (usize, &Fit)| -> Vec<Member> {
        fit.set
            .iter()
            .map(|effect| match effect.kind().spec().owner {
                Owner::Device => Member::Device(effect.kind()),
                Owner::Session => Member::Session(session, effect.kind()),
            })
            .collect()
    };
    fits.iter().enumerate().flat_map(of).collect()
}

fn sets_without(fits: &[Fit], member: Member) -> Vec<EffectSet> {
    let of = |(session, fit): (usize, &Fit)| match member {
        Member::Device(kind) => fit.set.without(kind),
        Member::Session(own, kind) if own == session => fit.set.without(kind),
        Member::Session(..) => fit.set.clone(),
    };
    fits.iter().enumerate().map(of).collect()
}

/// The effects of a set that are the device's.
pub(crate) fn of_device(set: &EffectSet) -> EffectSet {
    owned(set, Owner::Device)
}

/// The effects of a set that are the session's.
fn of_session(set: &EffectSet) -> EffectSet {
    owned(set, Owner::Session)
}

fn owned(set: &EffectSet, owner: Owner) -> EffectSet {
    set.iter()
        .filter(|effect| effect.kind().spec().owner == owner)
        .fold(EffectSet::new(), |set, effect| set.with(effect.clone()))
}

/// Both sets; of a kind in both, the effect of `first`.
pub(crate) fn merged(first: &EffectSet, second: &EffectSet) -> EffectSet {
    first
        .iter()
        .fold(second.clone(), |set, effect| set.with(effect.clone()))
}

/// The device's effects of all recordings; of several the one with the largest margin.
fn of_device_in_any(found: &[ScoredEffectSet]) -> EffectSet {
    let mut surest = EffectSet::new();
    for kind in EffectKind::ALL {
        let of = |found: &ScoredEffectSet| {
            let own = found.margins.iter().find(|(other, _)| *other == kind);
            let margin = own.map_or(f64::NEG_INFINITY, |(_, margin)| *margin);
            found
                .fit
                .set
                .get(kind)
                .map(|effect| (margin, effect.clone()))
        };
        let best = found
            .iter()
            .filter_map(of)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, effect)) = best.filter(|_| kind.spec().owner == Owner::Device) {
            surest.insert(effect);
        }
    }
    surest
}
