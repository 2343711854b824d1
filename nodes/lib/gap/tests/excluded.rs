//! Effects that the library is excluded: their gap is `unknown`.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::{DiagnoseOptions, PlacementAnswer, diagnose};
use cromosim_imu::EffectKind as K;
use cromosim_imu::STANDARD_GRAVITY;
use support::judge::{names, shares_add_up};
use support::{Scene, seed_of};

/// Without the effect the gap holds structure that nothing explains.
fn excluded(kind: K, values: &[f64]) -> PlacementAnswer {
    let options = DiagnoseOptions {
        excluded: vec![kind],
        ..DiagnoseOptions::default()
    };
    let answer = diagnose(
        &Scene::new(seed_of(kind)).with(kind, values).record(),
        &options,
    )
    .unwrap();
    let diagnosis = &answer.diagnosis;
    assert!(
        names(diagnosis).contains(&"unknown") && diagnosis.unexplained.significant,
        "{}",
        diagnosis.verdict
    );
    assert!(!names(diagnosis).contains(&kind.name()) && !answer.effects.effects.contains(kind));
    shares_add_up(diagnosis);
    answer
}

/// Where factors on the simulation tell nothing of the reference's noise either.
#[test]
fn what_is_faster_than_what_references_show_is_unknown() {
    let values = [
        71.0, 0.5, 0.3, 0.4, 0.8, 2.9, 5.1, 0.05, 0.03, 0.08, 1.6, 4.2, 3.0,
    ];
    let scene = Scene {
        imu_hz: 200.0,
        ..Scene::new(62)
    };
    let options = DiagnoseOptions {
        excluded: vec![K::Vibration],
        ..DiagnoseOptions::default()
    };
    let record = scene.with(K::Vibration, &values).record();
    let diagnosis = diagnose(&record, &options).unwrap().diagnosis;
    assert!(
        names(&diagnosis).contains(&"unknown"),
        "{}",
        diagnosis.verdict
    );
}

/// And nothing else is said with it.
fn excluded_alone(kind: K, values: &[f64]) {
    let answer = excluded(kind, values);
    let diagnosis = &answer.diagnosis;
    assert_eq!(names(diagnosis), ["unknown"], "{}", diagnosis.verdict);
    let applied: Vec<&str> = answer
        .effects
        .effects
        .iter()
        .map(|effect| effect.kind().name())
        .collect();
    let kept = diagnosis.calibration.iter();
    let kept: Vec<&str> = kept.map(|kept| kept.effect.as_str()).collect();
    assert_eq!(
        applied, kept,
        "a simulation takes over the plain calibration alone"
    );
    let (before, after) = (&diagnosis.gap.before, &diagnosis.gap.after);
    assert!(
        after.accel_rmse <= 1.02 * before.accel_rmse && after.gyro_rmse <= 1.02 * before.gyro_rmse,
        "{kept:?} make nothing worse: {before:?} to {after:?}"
    );
    let unknown = &diagnosis.causes[0];
    assert!(unknown.gap_share > 0.0);
    let channel = unknown.parameters["channel"].as_str().unwrap();
    let name = kind.name();
    let expected = if name.starts_with("accel_") {
        "accel"
    } else if name.starts_with("gyro_") {
        "gyro"
    } else {
        channel
    };
    assert_eq!(channel, expected, "the channel of {name}");
    for key in ["axes", "band_hz", "intervals_s", "depends_on"] {
        assert!(unknown.parameters.contains_key(key), "{key}");
    }
}

macro_rules! excluded {
    ($($name:ident: $kind:ident $values:expr;)*) => {
        $(#[test]
        fn $name() {
            excluded_alone(K::$kind, &$values);
        })*
    };
}

// Not here, because another effect says the same: time_offset (a low-pass of that delay),
// gyro_quantization (white noise).
excluded! {
    mount_rotation: MountRotation [0.2, -0.15, 0.3];
    lever_arm: LeverArm [0.05, 0.02, -0.06];
    dropped_samples: DroppedSamples [0.06, 3.0];
    accel_bias: AccelBias [0.2, -0.15, 0.1];
    gyro_scale: GyroScale [1.04, 0.95, 1.03];
    accel_bias_drift: AccelBiasDrift [0.008, -0.006, 0.007];
    gyro_saturation: GyroSaturation [2.0];
    gyro_g_sensitivity: GyroGSensitivity [2e-3, -1e-3, 1e-3, 1e-3, 2e-3, -2e-3, -1e-3, 1e-3, 2e-3];
    vibration: Vibration [17.3, 0.5, 0.3, 0.4, 0.8, 2.9, 5.1, 0.05, 0.03, 0.08, 1.6, 4.2, 3.0];
    axis_convention: AxisConvention [0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    accel_units: AccelUnits [1.0 / STANDARD_GRAVITY];
    gravity_convention: GravityConvention [1.0];
}

/// Chords between frames are a smoothing (a triangle's, near a Gaussian's), and undoing one helps.
#[test]
fn reference_interpolation() {
    let options = DiagnoseOptions {
        excluded: vec![K::ReferenceInterpolation],
        ..DiagnoseOptions::default()
    };
    let scene = Scene::new(seed_of(K::ReferenceInterpolation));
    let record = scene.with(K::ReferenceInterpolation, &[24.0]).record();
    let diagnosis = diagnose(&record, &options).unwrap().diagnosis;
    assert_eq!(names(&diagnosis), ["reference_smoothing"]);
    let (before, after) = (&diagnosis.gap.before, &diagnosis.gap.after);
    assert!(
        after.accel_rmse < 0.5 * before.accel_rmse && after.gyro_rmse < 0.5 * before.gyro_rmse,
        "{}",
        diagnosis.verdict
    );
}

// Of these other effects explain a part.
#[test]
fn clock_drift() {
    excluded(K::ClockDrift, &[400.0]);
}

#[test]
fn reference_tilt() {
    excluded(K::ReferenceTilt, &[0.04, -0.05, 0.0]);
}

#[test]
fn reference_units() {
    excluded(K::ReferenceUnits, &[1000.0]);
}

#[test]
fn channel_delay() {
    excluded(K::ChannelDelay, &[0.0115]);
}

#[test]
fn low_pass() {
    excluded(K::LowPass, &[8.0]);
}

#[test]
fn soft_tissue() {
    excluded(K::SoftTissue, &[7.0, 0.3]);
}

#[test]
fn reference_scale() {
    excluded(K::ReferenceScale, &[1.1]);
}
