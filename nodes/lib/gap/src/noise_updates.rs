//! The model of a placement's noise, made from the residual of the best simulation so far.

use std::sync::Arc;

use cromosim_imu::{EffectKind, EffectSet, PerChannel, ReadOff, Reading, strongest_line};
use cromosim_spatial::{KinematicTrack, PoseEstimate, PoseNoise};

use crate::digital::Digital;
use crate::fit::FitModel;
use crate::library::Library;
use crate::noise_model::{NoiseBasis, NoiseModel, ReferenceShare};
use crate::plausibility::is_strong;
use crate::policy::report::ORDINARY_REFERENCE_NOISE;
use crate::prepared::PreparedPlacement;
use crate::search::ScoredEffectSet;
use crate::sensor_noise::{found_noise, white_noise};

/// The model of the nominal simulation, with what is certain from the start.
pub(crate) fn first_model<'a>(
    prepared: &'a PreparedPlacement,
    track: Arc<KinematicTrack>,
    start: &EffectSet,
    digital: &PerChannel<Digital>,
    library: &Library,
) -> FitModel<'a> {
    let readings = prepared.predict(&track, start).readings;
    let residual = prepared.residual(&readings);
    let sigma = white_noise(
        prepared,
        found_noise(prepared, &residual, digital),
        digital,
        library,
    );
    let mut basis = NoiseBasis::new(prepared.estimate.clone(), sigma);
    basis.rate_squared = track
        .angular_velocity_in_segment
        .iter()
        .map(|rate| rate.norm_squared())
        .sum::<f64>()
        / track.len() as f64;
    basis.force_squared = readings
        .iter()
        .map(|reading| reading.specific_force.norm_squared())
        .sum::<f64>()
        / readings.len() as f64;
    if !library.allows_read_off(ReadOff::ReferenceScatter) {
        basis.reference_share = ordinary_share(prepared.estimate.noise());
    }
    basis.line_hz = suspicious_line(prepared, &basis, &readings);
    basis.steps =
        PerChannel::from_fn(|channel| prepared.steps[channel] / sigma[channel].max(1e-12));
    let noise = NoiseModel::new(prepared, &basis, &residual);
    FitModel::new(prepared, track, basis, noise)
}

/// The model with the noise that the residual of a fitted set shows, and with its lever arm.
pub(crate) fn with_updated_noise<'a>(
    model: &FitModel<'a>,
    scored: &ScoredEffectSet,
    digital: &PerChannel<Digital>,
    library: &Library,
) -> FitModel<'a> {
    let prepared = model.prepared;
    let readings = &scored.fit.prediction.readings;
    let set = &scored.fit.set;
    let mut basis = model.basis.clone();
    basis.lever_arm_m = set.lever_arm().norm();
    basis.line_hz = match set.iter().find_map(|effect| effect.spectral_line()) {
        Some(line) => Some(line.hz),
        None => suspicious_line(prepared, &basis, readings),
    };
    let residual = prepared.residual(readings);
    basis.sigma = white_noise(
        prepared,
        found_noise(prepared, &residual, digital),
        digital,
        library,
    );
    let noise = NoiseModel::new(prepared, &basis, &residual);
    FitModel::new(prepared, model.track.clone(), basis, noise)
}

/// The model whose noise covers what a fitted set leaves, frequency by frequency.
pub(crate) fn with_rest_as_noise<'a>(
    model: &FitModel<'a>,
    scored: &ScoredEffectSet,
) -> FitModel<'a> {
    let prepared = model.prepared;
    let residual = prepared.residual(&scored.fit.prediction.readings);
    FitModel::new(
        prepared,
        model.track.clone(),
        model.basis.clone(),
        model.noise.covering(prepared, &residual),
    )
}

/// The model with another estimate of the reference's motion, and the noise that a set leaves then.
pub(crate) fn with_estimate<'a>(
    model: &FitModel<'a>,
    estimate: PoseEstimate,
    set: &EffectSet,
) -> FitModel<'a> {
    let basis = NoiseBasis {
        estimate: Arc::new(estimate),
        ..model.basis.clone()
    };
    with_basis(model, basis, set)
}

/// The same with filters of the reference that are so much wider; a line that could have been a vibration and is none may be
/// motion that drowns in the reference's noise, as all else.
pub(crate) fn behind_wider_filters<'a>(
    model: &FitModel<'a>,
    wider_hz: f64,
    set: &EffectSet,
    library: &Library,
) -> FitModel<'a> {
    let line = set.iter().find_map(|effect| effect.spectral_line());
    let of_set = line.map(|line| line.hz);
    let line_hz = if library.allows(EffectKind::Vibration) {
        of_set
    } else {
        of_set.or(model.basis.line_hz)
    };
    let basis = NoiseBasis {
        estimate: Arc::new(model.basis.estimate.with_wider_filters(wider_hz)),
        line_hz,
        ..model.basis.clone()
    };
    with_basis(model, basis, set)
}

fn with_basis<'a>(model: &FitModel<'a>, basis: NoiseBasis, set: &EffectSet) -> FitModel<'a> {
    let prepared = model.prepared;
    let track = Arc::new(prepared.track(&basis.estimate));
    let residual = prepared.residual(&prepared.predict(&track, set).readings);
    let noise = NoiseModel::new(prepared, &basis, &residual);
    FitModel::new(prepared, track, basis, noise)
}

/// Shares of a reference's noise densities that an ordinary reference has.
pub(crate) fn ordinary_share(found: PoseNoise) -> ReferenceShare {
    let share = |ordinary: f64, found: f64| (ordinary / found.max(1e-12)).powi(2).min(1.0);
    ReferenceShare {
        position: share(ORDINARY_REFERENCE_NOISE.position, found.position),
        rotation: share(ORDINARY_REFERENCE_NOISE.rotation, found.rotation),
    }
}

/// Frequency of the strongest line of the residual where it may be a vibration, Hz.
fn suspicious_line(
    prepared: &PreparedPlacement,
    basis: &NoiseBasis,
    simulated: &[Reading],
) -> Option<f64> {
    let line = strongest_line(&prepared.view(simulated))?;
    is_strong(&line, basis.sigma).then_some(line.hz)
}
