//! One placement's diagnosis, from record to answer.

use cromosim_imu::{DeclaredNoise, Effect, EffectKind, EffectSet, PlacementEffects, Reading};
use cromosim_spatial::{KinematicTrack, PoseNoise};

use crate::fit::Context;
use crate::gross::{self, Digital, Gross, insert};
use crate::problem::Problem;
use crate::search::{State, debug, kinds, library};
use crate::sensor_noise::{
    allowed_digital, declared_in_si, found_noise, is_white, mask_clipped, white_noise,
};
use crate::unknown::{self, Unknown};
use crate::whiten::{NoiseBasis, NoiseModel};
use crate::{Evidence, GapError, PlacementDiagnosis, PlacementRecord};

/// Most effects of a set, in the first search and in those that follow.
const FIRST: usize = 2;
const MOST: usize = 5;
/// Rounds of search, each with the noise that the one before leaves.
const ROUNDS: usize = 3;
/// Noise per sample and axis from which on the reference's noise is a cause: m, rad.
const NAMED_NOISE: PoseNoise = PoseNoise {
    position: 1e-3,
    rotation: 0.25 * std::f64::consts::PI / 180.0,
};
/// What the reference's noise ordinarily is at most: m, rad.
const ORDINARY_NOISE: PoseNoise = PoseNoise {
    position: 3e-4,
    rotation: 0.1 * std::f64::consts::PI / 180.0,
};
/// What every recording has: quartz and stamps are no better, mounts and calibrations neither. An
/// effect whose values all stay below is fitted, so that it does not pass for another, but it is no
/// cause. (Scales: distance from 1.)
const ORDINARY: [(EffectKind, f64); 15] = [
    (EffectKind::ReferenceTilt, 2e-3),
    (EffectKind::ReferenceScale, 6e-3),
    (EffectKind::MountRotation, 3e-3),
    (EffectKind::LeverArm, 1e-3),
    (EffectKind::TimeOffset, 2e-3),
    (EffectKind::ClockDrift, 30.0),
    (EffectKind::AccelBias, 5e-3),
    (EffectKind::GyroBias, 4e-4),
    (EffectKind::AccelScale, 2e-3),
    (EffectKind::GyroScale, 2e-3),
    (EffectKind::AccelMisalignment, 3e-3),
    (EffectKind::GyroMisalignment, 3e-3),
    (EffectKind::AccelBiasDrift, 2e-4),
    (EffectKind::GyroBiasDrift, 1.5e-5),
    (EffectKind::GyroGSensitivity, 5e-5),
];
/// Part of the gap's excess over noise (in log-likelihood) below which the unexplained rest is the
/// smaller part.
const MOSTLY: f64 = 0.5;
/// What every sensor has to be calibrated for.
pub(crate) const CALIBRATIONS: [EffectKind; 5] = [
    EffectKind::MountRotation,
    EffectKind::LeverArm,
    EffectKind::TimeOffset,
    EffectKind::AccelBias,
    EffectKind::GyroBias,
];
/// The same of a slip's angle, rad.
const ORDINARY_SLIP: f64 = 5e-3;
/// Variance of the white noise against the declared one from which on it is a cause.
const NAMED_NOISE_RATIO: f64 = 2.0;
/// Steps of quantisation in units of the white noise from which on they are a cause.
const NAMED_STEP: f64 = 1.0;

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct DiagnoseOptions {
    /// Effects taken out of the library.
    pub without: Vec<EffectKind>,
    /// Of the noise in comparisons with the noisy simulation.
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

/// What the analysis found, before it is put into words.
pub(crate) struct Findings<'a> {
    pub context: Context<'a>,
    pub state: State,
    pub digital: [Digital; 2],
    /// White noise per sample that the residual shows.
    pub found: [f64; 2],
    /// All named causes but `unknown`.
    pub named: EffectSet,
    /// What is denied to the library.
    pub without: Vec<EffectKind>,
    /// What none of them explains.
    pub unknown: Option<Unknown>,
    /// Whether little is unknown against what the found effects explain: then calibrations among
    /// these are no imitations of it.
    pub mostly_explained: bool,
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
    let mut problem = Problem::new(record)?;
    let raw = problem.measured.clone();
    let track = problem.track(&problem.estimate);
    let gross = Gross::find(&problem, &track);
    let digital = [0, 1].map(|channel| {
        allowed_digital(gross::digital(&problem.measured, channel), channel, options)
    });
    problem.cover(gross.lag_s)?;
    let covered = problem.usable.clone();
    for (channel, digital) in digital.iter().enumerate() {
        mask_clipped(&mut problem, channel, digital);
    }
    let units = allowed_units(&gross, options);
    for reading in &mut problem.measured {
        reading.specific_force /= units[0];
        reading.angular_velocity /= units[1];
    }
    problem.declared = declared_in_si(&problem, units);
    debug(|| {
        eprintln!(
            "{}: {gross:?} {digital:?} {:?}",
            problem.name,
            problem.estimate.noise()
        )
    });
    let findings = analyse(&problem, track, &gross, digital, units, options);
    debug(|| eprintln!("{}: {:?}", problem.name, kinds(&findings.named)));
    let (diagnosis, evidence) =
        crate::answer::Answer::new(&findings, &problem, &raw, &covered, options).finish();
    let density = |c: usize| findings.problem_sigma(c) / problem.rate_hz.sqrt();
    let effects = PlacementEffects {
        epoch: problem.epoch,
        declared_noise: DeclaredNoise {
            accel_density: density(0),
            gyro_density: density(1),
        },
        effects: findings.named.clone(),
    };
    Ok(PlacementAnswer {
        diagnosis,
        effects,
        evidence,
    })
}

impl Findings<'_> {
    /// Declared white noise per sample in SI units; where unknown, the found one counts as
    /// declared.
    pub fn problem_sigma(&self, channel: usize) -> f64 {
        self.context.problem.declared[channel].unwrap_or(self.found[channel])
    }

    /// Fits once more, each frequency in units of what is left there: else what is unexplained
    /// pulls at the values. Calibrations that help then are taken up.
    fn refit_beside_unknown(&mut self, library: &[EffectKind]) {
        let Some(unknown) = &self.unknown else { return };
        if !self.mostly_explained {
            return;
        }
        let calibrations: Vec<EffectKind> = library
            .iter()
            .copied()
            .filter(|kind| CALIBRATIONS.contains(kind) && !unknown.imitations.contains(kind))
            .collect();
        let residual = self
            .context
            .problem
            .residual(&self.state.fit.prediction.readings);
        let noise = self.context.noise.covering(self.context.problem, &residual);
        let context = Context::new(
            self.context.problem,
            self.context.track.clone(),
            self.context.basis.clone(),
            noise,
        );
        let found = context.search(
            std::slice::from_ref(&self.state.fit.set),
            &calibrations,
            CALIBRATIONS.len(),
        );
        debug(|| {
            eprintln!(
                "beside unknown: {:?} -> {:?}",
                self.state.fit.set.iter().collect::<Vec<_>>(),
                found.fit.set.iter().collect::<Vec<_>>()
            )
        });
        for kind in EffectKind::ALL {
            match (self.state.fit.set.get(kind), found.fit.set.get(kind)) {
                (Some(_), None) => self.named.remove(kind),
                (None, Some(effect)) if !is_ordinary(effect, 1.0) => {
                    self.named.insert(effect.clone())
                }
                (Some(_), Some(effect)) if self.named.contains(kind) => {
                    self.named.insert(effect.clone())
                }
                _ => None,
            };
        }
        let margins = std::mem::take(&mut self.state.margins);
        let covariance = found.fit.linear.covariance;
        self.state = State {
            margins,
            ..self.context.state_as_it_is(found.fit.set)
        };
        // The values are no surer than what is left there allows.
        self.state.fit.linear.covariance = covariance;
    }

    /// Takes out the effects that only imitate what is unknown, and fits the others again.
    fn drop_imitations(&mut self) {
        let Some(unknown) = &self.unknown else { return };
        self.named = without_all(&self.named, &unknown.imitations);
        let fitted = without_all(&self.state.fit.set, &unknown.imitations);
        if fitted == self.state.fit.set {
            return;
        }
        let margins = std::mem::take(&mut self.state.margins);
        self.state = State {
            margins,
            ..self.context.state(fitted)
        };
        for effect in self.state.fit.set.iter() {
            if self.named.contains(effect.kind()) {
                self.named.insert(effect.clone());
            }
        }
    }
}

fn allowed_units(gross: &Gross, options: &DiagnoseOptions) -> [f64; 2] {
    [EffectKind::AccelUnits, EffectKind::GyroUnits].map(|kind| {
        let factor = gross.units[usize::from(kind == EffectKind::GyroUnits)];
        if options.without.contains(&kind) {
            1.0
        } else {
            factor
        }
    })
}

fn analyse<'a>(
    problem: &'a Problem,
    track: KinematicTrack,
    gross: &Gross,
    digital: [Digital; 2],
    units: [f64; 2],
    options: &DiagnoseOptions,
) -> Findings<'a> {
    let starts: Vec<EffectSet> = gross
        .starts()
        .into_iter()
        .map(|set| without_all(&set, &options.without))
        .collect();
    let library = library(&options.without);
    let mut context = first_context(
        problem,
        track,
        &starts[0],
        &digital,
        units,
        &options.without,
    );
    let mut state = context.search(&starts, &library, FIRST);
    debug(|| {
        eprintln!(
            "first: {:?} {:.2?}",
            kinds(&state.fit.set),
            state.fit.held_out_ratio()
        )
    });
    if !options.without.contains(&EffectKind::ReferenceSmoothing) {
        (context, state) = crate::smoothing::try_smoothing(context, state, &starts, &library);
    }
    for round in 0..ROUNDS {
        context = renewed(&context, &state, &digital, &options.without);
        let before = state.fit.set.clone();
        state = context.search(std::slice::from_ref(&before), &library, MOST);
        debug(|| {
            eprintln!(
                "round {round}: {:?} {:.2?}",
                kinds(&state.fit.set),
                state.fit.held_out_ratio()
            )
        });
        if kinds(&before) == kinds(&state.fit.set) {
            break;
        }
    }
    state = context.exchanged(state, &library);
    let residual = problem.residual(&state.fit.prediction.readings);
    let found = found_noise(problem, &residual);
    let white = is_white(problem, &residual);
    let named = named(
        problem,
        &context,
        &state,
        &digital,
        units,
        (found, white),
        &options.without,
    );
    let nominal = context.excess(&context.state(EffectSet::new()).fit);
    let mostly_explained = context.excess(&state.fit) < MOSTLY * nominal;
    let without = options.without.clone();
    let mut findings = Findings {
        context,
        state,
        digital,
        found,
        named,
        without,
        unknown: None,
        mostly_explained,
    };
    for calibrations in [false, true] {
        findings.unknown = unknown::look(&findings, calibrations);
        if findings.unknown.is_none() {
            break;
        }
        findings.drop_imitations();
    }
    findings.refit_beside_unknown(&library);
    findings
}

/// The context of the nominal simulation, with what is certain from the start.
fn first_context<'a>(
    problem: &'a Problem,
    track: KinematicTrack,
    start: &EffectSet,
    digital: &[Digital; 2],
    units: [f64; 2],
    without: &[EffectKind],
) -> Context<'a> {
    let first = problem.predict(&track, start);
    let residual = problem.residual(&first.readings);
    let sigma = white_noise(problem, found_noise(problem, &residual), digital, without);
    let mut basis = NoiseBasis::new(problem.estimate.clone(), sigma);
    basis.rate_squared = track
        .angular_velocity_in_segment
        .iter()
        .map(|w| w.norm_squared())
        .sum::<f64>()
        / track.len() as f64;
    basis.force_squared = first
        .readings
        .iter()
        .map(|r| r.specific_force.norm_squared())
        .sum::<f64>()
        / first.readings.len() as f64;
    if without.contains(&EffectKind::ReferenceNoise) {
        basis.reference_share = ordinary_share(problem.estimate.noise());
    }
    basis.line_hz = suspicious_line(problem, &basis, &first.readings);
    basis.steps = [0, 1].map(|c| {
        digital[c]
            .lsb
            .map_or(0.0, |lsb| lsb / units[c] / sigma[c].max(1e-12))
    });
    let noise = NoiseModel::new(problem, &basis, &residual);
    Context::new(problem, track, basis, noise)
}

/// Shares of a reference's noise densities, position and rotation, that an ordinary reference has.
pub(crate) fn ordinary_share(found: PoseNoise) -> [f64; 2] {
    let share = |ordinary: f64, found: f64| (ordinary / found.max(1e-12)).powi(2).min(1.0);
    [
        share(ORDINARY_NOISE.position, found.position),
        share(ORDINARY_NOISE.rotation, found.rotation),
    ]
}

fn without_all(set: &EffectSet, kinds: &[EffectKind]) -> EffectSet {
    kinds
        .iter()
        .fold(set.clone(), |set, kind| set.without(*kind))
}

/// The context with the noise that the residual of `state` shows, and with its lever arm.
fn renewed<'a>(
    context: &Context<'a>,
    state: &State,
    digital: &[Digital; 2],
    without: &[EffectKind],
) -> Context<'a> {
    let set = &state.fit.set;
    let mut basis = context.basis.clone();
    basis.lever_arm_m = set.get(EffectKind::LeverArm).map_or(0.0, |lever| {
        lever.values().iter().map(|v| v * v).sum::<f64>().sqrt()
    });
    basis.line_hz = match set.get(EffectKind::Vibration) {
        Some(vibration) => vibration.values().first().copied(),
        None => suspicious_line(context.problem, &basis, &state.fit.prediction.readings),
    };
    let residual = context.problem.residual(&state.fit.prediction.readings);
    let found = found_noise(context.problem, &residual);
    basis.sigma = white_noise(context.problem, found, digital, without);
    let noise = NoiseModel::new(context.problem, &basis, &residual);
    Context::new(context.problem, context.track.clone(), basis, noise)
}

/// Frequency of the strongest line of the accelerometer's residual where it may be a vibration.
fn suspicious_line(problem: &Problem, basis: &NoiseBasis, simulated: &[Reading]) -> Option<f64> {
    let values = (EffectKind::Vibration.spec().starts)(&problem.view(basis, simulated))
        .into_iter()
        .next()?;
    let power: f64 = values[1..4]
        .iter()
        .map(|amplitude| 0.5 * amplitude * amplitude)
        .sum();
    (power > 0.3 * basis.sigma[0].powi(2)).then_some(values[0])
}

/// The causes: fitted effects beyond what is ordinary, and those that are read off the readings.
fn named(
    problem: &Problem,
    context: &Context,
    state: &State,
    digital: &[Digital; 2],
    units: [f64; 2],
    (found, white): ([f64; 2], [bool; 2]),
    without: &[EffectKind],
) -> EffectSet {
    let mut set = state.fit.set.clone();
    let noise = problem.estimate.noise();
    let noisy = noise.position >= NAMED_NOISE.position || noise.rotation >= NAMED_NOISE.rotation;
    // What is fitted to a reference this poor is that much poorer.
    let factor = if noisy {
        15.0
    } else if context.basis.undone_hz.is_some() {
        8.0
    } else {
        1.0
    };
    let coarse = [0, 1].map(|c| {
        if context.basis.steps[c] > 3.0 {
            context.basis.steps[c] * context.basis.sigma[c]
        } else {
            0.0
        }
    });
    let seconds = problem.length as f64 / problem.rate_hz;
    for kind in EffectKind::ALL {
        if set.get(kind).is_some_and(|effect| {
            is_ordinary(effect, factor) || is_rounding(effect, coarse, seconds)
        }) {
            set.remove(kind);
        }
    }
    let mut add = |kind: EffectKind, values: Vec<f64>| {
        if !without.contains(&kind) {
            insert(&mut set, kind, values);
        }
    };
    for (c, kinds) in [
        [
            EffectKind::AccelSaturation,
            EffectKind::AccelQuantization,
            EffectKind::AccelNoise,
            EffectKind::AccelUnits,
        ],
        [
            EffectKind::GyroSaturation,
            EffectKind::GyroQuantization,
            EffectKind::GyroNoise,
            EffectKind::GyroUnits,
        ],
    ]
    .into_iter()
    .enumerate()
    {
        if let Some(limit) = digital[c].limit {
            add(kinds[0], vec![limit / units[c]]);
        }
        let step = digital[c].lsb.map_or(0.0, |lsb| lsb / units[c]);
        let declared = problem.declared[c].unwrap_or(found[c]);
        if step > NAMED_STEP * declared && step > 0.0 {
            add(kinds[1], vec![step]);
        }
        // Rounding adds step^2 / 12 of noise of its own.
        let beyond = found[c].powi(2) - step * step / 12.0 - declared.powi(2);
        // What a smoothed reference lacks is broad enough to pass for noise.
        let doubtful = context.basis.undone_hz.is_some() || problem.dropped.0 > 0.02;
        let factor = if doubtful {
            20.0
        } else {
            NAMED_NOISE_RATIO - 1.0
        };
        if problem.declared[c].is_some()
            && white[c]
            && beyond > factor * declared.powi(2) + 0.2 * step * step / 12.0
        {
            add(kinds[2], vec![(beyond / problem.rate_hz).sqrt()]);
        }
        if units[c] != 1.0 {
            add(kinds[3], vec![units[c]]);
        }
    }
    if problem.dropped.0 > 0.0 {
        add(
            EffectKind::DroppedSamples,
            vec![problem.dropped.0, problem.dropped.1.max(1.0)],
        );
    }
    if noisy {
        add(
            EffectKind::ReferenceNoise,
            vec![noise.position, noise.rotation],
        );
    }
    if let Some(cutoff_hz) = context.basis.undone_hz {
        add(EffectKind::ReferenceSmoothing, vec![cutoff_hz]);
    }
    set
}

/// Whether an effect is no larger than what every recording has.
fn is_ordinary(effect: &Effect, factor: f64) -> bool {
    if effect.kind() == EffectKind::MountSlip {
        return effect.values()[1..]
            .iter()
            .map(|value| value * value)
            .sum::<f64>()
            .sqrt()
            < factor * ORDINARY_SLIP;
    }
    let neutral = effect.kind().spec().neutral();
    let size = effect
        .values()
        .iter()
        .zip(&neutral)
        .map(|(value, neutral)| (value - neutral).abs())
        .fold(0.0, f64::max);
    ORDINARY
        .iter()
        .any(|(kind, ordinary)| *kind == effect.kind() && size < factor * ordinary)
}

/// Whether a bias or drift stays below half a step of a coarse rounding: slow motion dwells on one
/// side of a step.
fn is_rounding(effect: &Effect, step: [f64; 2], seconds: f64) -> bool {
    let size = effect
        .values()
        .iter()
        .map(|value| value.abs())
        .fold(0.0, f64::max);
    match effect.kind() {
        EffectKind::AccelBias => size < 0.5 * step[0],
        EffectKind::GyroBias => size < 0.5 * step[1],
        EffectKind::AccelBiasDrift => size * seconds < 0.5 * step[0],
        EffectKind::GyroBiasDrift => size * seconds < 0.5 * step[1],
        _ => false,
    }
}

/// The values of an effect, or none.
pub(crate) fn values_of(set: &EffectSet, kind: EffectKind) -> Option<&[f64]> {
    set.get(kind).map(Effect::values)
}
