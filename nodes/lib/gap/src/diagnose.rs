//! One placement's diagnosis, from record to answer.

use cromosim_imu::{
    Channel, DeclaredNoise, Effect, EffectKind, EffectSet, PerChannel, PlacementEffects, ReadOff,
};
use cromosim_spatial::{FrameGrid, KinematicTrack};

use crate::builder::DiagnosisBuilder;
use crate::coarse_alignment::CoarseAlignment;
use crate::confounding::is_calibration;
use crate::diagnosis::PlacementDiagnosis;
use crate::digital::{Digital, mask_clipped};
use crate::error::GapError;
use crate::evidence::Evidence;
use crate::findings::Findings;
use crate::fit::FitModel;
use crate::library::{Library, without_all};
use crate::noise_updates::{first_model, with_updated_noise};
use crate::policy::report::MOSTLY_EXPLAINED;
use crate::policy::search::{MOST, MOST_AT_FIRST, ROUNDS};
use crate::prepared::{PreparedPlacement, ReferenceReport};
use crate::record::PlacementRecord;
use crate::reportable::{Observations, is_ordinary, reportable_effects};
use crate::search::{ScoredEffectSet, excess, exchanged, score, score_as_it_is, search};
use crate::sensor_noise::{declared_in_si, found_noise, is_white};
use crate::smoothing::try_smoothing;
use crate::trace::{names, trace};
use crate::unknown::{Suspects, detect_unmodelled_structure};

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct DiagnoseOptions {
    /// Effects taken out of the library.
    pub excluded: Vec<EffectKind>,
    /// Seed of the noise in comparisons with the noisy simulation.
    pub seed: u64,
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
    let library = Library::without(&options.excluded);
    let mut prepared = PreparedPlacement::new(record)?;
    let raw = prepared.measured.clone();
    let mut track = prepared.track(&prepared.estimate);
    let alignment = CoarseAlignment::find(&prepared, &track);
    let report = reference_report(record, &alignment, &library);
    if report.length_units != 1.0 || report.frames.is_some() {
        prepared.restore_reference(&record.reference, report)?;
        track = prepared.track(&prepared.estimate);
    }
    let digital =
        PerChannel::from_fn(|channel| Digital::read_off(&prepared.measured, channel, &library));
    prepared.cover(alignment.lag_s)?;
    let covered = prepared.usable.clone();
    for channel in Channel::ALL {
        mask_clipped(&mut prepared, channel, &digital[channel]);
    }
    let units = allowed_units(&alignment, &library);
    bring_to_si(&mut prepared, units);
    trace(|| {
        eprintln!(
            "{}: {alignment:?} {digital:?} {:?}",
            prepared.name,
            prepared.estimate.noise()
        )
    });
    let starts: Vec<EffectSet> = alignment
        .starts()
        .iter()
        .map(|set| library.restrict(set))
        .collect();
    let analysis = Analysis {
        prepared: &prepared,
        starts: &starts,
        digital,
        units,
        library,
    };
    let findings = analysis.run(track);
    trace(|| eprintln!("{}: {:?}", prepared.name, names(&findings.reportable)));
    let (diagnosis, evidence, unexplained) =
        DiagnosisBuilder::new(&findings, &raw, &covered, options.seed).build();
    let effects = simulated_effects(&findings, unexplained);
    Ok(PlacementAnswer {
        diagnosis,
        effects,
        evidence,
    })
}

/// Takes the factors of the device's units out of the readings and of what is declared for them.
fn bring_to_si(prepared: &mut PreparedPlacement, units: PerChannel<f64>) {
    for reading in &mut prepared.measured {
        reading.specific_force /= units.accelerometer;
        reading.angular_velocity /= units.gyroscope;
    }
    prepared.declared = declared_in_si(prepared, units);
}

/// What a simulation of the device takes: the named effects and the declared noise, where none is
/// declared the one that was found.
fn simulated_effects(findings: &Findings, unexplained: PerChannel<f64>) -> PlacementEffects {
    let prepared = findings.model.prepared;
    let density = |channel| findings.declared_sigma(channel) / prepared.rate_hz.sqrt();
    PlacementEffects {
        epoch: prepared.epoch,
        declared_noise: DeclaredNoise {
            accel_density: density(Channel::Accelerometer),
            gyro_density: density(Channel::Gyroscope),
        },
        effects: findings.reportable.clone(),
        unexplained,
    }
}

/// Factors of the units that the library may name; 1 where it may not.
fn allowed_units(alignment: &CoarseAlignment, library: &Library) -> PerChannel<f64> {
    PerChannel::from_fn(|channel| {
        if library.allows_read_off(ReadOff::UnitFactor(channel)) {
            alignment.units[channel]
        } else {
            1.0
        }
    })
}

/// How the reference reports its poses, as far as the library may name it.
fn reference_report(
    record: &PlacementRecord,
    alignment: &CoarseAlignment,
    library: &Library,
) -> ReferenceReport {
    let nominal = ReferenceReport::default();
    ReferenceReport {
        length_units: if library.allows_read_off(ReadOff::ReferenceLength) {
            alignment.length_units
        } else {
            nominal.length_units
        },
        frames: library
            .allows_read_off(ReadOff::ReferenceFrames)
            .then(|| FrameGrid::find(&record.reference))
            .flatten(),
    }
}

/// What the analysis starts from.
struct Analysis<'a> {
    prepared: &'a PreparedPlacement,
    /// Sets of effects that the closed forms found, the best first.
    starts: &'a [EffectSet],
    digital: PerChannel<Digital>,
    /// Factors of the device's units.
    units: PerChannel<f64>,
    library: Library,
}

impl<'a> Analysis<'a> {
    fn run(self, track: KinematicTrack) -> Findings<'a> {
        let fitted = self.library.fitted();
        let (model, scored) = self.searched(track, &fitted);
        let scored = exchanged(&model, scored, &fitted);
        let residual = self.prepared.residual(&scored.fit.prediction.readings);
        let found_noise = found_noise(self.prepared, &residual);
        let reportable = reportable_effects(
            &model,
            &scored.fit.set,
            &Observations {
                digital: &self.digital,
                units: self.units,
                found_noise,
                is_white: is_white(self.prepared, &residual),
            },
            &self.library,
        );
        let nominal = excess(&model, &score(&model, EffectSet::new()).fit);
        let is_mostly_explained = excess(&model, &scored.fit) < MOSTLY_EXPLAINED * nominal;
        let mut findings = Findings {
            model,
            scored,
            digital: self.digital,
            found_noise,
            reportable,
            library: self.library,
            unknown: None,
            is_mostly_explained,
        };
        for suspects in [Suspects::AllButCalibrations, Suspects::All] {
            findings.unknown = detect_unmodelled_structure(&findings, suspects);
            if findings.unknown.is_none() {
                break;
            }
            remove_confounded_effects(&mut findings);
        }
        refit_beside_unknown(&mut findings, &fitted);
        findings
    }

    /// The first search, a smoothing of the reference where one is believed, and rounds of search,
    /// each with the noise that the one before leaves.
    fn searched(
        &self,
        track: KinematicTrack,
        fitted: &[EffectKind],
    ) -> (FitModel<'a>, ScoredEffectSet) {
        let mut model = first_model(
            self.prepared,
            track,
            &self.starts[0],
            &self.digital,
            self.units,
            &self.library,
        );
        let mut scored = search(&model, self.starts, fitted, MOST_AT_FIRST);
        trace_scored("first", &scored);
        if self.library.allows_read_off(ReadOff::ReferenceSpectrum) {
            (model, scored) = try_smoothing(model, scored, self.starts, fitted);
        }
        for round in 0..ROUNDS {
            model = with_updated_noise(&model, &scored, &self.digital, &self.library);
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

/// Takes out the effects that only pass for what is unknown, and fits the others again.
fn remove_confounded_effects(findings: &mut Findings) {
    let Some(unknown) = &findings.unknown else {
        return;
    };
    findings.reportable = without_all(&findings.reportable, &unknown.confounded_effects);
    let fitted = without_all(&findings.scored.fit.set, &unknown.confounded_effects);
    if fitted == findings.scored.fit.set {
        return;
    }
    let margins = std::mem::take(&mut findings.scored.margins);
    findings.scored = ScoredEffectSet {
        margins,
        ..score(&findings.model, fitted)
    };
    for effect in findings.scored.fit.set.iter() {
        if findings.reportable.contains(effect.kind()) {
            findings.reportable.insert(effect.clone());
        }
    }
}

/// Fits once more, each frequency in units of what is left there: else what is unexplained pulls at
/// the values. Calibrations that help then are taken up.
fn refit_beside_unknown(findings: &mut Findings, fitted: &[EffectKind]) {
    let Some(unknown) = &findings.unknown else {
        return;
    };
    if !findings.is_mostly_explained {
        return;
    }
    let calibrations: Vec<EffectKind> = fitted
        .iter()
        .copied()
        .filter(|kind| is_calibration(*kind) && !unknown.confounded_effects.contains(kind))
        .collect();
    let prepared = findings.model.prepared;
    let residual = prepared.residual(&findings.scored.fit.prediction.readings);
    let model = FitModel::new(
        prepared,
        findings.model.track.clone(),
        findings.model.basis.clone(),
        findings.model.noise.covering(prepared, &residual),
    );
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
