//! IMUs that are late by a part of what the motion takes to turn round.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_imu::EffectKind as K;
use support::Scene;
use support::judge::{answer, names_exactly};
use support::motion::Motion;

#[test]
fn a_lag_of_a_third_of_a_period_is_no_low_pass() {
    // Motion up to 8 Hz turns round in 0.06 s.
    for (seconds, seed) in [(0.05, 31), (0.0886, 32), (-0.0886, 33), (0.095, 34)] {
        let scene = Scene {
            motion: Motion::random(seed).faster(2.0),
            ..Scene::new(seed)
        };
        let scene = scene.with(K::TimeOffset, &[seconds]);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}

#[test]
fn a_drift_of_more_than_a_period_is_found() {
    // From 0 to 0.96 s in four minutes, of a motion that has turned round in a tenth of that.
    let scene = Scene {
        motion: Motion::random(33).faster(2.0),
        seconds: 240.0,
        ..Scene::new(33)
    };
    let scene = scene.with(K::ClockDrift, &[-4000.0]);
    names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
}

#[test]
fn motion_that_is_played_again_and_again_is_no_lag_of_a_loop() {
    for (seconds, seed) in [(-0.4, 35), (0.6, 36), (-0.9, 37)] {
        let scene = Scene {
            motion: Motion::random(seed).repeated(10.0),
            ..Scene::new(seed)
        };
        let scene = scene.with(K::TimeOffset, &[seconds]);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}

/// A line of 16 Hz is three and a half turns off by the stamps in 146 s of 1500 ppm.
#[test]
fn a_vibration_is_told_beside_a_drift() {
    let mut values = vec![15.92, 0.27, 0.56, 0.68, 5.9, 3.2, 4.3];
    values.extend([0.031, 0.063, 0.036, 5.9, 3.9, 4.3]);
    for (ppm, seed) in [(-1470.0, 38), (540.0, 39)] {
        let scene = Scene {
            seconds: 146.0,
            ..Scene::new(seed)
        };
        let scene = scene
            .with(K::ClockDrift, &[ppm])
            .with(K::Vibration, &values);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}

/// A vibration would explain most of what an engine leaves that poses show under their noise, but is none.
#[test]
fn a_delay_is_told_beside_a_steady_motion() {
    for seed in [57, 58, 59] {
        let motion = Motion::random(seed).slowed(3.0);
        let motion = motion.humming(0.05, 13.5..13.75, seed);
        let scene = Scene {
            motion: motion.trembling(0.004, 13.5..13.75, seed),
            ..Scene::new(seed)
        };
        let scene = scene.with(K::ChannelDelay, &[0.007]);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}

/// Of the gyroscope against a shaking of 8 to 16 Hz at 50 Hz: by one linear step from no delay others explain more.
#[test]
fn a_delay_of_a_third_of_a_period_between_channels_is_found() {
    for (seconds, seed) in [(0.029, 71), (-0.029, 72), (0.03, 74)] {
        let motion = Motion::random(seed).slowed(3.0);
        let motion = motion.humming(6.0, 8.0..16.0, seed);
        let scene = Scene {
            motion: motion.trembling(0.6, 8.0..16.0, seed + 5),
            imu_hz: 50.0,
            ..Scene::new(seed)
        };
        let scene = scene
            .with(K::ChannelDelay, &[seconds])
            .with(K::ClockDrift, &[530.0]);
        names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
    }
}
