#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use super::*;
use crate::{Complex64, ErrorPath, FourierPair, SmoothingKernel};

/// Deterministic noise: sums of twelve uniform numbers.
struct Normal(u64);

impl Normal {
    fn draw(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// A swing about a turning axis with a known acceleration.
fn motion(t: f64) -> (Vector3<f64>, UnitQuaternion<f64>, Vector3<f64>) {
    let w = TAU * 1.3;
    let position = Vector3::new(
        0.2 * (w * t).sin(),
        0.1 * (2.0 * w * t).cos(),
        1.0 + 0.05 * (3.0 * w * t).sin(),
    );
    let acceleration = Vector3::new(
        -0.2 * w * w * (w * t).sin(),
        -0.4 * w * w * (2.0 * w * t).cos(),
        -0.45 * w * w * (3.0 * w * t).sin(),
    );
    let rotation = so3::exp(&Vector3::new(0.8 * (w * t).sin(), 0.0, 0.0))
        * so3::exp(&Vector3::new(0.0, 0.0, 0.4 * t));
    (position, rotation, acceleration)
}

fn poses(
    noise: PoseNoise,
    rate_hz: f64,
    keep: impl Fn(f64) -> bool,
) -> (Vec<Stamp>, Vec<Vector3<f64>>, Vec<UnitQuaternion<f64>>) {
    let mut random = Normal(7);
    let (mut stamps, mut positions, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(60.0 * rate_hz) as i64 {
        let t = k as f64 / rate_hz;
        let (position, rotation, _) = motion(t);
        let mut draw =
            |sigma: f64| Vector3::new(random.draw(), random.draw(), random.draw()) * sigma;
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
        .map(|(k, t)| {
            (track.world_from_segment[k] * track.acceleration_in_segment[k] - motion(t).2)
                .norm_squared()
        })
        .collect();
    (errors.iter().sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn noise_is_found_and_kept_out_of_the_derivatives() {
    let truth = PoseNoise {
        position: 1e-4,
        rotation: 8e-4,
    };
    let (stamps, positions, rotations) = poses(truth, 100.0, |_| true);
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let found = estimate.noise();
    assert!(
        (found.position / truth.position - 1.0).abs() < 0.08,
        "{found:?}"
    );
    assert!(
        (found.rotation / truth.rotation - 1.0).abs() < 0.08,
        "{found:?}"
    );
    let track = estimate.track(200.0);
    assert_eq!(track.rate_hz, 200.0);
    let error = acceleration_error(&track);
    // Second differences at 100 Hz would err by sqrt(3) sqrt(6) 1e-4 100^2 = 4 m/s2.
    assert!(error < 0.2, "{error}");
    // The motion's three lines pass; at 20 Hz there is nothing but noise.
    assert!(estimate.filter_at(1.3).0 > 0.99 && estimate.filter_at(20.0).0 == 0.0);
}

#[test]
fn derivatives_err_as_much_as_is_stated() {
    let noise = PoseNoise {
        position: 5e-4,
        rotation: 4e-3,
    };
    let (stamps, positions, rotations) = poses(noise, 100.0, |_| true);
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let track = estimate.track(100.0);
    let inner = &stamps[100..5800];
    let stated: f64 = estimate
        .variances(inner, &path(0.0, &|_| [1.0; 2]))
        .iter()
        .map(|variance| 3.0 * variance.acceleration)
        .sum();
    let ratio = acceleration_error(&track).powi(2) / (stated / inner.len() as f64);
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
    let at = |path: &ErrorPath| estimate.variances(&stamps[300..301], path)[0];
    let [near, far] = [0.0, 0.1].map(|arm_m| at(&path(arm_m, &|_| [1.0; 2])));
    assert!(far.acceleration > near.acceleration);
    assert_eq!(far.angular_velocity, near.angular_velocity);
    // Half of the power of the rate, a quarter of that of the acceleration.
    let less = at(&path(0.1, &|_| [0.5, 0.25]));
    assert_eq!(less.orientation, far.orientation);
    assert!((less.angular_velocity / far.angular_velocity - 0.5).abs() < 1e-12);
    assert!((less.acceleration / far.acceleration - 0.25).abs() < 1e-12);
}

fn path(lever_arm_m: f64, passed: &dyn Fn(f64) -> [f64; 2]) -> ErrorPath<'_> {
    ErrorPath {
        units_per_metre: 1.0,
        lever_arm_m,
        passed,
    }
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
    let noise = PoseNoise {
        position: 1e-4,
        rotation: 8e-4,
    };
    let (stamps, positions, rotations) = poses(noise, 100.0, |t| {
        !(20.0..20.3).contains(&t) && !(40.0..40.08).contains(&t)
    });
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
    let (stamps, mut positions, rotations) = poses(
        PoseNoise {
            position: 1e-6,
            rotation: 1e-6,
        },
        100.0,
        |_| true,
    );
    let smoothing = ZeroPhaseSmoothing {
        cutoff_hz: 3.0,
        kernel: SmoothingKernel::SECOND_ORDER,
    };
    let gain = |f: f64| 1.0 / smoothing.undoing_gain(f, 100.0);
    assert!(smoothing.undoing_gain(3.9, 100.0) < LARGEST_GAIN);
    for (k, position) in positions.iter_mut().enumerate() {
        let t = k as f64 / 100.0;
        let clean = motion(t).0;
        let noise = *position - clean;
        let rest = Vector3::new(0.0, 0.0, 1.0);
        let swing = clean - rest;
        *position =
            rest + Vector3::new(
                swing.x * gain(1.3),
                swing.y * gain(2.6),
                swing.z * gain(3.9),
            ) + noise;
    }
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    assert!(acceleration_error(&estimate.track(100.0)) > 5.0);
    let error = acceleration_error(&estimate.undoing(smoothing).track(100.0));
    assert!(error < 0.6, "{error}");
}

/// A motion of many frequencies up to 7 Hz with noise at all of them, as a smoothing reports it:
/// position, and acceleration of the motion.
fn many_frequencies(t: f64, gain: &dyn Fn(f64) -> f64) -> (Vector3<f64>, Vector3<f64>) {
    let (mut position, mut acceleration) = (Vector3::zeros(), Vector3::zeros());
    for k in 1..=850 {
        let (hz, w) = (f64::from(k) * 0.0583, TAU * f64::from(k) * 0.0583);
        let moves = hz < 7.0;
        for axis in 0..3 {
            let phase = f64::from((k * (71 + 13 * axis as i32)) % 97);
            let size = if moves {
                0.02 / (1.0 + hz.powi(2))
            } else {
                1e-5
            };
            let wave = size * (w * t + phase).sin();
            position[axis] += gain(hz) * wave;
            if moves {
                acceleration[axis] -= w * w * wave;
            }
        }
    }
    (position, acceleration)
}

#[test]
fn a_smoothing_is_undone_up_to_the_ends() {
    // Without noise after it, smoothed poses fall by sixteen decades: rounding must not bend them.
    let (stamps, _, rotations) = poses(PoseNoise::default(), 100.0, |t| t < 30.0);
    for kernel in [SmoothingKernel::SECOND_ORDER, SmoothingKernel::Gaussian] {
        let smoothing = ZeroPhaseSmoothing {
            cutoff_hz: 4.0,
            kernel,
        };
        let left = |hz: f64| 1.0 / smoothing.undoing_gain(hz, 100.0);
        let positions: Vec<Vector3<f64>> = (0..stamps.len())
            .map(|k| many_frequencies(k as f64 / 100.0, &left).0)
            .collect();
        let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
        let error = |estimate: &PoseEstimate, from: f64, to: f64| {
            let track = estimate.track(100.0);
            let squares = (0..track.len())
                .filter(|k| (from..to).contains(&(*k as f64 / 100.0)))
                .map(|k| {
                    let found = track.world_from_segment[k] * track.acceleration_in_segment[k];
                    (found - many_frequencies(k as f64 / 100.0, &|_| 1.0).1).norm_squared()
                });
            let squares: Vec<f64> = squares.collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let undone = estimate.undoing(smoothing);
        for (from, to) in [(0.0, 1.0), (1.0, 28.9), (28.9, 30.0)] {
            let (plain, undone) = (error(&estimate, from, to), error(&undone, from, to));
            assert!(
                undone < 0.5 * plain,
                "{kernel:?}, {from} to {to} s: {undone} against {plain} m/s2"
            );
        }
    }
}

#[test]
fn lines_beyond_the_band_come_back_where_a_smoothing_is_undone() {
    // A knee: swings of 0.6 Hz, shaken at 6.2 Hz, nothing but noise in between.
    let smoothing = ZeroPhaseSmoothing {
        cutoff_hz: 6.0,
        kernel: SmoothingKernel::SECOND_ORDER,
    };
    let left = 1.0 / smoothing.undoing_gain(6.2, 100.0);
    let (slow, fast) = (TAU * 0.6, TAU * 6.2);
    let (stamps, _, rotations) = poses(PoseNoise::default(), 100.0, |t| t < 30.0);
    let mut random = Normal(12);
    let positions: Vec<Vector3<f64>> = (0..stamps.len())
        .map(|k| {
            let t = k as f64 / 100.0;
            let noise = Vector3::new(random.draw(), random.draw(), random.draw()) * 3e-4;
            Vector3::x() * (0.2 * (slow * t).sin() + 2e-3 * left * (fast * t).sin()) + noise
        })
        .collect();
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let error = |estimate: &PoseEstimate| {
        let track = estimate.track(100.0);
        let squares = (200..track.len() - 200).map(|k| {
            let t = k as f64 / 100.0;
            let found = track.world_from_segment[k] * track.acceleration_in_segment[k];
            let true_x =
                -0.2 * slow * slow * (slow * t).sin() - 2e-3 * fast * fast * (fast * t).sin();
            (found.x - true_x).powi(2)
        });
        let squares: Vec<f64> = squares.collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let (plain, undone) = (error(&estimate), error(&estimate.undoing(smoothing)));
    assert!(plain > 1.0 && undone < 0.6, "{undone} against {plain} m/s2");
}

#[test]
fn motion_up_to_the_largest_gain_is_no_noise_before_a_smoothing() {
    let (stamps, _, rotations) = poses(PoseNoise::default(), 100.0, |t| t < 30.0);
    let smoothing = ZeroPhaseSmoothing {
        cutoff_hz: 2.5,
        kernel: SmoothingKernel::Butterworth { order: 4 },
    };
    let left = |hz: f64| 1.0 / smoothing.undoing_gain(hz, 100.0);
    let mut random = Normal(11);
    let positions: Vec<Vector3<f64>> = (0..stamps.len())
        .map(|k| {
            let noise = Vector3::new(random.draw(), random.draw(), random.draw()) * 1e-7;
            many_frequencies(k as f64 / 100.0, &left).0 + noise
        })
        .collect();
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let (position, ..) = estimate.undoing(smoothing).filter_at(3.0);
    assert!(position > 0.9, "{position}");
}

#[test]
fn bad_input_is_refused() {
    let (stamps, positions, rotations) = poses(PoseNoise::default(), 100.0, |t| t < 1.0);
    assert!(matches!(
        PoseEstimate::fit(&stamps[..4], &positions[..4], &rotations[..4]),
        Err(SpatialError::TooFewSamples { .. })
    ));
    assert!(matches!(
        PoseEstimate::fit(&stamps, &positions[..4], &rotations),
        Err(SpatialError::LengthMismatch { .. })
    ));
    let mut nan = positions.clone();
    nan[3].y = f64::NAN;
    assert!(matches!(
        PoseEstimate::fit(&stamps, &nan, &rotations),
        Err(SpatialError::NotFinite { index: 3, .. })
    ));
}

#[test]
fn white_noise_alone_passes_nowhere() {
    let mut random = Normal(3);
    let count = 12_000;
    let series: Vec<Vec<f64>> = (0..3)
        .map(|_| (0..count).map(|_| random.draw()).collect())
        .collect();
    let floor = NoiseFloor::learn(&series, 200.0, 1.0);
    let passing: Vec<f64> = floor
        .filter
        .iter()
        .enumerate()
        .skip(40)
        .filter(|(_, w)| **w > 0.0)
        .map(|(k, _)| k as f64 * floor.spacing_hz)
        .collect();
    assert!(passing.is_empty(), "{passing:?}");
}

/// Series of a given one-sided density, unit^2/Hz, at `rate_hz`.
fn coloured(
    random: &mut Normal,
    count: usize,
    rate_hz: f64,
    density: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let transform = FourierPair::new(count);
    let mut values: Vec<Complex64> = (0..count)
        .map(|_| Complex64::new(random.draw(), 0.0))
        .collect();
    transform.forward(&mut values);
    for (k, value) in values.iter_mut().enumerate() {
        let frequency_hz = k.min(count - k).max(1) as f64 * rate_hz / count as f64;
        *value *= (density(frequency_hz) * rate_hz / 2.0).sqrt();
    }
    transform.inverse(&mut values);
    values.iter().map(|value| value.re).collect()
}

#[test]
fn noise_that_wanders_is_told_from_motion_by_its_knee() {
    // As optical recordings that were resampled to the IMU's rate: motion falls by f^-9, noise by
    // 1/f up to 15 Hz, then by f^-2.5.
    let (count, rate_hz) = (18_000, 300.0);
    let motion = |f: f64| 1e-2 / (1.0 + (f / 2.0).powi(9));
    let noise = |f: f64| {
        1e-10
            * if f < 15.0 {
                15.0 / f.max(0.5)
            } else {
                (15.0 / f).powf(2.5)
            }
    };
    let mut random = Normal(5);
    let mut axis = |density: &dyn Fn(f64) -> f64| coloured(&mut random, count, rate_hz, density);
    let clean = [0; 3].map(|_| axis(&motion));
    let noisy: Vec<Vec<f64>> = clean
        .iter()
        .map(|series| {
            series
                .iter()
                .zip(axis(&noise))
                .map(|(a, b)| a + b)
                .collect()
        })
        .collect();
    let floor = NoiseFloor::learn(&noisy, rate_hz, 1.0);
    for hz in [8.0, 12.0, 20.0, 30.0] {
        let ratio = floor.noise_at(hz) / noise(hz);
        assert!((0.4..2.5).contains(&ratio), "{ratio} at {hz} Hz");
    }
    // Accelerations are as good as the best filter makes them, which knows both densities.
    let stamps: Vec<Stamp> = (0..count)
        .map(|k| Stamp::from_nanos((k as f64 * 1e9 / rate_hz).round() as i64))
        .collect();
    let positions: Vec<Vector3<f64>> = (0..count)
        .map(|k| Vector3::new(noisy[0][k], noisy[1][k], noisy[2][k]))
        .collect();
    let track = PoseEstimate::fit(
        &stamps,
        &positions,
        &vec![UnitQuaternion::identity(); count],
    )
    .unwrap()
    .track(rate_hz);
    let truth: Vec<Vec<f64>> = clean
        .iter()
        .map(|series| second_derivative(series, rate_hz))
        .collect();
    let inner = 1000..count - 1000;
    let every = (track.rate_hz / rate_hz).round() as usize;
    let squares: f64 = inner
        .clone()
        .map(|k| {
            (0..3)
                .map(|i| (track.acceleration_in_segment[every * k][i] - truth[i][k]).powi(2))
                .sum::<f64>()
        })
        .sum();
    let error = (squares / (3.0 * inner.len() as f64)).sqrt();
    let step_hz = 0.05;
    let best: f64 = (1..3000)
        .map(|k| f64::from(k) * step_hz)
        .map(|f| (TAU * f).powi(4) * motion(f) * noise(f) / (motion(f) + noise(f)) * step_hz)
        .sum::<f64>()
        .sqrt();
    assert!(error < 1.15 * best, "{error} against {best} m/s2");
}

/// In the Fourier domain.
fn second_derivative(series: &[f64], rate_hz: f64) -> Vec<f64> {
    let transform = FourierPair::new(series.len());
    let mut values: Vec<Complex64> = series
        .iter()
        .map(|value| Complex64::new(*value, 0.0))
        .collect();
    transform.forward(&mut values);
    for (k, value) in values.iter_mut().enumerate() {
        *value *= -(TAU * k.min(series.len() - k) as f64 * rate_hz / series.len() as f64).powi(2);
    }
    transform.inverse(&mut values);
    values.iter().map(|value| value.re).collect()
}

#[test]
fn the_ends_are_sound() {
    let (stamps, positions, rotations) = poses(
        PoseNoise {
            position: 1e-4,
            rotation: 8e-4,
        },
        100.0,
        |_| true,
    );
    let track = PoseEstimate::fit(&stamps, &positions, &rotations)
        .unwrap()
        .track(200.0);
    let at = |k: usize| {
        (track.world_from_segment[k] * track.acceleration_in_segment[k]
            - motion(k as f64 / track.rate_hz).2)
            .norm()
    };
    let worst = (0..100)
        .chain(track.len() - 100..track.len())
        .map(at)
        .fold(0.0, f64::max);
    // The motion reaches 27 m/s2; an odd continuation errs by as much.
    assert!(worst < 5.0, "{worst}");
}

#[test]
fn noise_that_is_louder_for_some_seconds_is_kept_out() {
    let usual = PoseNoise {
        position: 5e-5,
        rotation: 5e-4,
    };
    let is_loud = |t: f64| (20.0..28.0).contains(&t);
    let (stamps, mut positions, rotations) = poses(usual, 120.0, |_| true);
    let mut random = Normal(11);
    for (k, position) in positions.iter_mut().enumerate() {
        let sigma = if is_loud(k as f64 / 120.0) { 4e-4 } else { 0.0 };
        *position += Vector3::new(random.draw(), random.draw(), random.draw()) * sigma;
    }
    let track = PoseEstimate::fit(&stamps, &positions, &rotations)
        .unwrap()
        .track(120.0);
    let error = |inside: &dyn Fn(f64) -> bool| {
        let errors: Vec<f64> = (0..track.len())
            .filter(|k| inside(*k as f64 / track.rate_hz))
            .map(|k| {
                let own = track.world_from_segment[k] * track.acceleration_in_segment[k];
                (own - motion(k as f64 / track.rate_hz).2).norm_squared()
            })
            .collect();
        (errors.iter().sum::<f64>() / errors.len() as f64).sqrt()
    };
    // Twice differentiated at the full band, this noise alone would be 30 m/s2.
    let (loud, quiet) = (
        error(&|t| (22.0..26.0).contains(&t)),
        error(&|t| (34.0..54.0).contains(&t)),
    );
    println!("{loud:.3} m/s2 where the noise is loud, {quiet:.3} elsewhere");
    assert!(loud < 1.0 && quiet < 0.2, "{loud} {quiet}");
}

/// Motion that goes on beyond the Nyquist frequency, as steep as people's.
#[test]
fn poses_too_slow_for_a_motion_keep_what_they_show_of_it() {
    let rate_hz = 17.0;
    let mut random = Normal(11);
    let terms: Vec<(f64, f64, f64)> = (2..160)
        .map(|k| {
            let hz = 0.17 * f64::from(k) + 0.03 * random.draw();
            (hz, 0.02 * hz.powi(-4) * random.draw(), random.draw())
        })
        .collect();
    let at = |t: f64, order: i32| -> f64 {
        let own = terms
            .iter()
            .map(|(hz, size, phase)| (TAU * hz).powi(order) * size * (TAU * hz * t + phase).sin());
        own.sum()
    };
    let start = Stamp::from_nanos(1_700_000_000_000_000_000);
    let mut draw = || Vector3::new(random.draw(), random.draw(), random.draw()) * 1e-5;
    let (mut stamps, mut positions, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(60.0 * rate_hz) as usize {
        let t = k as f64 / rate_hz;
        stamps.push(start.plus_seconds(t));
        positions.push(Vector3::new(at(t, 0), at(t + 100.0, 0), at(t + 200.0, 0)) + draw());
        rotations.push(so3::exp(&(Vector3::x() * (0.3 * at(t, 0)) + draw())));
    }
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let (near_the_end, ..) = estimate.filter_at(7.0);
    assert!(near_the_end > 0.6, "{near_the_end}");
    assert_eq!(estimate.filter_at(30.0).0, 0.0);
    assert!(estimate.noise().position < 0.7 * estimate.scatter().position);
    let track = estimate.track(200.0);
    let path = ErrorPath {
        units_per_metre: 1.0,
        lever_arm_m: 0.0,
        passed: &|_| [1.0; 2],
    };
    let (mut squares, mut stated) = (0.0, 0.0);
    for k in (400..track.len() - 400).step_by(7) {
        let t = k as f64 / track.rate_hz;
        let found = track.world_from_segment[k] * track.acceleration_in_segment[k];
        let truth = -Vector3::new(at(t, 2), at(t + 100.0, 2), at(t + 200.0, 2));
        squares += (found - truth).norm_squared() / 3.0;
        let stamps = [start.plus_seconds(t)];
        stated += estimate.variances(&stamps, &path)[0].acceleration;
    }
    let ratio = squares / stated;
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_machine_that_is_known_of_is_left_out_though_it_is_not_steady() {
    let noise = PoseNoise {
        position: 1e-5,
        rotation: 1e-4,
    };
    let (stamps, mut positions, rotations) = poses(noise, 200.0, |_| true);
    for (k, position) in positions.iter_mut().enumerate() {
        let t = k as f64 / 200.0;
        position.z += 1e-4 * (TAU * 31.0 * t + 3.0 * (TAU * 0.11 * t).sin()).sin();
    }
    let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
    let error = |estimate: &PoseEstimate| acceleration_error(&estimate.track(200.0));
    let [as_it_is, told, elsewhere] = [
        error(&estimate),
        error(&estimate.without_machine(31.0)),
        error(&estimate.without_machine(24.0)),
    ];
    let shaken = 1e-4 * (TAU * 31.0_f64).powi(2) / 2.0_f64.sqrt();
    assert!(as_it_is > 0.8 * shaken, "{as_it_is} of {shaken}");
    assert!(told < 0.15 * shaken, "{told} of {shaken}");
    assert_eq!(elsewhere, as_it_is);
    // What is slower than machines is left as it is.
    assert_eq!(error(&estimate.without_machine(3.9)), as_it_is);
}
