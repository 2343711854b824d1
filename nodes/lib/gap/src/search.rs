//! The search for the smallest set of effects.

use cromosim_imu::{EffectKind, EffectSet};

use crate::fit::{Context, Fit, free_values};
use crate::screen::FITTED;

/// Sets that are followed at once.
const BEAM: usize = 2;
/// Candidates of each set that are fitted.
const REFITS: usize = 3;
/// What an effect has to gain on held-out data, nats.
const LEAST_GAIN: f64 = 12.0;
/// And for each of its values.
const LEAST_GAIN_PER_VALUE: f64 = 2.0;
/// And as a share of what is still to be explained: what is left of a gap that no effect fits is
/// nibbled at by all.
const LEAST_SHARE: f64 = 0.02;

/// A fitted set and its worth.
#[derive(Clone, Debug)]
pub(crate) struct State {
    pub fit: Fit,
    /// Held-out log-likelihood less the price of the effects.
    pub score: f64,
    /// By how much each member beats the best set without it, nats.
    pub margins: Vec<(EffectKind, f64)>,
}

fn price(set: &EffectSet, coarse: f64) -> f64 {
    set.iter()
        .map(|effect| match effect.kind() {
            // One of 48, one of 3: no values to fit, but a choice.
            EffectKind::AxisConvention | EffectKind::GravityConvention => LEAST_GAIN + 4.0,
            kind => coarse * (LEAST_GAIN + LEAST_GAIN_PER_VALUE * free_values(kind).len() as f64),
        })
        .sum()
}

/// Effects that may be tried: all fitted ones but those that the caller takes out of the library.
pub(crate) fn library(without: &[EffectKind]) -> Vec<EffectKind> {
    FITTED
        .into_iter()
        .filter(|kind| !without.contains(kind))
        .collect()
}

impl Context<'_> {
    /// What a set costs. Coarse rounding and a smoothing whose shape is only guessed leave errors
    /// that are no white noise, and are fitted by many effects: everything costs more.
    fn price(&self, set: &EffectSet) -> f64 {
        let steps = self.basis.steps[0].max(self.basis.steps[1]);
        let coarse = (1.0 + steps / 3.0)
            * if self.basis.undone_hz.is_some() {
                5.0
            } else {
                1.0
            };
        price(set, coarse)
    }

    /// The fitted set and its worth; what no such effect looks like is worth nothing, wherever it
    /// comes from.
    pub fn state(&self, set: EffectSet) -> State {
        let fit = self.sharpen_slip(self.fit(set));
        let sound = plausible(&fit.set) && self.true_vibration(&fit);
        let score = if sound {
            fit.linear.held_out - self.price(&fit.set)
        } else {
            f64::NEG_INFINITY
        };
        State {
            fit,
            score,
            margins: Vec::new(),
        }
    }

    /// A set with the values that it has.
    pub fn state_as_it_is(&self, set: EffectSet) -> State {
        let fit = self.fit_steps(set, 0);
        State {
            score: fit.linear.held_out - self.price(&fit.set),
            fit,
            margins: Vec::new(),
        }
    }

    /// Log-likelihood that is still to be gained: of the held-out residual down to noise alone.
    pub fn excess(&self, fit: &Fit) -> f64 {
        let noise: f64 = (0..2).map(|c| -0.5 * self.whitener.count[c]).sum();
        (noise - fit.linear.held_out).max(0.0)
    }

    /// Grows and prunes from several starting sets.
    pub fn search(&self, starts: &[EffectSet], library: &[EffectKind], most: usize) -> State {
        let mut beam: Vec<State> = starts.iter().map(|set| self.state(set.clone())).collect();
        sort(&mut beam);
        let mut best = self.pruned(beam[0].clone());
        beam[0] = best.clone();
        for _ in 0..most {
            let mut grown: Vec<State> = Vec::new();
            for state in &beam {
                grown.extend(self.grown(state, library));
            }
            sort(&mut grown);
            grown.dedup_by(|a, b| kinds(&a.fit.set) == kinds(&b.fit.set));
            grown.truncate(BEAM);
            debug(|| {
                for state in &grown {
                    eprintln!(
                        "  grown {:?} score {:.1} ratio {:.2?}",
                        kinds(&state.fit.set),
                        state.score,
                        state.fit.held_out_ratio()
                    );
                }
            });
            let Some(first) = grown.first() else { break };
            let needed = LEAST_SHARE * self.excess(&best.fit);
            if first.score < best.score + needed {
                break;
            }
            best = self.pruned(first.clone());
            grown[0] = best.clone();
            beam = grown;
        }
        best
    }

    /// The set with one more effect, for the candidates that promise most.
    fn grown(&self, state: &State, library: &[EffectKind]) -> Vec<State> {
        let mut candidates: Vec<_> = library
            .iter()
            .filter(|kind| state.fit.set.get(**kind).is_none())
            .filter_map(|kind| self.screen(&state.fit, *kind))
            .map(|candidate| (candidate.promise - self.price(&candidate.set), candidate))
            .collect();
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        debug(|| {
            let list: Vec<String> = candidates
                .iter()
                .take(6)
                .map(|(promise, c)| format!("{:?}:{:.0}", kinds(&c.set), promise - state.score))
                .collect();
            eprintln!("  screen {:?}: {}", kinds(&state.fit.set), list.join(" "));
        });
        let best = candidates
            .first()
            .map_or(0.0, |(promise, _)| promise - state.score);
        candidates
            .into_iter()
            .take(REFITS)
            // One linear step says little of a large turn or delay: half the best promise is still
            // worth a fit.
            .filter(|(promise, _)| {
                *promise > state.score + (0.3 * best).min(best - 20.0).max(-10.0)
            })
            .map(|(_, candidate)| self.state(candidate.set))
            .filter(|state| state.score > f64::NEG_INFINITY)
            .collect()
    }

    /// Without the effects that do not earn their place beside the others.
    pub fn pruned(&self, mut state: State) -> State {
        loop {
            let members: Vec<EffectKind> =
                state.fit.set.iter().map(|effect| effect.kind()).collect();
            let smaller = members
                .iter()
                .map(|kind| self.state(state.fit.set.without(*kind)));
            let Some(best) = smaller.max_by(|a, b| a.score.total_cmp(&b.score)) else {
                return state;
            };
            if best.score < state.score {
                return state;
            }
            state = best;
        }
    }

    /// Tries every member against every effect outside; at the end, by how much each member beats
    /// the best set without it.
    pub fn exchanged(&self, mut state: State, library: &[EffectKind]) -> State {
        for _ in 0..3 {
            let members: Vec<EffectKind> =
                state.fit.set.iter().map(|effect| effect.kind()).collect();
            let mut best: Option<State> = None;
            state.margins.clear();
            for kind in members {
                let smaller = self.state(state.fit.set.without(kind));
                let mut rival = smaller.score;
                let mut candidates: Vec<_> = library
                    .iter()
                    .filter(|other| **other != kind && smaller.fit.set.get(**other).is_none())
                    .filter_map(|other| self.screen(&smaller.fit, *other))
                    .map(|candidate| (candidate.promise - self.price(&candidate.set), candidate))
                    .collect();
                candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
                for (promise, candidate) in candidates.into_iter().take(2) {
                    if promise < smaller.score + 0.3 * (state.score - smaller.score) {
                        continue;
                    }
                    let other = self.state(candidate.set);
                    rival = rival.max(other.score);
                    if other.score > best.as_ref().map_or(state.score, |best| best.score) {
                        best = Some(other);
                    }
                }
                state.margins.push((kind, state.score - rival));
            }
            match best {
                Some(better) => state = self.pruned(better),
                None => break,
            }
        }
        state
    }
}

/// Whether the fitted values are what such effects have: a filter that passes all motion, a tissue
/// stiffer than any, or a filter's attenuation without its delay are no causes but the reference's
/// own smoothing error in their disguise.
pub(crate) fn plausible(set: &EffectSet) -> bool {
    let value = |kind: EffectKind, index: usize| {
        set.get(kind)
            .and_then(|effect| effect.values().get(index).copied())
    };
    let cutoff_hz = value(EffectKind::LowPass, 0);
    if cutoff_hz.is_some_and(|hz| hz > 45.0) {
        return false;
    }
    if let (Some(hz), Some(seconds)) = (cutoff_hz, value(EffectKind::TimeOffset, 0))
        && (seconds + 0.225 / hz).abs() < 0.35 * 0.225 / hz
    {
        return false;
    }
    if let (Some(hz), Some(ratio)) = (
        value(EffectKind::SoftTissue, 0),
        value(EffectKind::SoftTissue, 1),
    ) && (hz > 22.0 || !(0.04..=1.5).contains(&ratio))
    {
        return false;
    }
    // Gravity left out is no scale, nor is a unit.
    let scales = [EffectKind::AccelScale, EffectKind::GyroScale]
        .into_iter()
        .flat_map(|kind| (0..3).filter_map(move |axis| value(kind, axis)));
    if scales
        .chain(value(EffectKind::ReferenceScale, 0))
        .any(|factor| !(0.5..=2.0).contains(&factor))
    {
        return false;
    }
    value(EffectKind::ReferenceScale, 0).is_none_or(|factor| (factor - 1.0).abs() > 0.006)
}

pub(crate) fn kinds(set: &EffectSet) -> Vec<&'static str> {
    set.iter().map(|effect| effect.kind().name()).collect()
}

fn sort(states: &mut [State]) {
    states.sort_by(|a, b| b.score.total_cmp(&a.score));
}

/// Developers' view of a search.
pub(crate) fn debug(print: impl Fn()) {
    if std::env::var_os("CROMOSIM_DEBUG").is_some() {
        print();
    }
}
