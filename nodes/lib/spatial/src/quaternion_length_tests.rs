#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rustfft::num_complex::Complex64;

use crate::{FourierPair, PoseEstimate, SmoothingKernel, Stamp, ZeroPhaseSmoothing, so3};

/// A turn about two axes by large angles: rotation, and angular velocity in the body.
fn large_turn(t: f64) -> (UnitQuaternion<f64>, Vector3<f64>) {
    let about = |axis, size: f64, hz: f64| {
        let angle = size * (TAU * hz * t).sin();
        let rate = size * TAU * hz * (TAU * hz * t).cos();
        (UnitQuaternion::from_axis_angle(&axis, angle), rate)
    };
    let (first, rate_of_first) = about(Vector3::x_axis(), 0.9, 1.1);
    let (second, rate_of_second) = about(Vector3::y_axis(), 0.7, 1.7);
    let rate = second.inverse() * Vector3::x() * rate_of_first + Vector3::y() * rate_of_second;
    (first * second, rate)
}

#[test]
fn a_smoothing_of_large_turns_is_undone() {
    const RATE_HZ: f64 = 100.0;
    // All frequencies come whole in so many poses, so that the filter has no ends.
    const COUNT: usize = 3000;
    let stamps: Vec<Stamp> = (0..COUNT)
        .map(|k| Stamp::from_seconds(k as f64 / RATE_HZ))
        .collect();
    let turns: Vec<_> = (0..COUNT)
        .map(|k| large_turn(k as f64 / RATE_HZ).0)
        .collect();
    let smoothing = ZeroPhaseSmoothing {
        cutoff_hz: 2.0,
        kernel: SmoothingKernel::SECOND_ORDER,
    };
    let transform = FourierPair::new(COUNT);
    let smoothed: Vec<Vec<f64>> = (0..4)
        .map(|part| {
            let mut values: Vec<_> = turns
                .iter()
                .map(|turn| Complex64::new(turn.coords[part], 0.0))
                .collect();
            transform.forward(&mut values);
            for (k, value) in values.iter_mut().enumerate() {
                let hz = k.min(COUNT - k) as f64 * RATE_HZ / COUNT as f64;
                *value /= smoothing.undoing_gain(hz, RATE_HZ);
            }
            transform.inverse(&mut values);
            values.iter().map(|value| value.re).collect()
        })
        .collect();
    let rotations: Vec<_> = (0..COUNT)
        .map(|at| {
            let [i, j, k, w] = [0, 1, 2, 3].map(|part: usize| smoothed[part][at]);
            // Irregular enough.
            let noise = Vector3::from_fn(|row, _| 1e-5 * ((at * (71 + 13 * row)) as f64).sin());
            UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)) * so3::exp(&noise)
        })
        .collect();
    let positions = vec![Vector3::zeros(); COUNT];
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let error = |estimate: &PoseEstimate| {
        let track = estimate.track(RATE_HZ);
        let inside = 200..COUNT - 200;
        let squares = inside.clone().map(|k| {
            let (_, rate) = large_turn(k as f64 / RATE_HZ);
            (track.angular_velocity_in_segment[k] - rate).norm_squared()
        });
        (squares.sum::<f64>() / inside.len() as f64).sqrt()
    };
    let (plain, undone) = (error(&estimate), error(&estimate.undoing(smoothing)));
    println!("{plain} {undone}");
    assert!(plain > 2.0 && undone < 0.1, "{plain}, {undone} rad/s");
    // As often as it is asked for.
    let again = error(&estimate.undoing(smoothing).undoing(smoothing));
    assert!((again - undone).abs() < 0.02, "{again}, {undone} rad/s");
}
