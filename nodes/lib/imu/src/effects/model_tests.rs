//! The measurement model: each effect by hand, and the order in which they act.
#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, TAU};

use cromosim_spatial::{KinematicTrack, Stamp, so3, uniform_stamps};
use nalgebra::{Matrix3, Vector3};

use super::{Effect, EffectKind, EffectKind as Kind, EffectSet, Reading, SensorModel, low_pass};

pub(super) const START: Stamp = Stamp::from_nanos(1_700_000_000_123_456_789);
const G: f64 = 9.80665;

/// A tumbling motion on a grid of 200 Hz: `w = (sin 2t, 0.5 cos 3t, 0.8)` and an acceleration of
/// some m/s2, both in segment axes.
pub(super) fn track(seconds: f64) -> KinematicTrack {
    let count = (seconds * 200.0) as usize + 1;
    let mut track = KinematicTrack {
        start: START,
        rate_hz: 200.0,
        ..KinematicTrack::default()
    };
    let mut rotation = so3::exp(&Vector3::new(0.3, -0.2, 0.5));
    for k in 0..count {
        let t = k as f64 / 200.0;
        let rate = |t: f64| Vector3::new((2.0 * t).sin(), 0.5 * (3.0 * t).cos(), 0.8);
        track.world_from_segment.push(rotation);
        track.angular_velocity_in_segment.push(rate(t));
        track.angular_acceleration_in_segment.push(Vector3::new(
            2.0 * (2.0 * t).cos(),
            -1.5 * (3.0 * t).sin(),
            0.0,
        ));
        track.acceleration_in_segment.push(Vector3::new(
            3.0 * (5.0 * t).sin(),
            2.0 * (4.0 * t).cos(),
            (7.0 * t).sin(),
        ));
        rotation *= so3::exp(&(rate(t + 0.0025) / 200.0));
    }
    track
}

/// Stamps of the grid itself, so that nothing is interpolated.
fn on_grid(track: &KinematicTrack) -> Vec<Stamp> {
    (0..track.len()).map(|k| track.stamp(k)).collect()
}

pub(super) fn set(effects: &[(Kind, &[f64])]) -> EffectSet {
    let effects: Vec<Effect> = effects
        .iter()
        .map(|(kind, values)| Effect::new(*kind, values.to_vec()).unwrap())
        .collect();
    EffectSet::try_from(effects).unwrap()
}

fn run(effects: &[(Kind, &[f64])], track: &KinematicTrack, stamps: &[Stamp]) -> Vec<Reading> {
    SensorModel::new(&set(effects), START).run(track, stamps)
}

fn close(found: &[Reading], expected: impl Fn(usize) -> Reading, tolerance: f64) {
    for (k, found) in found.iter().enumerate() {
        let expected = expected(k);
        let error = (found.specific_force - expected.specific_force)
            .norm()
            .max((found.angular_velocity - expected.angular_velocity).norm());
        assert!(
            error < tolerance,
            "reading {k}: {found:?} against {expected:?}"
        );
    }
}

/// The ideal reading of entry k, at a lever arm.
fn ideal(track: &KinematicTrack, k: usize, arm: &Vector3<f64>) -> Reading {
    let (w, alpha) = (
        track.angular_velocity_in_segment[k],
        track.angular_acceleration_in_segment[k],
    );
    let up = track.world_from_segment[k].inverse() * Vector3::new(0.0, 0.0, G);
    Reading {
        specific_force: track.acceleration_in_segment[k]
            + up
            + alpha.cross(arm)
            + w.cross(&w.cross(arm)),
        angular_velocity: w,
    }
}

#[test]
fn neutral_effects_change_nothing() {
    let track = track(4.0);
    let stamps = uniform_stamps(START.plus_seconds(-0.1), START.plus_seconds(4.1), 97.0).unwrap();
    let nominal = run(&[], &track, &stamps);
    for kind in EffectKind::ALL {
        let model = SensorModel::new(&EffectSet::new().with(Effect::neutral(kind)), START);
        assert_eq!(
            model.total_noise(&super::DeclaredNoise::default()),
            super::DeclaredNoise::default()
        );
        close(&model.run(&track, &stamps), |k| nominal[k], 1e-12);
    }
    let held = (&nominal[0], &nominal[nominal.len() - 1]);
    assert_eq!(held.0, &run(&[], &track, &[START])[0]);
    assert_eq!(held.1, &run(&[], &track, &[track.stamp(800)])[0]);
}

#[test]
fn effects_on_the_grid_act_as_by_hand() {
    let track = track(3.0);
    let stamps = on_grid(&track);
    let ideal = |k: usize| ideal(&track, k, &Vector3::zeros());
    let arm = Vector3::new(0.05, -0.1, 0.2);
    close(&run(&[], &track, &stamps), ideal, 1e-9);
    close(
        &run(&[(Kind::LeverArm, arm.as_slice())], &track, &stamps),
        |k| self::ideal(&track, k, &arm),
        1e-9,
    );
    // segment_from_sensor turns the sensor's x onto the segment's y.
    let mounted = run(
        &[(Kind::MountRotation, &[0.0, 0.0, FRAC_PI_2])],
        &track,
        &stamps,
    );
    let turned = |v: Vector3<f64>| Vector3::new(v.y, -v.x, v.z);
    close(
        &mounted,
        |k| Reading {
            specific_force: turned(ideal(k).specific_force),
            angular_velocity: turned(ideal(k).angular_velocity),
        },
        1e-9,
    );
    let swapped = run(
        &[(
            Kind::AxisConvention,
            &[0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        )],
        &track,
        &stamps,
    );
    let axes = |v: Vector3<f64>| Vector3::new(-v.z, v.x, v.y);
    close(
        &swapped,
        |k| Reading {
            specific_force: axes(ideal(k).specific_force),
            angular_velocity: axes(ideal(k).angular_velocity),
        },
        1e-9,
    );
    let up = |k: usize| track.world_from_segment[k].inverse() * Vector3::new(0.0, 0.0, G);
    for (mode, factor) in [(0.0, 1.0), (1.0, 0.0), (2.0, -1.0)] {
        let read = run(&[(Kind::GravityConvention, &[mode])], &track, &stamps);
        close(
            &read,
            |k| Reading {
                specific_force: track.acceleration_in_segment[k] + up(k) * factor,
                angular_velocity: track.angular_velocity_in_segment[k],
            },
            1e-9,
        );
    }
    // The reported world leans by T: what is up in it is T up.
    let tilt = Vector3::new(0.02, -0.03, 0.0);
    let leaning = |k: usize| {
        track.world_from_segment[k].inverse() * (so3::exp(&tilt) * Vector3::new(0.0, 0.0, G))
    };
    let tilted = run(
        &[
            (Kind::ReferenceTilt, tilt.as_slice()),
            (Kind::ReferenceScale, &[2.0]),
            (Kind::ReferenceUnits, &[100.0]),
        ],
        &track,
        &stamps,
    );
    close(
        &tilted,
        |k| Reading {
            specific_force: track.acceleration_in_segment[k] / 200.0 + leaning(k),
            angular_velocity: track.angular_velocity_in_segment[k],
        },
        1e-9,
    );
    let flat: Vec<f64> = (1..10).map(|k| 1e-3 * f64::from(k)).collect();
    let coupled = run(&[(Kind::GyroGSensitivity, &flat)], &track, &stamps);
    let g = Matrix3::from_row_slice(&flat);
    close(
        &coupled,
        |k| Reading {
            specific_force: ideal(k).specific_force,
            angular_velocity: ideal(k).angular_velocity + g * ideal(k).specific_force,
        },
        1e-9,
    );
}

#[test]
fn each_reading_is_scaled_shifted_and_made_digital_as_by_hand() {
    let track = track(2.0);
    let stamps = on_grid(&track);
    let ideal = |k: usize| ideal(&track, k, &Vector3::zeros());
    let read = run(
        &[
            (Kind::AccelBias, &[0.1, 0.2, 0.3]),
            (Kind::AccelScale, &[1.1, 0.9, 1.0]),
            (Kind::AccelMisalignment, &[0.01, 0.02, 0.03]),
            (Kind::AccelBiasDrift, &[0.01, 0.0, -0.02]),
            (Kind::GyroBias, &[0.0, -0.2, 0.0]),
            (Kind::GyroScale, &[2.0, 1.0, 1.0]),
        ],
        &track,
        &stamps,
    );
    let by_hand = |k: usize| {
        let (f, w, t) = (
            ideal(k).specific_force,
            ideal(k).angular_velocity,
            stamps[k] - START,
        );
        let x = 1.1 * (f.x + 0.01 * f.y + 0.02 * f.z) + 0.1 + 0.01 * t;
        let specific_force = Vector3::new(x, 0.9 * (f.y + 0.03 * f.z) + 0.2, f.z + 0.3 - 0.02 * t);
        Reading {
            specific_force,
            angular_velocity: Vector3::new(2.0 * w.x, w.y - 0.2, w.z),
        }
    };
    close(&read, by_hand, 1e-9);
    let digital = run(
        &[
            (Kind::AccelSaturation, &[8.1]),
            (Kind::AccelQuantization, &[0.5]),
            (Kind::GyroUnits, &[1000.0]),
            (Kind::GyroQuantization, &[0.1]),
        ],
        &track,
        &stamps,
    );
    let clip = |v: f64| (v.clamp(-8.1, 8.1) / 0.5).round() * 0.5;
    close(
        &digital,
        |k| Reading {
            specific_force: ideal(k).specific_force.map(clip),
            angular_velocity: ideal(k).angular_velocity.map(|v| (v / 0.1).round() * 100.0),
        },
        1e-9,
    );
    let density = SensorModel::new(
        &set(&[(Kind::AccelNoise, &[0.02]), (Kind::GyroNoise, &[0.003])]),
        START,
    )
    .total_noise(&super::DeclaredNoise::default());
    assert_eq!((density.accel_density, density.gyro_density), (0.02, 0.003));
}

#[test]
fn stamps_are_those_of_the_devices_clock() {
    let track = track(20.0);
    let clock: [(Kind, &[f64]); 2] = [(Kind::TimeOffset, &[0.031]), (Kind::ClockDrift, &[400.0])];
    // True times on the grid, stamped by the clock: t0 + (t - t0) 1.0004 + 0.031.
    let stamps: Vec<Stamp> = on_grid(&track)
        .iter()
        .map(|t| START.plus_seconds((*t - START) * 1.0004 + 0.031))
        .collect();
    close(
        &run(&clock, &track, &stamps),
        |k| ideal(&track, k, &Vector3::zeros()),
        1e-7,
    );
    // Drift of the bias goes by true time.
    let drifting: [(Kind, &[f64]); 3] =
        [clock[0], clock[1], (Kind::GyroBiasDrift, &[1.0, 0.0, 0.0])];
    let read = run(&drifting, &track, &stamps);
    let t = |k: usize| Vector3::new(k as f64 / 200.0, 0.0, 0.0);
    close(
        &read,
        |k| Reading {
            angular_velocity: track.angular_velocity_in_segment[k] + t(k),
            ..ideal(&track, k, &Vector3::zeros())
        },
        1e-7,
    );
}

#[test]
fn the_gyroscope_alone_is_late_with_all_that_it_feels() {
    let track = track(6.0);
    let stamps = uniform_stamps(START.plus_seconds(1.0), START.plus_seconds(5.0), 200.0).unwrap();
    let g = [0.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0];
    let felt: [(Kind, &[f64]); 4] = [
        (Kind::GyroGSensitivity, &g),
        (Kind::LowPass, &[12.0]),
        (Kind::MountSlip, &[START.as_seconds() + 3.0, 0.3, 0.0, 0.0]),
        (Kind::TimeOffset, &[0.02]),
    ];
    for seconds in [0.0125, -0.004] {
        let late: Vec<(Kind, &[f64])> = felt
            .iter()
            .copied()
            .chain([(Kind::ChannelDelay, std::slice::from_ref(&seconds))])
            .collect();
        let read = run(&late, &track, &stamps);
        let plain = run(&felt, &track, &stamps);
        let before: Vec<Stamp> = stamps.iter().map(|t| t.plus_seconds(-seconds)).collect();
        let earlier = run(&felt, &track, &before);
        close(
            &read,
            |k| Reading {
                specific_force: plain[k].specific_force,
                angular_velocity: earlier[k].angular_velocity,
            },
            1e-6,
        );
    }
}

#[test]
fn a_slip_is_sharp_and_turns_the_mount_further() {
    let track = track(4.0);
    let stamps = uniform_stamps(START, START.plus_seconds(4.0), 1000.0).unwrap();
    let (mount, slip) = (Vector3::new(0.4, 0.0, 0.1), Vector3::new(0.0, 0.5, -0.3));
    let at = START.nanos as f64 * 1e-9 + 2.00271;
    let seconds = super::mount_slip::since(START, at);
    assert!((seconds - 2.00271).abs() < 3e-7);
    let slipped = run(
        &[
            (Kind::MountRotation, mount.as_slice()),
            (Kind::MountSlip, &[at, slip.x, slip.y, slip.z]),
        ],
        &track,
        &stamps,
    );
    let before = run(&[(Kind::MountRotation, mount.as_slice())], &track, &stamps);
    let total = so3::log(&(so3::exp(&mount) * so3::exp(&slip)));
    let after = run(&[(Kind::MountRotation, total.as_slice())], &track, &stamps);
    close(
        &slipped,
        |k| {
            if stamps[k] - START < seconds {
                before[k]
            } else {
                after[k]
            }
        },
        1e-9,
    );
}

#[test]
fn the_low_pass_remembers_across_a_slip() {
    // Against the plain way: turn on a fine grid, then filter.
    let mut fine = track(4.0);
    let ideal: Vec<Reading> = (0..fine.len())
        .map(|k| ideal(&fine, k, &Vector3::zeros()))
        .collect();
    fine.start = START;
    let slip = Vector3::new(0.5, -0.9, 0.3);
    let g = [0.01, 0.0, 0.02, 0.0, -0.01, 0.0, 0.0, 0.03, 0.0];
    let at_index = 401;
    let at = START.nanos as f64 * 1e-9 + 2.0025;
    let low_passed: [(Kind, &[f64]); 3] = [
        (Kind::MountSlip, &[at, slip.x, slip.y, slip.z]),
        (Kind::LowPass, &[5.0]),
        (Kind::GyroGSensitivity, &g),
    ];
    let read = run(&low_passed, &fine, &on_grid(&fine));
    let turned: Vec<Reading> = ideal
        .iter()
        .enumerate()
        .map(|(k, reading)| {
            let back = so3::exp(&slip).inverse();
            let (specific_force, rate) = if k < at_index {
                (reading.specific_force, reading.angular_velocity)
            } else {
                (
                    back * reading.specific_force,
                    back * reading.angular_velocity,
                )
            };
            Reading {
                specific_force,
                angular_velocity: rate + Matrix3::from_row_slice(&g) * specific_force,
            }
        })
        .collect();
    // Held straight between samples, the switch is a ramp over one interval around 2.0025 s: right
    // to a part of the grid's interval.
    let mut filter = super::filter::Streamed::new(super::filter::SecondOrder {
        natural_hz: 5.0,
        damping_ratio: low_pass::DAMPING_RATIO,
    });
    let mut rates = filter.clone();
    let plain: Vec<Reading> = turned
        .iter()
        .map(|reading| Reading {
            specific_force: filter.push(reading.specific_force, 0.005),
            angular_velocity: rates.push(reading.angular_velocity, 0.005),
        })
        .collect();
    close(&read, |k| plain[k], 0.02);
}

#[test]
fn vibration_passes_the_filter_and_reaches_the_gyroscope() {
    let mut still = track(4.0);
    still.acceleration_in_segment.fill(Vector3::zeros());
    still.angular_velocity_in_segment.fill(Vector3::zeros());
    still.angular_acceleration_in_segment.fill(Vector3::zeros());
    still.world_from_segment.fill(so3::exp(&Vector3::zeros()));
    let stamps = uniform_stamps(START.plus_seconds(1.0), START.plus_seconds(3.0), 333.0).unwrap();
    let g = [0.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0];
    let vibration = [
        31.7, 1.0, -2.0, 0.5, 0.7, 2.1, 5.9, 0.1, 0.2, 0.05, 0.3, 4.0, 1.1,
    ];
    let gravity = Vector3::new(0.0, 0.0, G);
    let plain: [(Kind, &[f64]); 2] = [(Kind::Vibration, &vibration), (Kind::GyroGSensitivity, &g)];
    let by_hand = |gain: f64, delay: f64, gyroscope_late: f64| {
        let stamps = &stamps;
        move |k: usize| {
            let wave = |first: usize, late: f64| {
                let x = TAU * 31.7 * (stamps[k] - START - late) + delay;
                Vector3::from_fn(|axis, _| {
                    vibration[first + axis] * (x + vibration[first + 3 + axis]).sin() * gain
                })
            };
            Reading {
                specific_force: wave(1, 0.0) + gravity,
                angular_velocity: wave(7, gyroscope_late)
                    + Matrix3::from_row_slice(&g) * (wave(1, gyroscope_late) + gravity),
            }
        }
    };
    close(&run(&plain, &still, &stamps), by_hand(1.0, 0.0, 0.0), 1e-9);
    let filtered: [(Kind, &[f64]); 4] = [
        plain[0],
        plain[1],
        (Kind::LowPass, &[20.0]),
        (Kind::ChannelDelay, &[0.006]),
    ];
    // 1 / (1 - r^2 + sqrt(2) i r) at r = 31.7 / 20.
    let r: f64 = 31.7 / 20.0;
    let (real, imaginary) = (1.0 - r * r, 2f64.sqrt() * r);
    close(
        &run(&filtered, &still, &stamps),
        by_hand(
            (1.0 + r.powi(4)).sqrt().recip(),
            -imaginary.atan2(real),
            0.006,
        ),
        1e-9,
    );
}

/// Pairs of effects that do not commute, with the result of the right order by hand at one time.
#[test]
fn the_order_is_that_of_the_measurement_model() {
    let track = track(3.0);
    let stamps = on_grid(&track);
    let ideal = |k: usize| ideal(&track, k, &Vector3::zeros());
    let swap = [0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let m = Matrix3::from_row_slice(&swap);
    // 3: axes after the mount.
    let rotvec = Vector3::new(0.7, 0.0, 0.0);
    let mount = so3::exp(&rotvec).inverse();
    let read = run(
        &[
            (Kind::MountRotation, rotvec.as_slice()),
            (Kind::AxisConvention, &swap),
        ],
        &track,
        &stamps,
    );
    close(
        &read,
        |k| Reading {
            specific_force: m * (mount * ideal(k).specific_force),
            angular_velocity: m * (mount * ideal(k).angular_velocity),
        },
        1e-9,
    );
    // 3 before 5: the coupling feels force in the chip's axes.
    let mut g = [0.0; 9];
    g[1] = 0.1;
    let read = run(
        &[(Kind::AxisConvention, &swap), (Kind::GyroGSensitivity, &g)],
        &track,
        &stamps,
    );
    close(
        &read,
        |k| Reading {
            specific_force: m * ideal(k).specific_force,
            angular_velocity: m * ideal(k).angular_velocity
                + Matrix3::from_row_slice(&g) * m * ideal(k).specific_force,
        },
        1e-9,
    );
    // 5 before 7: the gyroscope does not feel the accelerometer's own bias, but its scale acts on
    // what it feels.
    let read = run(
        &[
            (Kind::AccelBias, &[1.0, 1.0, 1.0]),
            (Kind::GyroScale, &[2.0, 1.0, 1.0]),
            (Kind::GyroGSensitivity, &g),
        ],
        &track,
        &stamps,
    );
    let scaled = |k: usize| {
        Vector3::new(2.0, 1.0, 1.0).component_mul(
            &(ideal(k).angular_velocity + Matrix3::from_row_slice(&g) * ideal(k).specific_force),
        )
    };
    close(
        &read,
        |k| Reading {
            specific_force: ideal(k).specific_force + Vector3::repeat(1.0),
            angular_velocity: scaled(k),
        },
        1e-9,
    );
    // 7 before 8: bias, then the limit, then steps, then units.
    let read = run(
        &[
            (Kind::AccelBias, &[5.0; 3]),
            (Kind::AccelSaturation, &[7.3]),
            (Kind::AccelQuantization, &[1.0]),
            (Kind::AccelUnits, &[0.1]),
        ],
        &track,
        &stamps,
    );
    let digital = |v: f64| (v + 5.0).clamp(-7.3, 7.3).round() * 0.1;
    close(
        &read,
        |k| Reading {
            specific_force: ideal(k).specific_force.map(digital),
            angular_velocity: ideal(k).angular_velocity,
        },
        1e-9,
    );
    // 2 before 3 and on the force alone.
    let tissue = run(&[(Kind::SoftTissue, &[2.0, 0.3])], &track, &stamps);
    assert!(
        (0..stamps.len())
            .all(|k| (tissue[k].angular_velocity - ideal(k).angular_velocity).norm() < 1e-9)
    );
    assert!((100..500).any(|k| (tissue[k].specific_force - ideal(k).specific_force).norm() > 0.3));
    // 1 before 2: the lever arm's force goes through the tissue.
    let arm = [0.3, 0.0, 0.0];
    let both = run(
        &[(Kind::LeverArm, &arm), (Kind::SoftTissue, &[2.0, 0.3])],
        &track,
        &stamps,
    );
    let mut added: Vec<Vector3<f64>> = (0..stamps.len())
        .map(|k| {
            self::ideal(&track, k, &Vector3::from(arm)).specific_force - ideal(k).specific_force
        })
        .collect();
    let tissue_alone = super::tissue::Tissue {
        filter: super::filter::SecondOrder {
            natural_hz: 2.0,
            damping_ratio: 0.3,
        },
    };
    let turning = |k: usize| super::tissue::Turning {
        velocity: track.angular_velocity_in_segment[k],
        acceleration: track.angular_acceleration_in_segment[k],
    };
    tissue_alone.apply(&mut added, turning, 200.0);
    close(
        &both,
        |k| Reading {
            specific_force: tissue[k].specific_force + added[k],
            angular_velocity: tissue[k].angular_velocity,
        },
        1e-9,
    );
    // 5 before 6: what the gyroscope feels is low-passed once, with the rest.
    let low = run(&[(Kind::LowPass, &[3.0])], &track, &stamps);
    let coupled = run(
        &[(Kind::LowPass, &[3.0]), (Kind::GyroGSensitivity, &g)],
        &track,
        &stamps,
    );
    close(
        &coupled,
        |k| Reading {
            specific_force: low[k].specific_force,
            angular_velocity: low[k].angular_velocity
                + Matrix3::from_row_slice(&g) * low[k].specific_force,
        },
        1e-9,
    );
}
