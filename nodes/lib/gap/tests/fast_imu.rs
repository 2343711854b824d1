//! IMUs at rates that the search thins.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_imu::EffectKind as K;
use support::Scene;
use support::judge::{answer, cause, names_exactly, near, values_are};

fn at(imu_hz: f64, seed: u64) -> Scene {
    Scene {
        imu_hz,
        ..Scene::new(seed)
    }
}

#[test]
fn effects_are_fitted_to_all_readings() {
    let scene = at(286.0, 80)
        .with(K::LeverArm, &[0.03, 0.02, -0.04])
        .with(K::LowPass, &[9.0]);
    let answer = answer(&scene.record());
    names_exactly(&answer.diagnosis, &scene.effects);
    for effect in scene.effects.iter() {
        values_are(&answer.diagnosis, effect);
    }
}

#[test]
fn a_vibration_above_half_of_the_thinned_rate_keeps_its_frequency() {
    // Every third of 300 Hz: 112 Hz look like 12 Hz, 101.3 like motion.
    for true_hz in [112.0, 101.3] {
        let values = [
            true_hz, 0.5, 0.3, 0.4, 0.8, 2.9, 5.1, 0.05, 0.03, 0.08, 1.6, 4.2, 3.0,
        ];
        let scene = at(300.0, 81)
            .with(K::LeverArm, &[0.03, 0.02, -0.04])
            .with(K::Vibration, &values);
        let answer = answer(&scene.record());
        names_exactly(&answer.diagnosis, &scene.effects);
        let hz = &cause(&answer.diagnosis, K::Vibration).parameters["hz"];
        near(hz.as_f64().unwrap(), true_hz, 0.01, "hz");
    }
}

#[test]
fn nothing_is_said_where_nothing_is() {
    let answer = answer(&at(1000.0, 82).record());
    assert!(
        answer.diagnosis.causes.is_empty(),
        "{}",
        answer.diagnosis.verdict
    );
}
