#![allow(clippy::unwrap_used)]

use cromosim_spatial::KinematicTrack;
use nalgebra::Vector3;

use super::*;
use crate::{DeclaredNoise, EffectSet, Lateness, UnexplainedErrors};

/// Spins up by 2 rad/s2 about one axis, at 100 Hz.
fn spinning_up() -> KinematicTrack {
    let count = 200;
    KinematicTrack {
        start: Stamp::from_nanos(1_700_000_000_000_000_000),
        rate_hz: 100.0,
        world_from_segment: vec![UnitQuaternion::identity(); count],
        acceleration_in_segment: vec![Vector3::zeros(); count],
        angular_velocity_in_segment: (0..count)
            .map(|k| Vector3::new(0.02 * k as f64, 0.0, 0.0))
            .collect(),
        angular_acceleration_in_segment: vec![Vector3::new(2.0, 0.0, 0.0); count],
    }
}

fn stated(effects: EffectSet, before_s: f64, unexplained: UnexplainedErrors) -> Imu {
    let track = spinning_up();
    let stamps: Vec<Stamp> = (50..150)
        .map(|k| track.start.plus_seconds(k as f64 / 100.0))
        .collect();
    let motion = RecordedMotion {
        track: &track,
        stamps: &stamps,
        variances: &[],
        stamps_are_recorded: true,
    };
    let effects = PlacementEffects {
        epoch: stamps[50].plus_seconds(-before_s),
        declared_noise: DeclaredNoise {
            accel_density: 1e-3,
            gyro_density: 1e-4,
        },
        effects,
        unexplained,
        reference_response: None,
        other_sessions: Vec::new(),
        magnetometer: None,
        field_in_world: None,
    };
    let options = ImuOptions {
        rate_hz: 100.0,
        seed: 1,
        name: "wrist".to_owned(),
        noise: false,
        frame_id: "wrist_imu".to_owned(),
        mapping: None,
        field: None,
        orientation: OrientationSource::Truth,
    };
    measure_recording(motion, &effects, options).unwrap()[50].clone()
}

#[test]
fn what_stays_between_the_clocks_grows_with_the_motion_and_the_recording() {
    // 4 ms at the first message less 6 ms per second: 1 ms after half a second, in which 2 rad/s2
    // become 2 mrad/s about one of three axes.
    let mut rest = UnexplainedErrors::default();
    rest.late.gyroscope = Lateness {
        seconds: 4e-3,
        per_second: -6e-3,
    };
    let imu = stated(EffectSet::new(), 0.0, rest);
    let (added, expected) = (
        imu.angular_velocity_covariance[0] - 1e-6,
        (1e-3 * 2.0_f64).powi(2) / 3.0,
    );
    assert!((added / expected - 1.0).abs() < 1e-6, "{added}");
    let accel = imu.linear_acceleration_covariance[0];
    assert!((accel - 1e-4).abs() < 1e-12, "{accel}");
}

#[test]
fn a_device_states_live_what_it_states_offline() {
    let device = |rest: &str| {
        let text = format!(
            "schema: cromosim/device/1\ndeclared_noise: {{accel_density: 0.002, gyro_density: 1.0e-4}}\n\
             effects:\n  - {{effect: accel_noise, density: 0.0015}}\n  - {{effect: accel_quantization, lsb: 0.06}}\n  \
             - {{effect: accel_units, factor: 0.1}}\n{rest}"
        );
        Device::parse(&text, "watch.yaml").unwrap()
    };
    let variance = |device: &Device| Covariances::for_device(device, 100.0).linear_acceleration[0];
    // In units of 10 m/s2: noise of both densities, and rounding.
    let own = 0.0025_f64.powi(2) * 100.0 + 0.06_f64.powi(2) / 12.0;
    let found = variance(&device(""));
    assert!((found / (0.01 * own) - 1.0).abs() < 1e-12, "{found}");
    let rest = "unexplained: {accel_variance: 0.0021, accel_reference_excess: 0.5}\n";
    let found = variance(&device(rest));
    assert!(
        (found / (0.01 * (own + 0.0021)) - 1.0).abs() < 1e-12,
        "{found}"
    );
    // Errors of the poses go with the excess, in the device's units.
    let of_poses = SampleVariance {
        acceleration: 0.04,
        angular_velocity: 1e-4,
        orientation: 0.0,
        ..SampleVariance::default()
    };
    let stated = StatedErrors::of_device(&device(rest), 100.0).of_motion(of_poses, 0.0);
    assert!((stated.acceleration - 0.04 * 1.5 * 0.01).abs() < 1e-15);
    assert_eq!(stated.angular_velocity, 1e-4);
    let refused = Device::parse(
        "schema: cromosim/device/1\ndeclared_noise: {accel_density: 0.0, gyro_density: 0.0}\n\
         unexplained: {gyro_variance: -1.0}\n",
        "watch.yaml",
    );
    let refused = refused.unwrap_err().to_string();
    assert!(
        refused.contains("watch.yaml") && refused.contains("gyro_variance"),
        "{refused}"
    );
}

#[test]
fn a_filter_knows_the_units_that_its_device_reports() {
    let orientations = |effects: &str| {
        let text = format!(
            "schema: cromosim/device/1\ndeclared_noise: {{accel_density: 0.0, gyro_density: 0.0}}\neffects: [{effects}]\n"
        );
        let options = ImuOptions {
            rate_hz: 100.0,
            seed: 1,
            name: "wrist".to_owned(),
            noise: false,
            frame_id: "wrist_imu".to_owned(),
            mapping: None,
            field: None,
            orientation: OrientationSource::Madgwick,
        };
        let mut imu = VirtualImu::new(&Device::parse(&text, "d.yaml").unwrap(), options).unwrap();
        let motion = |k: i64| KinematicSample {
            stamp: Stamp::from_nanos(k * 10_000_000),
            world_from_sensor: Isometry3::rotation(Vector3::z() * (0.01 * k as f64)),
            acceleration_in_world: Vector3::zeros(),
            angular_velocity_in_world: Vector3::z(),
            angular_acceleration_in_world: None,
            variance: SampleVariance::default(),
            bandwidth: None,
        };
        let turned = |k| imu.measure(&motion(k)).unwrap().data.orientation.z;
        (0..100).map(turned).collect::<Vec<f64>>()
    };
    let plain = orientations("");
    assert!(
        (plain[99] - (0.99_f64 / 2.0).sin()).abs() < 1e-3,
        "{}",
        plain[99]
    );
    let degrees =
        "{effect: gyro_units, factor: 57.29577951308232}, {effect: accel_units, factor: 0.10197}";
    for (plain, degrees) in plain.iter().zip(orientations(degrees)) {
        assert!((plain - degrees).abs() < 1e-5);
    }
}
