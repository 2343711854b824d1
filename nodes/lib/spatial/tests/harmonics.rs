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

/// Rate of poses of a tool, Hz, and their noise, m.
const TOOL_RATE_HZ: f64 = 300.0;
const TOOL_NOISE: f64 = 2.4e-5;

/// What is lost of the power of a tool's acceleration along y, where it only shakes, for a motor of so many metres whose phase
/// is a function of time.
fn lost_of_a_tool(motor: f64, phase: impl Fn(f64) -> f64) -> f64 {
    let mut state = 6;
    let mut draw = || Vector3::from_fn(|_, _| TOOL_NOISE * noise(&mut state));
    let tool = |t: f64| {
        let way = 0.2 * (TAU * 0.4 * t).sin();
        Vector3::new(way, motor * phase(t).sin(), motor * phase(t).cos())
    };
    let stamp = |k: i64| Stamp::from_nanos(0).plus_seconds(k as f64 / TOOL_RATE_HZ);
    let poses = 0..(30.0 * TOOL_RATE_HZ) as i64;
    let stamps: Vec<Stamp> = poses.clone().map(stamp).collect();
    let positions: Vec<_> = poses
        .map(|k| tool(k as f64 / TOOL_RATE_HZ) + draw())
        .collect();
    let rotations = vec![UnitQuaternion::identity(); stamps.len()];
    let track = PoseEstimate::fit(&stamps, &positions, &rotations)
        .unwrap()
        .track(TOOL_RATE_HZ);
    let (mut errors, mut squares) = (0.0, 0.0);
    for k in TOOL_RATE_HZ as usize..track.len() - TOOL_RATE_HZ as usize {
        let (t, step) = (k as f64 / track.rate_hz, 1e-5);
        let true_one = (tool(t + step) - 2.0 * tool(t) + tool(t - step)) / (step * step);
        errors += (track.acceleration_in_segment[k].y - true_one.y).powi(2);
        squares += true_one.y.powi(2);
    }
    errors / squares
}

/// Phase of a motor whose speed wanders between 36 and 44 Hz.
fn changing(t: f64) -> f64 {
    TAU * 40.0 * t + 13.0 * (TAU * 0.21 * t).sin() + 9.0 * (TAU * 0.136 * t + 1.0).sin()
}

/// Amid noise of half its size.
#[test]
fn a_motor_is_kept_whose_speed_changes() {
    let lost = lost_of_a_tool(5e-5, changing);
    assert!(lost < 0.25, "{lost} of the motor's power is lost");
}

/// For four seconds at a time; it changes between two poses.
#[test]
fn a_motor_is_kept_whose_speed_is_steady_for_some_seconds() {
    const SPEEDS_HZ: [f64; 8] = [37.0, 43.0, 38.1, 42.2, 36.4, 43.7, 37.6, 42.9];
    let turns = |t: f64| {
        let spent = |k: usize| (t + 0.001 - 4.0 * k as f64).clamp(0.0, 4.0);
        let runs = SPEEDS_HZ.iter().enumerate();
        runs.map(|(k, hz)| hz * spent(k)).sum::<f64>()
    };
    let lost = lost_of_a_tool(5e-5, |t| TAU * turns(t));
    assert!(lost < 0.25, "{lost} of the motor's power is lost");
}

/// It stands nowhere far above the noise.
#[test]
fn a_weak_motor_is_kept_whose_speed_changes() {
    let lost = lost_of_a_tool(1.2e-5, changing);
    assert!(lost < 0.6, "{lost} of the motor's power is lost");
}

/// It may shake the reference as well; a `vibration` describes it better than poses show it.
#[test]
fn a_machine_of_one_frequency_is_left_out() {
    let lost = lost_of_a_tool(5e-5, |t| TAU * 40.3 * t);
    assert!(lost > 0.9, "only {lost} of the machine's power is left out");
}
