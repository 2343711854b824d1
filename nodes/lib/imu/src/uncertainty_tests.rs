#![allow(clippy::unwrap_used)]
use cromosim_spatial::so3;
use nalgebra::{Isometry3, UnitQuaternion};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;

use super::*;
use crate::test_motions::{START, frames, wrist};
use crate::{
    Device, KinematicSample, Scheme, SensorTrajectory, StreamOptions, StreamingImu, normal_pair,
    simulate_kinematics,
};

const WHITE: PoseStd = PoseStd {
    position_m: 2e-4,
    rotation_rad: 3e-4,
    correlation_s: 0.0,
};

fn uniform(count: usize, rate_hz: f64, pose_std: PoseStd) -> Vec<SensorFrame> {
    let frame = |k: usize| {
        SensorFrame::new(
            START.plus_seconds(k as f64 / rate_hz),
            Isometry3::identity(),
        )
        .with_pose_std(pose_std)
    };
    (0..count).map(frame).collect()
}

fn normal(random: &mut ChaCha12Rng) -> Vector3<f64> {
    let [x, y] = normal_pair(random);
    Vector3::new(x, y, normal_pair(random)[0])
}

/// The frames with errors as their `pose_std` says.
fn disturbed(exact: &[SensorFrame], random: &mut ChaCha12Rng) -> Vec<SensorFrame> {
    let disturb = |frame: &SensorFrame| {
        let Isometry3 {
            rotation,
            translation,
        } = frame.world_from_sensor;
        let place = translation.vector + normal(random) * frame.pose_std.position_m;
        let turned = so3::exp(&(normal(random) * frame.pose_std.rotation_rad)) * rotation;
        SensorFrame::new(frame.stamp, Isometry3::from_parts(place.into(), turned))
            .with_pose_std(frame.pose_std)
    };
    exact.iter().map(disturb).collect()
}

/// Mean squares, along or about an axis, of what errors do to a sample, and the mean of what the
/// samples state.
fn monte_carlo(
    scheme: Scheme,
    exact: &[SensorFrame],
    stamp: Stamp,
    runs: usize,
) -> [SampleVariance; 2] {
    let sample = |frames: Vec<SensorFrame>| {
        simulate_kinematics(&SensorTrajectory::new(frames).unwrap(), scheme, &[stamp]).unwrap()[0]
    };
    let mut random = ChaCha12Rng::seed_from_u64(5);
    let samples: Vec<KinematicSample> = (0..runs)
        .map(|_| sample(disturbed(exact, &mut random)))
        .collect();
    let of = |vector: &dyn Fn(&KinematicSample) -> Vector3<f64>| {
        let mean: Vector3<f64> = samples.iter().map(vector).sum::<Vector3<f64>>() / runs as f64;
        samples
            .iter()
            .map(|sample| (vector(sample) - mean).norm_squared())
            .sum::<f64>()
            / (3 * (runs - 1)) as f64
    };
    let turned = samples[0].world_from_sensor.rotation;
    let found = SampleVariance {
        acceleration: of(&|sample| sample.acceleration_in_world),
        angular_velocity: of(&|sample| sample.angular_velocity_in_world),
        orientation: of(&|sample| {
            so3::log(&(sample.world_from_sensor.rotation * turned.inverse()))
        }),
        ..SampleVariance::default()
    };
    let mean = |field: &dyn Fn(&SampleVariance) -> f64| {
        samples
            .iter()
            .map(|sample| field(&sample.variance))
            .sum::<f64>()
            / runs as f64
    };
    let stated = SampleVariance {
        acceleration: mean(&|variance| variance.acceleration),
        angular_velocity: mean(&|variance| variance.angular_velocity),
        orientation: mean(&|variance| variance.orientation),
        ..SampleVariance::default()
    };
    [found, stated]
}

fn assert_near([found, stated]: [SampleVariance; 2], part: f64, what: &str) {
    println!("{what}: found {found:?}, stated {stated:?}");
    for (found, stated) in [
        (found.acceleration, stated.acceleration),
        (found.angular_velocity, stated.angular_velocity),
        (found.orientation, stated.orientation),
    ] {
        assert!(
            (stated / found - 1.0).abs() < part,
            "{what}: found {found}, stated {stated}"
        );
    }
}

#[test]
fn white_errors_leave_the_stated_variance() {
    let exact: Vec<SensorFrame> = frames(wrist, 100.0, 0.4)
        .into_iter()
        .map(|frame| frame.with_pose_std(WHITE))
        .collect();
    // At a frame, between two, and at the one-sided end. 3 x 600 numbers tell a variance to 3.3 %.
    for seconds in [0.2, 0.2037, 0.4] {
        for scheme in [
            Scheme::Richardson,
            Scheme::SecondDifference,
            Scheme::Triangle,
        ] {
            let results = monte_carlo(scheme, &exact, START.plus_seconds(seconds), 600);
            assert_near(results, 0.12, &format!("{scheme} at {seconds} s"));
        }
    }
}

#[test]
fn the_splines_smoothing_counts() {
    // 1 mm and 0.2 degrees: enough for the smoothing to settle, which it does on each run anew.
    let jitter = PoseStd {
        position_m: 1e-3,
        rotation_rad: 3.5e-3,
        correlation_s: 0.0,
    };
    let exact: Vec<SensorFrame> = frames(wrist, 100.0, 1.0)
        .into_iter()
        .map(|frame| frame.with_pose_std(jitter))
        .collect();
    for seconds in [0.5, 0.5037] {
        let [found, stated] = monte_carlo(Scheme::Spline, &exact, START.plus_seconds(seconds), 100);
        assert_near([found, stated], 0.35, &format!("spline at {seconds} s"));
        let plain = 6.0 * (1e-3_f64 / 0.01_f64.powi(2)).powi(2);
        assert!(
            stated.acceleration < plain / 100.0,
            "smoothed by far: {} of {plain}",
            stated.acceleration
        );
    }
}

#[test]
fn gains_are_those_of_the_stencils() {
    let (h, std) = (0.01_f64, 0.002_f64);
    let frames = uniform(
        9,
        1.0 / h,
        PoseStd {
            position_m: std,
            rotation_rad: std,
            correlation_s: 0.0,
        },
    );
    let at = |scheme: Scheme| {
        FrameWeights::by_stencil(scheme.stencil().unwrap(), &frames, frames[4].stamp)
            .variance(&frames)
    };
    let cases = [
        // (1, -2, 1) / h2 and (-1, 0, 1) / 2h; (-1, 16, -30, 16, -1) / 12 h2 and (1, -8, 0, 8, -1)
        // / 12 h.
        (Scheme::SecondDifference, 6.0, 0.5),
        (Scheme::Richardson, 1414.0 / 144.0, 130.0 / 144.0),
    ];
    for (scheme, second, first) in cases {
        let variance = at(scheme);
        assert!(
            (variance.acceleration / (second * std.powi(2) / h.powi(4)) - 1.0).abs() < 1e-6,
            "{scheme}: {variance:?}"
        );
        assert!(
            (variance.angular_velocity / (first * std.powi(2) / h.powi(2)) - 1.0).abs() < 1e-6,
            "{scheme}: {variance:?}"
        );
        assert!((variance.orientation / std.powi(2) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn errors_that_hold_leave_less() {
    // Errors with the correlation exp(-(dt / tau)^2 / 2) have derivatives: of the first one the
    // variance is s^2 / tau^2, of the second 3 s^2 / tau^4.
    let (std, tau) = (0.05_f64, 0.4_f64);
    let pose_std = PoseStd {
        position_m: std,
        rotation_rad: std,
        correlation_s: tau,
    };
    let frames: Vec<SensorFrame> = frames(wrist, 100.0, 1.0)
        .into_iter()
        .map(|frame| frame.with_pose_std(pose_std))
        .collect();
    for scheme in [Scheme::Richardson, Scheme::SecondDifference] {
        let variance =
            FrameWeights::by_stencil(scheme.stencil().unwrap(), &frames, frames[50].stamp)
                .variance(&frames);
        assert!(
            (variance.acceleration / (3.0 * std.powi(2) / tau.powi(4)) - 1.0).abs() < 0.01,
            "{scheme}: {variance:?}"
        );
        assert!(
            (variance.angular_velocity / (std.powi(2) / tau.powi(2)) - 1.0).abs() < 0.01,
            "{scheme}: {variance:?}"
        );
    }
    let stamp = frames[50].stamp;
    let spline = simulate_kinematics(
        &SensorTrajectory::new(frames).unwrap(),
        Scheme::Spline,
        &[stamp],
    )
    .unwrap()[0]
        .variance;
    assert!(
        (spline.acceleration / (3.0 * std.powi(2) / tau.powi(4)) - 1.0).abs() < 0.05,
        "spline: {spline:?}"
    );
}

#[test]
fn poses_that_are_not_known_spoil_the_samples_that_rest_on_them() {
    let unknown = PoseStd::from_confidence(0.0, 0.0);
    assert!(unknown.position_m.is_infinite() && unknown.rotation_rad.is_infinite());
    let mut frames = frames(wrist, 100.0, 0.6);
    frames[30].pose_std = unknown;
    let stamps: Vec<Stamp> = frames.iter().map(|frame| frame.stamp).collect();
    for (scheme, reach) in [
        (Scheme::SecondDifference, 1),
        (Scheme::Richardson, 2),
        (Scheme::Spline, 8),
    ] {
        let samples = simulate_kinematics(
            &SensorTrajectory::new(frames.clone()).unwrap(),
            scheme,
            &stamps,
        )
        .unwrap();
        for (k, sample) in samples.iter().enumerate() {
            let is_known = sample.variance.acceleration.is_finite();
            let distance = k.abs_diff(30);
            assert!(
                if distance == 0 {
                    !is_known
                } else {
                    distance <= reach || is_known
                },
                "{scheme}, frame {k}"
            );
        }
    }
    let exact = PoseStd::from_confidence(1.0, 0.0);
    assert_eq!(
        (exact, PoseStd::from_confidence(f64::NAN, 0.0)),
        (PoseStd::NONE, PoseStd::NONE)
    );
    let half = PoseStd::from_confidence(0.5, 0.0);
    assert!((half.position_m - 0.1).abs() < 1e-12 && (half.rotation_rad - 0.2).abs() < 1e-12);
}

#[test]
fn live_samples_state_what_offline_ones_do() {
    let mut random = ChaCha12Rng::seed_from_u64(1);
    let mut exact = frames(wrist, 100.0, 0.6);
    for frame in &mut exact {
        frame.pose_std = PoseStd {
            position_m: 1e-3 * (1.0 + normal_pair(&mut random)[0].abs()),
            ..WHITE
        };
    }
    let mut stream =
        StreamingImu::new(Scheme::Richardson, StreamOptions::resampled(100.0, 70.0)).unwrap();
    let live: Vec<KinematicSample> = exact
        .iter()
        .flat_map(|frame| stream.push_kinematics(*frame).unwrap())
        .collect();
    let stamps: Vec<Stamp> = live.iter().map(|sample| sample.stamp).collect();
    let offline = simulate_kinematics(
        &SensorTrajectory::new(exact.clone()).unwrap(),
        Scheme::Richardson,
        &stamps,
    )
    .unwrap();
    for (live, offline) in live.iter().zip(&offline).skip(5) {
        assert!(
            (live.variance.acceleration / offline.variance.acceleration - 1.0).abs() < 1e-6,
            "{live:?} {offline:?}"
        );
    }
    let mut spline =
        StreamingImu::new(Scheme::Spline, StreamOptions::resampled(100.0, 100.0)).unwrap();
    let live: Vec<KinematicSample> = exact
        .iter()
        .flat_map(|frame| spline.push_kinematics(*frame).unwrap())
        .collect();
    assert!(
        live.len() > 40
            && live.iter().all(|sample| sample.variance.acceleration > 0.0
                && sample.variance.acceleration.is_finite())
    );
}

#[test]
fn the_messages_covariance_is_that_of_the_readings() {
    // At rest and tilted: what turns the sensor turns gravity in its axes.
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 1.0));
    let std = PoseStd {
        position_m: 1e-5,
        rotation_rad: 0.02,
        correlation_s: 0.0,
    };
    let exact: Vec<SensorFrame> = uniform(9, 50.0, std)
        .into_iter()
        .map(|frame| {
            SensorFrame::new(
                frame.stamp,
                Isometry3::from_parts(Vector3::zeros().into(), turn),
            )
            .with_pose_std(std)
        })
        .collect();
    let still = simulate_kinematics(
        &SensorTrajectory::new(exact.clone()).unwrap(),
        Scheme::SecondDifference,
        &[exact[4].stamp],
    )
    .unwrap()[0];
    let device = Covariances::for_device(&Device::white(0.003, 0.0002), 100.0);
    let stated = device.with_motion(&still.variance, &still.imu());
    let mut random = ChaCha12Rng::seed_from_u64(3);
    let runs = 4000;
    let mut sum = Matrix3::zeros();
    for _ in 0..runs {
        let noisy = SensorTrajectory::new(disturbed(&exact, &mut random)).unwrap();
        let reading = simulate_kinematics(&noisy, Scheme::SecondDifference, &[exact[4].stamp])
            .unwrap()[0]
            .imu();
        let error = reading.specific_force - still.imu().specific_force;
        sum += error * error.transpose() / f64::from(runs);
    }
    let found = Matrix3::from_row_slice(&stated.linear_acceleration)
        - Matrix3::identity() * device.linear_acceleration[0];
    println!("readings {sum}stated {found}");
    assert!(
        (found - sum).norm() < 0.1 * sum.norm(),
        "readings {sum}stated {found}"
    );
    assert!(
        (stated.orientation[0] - 4e-4).abs() < 1e-12
            && stated.orientation[0] == stated.orientation[8]
    );
    assert_eq!(
        device.with_motion(&SampleVariance::default(), &still.imu()),
        device,
        "nothing known of errors: nothing added"
    );
    let lost = device.with_motion(
        &SampleVariance {
            acceleration: f64::INFINITY,
            ..still.variance
        },
        &still.imu(),
    );
    assert!(
        lost.linear_acceleration[0] == -1.0 && lost.angular_velocity[0] > 0.0,
        "REP-145: no estimate"
    );
    let raw = device
        .without_orientation()
        .with_motion(&still.variance, &still.imu());
    assert_eq!(raw.orientation[0], -1.0, "what is not reported stays so");
}
