//! Curve, fit and device of a generator whose coefficients are known, live and offline.
#![allow(clippy::unwrap_used)]
use cromosim_spatial::{KinematicTrack, Stamp, uniform_stamps};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::*;
use crate::{
    Channel, Device, DrawnBiases, ImuOptions, KinematicSample, NoiseSource, OrientationSource,
    PlacementEffects, Reading, RecordedMotion, SampleVariance, UnexplainedErrors, VirtualImu,
    measure_recording,
};

const START: Stamp = Stamp::from_nanos(1_700_000_000_000_000_000);
/// White, deviation, time constant, walk.
const ACCEL: NoiseModel = NoiseModel {
    white: 2e-3,
    instability: (8e-4, 12.0),
    walk: 0.0,
};
const GYRO: NoiseModel = NoiseModel {
    white: 1.5e-4,
    instability: (0.0, 0.0),
    walk: 2e-5,
};

fn device() -> Device {
    let text = "schema: cromosim/device/1
declared_noise: {accel_density: 0.002, gyro_density: 0.00015}
effects:
- {effect: accel_bias_instability, deviation: 0.0008, time_constant: 12.0}
- {effect: gyro_bias_walk, density: 0.00002}
";
    Device::parse(text, "known.yaml").unwrap()
}

/// Readings of a device at rest, without the way through an IMU's stages.
fn generated(device: &Device, rate_hz: f64, count: usize, seed: u64) -> (Vec<Stamp>, Vec<Reading>) {
    let noise = device.declared_noise();
    let mut white = NoiseSource::white(&noise, 0.0, rate_hz, seed, "still").unwrap();
    let mut biases = DrawnBiases::new(device.effects(), seed, "still").unwrap();
    let stamp = |k: usize| START.plus_seconds(k as f64 / rate_hz);
    let read = |k: usize| {
        let mut reading = white.draw();
        reading.specific_force.z += 9.80665;
        biases.add_to(&mut reading, stamp(k));
        reading
    };
    let readings = (0..count).map(read).collect();
    ((0..count).map(stamp).collect(), readings)
}

/// Live: samples as they come, through all stages.
fn live(device: &Device, rate_hz: f64, count: usize, seed: u64) -> Vec<Reading> {
    let mut imu = VirtualImu::new(device, options(rate_hz, seed)).unwrap();
    let measured = |k: usize| {
        let still = KinematicSample {
            stamp: START.plus_seconds(k as f64 / rate_hz),
            world_from_sensor: Isometry3::identity(),
            acceleration_in_world: Vector3::zeros(),
            angular_velocity_in_world: Vector3::zeros(),
            angular_acceleration_in_world: None,
            variance: SampleVariance::default(),
            bandwidth: None,
        };
        imu.measure(&still).unwrap().data_raw
    };
    (0..count).map(measured).map(|imu| reading(&imu)).collect()
}

/// Offline: a whole recording at once.
fn offline(device: &Device, rate_hz: f64, count: usize, seed: u64) -> Vec<Reading> {
    let (grid, seconds) = (200.0, count as f64 / rate_hz);
    let nodes = (seconds * grid) as usize + 2;
    let track = KinematicTrack {
        start: START,
        rate_hz: grid,
        world_from_segment: vec![UnitQuaternion::identity(); nodes],
        acceleration_in_segment: vec![Vector3::zeros(); nodes],
        angular_velocity_in_segment: vec![Vector3::zeros(); nodes],
        angular_acceleration_in_segment: vec![Vector3::zeros(); nodes],
    };
    let stamps: Vec<Stamp> = (0..count)
        .map(|k| START.plus_seconds(k as f64 / rate_hz))
        .collect();
    let effects = PlacementEffects {
        epoch: START,
        declared_noise: device.declared_noise(),
        effects: device.effects().clone(),
        unexplained: UnexplainedErrors::default(),
        reference_response: None,
        other_sessions: Vec::new(),
        magnetometer: None,
        field_in_world: None,
    };
    let motion = RecordedMotion {
        track: &track,
        stamps: &stamps,
        variances: &[],
        stamps_are_recorded: false,
    };
    let messages = measure_recording(motion, &effects, options(rate_hz, seed)).unwrap();
    messages.iter().map(reading).collect()
}

fn options(rate_hz: f64, seed: u64) -> ImuOptions {
    ImuOptions {
        rate_hz,
        seed,
        name: "still".to_owned(),
        noise: true,
        frame_id: "still_imu".to_owned(),
        mapping: None,
        field: None,
        orientation: OrientationSource::Truth,
    }
}

fn reading(imu: &cromosim_msgs::sensor_msgs::Imu) -> Reading {
    let (f, w) = (&imu.linear_acceleration, &imu.angular_velocity);
    Reading {
        specific_force: Vector3::new(f.x, f.y, f.z),
        angular_velocity: Vector3::new(w.x, w.y, w.z),
    }
}

#[test]
fn deviations_are_those_by_hand() {
    // m = 1: half the mean of squared differences 1, 4, 1, 4, ...; m = 2: of means over two.
    let values: Vec<f64> = (0..20).map(|k| [0.0, 1.0, 3.0, 2.0][k % 4]).collect();
    let curve = allan_curve(&values, 2.0);
    assert_eq!(
        curve.iter().map(|it| it.tau_s).collect::<Vec<_>>(),
        [0.5, 1.0, 1.5, 2.0]
    );
    let by_hand = |m: usize| {
        let mean = |k: usize| values[k..k + m].iter().sum::<f64>() / m as f64;
        let count = values.len() + 1 - 2 * m;
        let sum: f64 = (0..count).map(|k| (mean(k + m) - mean(k)).powi(2)).sum();
        (sum / (2.0 * count as f64)).sqrt()
    };
    for (point, m) in curve.iter().zip([1, 2, 3, 4]) {
        assert!((point.deviation - by_hand(m)).abs() < 1e-12, "{m}");
    }
}

#[test]
fn a_generators_coefficients_are_found_within_their_intervals() {
    let (mut within, mut all) = ([0; 5], 0);
    for seed in 0..30 {
        let (stamps, readings) = generated(&device(), 20.0, 60_000, seed);
        let noise = StaticNoise::of(&stamps, &readings).unwrap();
        let [accel, gyro] = Channel::ALL.map(|channel| noise.channels[channel].fit);
        let holds = |interval: Option<(f64, f64)>, truth: f64| {
            usize::from(interval.is_some_and(|(low, high)| low <= truth && truth <= high))
        };
        all += 1;
        within[0] += holds(accel.intervals[0], ACCEL.white);
        within[1] += holds(accel.intervals[1], ACCEL.instability.0);
        within[2] += holds(accel.intervals[2], ACCEL.instability.1);
        within[3] += holds(gyro.intervals[0], GYRO.white);
        within[4] += holds(gyro.intervals[3], GYRO.walk);
        for (found, truth) in [
            (accel.model.white, ACCEL.white),
            (accel.model.instability.0, ACCEL.instability.0),
            (gyro.model.white, GYRO.white),
        ] {
            assert!(
                (found / truth - 1.0).abs() < 0.35,
                "{seed}: {found} {truth}"
            );
        }
    }
    println!("95 % intervals hold the truth in {within:?} of {all}");
    // 30 of 95 %: 28.5 +- 1.2 each, 142.5 +- 2.7 together.
    assert!(within.iter().all(|held| *held >= 25), "{within:?} of {all}");
    assert!(within.iter().sum::<usize>() >= 135, "{within:?} of {all}");
}

#[test]
fn a_device_of_a_recording_has_the_recordings_curve_live_and_offline() {
    let (rate_hz, count) = (20.0, 60_000);
    let (stamps, readings) = generated(&device(), rate_hz, count, 5);
    let recorded = StaticNoise::of(&stamps, &readings).unwrap();
    let made = recorded.device().unwrap();
    let again = [
        ("live", live(&made, rate_hz, count, 77)),
        ("offline", offline(&made, rate_hz, count, 78)),
    ];
    for (path, readings) in again {
        let simulated = StaticNoise::of(&stamps, &readings).unwrap();
        for channel in Channel::ALL {
            let pairs = recorded.channels[channel].curve.iter();
            let pairs = pairs.zip(&simulated.channels[channel].curve);
            let apart: Vec<f64> = pairs
                .clone()
                .filter(|(a, b)| a.interval.0 > b.interval.1 || b.interval.0 > a.interval.1)
                .map(|(a, _)| a.tau_s)
                .collect();
            assert!(apart.is_empty(), "{path} {}: {apart:?}", channel.name());
            // The model's curve lies in the recording's intervals but for some by chance.
            let fit = recorded.channels[channel].fit.model;
            let out = pairs.filter(|(a, _)| {
                let deviation = fit.variance(a.tau_s).sqrt();
                deviation < a.interval.0 || deviation > a.interval.1
            });
            assert!(out.count() <= 4, "{path} {}", channel.name());
        }
    }
}

#[test]
fn live_and_offline_draw_the_same_numbers() {
    let (live, offline) = (
        live(&device(), 50.0, 500, 3),
        offline(&device(), 50.0, 500, 3),
    );
    for (live, offline) in live.iter().zip(&offline) {
        assert!((live.specific_force - offline.specific_force).norm() < 1e-12);
        assert!((live.angular_velocity - offline.angular_velocity).norm() < 1e-12);
    }
}

#[test]
fn motion_gaps_and_short_recordings_are_said() {
    let (stamps, mut readings) = generated(&device(), 50.0, 3000, 1);
    let refusal = |stamps: &[Stamp], readings: &[Reading]| {
        StaticNoise::of(stamps, readings).unwrap_err().to_string()
    };
    let short = refusal(&stamps[..900], &readings[..900]);
    assert!(short.contains("900 readings without a gap"), "{short}");
    let mut late = stamps.clone();
    late[1200..]
        .iter_mut()
        .for_each(|it| *it = it.plus_seconds(0.5));
    let cut = StaticNoise::of(&late, &readings).unwrap();
    assert_eq!(
        (cut.left_out, (cut.rate_hz - 50.0).abs() < 1e-6),
        (1200, true)
    );
    readings[2000..]
        .iter_mut()
        .for_each(|it| it.angular_velocity.x += 0.4);
    let moved = refusal(&stamps, &readings);
    assert!(
        moved.contains("after 40.0 s the gyroscope reads 0.40 rad/s off"),
        "{moved}"
    );
    let still = refusal(&stamps, &vec![Reading::default(); 3000]);
    assert!(still.contains("stands still at one value"), "{still}");
}

#[test]
fn covariances_state_what_is_drawn() {
    let imu = |k: usize| {
        let mut imu = VirtualImu::new(&device(), options(20.0, 1)).unwrap();
        let grid = uniform_stamps(START, START.plus_seconds(1000.0), 20.0).unwrap();
        let at = |stamp: &Stamp| KinematicSample {
            stamp: *stamp,
            world_from_sensor: Isometry3::identity(),
            acceleration_in_world: Vector3::zeros(),
            angular_velocity_in_world: Vector3::zeros(),
            angular_acceleration_in_world: None,
            variance: SampleVariance::default(),
            bandwidth: None,
        };
        let messages = grid[..=k]
            .iter()
            .map(|it| imu.measure(&at(it)).unwrap().data_raw);
        messages.last().unwrap()
    };
    let (first, last) = (imu(0), imu(20_000));
    let force = 4e-6 * 20.0 + 6.4e-7;
    assert!((first.linear_acceleration_covariance[0] / force - 1.0).abs() < 1e-9);
    assert_eq!(
        first.linear_acceleration_covariance,
        last.linear_acceleration_covariance
    );
    let rate = 2.25e-8 * 20.0;
    assert!((first.angular_velocity_covariance[4] / rate - 1.0).abs() < 1e-9);
    let walked = rate + 4e-10 * 1000.0;
    assert!((last.angular_velocity_covariance[4] / walked - 1.0).abs() < 1e-9);
}
