//! A placement's diagnosis, from its records to the answer.

use std::borrow::Cow;

use cromosim_imu::{
    Channel, DeclaredNoise, EffectKind, OtherSession, Owner, PerChannel, PlacementEffects, Search,
    UnexplainedErrors, unit_factors,
};
use cromosim_spatial::MotionResponse;

use crate::builder::DiagnosisBuilder;
use crate::clock_jumps::{Parts, parts};
use crate::diagnosis::{Cause, ClockJump, PlacementDiagnosis};
use crate::error::GapError;
use crate::evidence::Evidence;
use crate::findings::Findings;
use crate::library::Library;
use crate::magnetometer::{MagneticRecording, diagnose_magnetometer};
use crate::policy::probability::{LEAST_NAMED, LEAST_SIGNIFICANCE, SMALL_SHARE};
use crate::progress::{ANALYSIS, PREPARATION, Progress};
use crate::record::{MeasuredField, PlacementRecord};
use crate::session::Session;
use crate::together::analysed;
use crate::trace::{names, trace};
use crate::words::jumps_in_words;

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct DiagnoseOptions {
    /// Effects taken out of the library.
    pub excluded: Vec<EffectKind>,
    /// Seed of the noise in comparisons with the noisy simulation.
    pub seed: u64,
    /// Who is told how far it has come.
    pub progress: Progress,
}

/// A placement's answer.
#[derive(Clone, Debug)]
pub struct PlacementAnswer {
    /// For diagnosis.json.
    pub diagnosis: PlacementDiagnosis,
    /// For effects.yaml.
    pub effects: PlacementEffects,
    /// For pictures.
    pub evidence: Evidence,
}

/// Diagnoses one placement.
///
/// # Errors
/// [`GapError`] where there is nothing to compare: no overlap in time, too few messages, readings
/// that are no numbers or never change.
pub fn diagnose(
    record: &PlacementRecord,
    options: &DiagnoseOptions,
) -> Result<PlacementAnswer, GapError> {
    match diagnose_together(&[("", record)], options) {
        Ok((answer, _)) => Ok(answer),
        Err((_, error)) => Err(error),
    }
}

/// A recording's name, and what is wrong with it.
pub type OfRecording<'r> = (&'r str, GapError);

/// Diagnoses recordings of the same device, each with its name: what is the device's or its mount's
/// ([`cromosim_imu::Owner::Device`]) is the same in all of them, what is a session's is each
/// recording's own. The effects are those of the last recording, with the other sessions beside
/// them. Recordings with nothing to compare are left out, and come back with their name and error.
///
/// # Errors
/// The first recording's name and [`GapError`] where none can be compared.
pub fn diagnose_together<'r>(
    recordings: &[(&'r str, &'r PlacementRecord)],
    options: &DiagnoseOptions,
) -> Result<(PlacementAnswer, Vec<OfRecording<'r>>), OfRecording<'r>> {
    let library = Library::without(&options.excluded);
    let (cut, jumps) = in_parts(recordings);
    let (mut sessions, mut kept, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    let preparing = options.progress.part(&PREPARATION);
    for (index, part) in cut.iter().enumerate() {
        match Session::new(&part.record, &library, None) {
            Ok(session) => {
                sessions.push(session);
                kept.push(part);
            }
            Err(error) => errors.push((part.recording, error)),
        }
        preparing.one_of(index, cut.len()).reached(1.0);
    }
    if sessions.is_empty() {
        return Err(errors.swap_remove(0));
    }
    let units = commonest_units(&sessions);
    for (session, part) in sessions.iter_mut().zip(&kept) {
        if session.units != units {
            *session = Session::new(&part.record, &library, Some(units))
                .map_err(|error| (part.recording, error))?;
        }
    }
    let names: Vec<&str> = kept.iter().map(|part| part.name.as_str()).collect();
    let fields: Vec<&MeasuredField> = kept.iter().map(|part| &part.record.field).collect();
    let findings = analysed(&sessions, &library, &options.progress.part(&ANALYSIS));
    let others = in_neighbouring_units(&findings, &sessions, &kept, &library);
    let of_others = if others.is_empty() {
        Vec::new()
    } else {
        analysed(&others, &library, &Progress::default())
    };
    let (sessions, findings) = if is_without_scale(&of_others) {
        (&others, of_others)
    } else {
        (&sessions, findings)
    };
    let mut answer = answer(findings, sessions, &fields, &names, options);
    if !jumps.is_empty() {
        let verdict = &answer.diagnosis.verdict;
        answer.diagnosis.verdict = format!("{}; {verdict}", jumps_in_words(&jumps));
    }
    answer.diagnosis.clock_jumps = jumps;
    Ok((answer, errors))
}

/// A recording, or a part of it with one clock.
struct Part<'r> {
    recording: &'r str,
    /// The recording's name, and which part.
    name: String,
    record: Cow<'r, PlacementRecord>,
}

/// Takes recordings apart where a clock jumps.
fn in_parts<'r>(recordings: &[(&'r str, &'r PlacementRecord)]) -> (Vec<Part<'r>>, Vec<ClockJump>) {
    let (mut cut, mut all) = (Vec::new(), Vec::new());
    for &(recording, record) in recordings {
        let Parts { parts, jumps } = parts(record);
        let of_recording = |jump| ClockJump {
            recording: recording.to_owned(),
            ..jump
        };
        let set_back = record.set_back.iter().cloned();
        all.extend(jumps.into_iter().chain(set_back).map(of_recording));
        let Some(parts) = parts else {
            cut.push(Part {
                recording,
                name: recording.to_owned(),
                record: Cow::Borrowed(record),
            });
            continue;
        };
        let count = parts.len();
        for (index, record) in parts.into_iter().enumerate() {
            let which = format!("part {}", index + 1);
            cut.push(Part {
                recording,
                name: match (recording.is_empty(), count) {
                    (_, 1) => recording.to_owned(),
                    (true, _) => which,
                    (false, _) => format!("{recording}, {which}"),
                },
                record: Cow::Owned(record),
            });
        }
    }
    (cut, all)
}

/// The device's units that most of the recordings show; of several, those of the first.
fn commonest_units(sessions: &[Session]) -> PerChannel<f64> {
    PerChannel::from_fn(|channel| {
        let factors = || sessions.iter().map(|session| session.units[channel]);
        let count = |factor: f64| factors().filter(|other| *other == factor).count();
        factors()
            .rev()
            .max_by_key(|factor| count(*factor))
            .unwrap_or(1.0)
    })
}

/// Whether a scale of the accelerometer is among no causes.
fn is_without_scale(findings: &[Findings]) -> bool {
    let has = |one: &Findings| one.reportable.contains(EffectKind::AccelScale);
    !findings.is_empty() && !findings.iter().any(has)
}

/// The sessions in units of the accelerometer next to those that the closed forms found, where these
/// leave a scale that brings them there: hundredths of m/s2 and thousandths of g are 2 % apart. None
/// where there is nothing to try.
fn in_neighbouring_units(
    findings: &[Findings],
    sessions: &[Session],
    parts: &[&Part],
    library: &Library,
) -> Vec<Session> {
    let units = sessions[0].units;
    let scale = |one: &Findings| {
        let effect = one.reportable.get(EffectKind::AccelScale)?;
        Some(effect.values().iter().sum::<f64>() / 3.0)
    };
    let found = findings.iter().find_map(scale);
    let off = |factor: f64, scale: f64| (units.accelerometer * scale / factor).ln().abs();
    let nearest = found.and_then(|scale| {
        let factors = unit_factors(Channel::Accelerometer).iter().copied();
        let nearest = factors.min_by(|a, b| off(*a, scale).total_cmp(&off(*b, scale)))?;
        (nearest != units.accelerometer).then_some(nearest)
    });
    let Some(accelerometer) = nearest.filter(|_| library.allows(EffectKind::AccelUnits)) else {
        return Vec::new();
    };
    let units = PerChannel {
        accelerometer,
        ..units
    };
    let in_units = |part: &&Part| Session::new(&part.record, library, Some(units)).ok();
    let all: Option<Vec<Session>> = parts.iter().map(in_units).collect();
    all.unwrap_or_default()
}

/// Fitted causes of hardly any of the gap that are not likely enough to be there, or of the device and little beyond
/// their own standard errors: what other effects leave is taken up by small ones.
fn doubtful(causes: &[Cause], findings: &[Findings]) -> Vec<EffectKind> {
    let is_significant = |kind: EffectKind| {
        findings.iter().any(|one| {
            let effect = one.reportable.get(kind);
            effect.is_some_and(|effect| one.scored.fit.significance(effect) >= LEAST_SIGNIFICANCE)
        })
    };
    let doubtful = |cause: &Cause| {
        let kind = EffectKind::from_name(&cause.effect)?;
        let spec = kind.spec();
        let is_fitted = matches!(spec.search, Search::Fitted(_));
        let is_likely = cause.probability >= LEAST_NAMED
            && (spec.owner == Owner::Session || is_significant(kind));
        let is_doubtful = is_fitted && cause.gap_share < SMALL_SHARE && !is_likely;
        trace(|| {
            let Cause {
                effect,
                probability,
                gap_share,
                ..
            } = cause;
            eprintln!("  {effect} {probability:.2} of {gap_share:.4}, doubtful {is_doubtful}");
        });
        is_doubtful.then_some(kind)
    };
    causes.iter().filter_map(doubtful).collect()
}

fn answer(
    mut findings: Vec<Findings>,
    sessions: &[Session],
    fields: &[&MeasuredField],
    recordings: &[&str],
    options: &DiagnoseOptions,
) -> PlacementAnswer {
    for one in &findings {
        trace(|| eprintln!("{}: {:?}", one.model.prepared.name, names(&one.reportable)));
    }
    let builder = DiagnosisBuilder::new(&findings, sessions, options.seed);
    let diagnosis = builder.diagnosis(recordings);
    let doubtful = doubtful(&diagnosis.causes, &findings);
    if !doubtful.is_empty() {
        // Calibrations among them are taken over all the same.
        for one in &mut findings {
            for kind in &doubtful {
                one.reportable.remove(*kind);
            }
        }
        return answer(findings, sessions, fields, recordings, options);
    }
    let unexplained = builder.unexplained_errors();
    let magnetic: Vec<MagneticRecording> = findings
        .iter()
        .zip(fields)
        .map(|(findings, measured)| MagneticRecording { findings, measured })
        .collect();
    let mut answer = PlacementAnswer {
        diagnosis,
        effects: simulated_effects(&findings, &unexplained, builder.reference_responses()),
        evidence: builder.evidence(recordings),
    };
    if let Some(found) = diagnose_magnetometer(&magnetic) {
        answer.diagnosis.magnetometer = Some(found.diagnosis);
        answer.evidence.magnetic = found.curves;
        (answer.effects.magnetometer, answer.effects.field_in_world) = found.simulated.unzip();
    }
    options.progress.reached(1.0);
    answer
}

/// What a simulation of the device takes: the named effects of the last recording (and those of the
/// other sessions), its noise ([`Findings::simulated_sigma`]), and what stayed unexplained in all of them.
fn simulated_effects(
    findings: &[Findings],
    unexplained: &[UnexplainedErrors],
    mut responses: Vec<Option<MotionResponse>>,
) -> PlacementEffects {
    let (others, last) = findings.split_at(findings.len() - 1);
    let last = &last[0];
    let of_last = responses.pop().flatten();
    let prepared = last.model.prepared;
    let density = |channel| last.simulated_sigma(channel) / prepared.rate_hz.sqrt();
    let mean = |of: fn(&UnexplainedErrors) -> PerChannel<f64>| {
        PerChannel::from_fn(|channel| {
            let all = unexplained.iter().map(|own| of(own)[channel]);
            all.sum::<f64>() / unexplained.len() as f64
        })
    };
    PlacementEffects {
        epoch: prepared.epoch,
        declared_noise: DeclaredNoise {
            accel_density: density(Channel::Accelerometer),
            gyro_density: density(Channel::Gyroscope),
        },
        effects: last.applied(),
        unexplained: UnexplainedErrors {
            variance: mean(|own| own.variance),
            reference_excess: mean(|own| own.reference_excess),
            // The clock is the session's own.
            late: unexplained.last().map(|own| own.late).unwrap_or_default(),
        },
        other_sessions: others
            .iter()
            .zip(responses)
            .map(|(one, reference_response)| OtherSession {
                epoch: one.model.prepared.epoch,
                effects: one.applied(),
                reference_response,
            })
            .collect(),
        reference_response: of_last,
        magnetometer: None,
        field_in_world: None,
    }
}
