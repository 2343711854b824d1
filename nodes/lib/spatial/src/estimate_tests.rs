#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use super::*;

/// Deterministic noise: sums of twelve uniform numbers.
struct Normal(u64);

impl Normal {
    fn draw(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// A swing about a turning axis with a known acceleration.
fn motion(t: f64) -> (Vector3<f64>, UnitQuaternion<f64>, Vector3<f64>) {
    let w = TAU * 1.3;
    let position = Vector3::new(0.2 * (w * t).sin(), 0.1 * (2.0 * w * t).cos(), 1.0 + 0.05 * (3.0 * w * t).sin());
    let acceleration = Vector3::new(-0.2 * w * w * (w * t).sin(), -0.4 * w * w * (2.0 * w * t).cos(), -0.45 * w * w * (3.0 * w * t).sin());
    let rotation = so3::exp(&Vector3::new(0.8 * (w * t).sin(), 0.0, 0.0)) * so3::exp(&Vector3::new(0.0, 0.0, 0.4 * t));
    (position, rotation, acceleration)
}

fn poses(noise: PoseNoise, rate_hz: f64, keep: impl Fn(f64) -> bool) -> (Vec<Stamp>, Vec<Vector3<f64>>, Vec<UnitQuaternion<f64>>) {
    let mut random = Normal(7);
    let (mut stamps, mut positions, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(60.0 * rate_hz) as i64 {
        let t = k as f64 / rate_hz;
        let (position, rotation, _) = motion(t);
        let mut draw = |sigma: f64| Vector3::new(random.draw(), random.draw(), random.draw()) * sigma;
        let (dp, dr) = (draw(noise.position), draw(noise.rotation));
        if keep(t) {
            stamps.push(Stamp::from_nanos(1_700_000_000_000_000_000).plus_seconds(t));
            positions.push(position + dp);
            rotations.push(rotation * so3::exp(&dr));
        }
    }
    (stamps, positions, rotations)
}

fn acceleration_error(track: &KinematicTrack) -> f64 {
    let errors: Vec<f64> = (0..track.len())
        .map(|k| k as f64 / track.rate_hz)
        .enumerate()
        .filter(|(_, t)| (1.0..58.0).contains(t))
        .map(|(k, t)| (track.world_from_segment[k] * track.acceleration[k] - motion(t).2).norm_squared())
        .collect();
    (errors.iter().sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn noise_is_found_and_kept_out_of_the_derivatives() {
    let truth = PoseNoise { position: 1e-4, rotation: 8e-4 };
    let (stamps, positions, rotations) = poses(truth, 100.0, |_| true);
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let found = estimate.noise();
    assert!((found.position / truth.position - 1.0).abs() < 0.08, "{found:?}");
    assert!((found.rotation / truth.rotation - 1.0).abs() < 0.08, "{found:?}");
    let track = estimate.track(200.0);
    assert_eq!(track.rate_hz, 200.0);
    let error = acceleration_error(&track);
    // Second differences at 100 Hz would err by sqrt(3) sqrt(6) 1e-4 100^2 = 4 m/s2.
    assert!(error < 0.2, "{error}");
    // The motion's three lines pass; at 20 Hz there is nothing but noise.
    assert!(estimate.filter_at(1.3).0 > 0.99 && estimate.filter_at(20.0).0 == 0.0);
}

#[test]
fn without_noise_derivatives_are_exact() {
    let (stamps, positions, rotations) = poses(PoseNoise::default(), 120.0, |_| true);
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let error = acceleration_error(&estimate.track(200.0));
    assert!(error < 5e-3, "{error}");
}

#[test]
fn holes_are_named_and_bridged() {
    let noise = PoseNoise { position: 1e-4, rotation: 8e-4 };
    let (stamps, positions, rotations) = poses(noise, 100.0, |t| !(20.0..20.3).contains(&t) && !(40.0..40.08).contains(&t));
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    assert_eq!(estimate.gaps().len(), 2);
    let (from, to) = estimate.gaps()[0];
    assert!((to - from - 0.31).abs() < 0.011, "{}", to - from);
    let error = acceleration_error(&estimate.track(200.0));
    assert!(error < 0.6, "{error}");
}

#[test]
fn a_smoothing_is_undone() {
    // Through the smoothing's own gain at the motion's frequencies.
    let (stamps, mut positions, rotations) = poses(PoseNoise { position: 1e-6, rotation: 1e-6 }, 100.0, |_| true);
    let gain = |f: f64| 1.0 / undo(f, Some(3.0), 100.0);
    assert!(undo(3.9, Some(3.0), 100.0) < LARGEST_GAIN);
    for (k, position) in positions.iter_mut().enumerate() {
        let t = k as f64 / 100.0;
        let clean = motion(t).0;
        let noise = *position - clean;
        let rest = Vector3::new(0.0, 0.0, 1.0);
        let swing = clean - rest;
        *position = rest + Vector3::new(swing.x * gain(1.3), swing.y * gain(2.6), swing.z * gain(3.9)) + noise;
    }
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    assert!(acceleration_error(&estimate.track(100.0)) > 5.0);
    let error = acceleration_error(&estimate.undoing(3.0).track(100.0));
    assert!(error < 0.6, "{error}");
}

#[test]
fn bad_input_is_refused() {
    let (stamps, positions, rotations) = poses(PoseNoise::default(), 100.0, |t| t < 1.0);
    assert!(matches!(PoseEstimate::fit(&stamps[..4], &positions[..4], &rotations[..4]), Err(SpatialError::TooFewSamples { .. })));
    assert!(matches!(PoseEstimate::fit(&stamps, &positions[..4], &rotations), Err(SpatialError::LengthMismatch { .. })));
    let mut nan = positions.clone();
    nan[3].y = f64::NAN;
    assert!(matches!(PoseEstimate::fit(&stamps, &nan, &rotations), Err(SpatialError::NotFinite { index: 3, .. })));
}

#[test]
fn white_noise_alone_passes_nowhere() {
    let mut random = Normal(3);
    let count = 12_000;
    let series: Vec<Vec<f64>> = (0..3).map(|_| (0..count).map(|_| random.draw()).collect()).collect();
    let floor = Floor::learn(&series, 200.0);
    let passing: Vec<f64> =
        floor.filter.iter().enumerate().skip(40).filter(|(_, w)| **w > 0.0).map(|(k, _)| k as f64 * floor.spacing_hz).collect();
    assert!(passing.is_empty(), "{passing:?}");
}

#[test]
fn the_ends_are_sound() {
    let (stamps, positions, rotations) = poses(PoseNoise { position: 1e-4, rotation: 8e-4 }, 100.0, |_| true);
    let track = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap().track(200.0);
    let at = |k: usize| (track.world_from_segment[k] * track.acceleration[k] - motion(k as f64 / track.rate_hz).2).norm();
    let worst = (0..100).chain(track.len() - 100..track.len()).map(at).fold(0.0, f64::max);
    // The motion reaches 27 m/s2; an odd continuation errs by as much.
    assert!(worst < 5.0, "{worst}");
}
