//! Whether the reference was smoothed before it came here.

use cromosim_imu::{Channel, Effect, EffectKind, EffectSet, PerChannel};
use cromosim_spatial::{SmoothingKernel, ZeroPhaseSmoothing};

use crate::attenuation::Shown;
use crate::axes::{larger, smaller, sum_over_channels};
use crate::fit::FitModel;
use crate::noise_updates::with_estimate;
use crate::plausibility::told_from_smoothing;
use crate::policy::smoothing::{
    BESIDE, BEST_RATIO, CLOSER, FARTHER_FOR_CLOSER, HARDLY_FARTHER, LEAST_GAIN_NATS, LEAST_SHARE,
    MUCH_CLOSER, MUCH_FARTHER, NOT_FARTHER, PART_OF_ATTENUATION, SHARP, SHARPENINGS,
    SHORTEST_DELAY_S, SOFTER, SUSPICIOUS, SUSPICIOUS_OF_GAUSSIAN, TRIAL_STEPS,
};
use crate::response::left_beside_attenuation;
use crate::search::{ScoredEffectSet, excess, score, score_after, search_down_to_noise};
use crate::trace::{names, trace};

/// Cutoffs that are tried first, Hz. Beyond the last nothing is undone but noise.
const CUTOFFS_HZ: [f64; 9] = [1.5, 2.0, 2.6, 3.4, 4.4, 5.7, 7.4, 9.6, 12.5];
/// A cutoff that leaves all poses as they are.
const UNDOES_NOTHING_HZ: f64 = 1e6;
/// Where a Gaussian's cutoff is looked for, as parts of the best one of Butterworth's filter, in turn until one comes in question:
/// its half power lies below that one's half amplitude, but not where all of the motion is far beyond the cutoff, and Butterworth's
/// best one is too low.
const GAUSSIAN_PARTS: [f64; 3] = [0.7, 0.85, 1.0];
/// Factors between neighbouring cutoffs: where they tell a Gaussian from Butterworth's filter, one order of that from
/// another, and where they refine the best, with what was found beside it.
const BETWEEN_KERNELS: f64 = 1.2;
const BETWEEN_ORDERS: f64 = 1.12;
const FINE: f64 = 1.04;
const FINEST: f64 = 1.01;

/// The better of `model` and models in which a smoothing of the reference is undone, each with the
/// best set of effects.
pub(crate) fn try_smoothing<'a>(
    model: FitModel<'a>,
    scored: ScoredEffectSet,
    starts: &[EffectSet],
    library: &[EffectKind],
) -> (FitModel<'a>, ScoredEffectSet) {
    let found = told_from_smoothing(&scored.fit.set);
    let is_imitated = found != scored.fit.set;
    let shown = if found.contains(EffectKind::LowPass)
        || with_all_delay_by_filter(&found, library).is_some()
    {
        // A filter of the readings, with a cutoff that is not known yet, would change their shape as well.
        Shown::default()
    } else {
        Shown::by_readings(&model, &found)
    };
    let is_suspicious = is_imitated || larger(scored.fit.held_out_ratio()) > SUSPICIOUS;
    if shown.smoothings.is_empty() && (shown.is_excluded || !is_suspicious) {
        return (model, scored);
    }
    let plain = evidence(&model, &scored);
    let without_smoothing = if is_imitated {
        evidence(&model, &score(&model, found.clone()))
    } else {
        plain
    };
    let start = with_line(&starts[0], &found);
    let sets = starting_sets(starts, found, library);
    let trial = Trial {
        shown: &shown,
        plain,
        without_smoothing,
        needed: needed(&model, &scored),
        plain_ratio: scored.fit.held_out_ratio(),
        model: &model,
        start: &start,
        beside: with_plain_norms(&model, sets.clone()),
    };
    let Some(first) = trial.first() else {
        return (model, scored);
    };
    let undone = with_undone_smoothing(&model, &start, first.smoothing);
    let searched = search_down_to_noise(&undone, &sets, library, BESIDE);
    let (undone, searched, smoothing) = trial.sharpened(undone, searched, first, library);
    let gained = evidence(&undone, &searched);
    trace(|| {
        eprintln!(
            "  {smoothing:?} with {:?}: {gained:.1}",
            names(&searched.fit.set),
        )
    });
    if trial.believes(&smoothing, &searched, gained, &scored, is_imitated) {
        (undone, searched)
    } else {
        (model, scored)
    }
}

/// What is certain, with a vibration that was found: it would pass for noise, and no smoothing touches it.
fn with_line(certain: &EffectSet, found: &EffectSet) -> EffectSet {
    let is_line = |effect: &&Effect| effect.spectral_line().is_some();
    match found.iter().find(is_line) {
        Some(line) => certain.clone().with(line.clone()),
        None => certain.clone(),
    }
}

/// Beside what was found without it, that with the delay of a filter, and alone.
fn starting_sets(starts: &[EffectSet], found: EffectSet, library: &[EffectKind]) -> Vec<EffectSet> {
    let mut sets = starts.to_vec();
    sets.extend(with_all_delay_by_filter(&found, library));
    if !starts.contains(&found) {
        sets.push(found);
    }
    sets
}

/// Whether a cutoff is above all that explain something, and would be were it lower by a factor.
fn reaches_no_motion(smoothing: &ZeroPhaseSmoothing, factor: f64) -> bool {
    smoothing.cutoff_hz > factor * CUTOFFS_HZ[CUTOFFS_HZ.len() - 1]
}

/// What cutoffs are tried beside.
struct Trial<'t, 'a> {
    /// What the readings show of it.
    shown: &'t Shown,
    model: &'t FitModel<'a>,
    /// What is certain from the start.
    start: &'t EffectSet,
    /// The sets that are tried, with how far the reference as it is is off with each.
    beside: Vec<(EffectSet, PerChannel<f64>)>,
    /// Evidence of the reference as it is, nats.
    plain: f64,
    /// The same without effects that cannot be told from a smoothing.
    without_smoothing: f64,
    /// Evidence from which on a smoothing is believed.
    needed: f64,
    /// Held-out mean square of the whitened residual of the reference as it is.
    plain_ratio: PerChannel<f64>,
}

/// A smoothing that was tried.
struct Tried {
    evidence: f64,
    smoothing: ZeroPhaseSmoothing,
    /// The best of the starting sets beside it.
    set: EffectSet,
}

impl<'a> Trial<'_, 'a> {
    /// The nearest of the smoothings that the readings show, or the one of the second order with the most evidence, or where that
    /// explains nothing the Gaussian.
    fn first(&self) -> Option<Tried> {
        let shown = self.shown.smoothings.iter().find_map(|own| {
            let found = self.refined(self.tried(*own)?, FINE);
            (!reaches_no_motion(&found.smoothing, FINE)).then_some(found)
        });
        let best = shown.or_else(|| self.best_of(SmoothingKernel::SECOND_ORDER));
        best.or_else(|| {
            let is_far = larger(self.plain_ratio) > SUSPICIOUS_OF_GAUSSIAN;
            is_far
                .then(|| self.best_of(SmoothingKernel::Gaussian))
                .flatten()
        })
    }

    /// The smoothing with the most evidence among those of the kernels that the readings show.
    fn best_shown(&self, begun: Tried) -> Tried {
        let mut best = self.refined(begun, FINE);
        let is_other = |own: &&ZeroPhaseSmoothing| own.kernel != best.smoothing.kernel;
        let others: Vec<_> = self.shown.smoothings.iter().filter(is_other).collect();
        for smoothing in others {
            let Some(other) = self.tried(*smoothing).map(|own| self.refined(own, FINE)) else {
                continue;
            };
            if self.outdoes(&other, &best) {
                best = other;
            }
        }
        best
    }

    /// Whether a smoothing has more evidence than another; by far where it is one of the first order, which differs from a Gaussian
    /// where little is left.
    fn outdoes(&self, one: &Tried, other: &Tried) -> bool {
        let gained = one.evidence - other.evidence;
        let is_soft = one.smoothing.kernel == SmoothingKernel::Butterworth { order: 1 };
        let most = other.evidence - self.plain;
        !reaches_no_motion(&one.smoothing, 1.0)
            && gained > if is_soft { SOFTER * most } else { 0.0 }
    }

    /// Whether a smoothing is believed, beside which another set was found with so much evidence: one that the readings clearly show
    /// where the simulation comes no farther, or hardly farther for the evidence; another by the evidence, where it is of motion.
    fn believes(
        &self,
        smoothing: &ZeroPhaseSmoothing,
        searched: &ScoredEffectSet,
        gained: f64,
        without: &ScoredEffectSet,
        is_imitated: bool,
    ) -> bool {
        if reaches_no_motion(smoothing, 1.0) {
            return false;
        }
        let ratio = distance(self.model, without, searched);
        let farther = ratio.accelerometer * ratio.gyroscope;
        trace(|| eprintln!("  {farther:.3} times as far as without it"));
        let is_by_evidence = gained > self.needed;
        let is_shown = self.shown.is_clear && self.is_near_shown(smoothing);
        if is_shown && (farther < 1.0 || is_by_evidence && farther < HARDLY_FARTHER) {
            return true;
        }
        // What passes for a smoothing has its own parameters for one channel, and shall be outdone over both.
        is_by_evidence
            && self.outdoes_rivals(gained, &searched.fit.set, &without.fit.set)
            && self.is_of_motion(smoothing, searched)
            && (!is_imitated || farther < 1.0)
    }

    /// Whether the cutoff with the most evidence is hardly another one than that which the readings show of the same kernel.
    fn is_near_shown(&self, smoothing: &ZeroPhaseSmoothing) -> bool {
        let shown = self.shown.of_kernel(smoothing.kernel);
        shown.is_some_and(|own| {
            let factor = smoothing.cutoff_hz / own.cutoff_hz;
            factor.max(factor.recip()) < BETWEEN_KERNELS
        })
    }

    /// A smoothing beside what was found once it was undone: its cutoff had made up for that, and kernels that rise more steeply
    /// bring more noise, which covers it. Once more where more than noise is left then.
    fn sharpened(
        &self,
        mut undone: FitModel<'a>,
        mut searched: ScoredEffectSet,
        first: Tried,
        library: &[EffectKind],
    ) -> (FitModel<'a>, ScoredEffectSet, ZeroPhaseSmoothing) {
        let mut smoothing = first.smoothing;
        let mut set_of_first = Some(first.set);
        for pass in 0..SHARPENINGS {
            let found = &searched.fit.set;
            let mut sets = vec![found.clone()];
            sets.extend(with_all_delay_by_filter(found, library));
            let other = set_of_first.take();
            sets.extend(other.filter(|other| names(other) != names(found)));
            let beside = Trial {
                beside: with_plain_norms(self.model, sets),
                ..*self
            };
            let begun = Tried {
                evidence: evidence(&undone, &searched),
                smoothing,
                set: found.clone(),
            };
            let sharp = if pass == 0 {
                if self.shown.is_clear {
                    beside.best_shown(begun)
                } else {
                    beside.best_kernel(begun)
                }
            } else {
                beside.refined(begun, FINEST)
            };
            if reaches_no_motion(&sharp.smoothing, 1.0) {
                // It will not be believed.
                return (undone, searched, sharp.smoothing);
            }
            let leaves_more = larger(searched.fit.held_out_ratio()) > SUSPICIOUS;
            if sharp.smoothing == smoothing && !leaves_more {
                break;
            }
            if sharp.smoothing != smoothing {
                smoothing = sharp.smoothing;
                undone = with_undone_smoothing(self.model, self.start, smoothing);
            }
            let before = names(&sharp.set);
            searched = search_down_to_noise(&undone, &[sharp.set], library, BESIDE);
            if names(&searched.fit.set) == before {
                break;
            }
        }
        (undone, searched, smoothing)
    }

    /// Whether the simulation comes closer, and not as factors below one would bring it, or no farther where the cutoff is a sharp
    /// one: most of a fast motion is lost in the reference's noise, and undoing the rest brings the simulation hardly closer.
    fn is_of_motion(&self, smoothing: &ZeroPhaseSmoothing, undone: &ScoredEffectSet) -> bool {
        let plain = score(self.model, undone.fit.set.clone());
        let ratio = distance(self.model, &plain, undone);
        let attenuated = left_beside_attenuation(self.model, &plain.fit);
        trace(|| {
            eprintln!("  smoothing comes closer by {ratio:.3?}, attenuation by {attenuated:.3?}");
        });
        if is_attenuation(ratio, attenuated) {
            return false;
        }
        let goes_no_farther = smaller(ratio) < 1.0 && larger(ratio) < NOT_FARTHER;
        comes_closer(ratio) || (goes_no_farther && self.is_sharp(smoothing, &undone.fit.set))
    }

    /// Whether the cutoffs next to one, on both sides, lose much of what undoing it gains; of a reference that was interpolated each
    /// cutoff near half of its frames' rate does.
    fn is_sharp(&self, smoothing: &ZeroPhaseSmoothing, set: &EffectSet) -> bool {
        if self.model.prepared.report.frames.is_some() {
            return false;
        }
        let beside = Trial {
            beside: with_plain_norms(self.model, vec![set.clone()]),
            ..*self
        };
        let evidence = |factor: f64| {
            let cutoff_hz = factor * smoothing.cutoff_hz;
            let tried = beside.tried(ZeroPhaseSmoothing {
                cutoff_hz,
                ..*smoothing
            });
            tried.map(|tried| tried.evidence)
        };
        let around = [1.0, BETWEEN_ORDERS, BETWEEN_ORDERS.recip()].map(evidence);
        let [Some(best), Some(higher), Some(lower)] = around else {
            return false;
        };
        let lost = (best - higher.max(lower)) / (best - self.plain);
        trace(|| eprintln!("  cutoffs next to it lose {lost:.3}"));
        best > self.plain && lost > SHARP
    }

    /// Whether undoing it has more evidence than what was found without it has together with what was found since, and than
    /// the same filters have where nothing is undone.
    fn outdoes_rivals(&self, gained: f64, since: &EffectSet, without: &EffectSet) -> bool {
        let mut both = without.clone();
        both.extend(since.iter());
        let nothing = ZeroPhaseSmoothing {
            cutoff_hz: UNDOES_NOTHING_HZ,
            kernel: SmoothingKernel::SECOND_ORDER,
        };
        let same_filters = with_undone_smoothing(self.model, self.start, nothing);
        [(self.model, &both), (&same_filters, since)]
            .into_iter()
            .all(|(model, set)| gained > needed(model, &score(model, set.clone())))
    }

    /// The kernel with the most evidence: Butterworth's of the second order, or the fourth, and where that is better the third; or a
    /// Gaussian, and where it is better than the second the first, which sets in more softly still. The best is refined. A
    /// Gaussian stays one: the second order explained nothing.
    fn best_kernel(&self, second: Tried) -> Tried {
        if second.smoothing.kernel == SmoothingKernel::Gaussian {
            return self.refined(self.refined(second, BETWEEN_KERNELS), FINE);
        }
        let middle_hz = second.smoothing.cutoff_hz;
        let around = |kernel, part, factor| {
            let cutoff_hz = part * middle_hz;
            let start = ZeroPhaseSmoothing { cutoff_hz, kernel };
            let first = self.tried(self.shown.of_kernel(kernel).unwrap_or(start))?;
            Some(self.refined(first, factor))
        };
        // Half of the amplitude is left at the cutoff whatever the order.
        let of_order = |order| around(SmoothingKernel::Butterworth { order }, 1.0, BETWEEN_ORDERS);
        let better = |one: Tried, other: Option<Tried>| match other {
            Some(other) if other.evidence > one.evidence => (other, true),
            _ => (one, false),
        };
        // The grid's cutoff was chosen beside less: left there it loses against kernels whose cutoffs are not.
        let second = self.refined(second, BETWEEN_ORDERS);
        if reaches_no_motion(&second.smoothing, 1.0) {
            // What was found beside it explains what it did.
            return second;
        }
        let (best, is_steeper) = better(second, of_order(4));
        if reaches_no_motion(&best.smoothing, 1.0) {
            return best;
        }
        let (best, _) = better(best, is_steeper.then(|| of_order(3)).flatten());
        let gaussian = GAUSSIAN_PARTS
            .into_iter()
            .find_map(|part| around(SmoothingKernel::Gaussian, part, BETWEEN_KERNELS));
        let (best, is_gaussian) = better(best, gaussian);
        let sets_in_softly = is_gaussian && !is_steeper;
        let first = sets_in_softly.then(|| of_order(1)).flatten();
        let first = first.filter(|first| self.outdoes(first, &best));
        let (best, _) = better(best, first);
        self.refined(best, FINE)
    }

    /// The one of a kernel with the most evidence.
    fn best_of(&self, kernel: SmoothingKernel) -> Option<Tried> {
        let best = self.best_of_grid(kernel)?;
        let is_best = |(set, _): &&(EffectSet, _)| names(set) == names(&best.set);
        let beside_best = Trial {
            beside: self
                .beside
                .iter()
                .find(is_best)
                .cloned()
                .into_iter()
                .collect(),
            ..*self
        };
        let best = beside_best.refined(best, BETWEEN_ORDERS);
        // Then nothing finer does, either.
        let reaches_motion = !reaches_no_motion(&best.smoothing, FINE);
        reaches_motion.then_some(best)
    }

    /// The cutoff of a kernel with the most evidence; none where none has more than the reference as it is, without what
    /// passes for a smoothing: of one that is there even a cutoff next to it explains far more. From the lowest on, until two in
    /// turn have lost most of what the best one gained.
    fn best_of_grid(&self, kernel: SmoothingKernel) -> Option<Tried> {
        let part = match kernel {
            SmoothingKernel::Gaussian => GAUSSIAN_PARTS[0],
            SmoothingKernel::Butterworth { .. } => 1.0,
        };
        let mut best: Option<Tried> = None;
        let mut far_behind = 0;
        for cutoff_hz in CUTOFFS_HZ {
            let cutoff_hz = part * cutoff_hz;
            let Some(other) = self.tried(ZeroPhaseSmoothing { cutoff_hz, kernel }) else {
                continue;
            };
            let most = best
                .as_ref()
                .map_or(f64::NEG_INFINITY, |best| best.evidence);
            let is_far = other.evidence < 0.5 * (most + self.without_smoothing);
            far_behind = if is_far { far_behind + 1 } else { 0 };
            if other.evidence > most {
                best = Some(other);
            }
            if far_behind == 2 {
                break;
            }
        }
        best.filter(|best| best.evidence > self.without_smoothing)
    }

    /// The best of a smoothing and those of other cutoffs: by a factor lower and higher as long as that is better, and then at
    /// the vertex of the parabola through the best and its neighbours, over the cutoff's logarithm.
    fn refined(&self, begun: Tried, factor: f64) -> Tried {
        let kernel = begun.smoothing.kernel;
        let at = |cutoff_hz: f64| self.tried(ZeroPhaseSmoothing { cutoff_hz, kernel });
        let height =
            |one: &Option<Tried>| one.as_ref().map_or(f64::NEG_INFINITY, |one| one.evidence);
        let mut best = begun;
        let mut beside = [factor.recip(), factor].map(|step| at(best.smoothing.cutoff_hz * step));
        for (side, step) in [factor.recip(), factor].into_iter().enumerate() {
            // Beyond what explains something evidence rises on towards that of undoing nothing.
            while height(&beside[side]) > best.evidence
                && !reaches_no_motion(&best.smoothing, 1.0)
                && let Some(next) = beside[side].take()
            {
                beside[side] = at(next.smoothing.cutoff_hz * step);
                beside[1 - side] = Some(std::mem::replace(&mut best, next));
            }
        }
        let [lower, upper] = [height(&beside[0]), height(&beside[1])];
        let bend = 2.0 * best.evidence - lower - upper;
        let steps = if bend.is_finite() && bend > 0.0 {
            0.5 * (upper - lower) / bend
        } else {
            // One side alone can be judged.
            0.5 * f64::from(i8::from(upper > lower) - i8::from(lower > upper))
        };
        let vertex = at(best.smoothing.cutoff_hz * factor.powf(steps));
        vertex
            .filter(|vertex| vertex.evidence > best.evidence)
            .unwrap_or(best)
    }

    /// A smoothing with the best of the starting sets; none where the noise that undoing it brings lets no set
    /// have the evidence that is needed, unless the readings show it. That noise covers what a cutoff that is too low leaves, so that one with which the
    /// simulation is far farther off does not count.
    fn tried(&self, smoothing: ZeroPhaseSmoothing) -> Option<Tried> {
        let undone = with_undone_smoothing(self.model, self.start, smoothing);
        let most = -sum_over_channels(|channel| {
            let whitener = &undone.whitener;
            let best_ratio = self.plain_ratio[channel].min(BEST_RATIO);
            whitener.count[channel] * (0.5 * best_ratio + whitener.log_scale[channel])
        });
        if most < self.needed && !self.shown.is_clear {
            return None;
        }
        let found = self
            .beside
            .iter()
            .map(|(set, plain)| (score_after(&undone, set.clone(), TRIAL_STEPS), plain))
            .filter(|(found, plain)| {
                let norms = residual_norms(&undone, found);
                larger(over(norms, **plain)) <= MUCH_FARTHER
            })
            .map(|(found, _)| found)
            .max_by(|a, b| a.score.total_cmp(&b.score))?;
        let evidence = evidence(&undone, &found);
        trace(|| {
            eprintln!(
                "  {smoothing:?}: {evidence:.1} against {:.1} {:.2?}",
                self.plain,
                found.fit.held_out_ratio()
            )
        });
        Some(Tried {
            evidence,
            smoothing,
            set: found.fit.set,
        })
    }
}

/// Sets with how far the reference as it is is off with each.
fn with_plain_norms(model: &FitModel, sets: Vec<EffectSet>) -> Vec<(EffectSet, PerChannel<f64>)> {
    let with_norms = |set: EffectSet| {
        let norms = residual_norms(model, &score(model, set.clone()));
        (set, norms)
    };
    sets.into_iter().map(with_norms).collect()
}

/// A set in which a filter alone makes the readings late, where an offset does, or both: beside a cutoff of the smoothing
/// that is not quite right each takes up what of the other it leaves.
fn with_all_delay_by_filter(set: &EffectSet, library: &[EffectKind]) -> Option<EffectSet> {
    let offset_s = set.get(EffectKind::TimeOffset).map(|_| set.time_offset())?;
    let filter = set.get(EffectKind::LowPass);
    let all_s = offset_s + filter.and_then(Effect::low_pass_delay).unwrap_or(0.0);
    let filter = Effect::low_pass_with_delay(all_s).ok()?;
    let may_be = library.contains(&EffectKind::LowPass) && SHORTEST_DELAY_S < all_s;
    may_be.then(|| set.without(EffectKind::TimeOffset).with(filter))
}

/// Held-out log-likelihood with the predicted noise's own volume: models with other noise become
/// comparable.
fn evidence(model: &FitModel, scored: &ScoredEffectSet) -> f64 {
    scored.score
        - sum_over_channels(|channel| {
            model.whitener.count[channel] * model.whitener.log_scale[channel]
        })
}

/// Evidence from which on a smoothing is believed rather than a fit without one.
fn needed(model: &FitModel, scored: &ScoredEffectSet) -> f64 {
    evidence(model, scored) + LEAST_GAIN_NATS + LEAST_SHARE * excess(model, &scored.fit)
}

/// The model in which a smoothing is undone.
pub(crate) fn with_undone_smoothing<'a>(
    model: &FitModel<'a>,
    set: &EffectSet,
    smoothing: ZeroPhaseSmoothing,
) -> FitModel<'a> {
    let estimate = model.prepared.estimate.undoing(smoothing);
    let mut undone = with_estimate(model, estimate, set);
    undone.basis.undone_smoothing = Some(smoothing);
    undone
}

/// Whether the simulation itself, by the ratio of its distances, comes closer in one channel than with the same effects alone, and in
/// none moves away: what is undone must not cost more than it gives. The noise that it lets in may take one farther where the
/// other comes much closer: factors by frequency keep that out in the end ([`crate::response`]).
fn comes_closer(ratio: PerChannel<f64>) -> bool {
    let (closer, farther) = (smaller(ratio), larger(ratio));
    let farther_for_closer = farther < FARTHER_FOR_CLOSER && closer * farther < MUCH_CLOSER;
    closer < CLOSER && (farther < NOT_FARTHER || farther_for_closer)
}

/// Whether most of the power that undoing a smoothing takes off the residual goes where the simulation is attenuated, too, and
/// undoing it leaves not much less: a smoothing leaves less of the motion than there was. Noise that its spectrum does not tell
/// from motion is more than there was, and the filters that undo a smoothing keep it out. Of ratios of root mean squares.
fn is_attenuation(undone: PerChannel<f64>, attenuated: PerChannel<f64>) -> bool {
    Channel::ALL.into_iter().all(|channel| {
        let [left, left_beside] = [undone, attenuated].map(|ratio| ratio[channel].powi(2));
        let takes_off_as_much = 1.0 - left_beside >= PART_OF_ATTENUATION * (1.0 - left);
        takes_off_as_much && left >= PART_OF_ATTENUATION * left_beside
    })
}

/// Root mean squares of the residuals of what is undone, over those of what is not.
fn distance(
    model: &FitModel,
    plain: &ScoredEffectSet,
    undone: &ScoredEffectSet,
) -> PerChannel<f64> {
    over(residual_norms(model, undone), residual_norms(model, plain))
}

fn residual_norms(model: &FitModel, scored: &ScoredEffectSet) -> PerChannel<f64> {
    let readings = &scored.fit.prediction.readings;
    model.prepared.residual_norms(readings)
}

fn over(one: PerChannel<f64>, other: PerChannel<f64>) -> PerChannel<f64> {
    PerChannel::from_fn(|channel| one[channel] / other[channel].max(1e-30))
}
