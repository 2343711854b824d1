//! The smallest set of effects for several recordings of one device: what is the device's is the same
//! in all of them, what is a session's is each recording's own.

use std::collections::BTreeSet;

use cromosim_imu::{Effect, EffectKind, EffectSet, Owner};

use crate::fit::{Fit, FitModel};
use crate::gauss_newton::fit_together;
use crate::plausibility::is_sound;
use crate::policy::price::LEAST_SHARE;
use crate::policy::search::{FIT_STEPS, MOST_RISE};
use crate::progress::Progress;
use crate::search::{ScoredEffectSet, excess, price_of_effect, rises};
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
    progress: &Progress,
) -> Vec<ScoredEffectSet> {
    let search = JointSearch {
        models: models.iter().collect(),
    };
    if let [alone] = found {
        return vec![alone.clone()];
    }
    let pruned_with = |device: &EffectSet| {
        let with_own = |found: &ScoredEffectSet| {
            let mut set = owned_by(Owner::Session, &found.fit.set);
            set.extend(device);
            set
        };
        search.pruned(search.scored(found.iter().map(with_own).collect()))
    };
    let mut devices: Vec<EffectSet> = vec![of_device_in_any(found)];
    let (mut best, mut margins) = pruned_with(&devices[0]);
    let steps = found.len() + 2;
    progress.one_of(0, steps).reached(1.0);
    for (index, found) in found.iter().enumerate() {
        let alone = owned_by(Owner::Device, &found.fit.set);
        if devices.iter().all(|other| names(other) != names(&alone)) {
            let other = pruned_with(&alone);
            if other.0.score >= best.score {
                (best, margins) = other;
            }
            devices.push(alone);
        }
        progress.one_of(index + 1, steps).reached(1.0);
    }
    if let Some(better) = search.with_effects_of_other_sessions(&best) {
        (best, margins) = search.pruned(better);
    }
    progress.reached(1.0);
    let with_margins = |(session, fit): (usize, Fit)| ScoredEffectSet {
        margins: margins
            .iter()
            .filter_map(|(member, margin)| match *member {
                Member::Device(kind) => Some((kind, *margin)),
                Member::Session(own, kind) => (own == session).then_some((kind, *margin)),
            })
            .collect(),
        ..ScoredEffectSet::new(fit, best.score)
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
            let does_harm =
                |smaller: &JointFit| rises(&self.models, &smaller.fits, &now.fits, MOST_RISE);
            let best = smaller
                .iter()
                .enumerate()
                .max_by(|a, b| a.1.score.total_cmp(&b.1.score));
            let worst_member = best
                .filter(|(_, best)| best.score >= now.score)
                .map(|(index, _)| index)
                .or_else(|| smaller.iter().position(does_harm));
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

    /// What one session shows of its own may be in the others too, too weak to be found there alone;
    /// none where nothing is gained.
    fn with_effects_of_other_sessions(&self, now: &JointFit) -> Option<JointFit> {
        let mut better: Option<JointFit> = None;
        loop {
            let now = better.as_ref().unwrap_or(now);
            let pairs = self.models.iter().zip(&now.fits);
            let left: f64 = pairs.map(|(model, fit)| excess(model, fit)).sum();
            let best = self
                .grown(now)
                .max_by(|a, b| a.score.total_cmp(&b.score))
                .filter(|best| best.score > now.score + LEAST_SHARE * left);
            match best {
                Some(best) => better = Some(best),
                None => return better,
            }
        }
    }

    /// The sets with one more effect in one session, of the kinds that other sessions have.
    fn grown(&self, now: &JointFit) -> impl Iterator<Item = JointFit> {
        let kinds: BTreeSet<EffectKind> = members(&now.fits)
            .into_iter()
            .filter_map(|member| match member {
                Member::Device(_) => None,
                Member::Session(_, kind) => Some(kind),
            })
            .collect();
        let sessions = 0..self.models.len();
        let places = sessions.flat_map(move |session| {
            let kinds = kinds.clone().into_iter();
            kinds.map(move |kind| (session, kind))
        });
        places
            .filter(|(session, kind)| !now.fits[*session].set.contains(*kind))
            .map(|(session, kind)| {
                let mut sets: Vec<EffectSet> = now.fits.iter().map(|fit| fit.set.clone()).collect();
                sets[session].insert(Effect::neutral(kind));
                self.scored(sets)
            })
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

/// The effects of a set that are the device's, or the session's.
pub(crate) fn owned_by(owner: Owner, set: &EffectSet) -> EffectSet {
    set.filtered(|effect| effect.kind().spec().owner == owner)
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
