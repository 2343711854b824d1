#![allow(clippy::unwrap_used)]
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::*;
use crate::{Stamp, so3};

fn position(t: f64) -> Vector3<f64> {
    Vector3::new(
        0.2 * (5.0 * t).sin() + 0.01 * (19.0 * t).sin(),
        0.15 * (6.1 * t).cos(),
        0.1 * (9.3 * t + 0.4).sin(),
    )
}

fn rotation(t: f64) -> UnitQuaternion<f64> {
    so3::exp(&Vector3::new(
        0.6 * (4.0 * t).sin(),
        0.4 * (7.1 * t).cos(),
        0.5 * (5.3 * t).sin(),
    ))
}

/// White noise, nearly normal.
fn scatter(random: &mut ChaCha12Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| {
        let sum: f64 = (0..12).map(|_| random.random::<f64>()).sum();
        size * (sum - 6.0)
    })
}

/// Poses at a rate on the chords between frames of another; none: on the motion itself.
fn poses(poses_hz: f64, frames_hz: Option<f64>, first_frame_s: f64, noise: [f64; 2]) -> PoseSeries {
    let mut random = ChaCha12Rng::seed_from_u64(3);
    let mut series = PoseSeries::default();
    for k in 0..(40.0 * poses_hz) as usize {
        let t = k as f64 / poses_hz;
        let (p, r) = match frames_hz {
            None => (position(t), rotation(t)),
            Some(hz) => {
                let turns = ((t - first_frame_s) * hz).floor();
                let [from, to] = [turns, turns + 1.0].map(|k| first_frame_s + k / hz);
                let share = (t - from) * hz;
                let turn = so3::log(&(rotation(from).inverse() * rotation(to)));
                (
                    position(from) * (1.0 - share) + position(to) * share,
                    rotation(from) * so3::exp(&(turn * share)),
                )
            }
        };
        series
            .stamps
            .push(Stamp::from_nanos(1_700_000_000_000_000_000).plus_seconds(t));
        series.positions.push(p + scatter(&mut random, noise[0]));
        series
            .rotations
            .push(r * so3::exp(&scatter(&mut random, noise[1])));
    }
    series
}

const ORDINARY: [f64; 2] = [1e-4, 8e-4];

#[test]
fn frames_are_found_and_come_back() {
    for (poses_hz, frames_hz, first, noise) in [
        (200.0, 54.27, 0.0, ORDINARY),
        (120.0, 54.27, 0.007, ORDINARY),
        (100.0, 54.27, 0.0, ORDINARY),
        (100.0, 45.73, 0.0, ORDINARY),
        (200.0, 25.0, 0.011, ORDINARY),
        (200.0, 23.14, 0.0, ORDINARY),
        (200.0, 41.305, 0.0, ORDINARY),
        (200.0, 60.0, 0.0, [2e-4, 1.2e-3]),
        (200.0, 50.0, 0.0, [3e-4, 1.7e-3]),
        (120.0, 30.0, 0.0, ORDINARY),
        (120.0, 60.0, 0.0, ORDINARY),
        (286.0, 120.0, 0.001, [1e-5, 1e-4]),
        (200.0, 40.0, 0.004, [0.0, 0.0]),
        // Kinks that drown in the noise between neighbours.
        (240.0, 16.02, 0.003, [1.5e-3, 1e-2]),
        (300.0, 16.66, 0.0, [2e-3, 1e-2]),
        // And nearly so over several.
        (263.6, 46.35, 0.004, [9e-4, 4.5e-3]),
        (240.0, 34.55, 0.004, [1.2e-3, 6e-3]),
        // The rate itself stands out less than its tenth multiple and more.
        (200.0, 10.0, 0.0013, [3e-4, 1.2e-3]),
        (200.0, 10.0, 0.0013, [5e-4, 2e-3]),
        (360.0, 9.0, 0.0013, [3e-4, 1.2e-3]),
        (240.0, 12.0, 0.0013, [3e-4, 1.2e-3]),
        // Two poses alone tell of the frame before the first pose.
        (290.6, 17.807, 0.0051, [0.0, 0.0]),
    ] {
        let case = format!("{frames_hz} Hz at {poses_hz} Hz");
        let poses = poses(poses_hz, Some(frames_hz), first, noise);
        let grid = FrameGrid::find(&poses).unwrap_or_else(|| panic!("{case}: none"));
        assert!(
            (grid.rate_hz() - frames_hz).abs() < 0.02,
            "{case}: {grid:?}"
        );
        let again = FrameGrid::at_rate(&poses, frames_hz).unwrap();
        assert!(
            (again.rate_hz() - frames_hz).abs() < 0.02,
            "{case}: {again:?}"
        );
        let frames = grid.frames(&poses);
        if poses_hz < 2.0 * frames_hz {
            assert_eq!(frames.stamps, poses.stamps, "{case}");
        }
        let mut squares = [0.0; 2];
        for (k, stamp) in frames.stamps.iter().enumerate() {
            let t = *stamp - poses.stamps[0];
            squares[0] += (frames.positions[k] - position(t)).norm_squared();
            squares[1] += so3::log(&(rotation(t).inverse() * frames.rotations[k])).norm_squared();
        }
        for (square, noise) in squares.iter().zip(noise) {
            let rms = (square / (3.0 * frames.stamps.len() as f64)).sqrt();
            assert!(rms < 1.3 * noise + 2e-4, "{case}: off by {rms}");
        }
    }
}

#[test]
fn where_there_are_no_chords_none_are_found() {
    for noise in [[0.0, 0.0], ORDINARY, [1e-3, 5e-3], [4e-3, 0.014]] {
        for poses_hz in [60.0, 120.0, 200.0] {
            let plain = poses(poses_hz, None, 0.0, noise);
            assert_eq!(FrameGrid::find(&plain), None, "{poses_hz} {noise:?}");
            assert_eq!(FrameGrid::at_rate(&plain, 50.0), None);
        }
    }
    // Frames faster than the poses leave no trace.
    let fast = poses(100.0, Some(240.0), 0.0, ORDINARY);
    assert_eq!(FrameGrid::find(&fast), None);
    assert!(FrameGrid::find(&PoseSeries::default()).is_none());
}

#[test]
fn missing_poses_leave_missing_frames() {
    let mut poses = poses(120.0, Some(40.0), 0.0, ORDINARY);
    let keep = |k: usize| !(1200..1500).contains(&k) && k % 131 != 7;
    let kept: Vec<usize> = (0..poses.stamps.len()).filter(|k| keep(*k)).collect();
    poses = PoseSeries {
        stamps: kept.iter().map(|&k| poses.stamps[k]).collect(),
        positions: kept.iter().map(|&k| poses.positions[k]).collect(),
        rotations: kept.iter().map(|&k| poses.rotations[k]).collect(),
    };
    let grid = FrameGrid::find(&poses).unwrap();
    let frames = grid.frames(&poses);
    let largest = frames
        .stamps
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .fold(0.0, f64::max);
    assert!((2.4..2.6).contains(&largest), "{largest}");
}

/// A gait's harmonics mark a rate as kinks do, and chords pass through its swings as well as noise lets them.
#[test]
fn a_gait_under_much_noise_has_no_chords() {
    for (step_hz, width, size) in [
        (1.008, 0.03, 0.03),
        (1.008, 0.045, 0.1),
        (1.008, 0.06, 0.25),
        (1.3, 0.06, 0.1),
    ] {
        let mut gait = poses(200.0, None, 0.0, [2.8e-3, 8.4e-3]);
        for (k, position) in gait.positions.iter_mut().enumerate() {
            let turns = (k as f64 / 200.0 * step_hz).fract();
            let swing = (-((turns - 0.5) / width).powi(2)).exp();
            position.x += size * swing;
            gait.rotations[k] *= so3::exp(&Vector3::new(2.0 * size * swing, 0.0, 0.0));
        }
        assert_eq!(FrameGrid::find(&gait), None, "{step_hz} steps a second");
    }
}

/// Kinks come back at the sum of two frequencies of a steady motion, but the rest of the motion has no images.
#[test]
fn a_motion_of_two_steady_frequencies_has_no_chords() {
    for (poses_hz, lines_hz, size, noise) in [
        (90.0, [14.14, 14.14], 1e-3, [1e-4, 1.3e-3]),
        (30.0, [7.64, 5.69], 3e-3, [7e-5, 1e-3]),
        (30.0, [7.38, 7.17], 3e-3, [3e-4, 2.5e-3]),
        (50.0, [8.19, 6.02], 3e-3, [7e-5, 8e-4]),
    ] {
        let mut steady = poses(poses_hz, None, 0.0, noise);
        for k in 0..steady.stamps.len() {
            let t = k as f64 / poses_hz;
            let [first, second] = lines_hz.map(|hz| (TAU * hz * t).sin());
            steady.positions[k] += Vector3::new(0.0, size * first, size * second);
            steady.rotations[k] *= so3::exp(&Vector3::new(0.0, size * second, 3.0 * size * first));
        }
        assert_eq!(FrameGrid::find(&steady), None, "{lines_hz:?} Hz");
    }
}

/// Adds noise of which a part of an error is left in the next.
fn add_noise_with_memory(poses: &mut PoseSeries, pole: f64) {
    let mut random = ChaCha12Rng::seed_from_u64(5);
    let mut noise = [Vector3::zeros(); 2];
    for (position, rotation) in poses.positions.iter_mut().zip(&mut poses.rotations) {
        for (value, size) in noise.iter_mut().zip([1.1e-4, 1.8e-3]) {
            *value = *value * pole + scatter(&mut random, size) * f64::sqrt(1.0 - pole * pole);
        }
        *position += noise[0];
        *rotation *= so3::exp(&noise[1]);
    }
}

/// Noise that is nearly the same in neighbours lies near short chords: those of a multiple of the rate fit better than the true
/// ones, and neighbours show little of how far it lies off these.
#[test]
fn behind_noise_with_a_memory_frames_are_none_of_a_multiple() {
    for (poses_hz, frames_hz, pole) in [
        (120.0, 15.0, 0.5),
        (120.0, 12.0, 0.45),
        (100.0, 12.5, 0.4),
        (90.0, 10.0, 0.4),
        (200.0, 20.0, 0.45),
        (200.0, 20.0, 0.73),
        (240.0, 20.0, 0.8),
    ] {
        let mut poses = poses(poses_hz, Some(frames_hz), 0.003, [0.0, 0.0]);
        add_noise_with_memory(&mut poses, pole);
        let found = FrameGrid::find(&poses).map(|grid| grid.rate_hz());
        assert!(
            found.is_some_and(|hz| (hz - frames_hz).abs() < 0.02),
            "{frames_hz} Hz at {poses_hz} Hz: {found:?}"
        );
    }
    for pole in [0.45, 0.73, 0.9] {
        let mut plain = poses(200.0, None, 0.0, [0.0, 0.0]);
        add_noise_with_memory(&mut plain, pole);
        assert_eq!(FrameGrid::find(&plain), None, "{pole}");
    }
}

#[test]
fn noise_about_a_chord_is_told_with_its_memory() {
    // White noise is as it is, and so is what bends.
    assert_eq!(about_chord([2.0, 2.1], 10.0), 2.0);
    assert_eq!(about_chord([2.0, 9.0], 10.0), 2.0);
    let memory: f64 = 0.8;
    let own = (1.0 - memory) * (3.0 - memory) / 3.0;
    let wider = (1.0 - memory.powi(2)) * (3.0 - memory.powi(2)) / 3.0;
    let [few, many] = [4.0, 30.0].map(|poses| about_chord([own, wider], poses));
    assert!(own < few && few < many && many < 1.0, "{own} {few} {many}");
}
