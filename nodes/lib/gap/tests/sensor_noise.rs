//! What is taken for the noise of a sensor, and what it is taken for.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_imu::{EffectKind as K, PerChannel};
use support::judge::{answer, names, near};
use support::motion::Motion;
use support::{IMU_HZ, SIGMA, Scene};

#[test]
fn noise_beside_rest_is_no_unit() {
    // A twentieth of a radian a second about one axis, and noise of as much in degrees.
    let scene = Scene {
        motion: Motion::sway(0.5),
        declared: PerChannel::default(),
        seconds: 30.0,
        ..Scene::new(11)
    };
    let diagnosis = answer(&scene.with(K::GyroNoise, &[0.176]).record()).diagnosis;
    let named = names(&diagnosis);
    assert!(!named.contains(&"gyro_units"), "{named:?}");
}

#[test]
fn less_noise_than_declared_is_simulated() {
    let scene = Scene {
        declared: PerChannel {
            accelerometer: Some(3.0 * SIGMA[0]),
            gyroscope: Some(3.0 * SIGMA[1]),
        },
        ..Scene::new(12)
    };
    let answer = answer(&scene.record());
    assert_eq!(names(&answer.diagnosis), [""; 0]);
    let noise = answer.effects.declared_noise;
    // By the loudest of four bands, which scatter.
    for (density, sigma) in [noise.accel_density, noise.gyro_density]
        .into_iter()
        .zip(SIGMA)
    {
        near(density * IMU_HZ.sqrt() / sigma, 1.05, 0.1, "noise");
    }
}

#[test]
fn motion_that_no_reference_resolves_is_no_noise() {
    let scene = Scene {
        motion: Motion::random(13).shivering(0.3, 13),
        imu_hz: 50.0,
        ..Scene::new(13)
    };
    let diagnosis = answer(&scene.record()).diagnosis;
    let named = names(&diagnosis);
    assert!(!named.contains(&"accel_noise"), "{named:?}");
    // Noise of as much is.
    let noisy = Scene {
        motion: Motion::random(13),
        ..scene
    };
    let diagnosis = answer(&noisy.with(K::AccelNoise, &[0.02]).record()).diagnosis;
    assert_eq!(names(&diagnosis), ["accel_noise"]);
}

#[test]
fn noise_is_told_below_motion_that_no_reference_resolves() {
    for seed in [20, 21] {
        let scene = Scene {
            motion: Motion::random(seed).shivering(1.5, seed),
            imu_hz: 50.0,
            ..Scene::new(seed)
        };
        let answer = answer(&scene.with(K::AccelNoise, &[0.02]).record());
        assert_eq!(names(&answer.diagnosis), ["accel_noise"]);
        let density = &answer.diagnosis.causes[0].parameters["density"];
        near(density.as_f64().unwrap(), 0.02, 0.001, "density");
    }
}

#[test]
fn motion_that_folds_over_is_no_noise() {
    // The reference resolves the motion up to half of the IMU's rate, and not beyond.
    for seed in [22, 23] {
        let motion = Motion::random(seed).humming(1.0, 4.0..12.0, seed);
        let scene = Scene {
            motion: motion.humming(0.3, 13.0..25.0, seed + 10),
            imu_hz: 25.0,
            ..Scene::new(seed)
        };
        assert_eq!(names(&answer(&scene.record()).diagnosis), [""; 0]);
    }
}

#[test]
fn an_error_of_the_reference_that_folds_over_is_no_noise() {
    // The reference resolves motion beyond half of the IMU's rate, so that nothing of its error is kept out.
    for seed in [18, 19] {
        let scene = Scene {
            motion: Motion::random(seed).shivering(12.0, seed),
            imu_hz: 25.0,
            seconds: 90.0,
            ..Scene::new(seed)
        };
        assert_eq!(names(&answer(&scene.record()).diagnosis), [""; 0]);
        // Noise of a multiple is some.
        let diagnosis = answer(&scene.with(K::AccelNoise, &[0.3]).record()).diagnosis;
        assert_eq!(names(&diagnosis), ["accel_noise"]);
    }
}

#[test]
fn rounding_is_no_noise_beside_the_rounding() {
    // Steps of 0.5 m/s2 leave 0.144 m/s2 of their own, of which an undeclared noise has nothing.
    let scene = Scene {
        declared: PerChannel::default(),
        ..Scene::new(14)
    };
    let answer = answer(&scene.with(K::AccelQuantization, &[0.5]).record());
    assert_eq!(names(&answer.diagnosis), ["accel_quantization"]);
    let noise = answer.effects.declared_noise.accel_density * IMU_HZ.sqrt();
    assert!(noise < 0.05, "{noise}");
}

#[test]
fn noise_is_told_where_messages_are_missing() {
    let scene = Scene {
        motion: Motion::random(16).slowed(4.0),
        imu_hz: 200.0,
        ..Scene::new(16)
    };
    let scene = scene
        .with(K::DroppedSamples, &[0.15, 3.0])
        .with(K::GyroNoise, &[3.5 * SIGMA[1] / 200_f64.sqrt()]);
    assert_eq!(
        names(&answer(&scene.record()).diagnosis),
        ["dropped_samples", "gyro_noise"]
    );
}
