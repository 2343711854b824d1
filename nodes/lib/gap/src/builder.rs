//! Findings put into the numbers and words of diagnosis.json.

use std::collections::BTreeMap;

use cromosim_imu::{Effect, EffectKind, EffectSet, Reading, UnexplainedErrors};
use cromosim_spatial::MotionResponse;

use crate::diagnosis::{
    Cause, Gap, GapLocation, KeptCalibration, Metrics, PlacementDiagnosis, RecordingCause,
    RecordingDiagnosis, ReferenceResponse, UNKNOWN, Unexplained, Unidentifiable,
};
use crate::evidence::{Evidence, collect};
use crate::findings::{Findings, Unknown};
use crate::fit::Fit;
use crate::identify::unidentifiable;
use crate::location::locate;
use crate::policy::probability::{LEAST_OF_SMALL_UNKNOWN, LEAST_OF_UNKNOWN, SMALL_SHARE};
use crate::probability::{calibrate, is_calibration_of, probability_of};
use crate::response::{LearntResponse, kept};
use crate::screen::is_change;
use crate::session::Session;
use crate::shares::{Shares, shares};
use crate::simulations::Simulations;
use crate::standard_errors::error_of_time;
use crate::together::reported_by_the_others;
use crate::unexplained::unexplained_errors;
use crate::words::{described, described_errors, unknown_cause, verdict};

/// Everything the diagnosis of a placement is made of.
pub(crate) struct DiagnosisBuilder<'a> {
    findings: &'a [Findings<'a>],
    /// By recording.
    parts: Vec<Part<'a>>,
    /// Of the recording with the most to explain.
    heaviest: usize,
}

/// One recording.
struct Part<'a> {
    findings: &'a Findings<'a>,
    simulations: Simulations<'a>,
    /// Shares of the reported effects, in their order.
    shares: Shares,
    before_readings: Vec<Reading>,
    after_readings: Vec<Reading>,
    before: Metrics,
    /// On time that was not fitted to.
    after: Metrics,
    /// Where the gap of the nominal simulation lies.
    location: GapLocation,
    /// Of its reference's motion.
    response: Option<LearntResponse>,
}

impl<'a> Part<'a> {
    fn new(findings: &'a Findings<'a>, session: &'a Session, seed: u64) -> Self {
        let simulations = Simulations::new(findings, &session.raw, &session.covered, seed);
        let (response, held_out) = kept(findings, &simulations);
        let reportable = &findings.reportable;
        let named: Vec<Effect> = reportable.iter().cloned().collect();
        let shares = shares(findings, &simulations, &named);
        let nominal = EffectSet::new();
        let before_readings = simulations.simulate(&nominal);
        let before = simulations.metrics(&nominal, &before_readings);
        let applied = findings.applied();
        let whole = response.as_ref().map(|learnt| &learnt.whole);
        let after_readings = simulations.simulate_with(&applied, whole);
        let after = simulations.metrics(&applied, &held_out);
        let whitener = simulations.whitener(&nominal);
        let white = simulations.whitened(&whitener, &before_readings);
        Self {
            location: locate(&white, &simulations.whole, &whitener),
            findings,
            simulations,
            shares,
            before_readings,
            after_readings,
            before,
            after,
            response,
        }
    }

    /// What the readings hold of the motion that the reference shows, by frequency; none where it is all of it.
    fn reference_response(&self) -> Option<&MotionResponse> {
        self.response.as_ref().map(|learnt| &learnt.whole)
    }

    /// Number of messages that are compared.
    fn samples(&self) -> f64 {
        let covered = self.simulations.comparison.covered.iter();
        covered.filter(|axes| axes.contains(&true)).count() as f64
    }

    /// Share of the recording's gap that an effect explains; 0 where it has none.
    fn share(&self, kind: EffectKind) -> f64 {
        let place = self.findings.reportable.iter();
        let place = place
            .zip(&self.shares.causes)
            .find(|(effect, _)| effect.kind() == kind);
        place.map_or(0.0, |(_, share)| *share)
    }

    /// Of the reported effects, those of some kinds.
    fn only(&self, kinds: &[EffectKind]) -> EffectSet {
        let reported = &self.findings.reportable;
        reported.filtered(|effect| kinds.contains(&effect.kind()))
    }

    fn under(&self, set: &EffectSet) -> Metrics {
        self.simulations
            .metrics(set, &self.simulations.simulate(set))
    }

    /// With a device that other recordings show; the reference is this one's.
    fn left_out(&self, set: &EffectSet) -> Metrics {
        let Some(response) = &self.response else {
            return self.under(set);
        };
        let of_fold = |_| set.clone();
        let readings = self
            .simulations
            .fold_by_fold(Some(&response.excluding_fold), of_fold);
        self.simulations.metrics(set, &readings)
    }

    /// Standard deviations that no recording takes away, of each value: the reference's clock is no better
    /// than others. It is right where the recording begins, and off by as much as is ordinary since.
    fn errors_of_reference(&self, effect: &Effect) -> Vec<f64> {
        let rate = EffectKind::ClockDrift.error_of_reference();
        let whole = &self.simulations.whole;
        let mut errors = vec![0.0; effect.values().len()];
        errors[0] = match effect.kind() {
            EffectKind::ClockDrift => rate,
            EffectKind::TimeOffset => 1e-6 * rate * (whole.epoch - whole.estimate.start()).abs(),
            // By the reference's clock where the device's is said to drift, else by the device's.
            EffectKind::Vibration if self.findings.reportable.contains(EffectKind::ClockDrift) => {
                1e-6 * rate * effect.values()[0]
            }
            _ => 0.0,
        };
        errors
    }

    /// Values of an effect and their standard errors in a fit, by the names of its parameters.
    fn values(&self, effect: &Effect, fit: &Fit) -> [BTreeMap<String, serde_json::Value>; 2] {
        let kind = effect.kind();
        let mut errors = fit.standard_errors(effect);
        let of_reference = self.errors_of_reference(effect);
        for (error, of_reference) in errors.iter_mut().zip(of_reference) {
            if *error > 0.0 {
                *error = error.hypot(of_reference);
            }
        }
        let of_time =
            is_change(kind).then(|| error_of_time(&self.simulations, effect, &self.after));
        [
            described(kind, effect.values()),
            described_errors(kind, &errors, of_time),
        ]
    }
}

impl<'a> DiagnosisBuilder<'a> {
    /// `seed` is that of the simulated noise.
    pub fn new(findings: &'a [Findings<'a>], sessions: &'a [Session], seed: u64) -> Self {
        let pairs = findings.iter().zip(sessions);
        let parts: Vec<Part> = pairs
            .map(|(findings, session)| Part::new(findings, session, seed))
            .collect();
        let heavier = |best: usize, other: usize| {
            if parts[other].shares.total > parts[best].shares.total {
                other
            } else {
                best
            }
        };
        Self {
            heaviest: (0..parts.len()).fold(0, heavier),
            findings,
            parts,
        }
    }

    /// What the readings of each recording hold of the motion that its reference shows, by frequency; in the units in
    /// which it was reported.
    pub fn reference_responses(&self) -> Vec<Option<MotionResponse>> {
        let response = |part: &Part| {
            let units = part.findings.model.prepared.report.length_units;
            Some(part.reference_response()?.in_units_of_length(units))
        };
        self.parts.iter().map(response).collect()
    }

    /// The diagnosis; `recordings` are the names of the recordings.
    pub fn diagnosis(&self, recordings: &[&str]) -> PlacementDiagnosis {
        let before = self.pooled(|part| part.before);
        let after = self.pooled(|part| part.after);
        let unexplained = self.weighted(|part| part.shares.unexplained);
        let mut causes = self.causes();
        if let Some(last) = causes.last_mut() {
            last.after = after;
        }
        let unknown = self.unknown();
        let with_it = unknown.and_then(|unknown| {
            // What is predictable of the rest belongs to `unknown`; what is not even that stays
            // unexplained.
            let share = unexplained * unknown.predictable;
            let with_it = with_unknown(&causes, unknown_cause(unknown, share, after), before);
            let own = with_it.iter().find(|cause| cause.effect == UNKNOWN)?;
            let is_taken_up = with_it.iter().any(|cause| is_calibration_of(&cause.effect));
            let least = if own.gap_share < SMALL_SHARE && !is_taken_up {
                LEAST_OF_SMALL_UNKNOWN
            } else {
                LEAST_OF_UNKNOWN
            };
            (own.probability >= least).then_some(with_it)
        });
        let unknown = unknown.filter(|_| with_it.is_some());
        let predictable = unknown.map_or(0.0, |unknown| unknown.predictable);
        let causes = with_it.unwrap_or_else(|| {
            calibrate(&mut causes);
            causes
        });
        PlacementDiagnosis {
            verdict: verdict(&causes, &before, &after),
            gap: Gap { before, after },
            location: self.parts[self.heaviest].location.clone(),
            calibration: self.calibration(),
            reference_response: self.last_response().map(ReferenceResponse::from),
            unidentifiable: self.unidentifiable(),
            unexplained: Unexplained {
                significant: unknown.is_some(),
                share: unexplained * (1.0 - predictable),
                location: unknown
                    .map(|unknown| unknown.location.clone())
                    .unwrap_or_default(),
            },
            causes,
            recordings: if self.parts.len() > 1 {
                (0..self.parts.len())
                    .map(|index| self.recording(index, recordings[index]))
                    .collect()
            } else {
                Vec::new()
            },
            clock_jumps: Vec::new(),
            magnetometer: None,
        }
    }

    /// The curves of the recording with the most to explain.
    pub fn evidence(&self, recordings: &[&str]) -> Evidence {
        let part = &self.parts[self.heaviest];
        let curves = collect(
            part.findings,
            &part.simulations.comparison,
            &part.before_readings,
            &part.after_readings,
        );
        Evidence {
            recording: recordings[self.heaviest].to_owned(),
            ..curves
        }
    }

    /// How far the readings of each recording are off beyond all that is known of.
    pub fn unexplained_errors(&self) -> Vec<UnexplainedErrors> {
        let of = |part: &Part| {
            let Part {
                findings,
                simulations,
                after,
                ..
            } = part;
            let response = part.reference_response();
            unexplained_errors(findings, simulations, &part.after_readings, after, response)
        };
        self.parts.iter().map(of).collect()
    }

    fn pooled(&self, of: impl Fn(&Part) -> Metrics) -> Metrics {
        let parts: Vec<(f64, Metrics)> = self
            .parts
            .iter()
            .map(|part| (part.samples(), of(part)))
            .collect();
        Metrics::pooled(&parts)
    }

    /// The mean of shares, each recording with what it has to explain.
    fn weighted(&self, of: impl Fn(&Part) -> f64) -> f64 {
        if let [alone] = self.parts.as_slice() {
            return of(alone);
        }
        // Where nothing is to be explained, all count alike.
        let weight = |part: &Part| part.shares.total.max(1e-9);
        let total: f64 = self.parts.iter().map(weight).sum();
        self.parts
            .iter()
            .map(|part| weight(part) * of(part))
            .sum::<f64>()
            / total
    }

    /// The named causes, the largest share first, each with what it and those above it leave.
    fn causes(&self) -> Vec<Cause> {
        let mut kinds: Vec<(EffectKind, f64)> = EffectKind::ALL
            .into_iter()
            .filter(|kind| self.last(*kind).is_some())
            .map(|kind| (kind, self.weighted(|part| part.share(kind))))
            .collect();
        kinds.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut above = Vec::new();
        let mut causes = Vec::new();
        for (kind, gap_share) in kinds {
            above.push(kind);
            let after = self.pooled(|part| part.under(&part.only(&above)));
            causes.extend(self.last(kind).map(|(part, effect)| {
                let fit = part.findings.fit_of(kind);
                let [parameters, standard_errors] = part.values(effect, fit);
                let by_margin = self.probability_by_margin(kind);
                Cause {
                    effect: kind.name().to_owned(),
                    probability: by_margin,
                    probability_by_margin: by_margin,
                    parameters,
                    standard_errors,
                    gap_share,
                    after,
                }
            }));
        }
        causes
    }

    /// An effect in the last recording that reports it, which is the one that effects.yaml is of.
    fn last(&self, kind: EffectKind) -> Option<(&Part<'a>, &Effect)> {
        let mut parts = self.parts.iter().rev();
        parts.find_map(|part| Some((part, part.findings.reportable.get(kind)?)))
    }

    /// That an effect is there, as the recording says that is the surest of it.
    fn probability_by_margin(&self, kind: EffectKind) -> f64 {
        let of = |part: &Part| {
            let effect = part.findings.reportable.get(kind)?;
            Some(probability_of(part.findings, effect))
        };
        self.parts.iter().filter_map(of).fold(0.0, f64::max)
    }

    /// What is unknown, as the recording shows it that has the most of it to explain.
    fn unknown(&self) -> Option<&Unknown> {
        self.parts
            .iter()
            .filter_map(|part| Some((part.shares.total, part.findings.unknown.as_ref()?)))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, unknown)| unknown)
    }

    /// Of the last recording.
    fn last_response(&self) -> Option<&MotionResponse> {
        self.parts.last().and_then(Part::reference_response)
    }

    /// What is kept beside the causes, as the last recording has it.
    fn calibration(&self) -> Vec<KeptCalibration> {
        let last = self.parts.last();
        let Some((part, fit)) = last.and_then(|part| Some((part, part.findings.kept.as_ref()?)))
        else {
            return Vec::new();
        };
        let described_one = |effect: &Effect| {
            let [parameters, standard_errors] = part.values(effect, fit);
            KeptCalibration {
                effect: effect.kind().name().to_owned(),
                parameters,
                standard_errors,
            }
        };
        let kept = part.findings.kept_calibrations();
        kept.iter().map(described_one).collect()
    }

    /// What none of the recordings can tell.
    fn unidentifiable(&self) -> Vec<Unidentifiable> {
        let mut lists = self.parts.iter().map(|part| unidentifiable(part.findings));
        let first = lists.next().unwrap_or_default();
        lists.fold(first, |mut common, list| {
            common.retain(|one| list.contains(one));
            common
        })
    }

    fn recording(&self, index: usize, name: &str) -> RecordingDiagnosis {
        let part = &self.parts[index];
        let mut causes: Vec<RecordingCause> = part
            .findings
            .reportable
            .iter()
            .map(|effect| {
                let fit = part.findings.fit_of(effect.kind());
                let [parameters, standard_errors] = part.values(effect, fit);
                RecordingCause {
                    effect: effect.kind().name().to_owned(),
                    parameters,
                    standard_errors,
                    gap_share: part.share(effect.kind()),
                }
            })
            .collect();
        causes.sort_by(|a, b| b.gap_share.total_cmp(&a.gap_share));
        RecordingDiagnosis {
            recording: name.to_owned(),
            gap: Gap {
                before: part.before,
                after: part.after,
            },
            left_out: part.left_out(&reported_by_the_others(self.findings, index)),
            location: part.location.clone(),
            causes,
        }
    }
}

/// The causes with `unknown` among them, as sure as they are then.
fn with_unknown(causes: &[Cause], unknown: Cause, before: Metrics) -> Vec<Cause> {
    let mut causes = causes.to_vec();
    causes.push(unknown);
    causes.sort_by(|a, b| b.gap_share.total_cmp(&a.gap_share));
    // It takes nothing away: what the causes above it leave is left below it, too.
    let place = causes.iter().position(|cause| cause.effect == UNKNOWN);
    if let Some(place) = place.filter(|place| place + 1 < causes.len()) {
        let above = place.checked_sub(1).map(|above| causes[above].after);
        causes[place].after = above.unwrap_or(before);
    }
    calibrate(&mut causes);
    causes
}
