//! Effects of the library beside one that is outside of it.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_imu::EffectKind as K;
use support::Scene;
use support::judge::{answer, names, values_are};

/// A gyroscope whose error grows with the square of its own rate (rad/s per (rad/s)^2), on top of
/// what the library has.
fn with_squares(scene: &Scene, factor: f64) -> cromosim_gap::PlacementRecord {
    let mut record = scene.record();
    for reading in &mut record.imu.readings {
        let rate = reading.angular_velocity;
        reading.angular_velocity += factor * rate.map(|axis| axis * axis.abs());
    }
    record
}

#[test]
fn what_explains_as_much_as_any_regression_would_stays_a_cause() {
    // The family "other axes" holds every misalignment, and yet that is the plainer answer.
    let scene = Scene::new(70)
        .with(K::GyroMisalignment, &[0.04, -0.03, 0.05])
        .with(K::LeverArm, &[0.03, 0.02, -0.04]);
    let diagnosis = answer(&with_squares(&scene, 0.004)).diagnosis;
    let said = names(&diagnosis);
    for effect in ["gyro_misalignment", "lever_arm", "unknown"] {
        assert!(said.contains(&effect), "{effect}: {}", diagnosis.verdict);
    }
    values_are(&diagnosis, scene.effects.get(K::LeverArm).unwrap());
}
