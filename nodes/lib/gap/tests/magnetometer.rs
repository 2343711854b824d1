//! What is put into a magnetometer is found again, with its standard errors, and nothing else.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::{
    DiagnoseOptions, MagnetometerDiagnosis, MeasuredField, PlacementRecord, diagnose,
};
use cromosim_imu::{EffectKind, normal_pair};
use cromosim_spatial::so3;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use support::Scene;
use support::motion::Motion;

/// Of the place, T.
const FIELD: Vector3<f64> = Vector3::new(3e-6, 1.9e-5, -4.4e-5);
/// White noise per reading, T.
const SIGMA: f64 = 3e-7;
/// Readings per second, Hz: not the IMU's.
const HZ: f64 = 50.0;

/// A magnetometer as the test knows it, by a formula of its own.
#[derive(Clone)]
struct Truth {
    hard: Vector3<f64>,
    soft: Matrix3<f64>,
    axes: Matrix3<f64>,
    delay: f64,
}

impl Default for Truth {
    fn default() -> Self {
        Self {
            hard: Vector3::zeros(),
            soft: Matrix3::identity(),
            axes: Matrix3::identity(),
            delay: 0.0,
        }
    }
}

impl Truth {
    /// The scene's IMU has a mount of 0.3 rad and stamps that are 30 ms late.
    fn record(&self, seed: u64, motion: Option<Motion>) -> PlacementRecord {
        let mount = Vector3::new(0.2, -0.1, 0.2);
        let late_s = 0.03;
        let mut scene = Scene::new(seed)
            .with(EffectKind::MountRotation, mount.as_slice())
            .with(EffectKind::TimeOffset, &[late_s]);
        if let Some(motion) = motion {
            scene.motion = motion;
        }
        let mut random = ChaCha12Rng::seed_from_u64(seed ^ 0xfe1d);
        let mut noise = || {
            let ([x, y], [z, _]) = (normal_pair(&mut random), normal_pair(&mut random));
            Vector3::new(x, y, z) * SIGMA
        };
        let mut field = MeasuredField::default();
        for k in 0..(scene.seconds * HZ) as usize {
            let seconds = k as f64 / HZ;
            let turned = scene
                .motion
                .at(seconds - late_s - self.delay)
                .world_from_segment;
            let in_sensor = (turned * so3::exp(&mount)).inverse() * FIELD;
            field.stamps.push(scene.start.plus_seconds(seconds));
            field
                .readings
                .push(self.soft * self.axes * in_sensor + self.hard + noise());
        }
        PlacementRecord {
            field,
            ..scene.record()
        }
    }

    fn found(&self, seed: u64) -> MagnetometerDiagnosis {
        diagnosed(&self.record(seed, None))
    }
}

fn diagnosed(record: &PlacementRecord) -> MagnetometerDiagnosis {
    let answer = diagnose(record, &DiagnoseOptions::default()).unwrap();
    answer.diagnosis.magnetometer.unwrap()
}

/// Of an effect: values and standard errors, flat.
fn values(found: &MagnetometerDiagnosis, effect: &str) -> (Vec<f64>, Vec<f64>) {
    let cause = found
        .causes
        .iter()
        .find(|cause| cause.effect == effect)
        .unwrap();
    fn flat(value: &serde_json::Value) -> Vec<f64> {
        match value.as_array() {
            Some(items) => items.iter().flat_map(flat).collect(),
            None => vec![value.as_f64().unwrap()],
        }
    }
    let errors = cause.standard_errors.get(effect).map(flat);
    (flat(&cause.parameters[effect]), errors.unwrap_or_default())
}

/// Exactly these are named, each value within four standard errors, and none with a useless one.
fn is_found(truth: &Truth, seed: u64, effects: &[&str]) {
    let found = truth.found(seed);
    let mut names: Vec<&str> = found
        .causes
        .iter()
        .map(|cause| cause.effect.as_str())
        .collect();
    names.sort_unstable();
    assert_eq!(names, effects, "{found:#?}");
    let scale = truth.soft.determinant().cbrt();
    for effect in effects {
        let (found, errors) = values(&found, effect);
        let soft = truth.soft / scale;
        let rows = |of: &Matrix3<f64>| of.transpose().as_slice().to_vec();
        let (wanted, useless) = match *effect {
            "hard_iron" => (truth.hard.as_slice().to_vec(), 1e-6),
            "soft_iron" => (rows(&soft), 0.02),
            "delay" => (vec![truth.delay], 2e-3),
            _ => (rows(&truth.axes), 0.0),
        };
        for (k, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            let error = errors.get(k).copied().unwrap_or_default();
            assert!(
                (found - wanted).abs() <= 4.0 * error + 1e-12 && error <= useless,
                "{effect} {k}: {found} +- {error}, put in {wanted}"
            );
        }
    }
    let gap = found.gap.unwrap();
    assert!(gap.after < 1.15 * SIGMA * 3f64.sqrt(), "{gap:?}");
    assert!((found.noise_density * HZ.sqrt() / SIGMA - 1.0).abs() < 0.15);
    let field = Vector3::from(found.field_in_world.unwrap());
    assert!((field - FIELD * scale).norm() < 1e-6, "{field}");
    let shares: f64 = found.causes.iter().map(|cause| cause.gap_share).sum();
    assert!(shares <= 1.0 + 1e-9, "{shares}");
}

const SOFT: [f64; 9] = [1.08, 0.03, -0.02, 0.01, 0.94, 0.04, -0.03, 0.02, 1.02];

#[test]
fn a_clean_one_says_nothing() {
    for seed in [1, 2, 3] {
        is_found(&Truth::default(), seed, &[]);
    }
}

#[test]
fn hard_iron_alone() {
    let hard = Vector3::new(6e-6, -3e-6, 2e-6);
    is_found(
        &Truth {
            hard,
            ..Truth::default()
        },
        11,
        &["hard_iron"],
    );
}

#[test]
fn soft_iron_alone() {
    let soft = Matrix3::from_row_slice(&SOFT);
    is_found(
        &Truth {
            soft,
            ..Truth::default()
        },
        12,
        &["soft_iron"],
    );
}

#[test]
fn a_delay_alone_early_or_late() {
    for (seed, delay) in [(13, 0.025), (14, -0.012), (15, 0.18)] {
        is_found(
            &Truth {
                delay,
                ..Truth::default()
            },
            seed,
            &["delay"],
        );
    }
}

#[test]
fn axes_of_another_chip() {
    let axes = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    is_found(
        &Truth {
            axes,
            ..Truth::default()
        },
        16,
        &["axes"],
    );
}

#[test]
fn all_of_them_together() {
    let truth = Truth {
        hard: Vector3::new(-1.2e-5, 8e-6, 2.5e-5),
        soft: Matrix3::from_row_slice(&SOFT),
        delay: 0.04,
        ..Truth::default()
    };
    is_found(&truth, 17, &["delay", "hard_iron", "soft_iron"]);
}

#[test]
fn what_rest_cannot_tell_is_said() {
    let hard = Vector3::new(6e-6, -3e-6, 2e-6);
    let record = Truth {
        hard,
        ..Truth::default()
    }
    .record(18, Some(Motion::rest()));
    let found = diagnosed(&record);
    assert!(found.causes.is_empty(), "{found:#?}");
    let open: Vec<&str> = found
        .unidentifiable
        .iter()
        .map(|one| one.effect.as_str())
        .collect();
    assert_eq!(open, ["hard_iron", "soft_iron", "delay"]);
}

#[test]
fn a_passing_magnet_moves_nothing() {
    let hard = Vector3::new(6e-6, -3e-6, 2e-6);
    let mut record = Truth {
        hard,
        ..Truth::default()
    }
    .record(19, None);
    for reading in &mut record.field.readings[500..650] {
        *reading += Vector3::new(4e-5, -2e-5, 3e-5);
    }
    let (found, _) = values(&diagnosed(&record), "hard_iron");
    let off = (Vector3::from_row_slice(&found) - hard).norm();
    assert!(off < 5e-7, "{off}");
}

#[test]
fn another_unit_and_too_few_readings_are_said() {
    let mut record = Truth::default().record(20, None);
    for reading in &mut record.field.readings {
        *reading *= 1e6;
    }
    let found = diagnosed(&record);
    assert!(
        found.verdict.contains("tesla") && found.causes.is_empty(),
        "{found:?}"
    );
    record.field.stamps.truncate(20);
    record.field.readings.truncate(20);
    assert!(diagnosed(&record).verdict.contains("fewer than 50"));
}

#[test]
fn two_recordings_share_the_device_and_not_the_field() {
    let truth = Truth {
        hard: Vector3::new(6e-6, -3e-6, 2e-6),
        soft: Matrix3::from_row_slice(&SOFT),
        ..Truth::default()
    };
    let first = truth.record(21, None);
    let mut second = truth.record(22, None);
    // Turned by the reference's world: x is where y was.
    let turn = so3::exp(&Vector3::new(0.0, 0.0, 0.8));
    for (position, rotation) in second
        .reference
        .positions
        .iter_mut()
        .zip(&mut second.reference.rotations)
    {
        *position = turn * *position;
        *rotation = turn * *rotation;
    }
    let recordings = [("first", &first), ("second", &second)];
    let (answer, _) =
        cromosim_gap::diagnose_together(&recordings, &DiagnoseOptions::default()).unwrap();
    let found = answer.diagnosis.magnetometer.unwrap();
    let (hard, _) = values(&found, "hard_iron");
    assert!(
        (Vector3::from_row_slice(&hard) - truth.hard).norm() < 2e-7,
        "{hard:?}"
    );
    let scale = truth.soft.determinant().cbrt();
    let field = Vector3::from(found.field_in_world.unwrap());
    assert!((field - turn * FIELD * scale).norm() < 1e-6, "{field}");
    let simulated = answer.effects.magnetometer.unwrap();
    assert!((simulated.soft_iron - truth.soft / scale).amax() < 0.01);
    assert_eq!(answer.effects.field_in_world.unwrap(), field);
}
