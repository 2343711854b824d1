//! Harmonics of what is shaken now and then are motion, with quiet frequencies before them.
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
