#![allow(clippy::unwrap_used)]
use nalgebra::Translation3;

use super::*;

/// A conical pendulum: everything about it is known.
fn cone(t: f64) -> Motion {
    let (rate, radius) = (3.0, 0.4);
    let (sine, cosine) = (rate * t).sin_cos();
    let axis = Vector3::z() * rate;
    let position = Vector3::new(radius * cosine, radius * sine, 1.0);
    Motion {
        rotation: so3::exp(&(axis * t)) * so3::exp(&Vector3::new(0.3, 0.0, 0.0)),
        position,
        velocity: axis.cross(&position),
        acceleration: axis.cross(&axis.cross(&position)),
        angular_velocity: axis,
        angular_acceleration: Vector3::zeros(),
    }
}

fn fitted() -> (Vec<Stamp>, PoseSpline) {
    let start = Stamp::from_nanos(1_700_000_000_000_000_000);
    let stamps: Vec<Stamp> = (0..600)
        .map(|k| start.plus_seconds(f64::from(k) * 0.01))
        .collect();
    let poses: Vec<_> = stamps
        .iter()
        .map(|s| cone(*s - start))
        .map(|m| Isometry3::from_parts(Translation3::from(m.position), m.rotation))
        .collect();
    let spline = PoseSpline::fit(&stamps, &poses, PoseSmoothing::default()).unwrap();
    (stamps, spline)
}

#[test]
fn motion_of_a_conical_pendulum_at_any_time() {
    let (stamps, spline) = fitted();
    for k in 0..=500 {
        let t = 5.99 * f64::from(k) / 500.0;
        let (found, known) = (spline.evaluate(stamps[0].plus_seconds(t)), cone(t));
        assert!((found.position - known.position).norm() < 1e-8, "{t}");
        assert!((found.velocity - known.velocity).norm() < 1e-6, "{t}");
        assert!(
            (found.acceleration - known.acceleration).norm() < 1e-4,
            "{t}"
        );
        assert!(found.rotation.angle_to(&known.rotation) < 1e-7, "{t}");
        assert!(
            (found.angular_velocity - known.angular_velocity).norm() < 1e-6,
            "{t}"
        );
        assert!(found.angular_acceleration.norm() < 1e-4, "{t}");
    }
}

#[test]
fn stamps_outside_are_moved_to_the_ends() {
    let (stamps, spline) = fitted();
    assert_eq!(
        spline.evaluate(stamps[0].plus_seconds(-2.0)),
        spline.evaluate(stamps[0])
    );
    assert_eq!(
        spline.evaluate(stamps[599].plus_seconds(0.5)),
        spline.evaluate(stamps[599])
    );
}

#[test]
fn turning_the_world_turns_the_result() {
    let mut state = 1_u64;
    let mut wobble = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        0.002 * ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    };
    let stamps: Vec<Stamp> = (0..300)
        .map(|k| Stamp::from_seconds(f64::from(k) * 0.01))
        .collect();
    let poses: Vec<Isometry3<f64>> = stamps
        .iter()
        .map(|s| cone(s.as_seconds()))
        .map(|m| {
            Isometry3::from_parts(
                (m.position + Vector3::new(wobble(), wobble(), wobble())).into(),
                m.rotation,
            )
        })
        .collect();
    let turn = so3::exp(&Vector3::new(0.4, 1.2, -0.7));
    let turned: Vec<_> = poses.iter().map(|pose| turn * pose).collect();
    let (plain, turned) = (
        PoseSpline::fit(&stamps, &poses, PoseSmoothing::default()).unwrap(),
        PoseSpline::fit(&stamps, &turned, PoseSmoothing::default()).unwrap(),
    );
    let stamp = Stamp::from_seconds(1.234);
    assert!(
        (turn * plain.evaluate(stamp).acceleration - turned.evaluate(stamp).acceleration).norm()
            < 1e-4
    );
    assert!(
        (turn * plain.evaluate(stamp).angular_velocity - turned.evaluate(stamp).angular_velocity)
            .norm()
            < 1e-6
    );
}

#[test]
fn both_halves_learn_at_once_what_each_learns_alone_to_the_bit() {
    let stamps: Vec<Stamp> = (0..150)
        .map(|k| Stamp::from_seconds(0.01 * f64::from(k) + if k > 70 { 0.013 } else { 0.0 }))
        .collect();
    let poses: Vec<_> = stamps
        .iter()
        .enumerate()
        .map(|(k, stamp)| {
            let motion = cone(stamp.as_seconds());
            let jitter = 1e-3 * ((k * 7919 % 101) as f64 / 101.0 - 0.5);
            let position = motion.position + Vector3::new(jitter, -jitter, 0.5 * jitter);
            let turn = so3::exp(&Vector3::new(2.0 * jitter, jitter, -jitter));
            Isometry3::from_parts(Translation3::from(position), turn * motion.rotation)
        })
        .collect();
    let times = PoseTimes::new(&stamps).unwrap();
    let both =
        PoseSpline::fit_on(&times, &poses, PoseSmoothing::adaptive(PoseSource::Tracked)).unwrap();
    let PoseSmoothing { position, rotation } = PoseSmoothing::adaptive(PoseSource::Tracked);
    let position =
        SmoothingSpline::fit_on(times.system(), &position_channels(&poses), position).unwrap();
    let rotation =
        SmoothingSpline::fit_on(times.system(), &rotation_channels(&poses), rotation).unwrap();
    assert_eq!(both.position.weight(), position.weight());
    assert_eq!(both.rotation.weight(), rotation.weight());
    for k in 0..400 {
        let t = 0.0038 * f64::from(k);
        assert_eq!(both.position.evaluate(t), position.evaluate(t));
        assert_eq!(both.rotation.evaluate(t), rotation.evaluate(t));
        assert_eq!(both.position.variance(t), position.variance(t));
        assert_eq!(both.rotation.variance(t), rotation.variance(t));
    }
}

#[test]
fn series_that_are_fitted_at_once_are_what_each_is_alone_to_the_bit() {
    let start = Stamp::from_nanos(1_700_000_000_000_000_000);
    let stamps: Vec<Stamp> = (0..150)
        .map(|k| start.plus_seconds(f64::from(k) / 120.0))
        .collect();
    // Rests, turns, and jitter of another size in each.
    let series: Vec<Vec<Isometry3<f64>>> = (0..5)
        .map(|whose| {
            let pose = |k: i32| {
                let (t, own) = (f64::from(k) / 120.0, f64::from(whose));
                let jitter = 1e-3 * own * (f64::from(k) * (12.9898 + own)).sin();
                let swing = (t - 0.5).max(0.0) * (9.0 * t + own).sin();
                Isometry3::new(
                    Vector3::new(swing + jitter, own, 1.0 - jitter),
                    Vector3::new(0.2 * own, swing - jitter, t),
                )
            };
            (0..150).map(pose).collect()
        })
        .collect();
    let times = PoseTimes::new(&stamps).unwrap();
    for smoothing in [
        PoseSmoothing::adaptive(PoseSource::Tracked),
        PoseSmoothing::adaptive(PoseSource::Fitted),
        PoseSmoothing::cutoff_hz(10.0),
    ] {
        let together = PoseSpline::fit_all_on(&times, &series, smoothing).unwrap();
        assert_eq!(together.len(), series.len());
        for (poses, found) in series.iter().zip(&together) {
            let alone = PoseSpline::fit_on(&times, poses, smoothing).unwrap();
            for k in 0..=300 {
                let at = start.plus_seconds(f64::from(k) / 240.0);
                // All bits of all numbers: `Debug` tells -0 from 0.
                let [found, alone] = [found, &alone].map(|one| format!("{:?}", one.estimate(at)));
                assert_eq!(found, alone, "{k}");
            }
        }
    }
}
