//! Each effect alone, plain to see: exactly it is named, with its values.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::PlacementAnswer;
use cromosim_imu::{Effect, EffectKind as K, STANDARD_GRAVITY};
use cromosim_spatial::{SmoothingKernel, ZeroPhaseSmoothing};
use nalgebra::Vector3;
use support::judge::{answer, cause, names, names_exactly, near, values_are};
use support::motion::Motion;
use support::{IMU_HZ, Scene, seed_of};

/// Names exactly what was put in, with its values.
fn found(scene: &Scene) -> PlacementAnswer {
    let answer = answer(&scene.record());
    names_exactly(&answer.diagnosis, &scene.effects);
    for effect in &scene.effects {
        values_are(&answer.diagnosis, effect);
    }
    answer
}

/// The same, and the simulation follows: the gap of the channels (accelerometer, gyroscope) falls
/// at least to this part.
fn followed(scene: &Scene, parts: [f64; 2]) {
    let gap = found(scene).diagnosis.gap;
    let [accel, gyro] = [
        gap.after.accel_rmse / gap.before.accel_rmse,
        gap.after.gyro_rmse / gap.before.gyro_rmse,
    ];
    assert!(
        accel < parts[0] && gyro < parts[1],
        "{:?}: gaps fall to {accel:.3} and {gyro:.3}",
        scene.effects
    );
    assert!(gap.after.nll_per_sample < gap.before.nll_per_sample);
}

/// A channel that the effect does not touch keeps its gap.
const KEPT: f64 = 1.05;

macro_rules! followed {
    ($($name:ident: $kind:ident $values:expr => $parts:expr;)*) => {
        $(#[test]
        fn $name() {
            followed(&Scene::new(seed_of(K::$kind)).with(K::$kind, &$values), $parts);
        })*
        const FOLLOWED: &[K] = &[$(K::$kind),*];
    };
}

followed! {
    reference_smoothing: ReferenceSmoothing [6.0, 0.0] => [0.5, 0.7];
    reference_interpolation: ReferenceInterpolation [47.3] => [0.75, 0.6];
    reference_tilt: ReferenceTilt [0.04, -0.05, 0.0] => [0.5, KEPT];
    reference_scale: ReferenceScale [1.1] => [0.5, KEPT];
    reference_units: ReferenceUnits [1000.0] => [0.01, KEPT];
    mount_rotation: MountRotation [0.2, -0.15, 0.3] => [0.2, 0.2];
    lever_arm: LeverArm [0.05, 0.02, -0.06] => [0.5, KEPT];
    soft_tissue: SoftTissue [7.0, 0.3] => [0.5, KEPT];
    time_offset: TimeOffset [0.021] => [0.5, 0.5];
    clock_drift: ClockDrift [400.0] => [0.6, 0.6];
    channel_delay: ChannelDelay [0.0115] => [KEPT, 0.2];
    accel_bias: AccelBias [0.2, -0.15, 0.1] => [0.7, KEPT];
    gyro_bias: GyroBias [0.05, -0.06, 0.03] => [KEPT, 0.6];
    accel_scale: AccelScale [1.04, 0.95, 1.03] => [0.6, KEPT];
    gyro_scale: GyroScale [1.04, 0.95, 1.03] => [KEPT, 0.6];
    accel_misalignment: AccelMisalignment [0.03, -0.04, 0.02] => [0.6, KEPT];
    gyro_misalignment: GyroMisalignment [0.03, -0.04, 0.02] => [KEPT, 0.9];
    accel_bias_drift: AccelBiasDrift [0.008, -0.006, 0.007] => [0.9, KEPT];
    gyro_bias_drift: GyroBiasDrift [2e-3, -1.5e-3, 1e-3] => [KEPT, 0.9];
    accel_saturation: AccelSaturation [13.0] => [0.95, KEPT];
    gyro_saturation: GyroSaturation [2.0] => [KEPT, 0.7];
    low_pass: LowPass [8.0] => [0.5, 0.5];
    gyro_g_sensitivity: GyroGSensitivity [2e-3, -1e-3, 1e-3, 1e-3, 2e-3, -2e-3, -1e-3, 1e-3, 2e-3] => [KEPT, 0.95];
    vibration: Vibration [17.3, 0.5, 0.3, 0.4, 0.8, 2.9, 5.1, 0.05, 0.03, 0.08, 1.6, 4.2, 3.0] => [0.7, 0.7];
    axis_convention: AxisConvention [0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0] => [0.05, 0.1];
    accel_units: AccelUnits [1.0 / STANDARD_GRAVITY] => [0.1, KEPT];
    gyro_units: GyroUnits [180.0 / std::f64::consts::PI] => [KEPT, 0.1];
    gravity_convention: GravityConvention [1.0] => [0.1, KEPT];
}

#[test]
fn an_offset_below_half_a_step_is_found_where_readings_go_from_step_to_step() {
    let scene = Scene::new(51).with(K::GyroBias, &[0.016, -0.02, 0.012]);
    let diagnosis = answer(&scene.with(K::GyroQuantization, &[0.06]).record()).diagnosis;
    assert_eq!(names(&diagnosis), ["gyro_bias", "gyro_quantization"]);
}

#[test]
fn units_two_percent_apart_are_told_apart_where_readings_clip() {
    for factor in [100.0, 1000.0 / STANDARD_GRAVITY] {
        let scene = Scene::new(52).with(K::AccelSaturation, &[11.0]);
        let diagnosis = answer(&scene.with(K::AccelUnits, &[factor]).record()).diagnosis;
        assert_eq!(names(&diagnosis), ["accel_saturation", "accel_units"]);
    }
}

#[test]
fn every_unit_of_length_is_known() {
    for (seed, factor) in [
        (43, 100.0),
        (44, 10.0),
        (45, 39.370_078_74),
        (46, 3.280_839_895),
    ] {
        found(&Scene::new(seed).with(K::ReferenceUnits, &[factor]));
    }
}

#[test]
fn a_reference_that_was_smoothed_by_a_gaussian() {
    followed(
        &Scene::new(50).with(K::ReferenceSmoothing, &[4.5, 1.0]),
        [0.5, 0.5],
    );
}

#[test]
fn a_reference_that_was_smoothed_by_a_steep_filter() {
    let of_fourth_order = ZeroPhaseSmoothing {
        cutoff_hz: 3.0,
        kernel: SmoothingKernel::Butterworth { order: 4 },
    };
    let smoothing = Effect::reference_smoothing(&of_fourth_order).unwrap();
    let scene = Scene::new(51).with(K::ReferenceSmoothing, smoothing.values());
    let diagnosis = answer(&scene.record()).diagnosis;
    names_exactly(&diagnosis, &scene.effects);
    // The third order's is as near where motion has few frequencies.
    let found = &cause(&diagnosis, K::ReferenceSmoothing).parameters;
    let kernel = found["kernel"].as_str().unwrap();
    assert!(
        ["butterworth_3", "butterworth_4"].contains(&kernel),
        "{kernel}"
    );
    near(found["cutoff_hz"].as_f64().unwrap(), 3.0, 0.15, "cutoff");
    let (before, after) = (&diagnosis.gap.before, &diagnosis.gap.after);
    assert!(after.accel_rmse < 0.3 * before.accel_rmse, "{after:?}");
}

#[test]
fn a_gyroscope_that_is_early() {
    followed(
        &Scene::new(47).with(K::ChannelDelay, &[-0.004]),
        [KEPT, 0.4],
    );
}

#[test]
fn a_vibration_of_the_accelerometer_alone() {
    let scene = Scene::new(48);
    let values = [
        17.3, 0.5, 0.3, 0.4, 0.8, 0.8, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    ];
    let diagnosis = answer(&scene.with(K::Vibration, &values).record()).diagnosis;
    assert_eq!(names(&diagnosis), ["vibration"]);
    assert!(diagnosis.gap.after.accel_rmse < 0.7 * diagnosis.gap.before.accel_rmse);
}

#[test]
fn a_vibration_of_the_gyroscope_alone() {
    let scene = Scene::new(49);
    let values = [
        23.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.03, 0.08, 1.6, 4.2, 3.0,
    ];
    let diagnosis = answer(&scene.with(K::Vibration, &values).record()).diagnosis;
    assert_eq!(names(&diagnosis), ["vibration"]);
    assert!(diagnosis.gap.after.gyro_rmse < 0.5 * diagnosis.gap.before.gyro_rmse);
}

/// What is left is small, and far from a straight line in the tissue's values: a whole step from a first guess leads
/// nowhere.
#[test]
fn a_tissue_under_slow_motion() {
    for (seed, values) in [(53, [8.2, 0.38]), (54, [6.8, 0.15])] {
        let mut scene = Scene::new(seed).with(K::SoftTissue, &values);
        scene.motion = scene.motion.slowed(2.0);
        let diagnosis = answer(&scene.record()).diagnosis;
        assert_eq!(names(&diagnosis), ["soft_tissue"], "{values:?}");
    }
}

/// An axis on which there is no motion has a gain of zero by the reference's noise there, which its readings do not have.
#[test]
fn gains_where_all_motion_is_in_a_plane() {
    for (kind, seed) in [(K::AccelScale, 57), (K::GyroScale, 58)] {
        let mut scene = Scene::new(seed).with(kind, &[1.02, 1.02, 1.02]);
        scene.motion = Motion::pendulum();
        let diagnosis = answer(&scene.record()).diagnosis;
        assert_eq!(names(&diagnosis), [kind.name()], "{}", diagnosis.verdict);
    }
}

/// A simulation that rounded as well would be farther off than one that does not know of the rounding.
#[test]
fn rounding_makes_no_channel_worse() {
    let scene = Scene::new(59)
        .with(K::AccelQuantization, &[0.08])
        .with(K::GyroQuantization, &[0.006]);
    let diagnosis = answer(&scene.record()).diagnosis;
    names_exactly(&diagnosis, &scene.effects);
    let (before, after) = (&diagnosis.gap.before, &diagnosis.gap.after);
    assert!(after.accel_rmse < 1.01 * before.accel_rmse, "{after:?}");
    assert!(after.gyro_rmse < 1.01 * before.gyro_rmse, "{after:?}");
}

/// Readings that stay on a step show no noise; what the device declares in SI units is not taken for its own.
#[test]
fn a_bias_beside_milli_degrees_that_are_rounded_coarsely() {
    let scene = Scene::new(56)
        .with(K::AccelBias, &[0.2, -0.15, 0.1])
        .with(K::GyroUnits, &[180_000.0 / std::f64::consts::PI])
        .with(K::GyroQuantization, &[1.0]);
    let diagnosis = answer(&scene.record()).diagnosis;
    assert_eq!(
        names(&diagnosis),
        ["accel_bias", "gyro_quantization", "gyro_units"]
    );
}

/// Names of the causes where what the sensor is on shakes as a whole, by 1 m/s2 about: the reference shows it, too, by
/// less than its noise.
fn causes_of_what_shakes_the_reference_too(hz: f64) -> Vec<String> {
    let scene = Scene::new(51);
    let (amplitude, phase) = ([0.9, 1.2, 0.7], [0.4, 2.0, 5.1]);
    let [x, y, z] = amplitude;
    let [px, py, pz] = phase;
    let values = [hz, x, y, z, px, py, pz, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let epoch = scene.epoch;
    let mut record = scene.with(K::Vibration, &values).record();
    let turn = std::f64::consts::TAU * hz;
    let poses = &mut record.reference;
    for ((stamp, position), rotation) in poses
        .stamps
        .iter()
        .zip(&mut poses.positions)
        .zip(&poses.rotations)
    {
        let angle = turn * (*stamp - epoch);
        let axes: [f64; 3] = std::array::from_fn(|k| -amplitude[k] * (angle + phase[k]).sin());
        *position += rotation * Vector3::from(axes) / turn.powi(2);
    }
    let causes = answer(&record).diagnosis.causes;
    causes.into_iter().map(|cause| cause.effect).collect()
}

#[test]
fn a_machine_that_shakes_the_reference_too_is_a_vibration() {
    assert_eq!(causes_of_what_shakes_the_reference_too(24.8), ["vibration"]);
    // As fast as a body moves it is motion that the reference shows too little of.
    let slower = causes_of_what_shakes_the_reference_too(9.0);
    assert!(!slower.contains(&"vibration".to_owned()), "{slower:?}");
}

#[test]
fn mount_slip() {
    let scene = Scene::new(40);
    let at = scene.epoch.as_seconds() + 31.3;
    followed(
        &scene.with(K::MountSlip, &[at, 0.1, -0.12, 0.15]),
        [0.2, 0.3],
    );
}

#[test]
fn gravity_negated() {
    followed(
        &Scene::new(41).with(K::GravityConvention, &[2.0]),
        [0.1, KEPT],
    );
}

#[test]
fn accel_units_declared_in_them() {
    let mut scene = Scene::new(42).with(K::AccelUnits, &[1000.0 / STANDARD_GRAVITY]);
    let declared = &mut scene.declared.accelerometer;
    *declared = declared.map(|sigma| sigma * 1000.0 / STANDARD_GRAVITY);
    followed(&scene, [0.1, KEPT]);
}

macro_rules! noise_like {
    ($($name:ident: $kind:ident $values:expr;)*) => {
        $(#[test]
        fn $name() {
            found(&Scene::new(seed_of(K::$kind)).with(K::$kind, &$values));
        })*
        const NOISE_LIKE: &[K] = &[$(K::$kind),*];
    };
}

// No simulation follows these sample by sample.
noise_like! {
    reference_noise: ReferenceNoise [4e-3, 0.014];
    accel_noise: AccelNoise [0.01];
    gyro_noise: GyroNoise [1e-3];
    accel_quantization: AccelQuantization [0.2];
    gyro_quantization: GyroQuantization [0.018];
}

/// Counted against what was lost, which scatters about the chances that the effect states.
#[test]
fn dropped_samples() {
    let scene = Scene::new(7).with(K::DroppedSamples, &[0.08, 4.0]);
    let record = scene.record();
    let diagnosis = answer(&record).diagnosis;
    names_exactly(&diagnosis, &scene.effects);
    let steps: Vec<f64> = record
        .imu
        .stamps
        .windows(2)
        .map(|pair| ((pair[1] - pair[0]) * IMU_HZ).round() - 1.0)
        .collect();
    let (lost, gaps) = (
        steps.iter().sum::<f64>(),
        steps.iter().filter(|lost| **lost > 0.0).count() as f64,
    );
    let parameters = &cause(&diagnosis, K::DroppedSamples).parameters;
    let all = lost + record.imu.stamps.len() as f64;
    near(
        parameters["fraction"].as_f64().unwrap(),
        lost / all,
        1e-9,
        "fraction",
    );
    near(
        parameters["mean_burst"].as_f64().unwrap(),
        lost / gaps,
        1e-9,
        "mean burst",
    );
}

#[test]
fn none_is_left_out() {
    let tested = |kind: &K| {
        FOLLOWED.contains(kind)
            || NOISE_LIKE.contains(kind)
            || [K::MountSlip, K::DroppedSamples].contains(kind)
            // Not searched for: device files state them.
            || matches!(kind.spec().search, cromosim_imu::Search::Given)
    };
    assert!(
        K::ALL.iter().all(tested),
        "{:?}",
        K::ALL
            .iter()
            .filter(|kind| !tested(kind))
            .collect::<Vec<_>>()
    );
}
