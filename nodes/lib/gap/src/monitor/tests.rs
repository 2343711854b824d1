#![allow(clippy::unwrap_used)]
//! Inject each effect into made-up motion; the monitor must name it.

use cromosim_imu::{EffectKind, PerChannel};
use cromosim_spatial::Stamp;
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::*;

const SIGMAS: [f64; 2] = [0.03, 0.003];

/// What a sensor reads at a time, s.
type Read = Box<dyn Fn(f64) -> (Vector3<f64>, Vector3<f64>)>;

/// A body-worn sensor's motion in sensor axes: specific force, angular velocity and acceleration,
/// and gravity's reaction.
pub(super) struct Moment {
    pub specific_force: Vector3<f64>,
    pub angular_velocity: Vector3<f64>,
    pub angular_acceleration: Vector3<f64>,
    pub up: Vector3<f64>,
}

pub(super) fn rotation(t: f64) -> Rotation3<f64> {
    Rotation3::from_euler_angles(
        0.7 * (2.1 * t).sin(),
        0.5 * (1.7 * t + 0.4).sin() + 0.2,
        0.9 * (2.9 * t + 1.0).sin(),
    )
}

fn angular_velocity(t: f64) -> Vector3<f64> {
    let step = 1e-4;
    (rotation(t - step).inverse() * rotation(t + step)).scaled_axis() / (2.0 * step)
}

pub(super) fn moment(t: f64) -> Moment {
    let acceleration = Vector3::new(
        3.0 * (6.1 * t).sin(),
        2.5 * (7.3 * t + 0.3).cos(),
        4.0 * (9.7 * t).sin(),
    );
    let to_sensor = rotation(t).inverse();
    let up = to_sensor * Vector3::new(0.0, 0.0, 9.80665);
    Moment {
        specific_force: to_sensor * acceleration + up,
        angular_velocity: angular_velocity(t),
        angular_acceleration: (angular_velocity(t + 1e-3) - angular_velocity(t - 1e-3)) / 2e-3,
        up,
    }
}

/// A standard normal number by Box and Muller from a hash of its index.
fn normal(index: u64) -> f64 {
    let uniform = |salt: u64| {
        let mut x = (index + salt).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (-2.0 * uniform(1 << 40).max(1e-12).ln()).sqrt()
        * (std::f64::consts::TAU * uniform(1 << 41)).cos()
}

fn stream(
    rate_hz: f64,
    noise: [f64; 2],
    seed: u64,
    read: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>),
) -> Vec<ImuReading> {
    let reading = |k: u64| {
        let t = 0.0034 + k as f64 / rate_hz;
        let (f, w) = read(t);
        let clean = [f.x, f.y, f.z, w.x, w.y, w.z];
        let values = std::array::from_fn(|axis| {
            clean[axis] + noise[axis / 3] * normal(seed * 1_000_000 + k * 6 + axis as u64)
        });
        ImuReading {
            stamp: Stamp::from_nanos(1_700_000_000_000_000_000).plus_seconds(t),
            values,
        }
    };
    (0..(10.0 * rate_hz) as u64).map(reading).collect()
}

fn simulated() -> Vec<ImuReading> {
    stream(120.0, [0.0; 2], 1, |t| {
        (moment(t).specific_force, moment(t).angular_velocity)
    })
}

fn options() -> MonitorOptions {
    MonitorOptions {
        declared_sigmas: PerChannel {
            accelerometer: Some(SIGMAS[0]),
            gyroscope: Some(SIGMAS[1]),
        },
        ..MonitorOptions::default()
    }
}

fn assess_measured(measured: &[ImuReading]) -> Assessment {
    assess(measured, &simulated(), &options()).unwrap()
}

fn named(read: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>)) -> Assessment {
    assess_measured(&stream(100.0, SIGMAS, 2, read))
}

#[test]
fn no_gap_is_none() {
    let found = named(|t| (moment(t).specific_force, moment(t).angular_velocity));
    assert_eq!(
        (found.first_cause, found.first_cause_share),
        (FirstCause::None, 0.0),
        "{found:?}"
    );
    assert!((found.accel_rmse / (3.0_f64.sqrt() * SIGMAS[0]) - 1.0).abs() < 0.1);
    assert!(found.lag_s.unwrap().abs() < 2e-4, "{found:?}");
    assert_eq!(found.compared, 1000);
}

#[test]
fn noise_of_the_simulation_is_no_gap() {
    let measured = stream(100.0, SIGMAS, 2, |t| {
        (moment(t).specific_force, moment(t).angular_velocity)
    });
    let noisy = stream(120.0, [0.05, 0.005], 3, |t| {
        (moment(t).specific_force, moment(t).angular_velocity)
    });
    let found = assess(&measured, &noisy, &options()).unwrap();
    assert_eq!(found.first_cause, FirstCause::None, "{found:?}");
}

#[test]
fn each_effect_is_named_where_it_is_injected() {
    let upper = Matrix3::new(0.0, 0.04, -0.03, 0.0, 0.0, 0.05, 0.0, 0.0, 0.0);
    let scale = Matrix3::from_diagonal(&Vector3::new(1.03, 0.98, 1.01));
    let turn = Rotation3::from_euler_angles(0.1, -0.2, 0.15);
    let axes = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let coupling = Matrix3::new(
        0.002, -0.003, 0.001, 0.0, 0.004, 0.002, -0.002, 0.001, 0.003,
    );
    let lever = Vector3::new(0.05, 0.0, -0.06);
    let of = |change: fn(Moment) -> (Vector3<f64>, Vector3<f64>)| -> Read {
        Box::new(move |t| change(moment(t)))
    };
    let cases: Vec<(&str, Read)> = vec![
        (
            "accel_bias",
            of(|m| {
                (
                    m.specific_force + Vector3::new(0.2, -0.1, 0.15),
                    m.angular_velocity,
                )
            }),
        ),
        (
            "gyro_bias",
            of(|m| {
                (
                    m.specific_force,
                    m.angular_velocity + Vector3::new(0.01, -0.02, 0.015),
                )
            }),
        ),
        (
            "accel_scale",
            Box::new(move |t| (scale * moment(t).specific_force, moment(t).angular_velocity)),
        ),
        (
            "gyro_scale",
            Box::new(move |t| (moment(t).specific_force, scale * moment(t).angular_velocity)),
        ),
        (
            "accel_misalignment",
            Box::new(move |t| {
                (
                    (Matrix3::identity() + upper) * moment(t).specific_force,
                    moment(t).angular_velocity,
                )
            }),
        ),
        (
            "gyro_misalignment",
            Box::new(move |t| {
                (
                    moment(t).specific_force,
                    (Matrix3::identity() + upper) * moment(t).angular_velocity,
                )
            }),
        ),
        (
            "mount_rotation",
            Box::new(move |t| {
                (
                    turn * moment(t).specific_force,
                    turn * moment(t).angular_velocity,
                )
            }),
        ),
        (
            "axis_convention",
            Box::new(move |t| {
                (
                    axes * moment(t).specific_force,
                    axes * moment(t).angular_velocity,
                )
            }),
        ),
        ("time_offset", of_time(0.021)),
        ("time_offset", of_time(-0.15)),
        (
            "lever_arm",
            Box::new(move |t| {
                let m = moment(t);
                (
                    m.specific_force
                        + m.angular_acceleration.cross(&lever)
                        + m.angular_velocity.cross(&m.angular_velocity.cross(&lever)),
                    m.angular_velocity,
                )
            }),
        ),
        (
            "gyro_g_sensitivity",
            Box::new(move |t| {
                (
                    moment(t).specific_force,
                    moment(t).angular_velocity + coupling * moment(t).specific_force,
                )
            }),
        ),
        (
            "gravity_convention",
            of(|m| (m.specific_force - m.up, m.angular_velocity)),
        ),
        (
            "gravity_convention",
            of(|m| (m.specific_force - m.up * 2.0, m.angular_velocity)),
        ),
        (
            "accel_units",
            of(|m| (m.specific_force / 9.80665, m.angular_velocity)),
        ),
        (
            "gyro_units",
            of(|m| (m.specific_force, m.angular_velocity.map(f64::to_degrees))),
        ),
        (
            "accel_units",
            of(|m| (m.specific_force * 100.0, m.angular_velocity)),
        ),
        (
            "accel_noise",
            of(|m| (m.specific_force, m.angular_velocity)),
        ),
        ("gyro_noise", of(|m| (m.specific_force, m.angular_velocity))),
    ];
    for (effect, read) in cases {
        let noise = match effect {
            "accel_noise" => [0.12, SIGMAS[1]],
            "gyro_noise" => [SIGMAS[0], 0.012],
            _ => SIGMAS,
        };
        let found = assess_measured(&stream(100.0, noise, 2, read));
        assert_eq!(found.first_cause.to_string(), effect, "{found:?}");
        assert!(found.first_cause_share > 0.9, "{effect}: {found:?}");
    }
}

fn of_time(late: f64) -> Read {
    Box::new(move |t| {
        (
            moment(t - late).specific_force,
            moment(t - late).angular_velocity,
        )
    })
}

#[test]
fn the_lag_is_that_of_the_stamps() {
    for late in [0.004, 0.021, -0.15] {
        let found = named(of_time(late));
        assert!(
            (found.lag_s.unwrap() - late).abs() < 5e-4,
            "{late}: {found:?}"
        );
    }
}

#[test]
fn clipped_readings_are_saturation() {
    let mut measured = stream(100.0, SIGMAS, 2, |t| {
        (moment(t).specific_force, moment(t).angular_velocity)
    });
    for reading in &mut measured {
        reading.values[..3]
            .iter_mut()
            .for_each(|value| *value = value.clamp(-11.0, 11.0));
    }
    let found = assess_measured(&measured);
    assert_eq!(
        found.first_cause,
        FirstCause::Effect(EffectKind::AccelSaturation),
        "{found:?}"
    );
}

#[test]
fn lost_messages_are_counted_and_named_where_nothing_else_is_wrong() {
    let mut measured = stream(100.0, SIGMAS, 2, |t| {
        (moment(t).specific_force, moment(t).angular_velocity)
    });
    let mut number = 0;
    measured.retain(|_| {
        number += 1;
        number % 20 != 0
    });
    let found = assess_measured(&measured);
    assert_eq!(
        (found.first_cause, pace(&measured).dropped),
        (FirstCause::Effect(EffectKind::DroppedSamples), 49),
        "{found:?}"
    );
    assert!((pace(&measured).rate_hz - 100.0).abs() < 0.1);
}

#[test]
fn what_no_effect_explains_is_unknown() {
    // A frequency that nothing in the motion has.
    let found = named(|t| {
        (
            moment(t).specific_force + Vector3::new(1.5, 1.0, -1.0) * (60.0 * t).sin(),
            moment(t).angular_velocity,
        )
    });
    assert_eq!(found.first_cause, FirstCause::Unknown, "{found:?}");
}

#[test]
fn streams_without_common_stamps_say_nothing() {
    let measured = stream(100.0, SIGMAS, 2, |t| {
        (moment(t).specific_force, moment(t).angular_velocity)
    });
    let mut late = simulated();
    late.iter_mut()
        .for_each(|reading| reading.stamp = reading.stamp.plus_seconds(60.0));
    assert_eq!(assess(&measured, &late, &options()), None);
    assert_eq!(assess(&measured, &[], &options()), None);
    assert_eq!(assess(&[], &[], &options()), None);
}

#[test]
fn a_gap_in_the_simulation_is_not_interpolated_over() {
    let measured = stream(100.0, SIGMAS, 2, |t| {
        (moment(t).specific_force, moment(t).angular_velocity)
    });
    let mut interrupted = simulated();
    interrupted.drain(300..600);
    let found = assess(&measured, &interrupted, &options()).unwrap();
    assert_eq!(found.first_cause, FirstCause::None);
    assert!((745..=752).contains(&found.compared), "{found:?}");
}

#[test]
fn a_still_sensor_has_no_lag() {
    let still = |_: f64| (Vector3::new(0.0, 0.3, 9.8), Vector3::zeros());
    let found = assess(
        &stream(100.0, SIGMAS, 2, still),
        &stream(120.0, [0.0; 2], 1, still),
        &options(),
    )
    .unwrap();
    assert_eq!((found.first_cause, found.lag_s), (FirstCause::None, None));
}
