//! Harmonics of what is shaken now and then, and motors, are motion, with quiet frequencies before them.
#![allow(clippy::unwrap_used)]

mod support;

use std::f64::consts::TAU;

use cromosim_spatial::{PoseEstimate, Stamp};
use nalgebra::{UnitQuaternion, Vector3};
use support::noise;

const RATE_HZ: f64 = 200.0;
const HZ: f64 = 5.0;
/// Noise of the poses, m.
const NOISE: f64 = 1.7e-4;
/// Of the harmonic: 2 m/s2, two windows of which stand out of the noise while all of the minute does not.
const HARMONIC: f64 = 5e-4;

/// 1 while something is shaken, from 20 to 26 s, eased over some tenths of a second.
fn shaken(t: f64) -> f64 {
    let eased = |x: f64| 1.0 / (1.0 + (-x / 0.08).exp());
    eased(t - 20.0) * eased(26.0 - t)
}

#[test]
fn the_second_harmonic_of_a_shake_is_kept() {
    let mut state = 5;
    let mut draw = || Vector3::from_fn(|_, _| NOISE * noise(&mut state));
    let (mut stamps, mut positions, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(60.0 * RATE_HZ) as i64 {
        let t = k as f64 / RATE_HZ;
        let size = shaken(t);
        let place = Vector3::new(
            0.03 * (TAU * HZ * t).sin(),
            HARMONIC * (2.0 * TAU * HZ * t).sin(),
            HARMONIC * (2.0 * TAU * HZ * t).cos(),
        );
        stamps.push(Stamp::from_nanos(0).plus_seconds(t));
        positions.push(size * place + draw());
        rotations.push(UnitQuaternion::identity());
    }
    let track = PoseEstimate::fit(&stamps, &positions, &rotations)
        .unwrap()
        .track(RATE_HZ);
    let (mut errors, mut squares) = (0.0, 0.0);
    for k in 0..track.len() {
        let t = k as f64 / track.rate_hz;
        if (21.0..25.0).contains(&t) {
            let phase = 2.0 * TAU * HZ * t;
            let true_one = -HARMONIC * (2.0 * TAU * HZ).powi(2) * phase.sin();
            errors += (track.acceleration_in_segment[k].y - true_one).powi(2);
            squares += true_one * true_one;
        }
    }
    assert!(
        errors < 0.05 * squares,
        "{} of the harmonic's power is lost",
        errors / squares
    );
}

/// A motor of a tool, amid noise of half its size.
#[test]
fn a_motor_is_kept_whose_speed_changes() {
    const RATE_HZ: f64 = 300.0;
    const NOISE: f64 = 2.4e-5;
    const MOTOR: f64 = 5e-5;
    let mut state = 6;
    let mut draw = || Vector3::from_fn(|_, _| NOISE * noise(&mut state));
    // From 36 to 44 Hz within two seconds.
    let phase = |t: f64| TAU * 40.0 * t + 16.0 * (TAU * 0.25 * t).sin();
    let tool = |t: f64| {
        let way = 0.2 * (TAU * 0.4 * t).sin();
        Vector3::new(way, MOTOR * phase(t).sin(), MOTOR * phase(t).cos())
    };
    let stamp = |k: i64| Stamp::from_nanos(0).plus_seconds(k as f64 / RATE_HZ);
    let poses = 0..(30.0 * RATE_HZ) as i64;
    let stamps: Vec<Stamp> = poses.clone().map(stamp).collect();
    let positions: Vec<_> = poses.map(|k| tool(k as f64 / RATE_HZ) + draw()).collect();
    let rotations = vec![UnitQuaternion::identity(); stamps.len()];
    let track = PoseEstimate::fit(&stamps, &positions, &rotations)
        .unwrap()
        .track(RATE_HZ);
    let (mut errors, mut squares) = (0.0, 0.0);
    for k in RATE_HZ as usize..track.len() - RATE_HZ as usize {
        let (t, step) = (k as f64 / track.rate_hz, 1e-5);
        let true_one = (tool(t + step) - 2.0 * tool(t) + tool(t - step)) / (step * step);
        errors += (track.acceleration_in_segment[k].y - true_one.y).powi(2);
        squares += true_one.y.powi(2);
    }
    assert!(
        errors < 0.25 * squares,
        "{} of the motor's power is lost",
        errors / squares
    );
}
