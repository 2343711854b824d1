#![allow(clippy::unwrap_used)]
use cromosim_spatial::uniform_stamps;

use super::*;
use crate::test_motions::{START, trajectory, wrist};
use crate::{Scheme, SensorTrajectory, simulate_kinematics};

const RATE_HZ: f64 = 400.0;

fn device(effects: &str) -> Device {
    let text = format!(
        "schema: cromosim/device/1\ndeclared_noise: {{accel_density: 0.002, gyro_density: 0.0003}}\neffects:\n{effects}"
    );
    Device::parse(&text, "d.yaml").unwrap()
}

fn samples(trajectory: &SensorTrajectory) -> Vec<KinematicSample> {
    let stamps = uniform_stamps(START, START.plus_seconds(3.0), RATE_HZ).unwrap();
    simulate_kinematics(trajectory, Scheme::Spline, &stamps).unwrap()
}

fn readings(device: &Device, samples: &[KinematicSample]) -> Vec<ImuSample> {
    let mut effects = StreamingEffects::new(device, RATE_HZ, 3, "wrist")
        .unwrap()
        .without_noise();
    samples
        .iter()
        .filter_map(|sample| effects.step(sample))
        .collect()
}

const MANY: &str = "- {effect: lever_arm, offset: [0.05, 0.0, -0.06]}
- {effect: mount_rotation, rotvec: [0.3, 0.1, -0.2]}
- {effect: mount_slip, at: 1700000001.623456789, rotvec: [0.0, 0.4, 0.0]}
- {effect: soft_tissue, natural_hz: 9.0, damping_ratio: 0.2}
- {effect: time_offset, seconds: 0.0125}
- {effect: clock_drift, ppm: 200}
- {effect: channel_delay, seconds: 0.0081}
- {effect: accel_bias, bias: [0.1, 0.2, 0.3]}
- {effect: gyro_bias_drift, rate: [0.01, 0.0, 0.0]}
- {effect: accel_saturation, limit: 30.0}
- {effect: low_pass, cutoff_hz: 15.0}
- {effect: gyro_g_sensitivity, matrix: [[0.001, 0.0, 0.0], [0.0, 0.0, 0.002], [0.0, 0.0, 0.0]]}
- {effect: vibration, hz: 31.0, amplitude: [0.1, 0.2, 0.3], phase: [0.4, 1.0, 5.0], gyro_amplitude: [0.02, 0.0, 0.01], gyro_phase: [0.3, 0.0, 2.0]}
";

#[test]
fn live_readings_are_those_of_the_model() {
    let (errors, stamps) = live_less_offline(MANY);
    assert!(errors.0 < 0.05 && errors.1 < 0.005, "{errors:?}");
    assert_eq!(stamps[400].nanos - START.nanos, 1_012_700_000);
}

#[test]
fn each_channel_has_its_own_low_pass_live_and_offline() {
    let filters =
        |first: &str, second: &str| format!("- {{effect: {first}}}\n- {{effect: {second}}}\n");
    let both = filters(
        "accel_low_pass, cutoff_hz: 8.0",
        "gyro_low_pass, cutoff_hz: 20.0",
    );
    let (errors, _) = live_less_offline(&both);
    assert!(errors.0 < 0.05 && errors.1 < 0.005, "{errors:?}");
    // One that is named takes the place of the common one, which the other channel keeps.
    let motion = samples(&trajectory(wrist, 240.0, 3.0));
    let common = filters(
        "low_pass, cutoff_hz: 20.0",
        "accel_low_pass, cutoff_hz: 8.0",
    );
    let [own, common] = [both, common].map(|effects| readings(&device(&effects), &motion));
    assert_eq!(own, common);
    let neither = readings(
        &device("- {effect: accel_bias, bias: [0.0, 0.0, 0.0]}\n"),
        &motion,
    );
    let apart = |of: fn(&ImuSample) -> Vector3<f64>| {
        let pairs = own.iter().zip(&neither);
        pairs
            .map(|(a, b)| (of(a) - of(b)).norm())
            .fold(0.0, f64::max)
    };
    assert!(apart(|it| it.specific_force) > 1.0 && apart(|it| it.angular_velocity) > 0.1);
}

/// Largest differences of both channels, and the stamps of the live readings.
fn live_less_offline(effects: &str) -> ((f64, f64), Vec<Stamp>) {
    let motion = samples(&trajectory(wrist, 240.0, 3.0));
    let device = device(effects);
    let live = readings(&device, &motion);
    let mut track = cromosim_spatial::KinematicTrack {
        start: START,
        rate_hz: RATE_HZ,
        ..Default::default()
    };
    for sample in &motion {
        let back = sample.world_from_sensor.rotation.inverse();
        track
            .world_from_segment
            .push(sample.world_from_sensor.rotation);
        track
            .acceleration_in_segment
            .push(back * sample.acceleration_in_world);
        track
            .angular_velocity_in_segment
            .push(back * sample.angular_velocity_in_world);
        track
            .angular_acceleration_in_segment
            .push(back * sample.angular_acceleration_in_world.unwrap());
    }
    let stamps: Vec<Stamp> = live.iter().map(|sample| sample.stamp).collect();
    let offline = SensorModel::new(device.effects(), START).run(&track, &stamps);
    let mut errors = (0.0f64, 0.0f64);
    // The live filters see the vibration begin, and a slip as a step of one interval.
    for (k, (live, offline)) in live.iter().zip(&offline).enumerate().skip(80) {
        if (k as f64 / RATE_HZ - 1.5).abs() > 0.1 {
            errors.0 = errors
                .0
                .max((live.specific_force - offline.specific_force).norm());
            errors.1 = errors
                .1
                .max((live.angular_velocity - offline.angular_velocity).norm());
        }
    }
    println!("{errors:?}");
    (errors, stamps)
}

#[test]
fn a_device_without_effects_changes_nothing() {
    let motion = samples(&trajectory(wrist, 240.0, 3.0));
    let plain: Vec<ImuSample> = motion.iter().map(KinematicSample::imu).collect();
    for (found, expected) in readings(&Device::white(0.1, 0.1), &motion)
        .iter()
        .zip(&plain)
    {
        assert!(
            (found.specific_force - expected.specific_force).norm() < 1e-12
                && found.stamp == expected.stamp
        );
        assert!((found.angular_velocity - expected.angular_velocity).norm() < 1e-12);
    }
}

#[test]
fn without_an_angular_acceleration_differences_stand_for_it() {
    let motion = samples(&trajectory(wrist, 240.0, 3.0));
    let bare: Vec<KinematicSample> = motion
        .iter()
        .map(|sample| KinematicSample {
            angular_acceleration_in_world: None,
            ..*sample
        })
        .collect();
    let device = device("- {effect: lever_arm, offset: [0.05, 0.0, -0.06]}");
    for (found, expected) in readings(&device, &bare)
        .iter()
        .zip(readings(&device, &motion))
        .skip(1)
    {
        assert!((found.specific_force - expected.specific_force).norm() < 0.4);
    }
}

#[test]
fn samples_are_lost_in_bursts_that_seed_and_name_make() {
    let motion = samples(&trajectory(wrist, 240.0, 3.0));
    let device = device("- {effect: dropped_samples, fraction: 0.2, mean_burst: 4}");
    let run = |seed, name: &str| {
        let mut effects = StreamingEffects::new(&device, RATE_HZ, seed, name).unwrap();
        let all = motion
            .iter()
            .cycle()
            .take(40_000)
            .map(|sample| effects.step(sample).is_some());
        all.collect::<Vec<bool>>()
    };
    let kept = run(1, "wrist");
    let lost = kept.iter().filter(|kept| !**kept).count() as f64;
    let bursts = kept.windows(2).filter(|pair| pair[0] && !pair[1]).count() as f64;
    assert!(
        (lost / 40_000.0 - 0.2).abs() < 0.02 && (lost / bursts - 4.0).abs() < 0.4,
        "{lost} in {bursts}"
    );
    assert_eq!(kept, run(1, "wrist"));
    assert!(kept != run(2, "wrist") && kept != run(1, "ankle"));
}

#[test]
fn a_new_beginning_is_a_new_epoch() {
    let motion = samples(&trajectory(wrist, 240.0, 3.0));
    let device = device("- {effect: gyro_bias_drift, rate: [0.1, 0.0, 0.0]}");
    let mut effects = StreamingEffects::new(&device, RATE_HZ, 3, "wrist")
        .unwrap()
        .without_noise();
    let drift = |effects: &mut StreamingEffects, k: usize| {
        (effects.step(&motion[k]).unwrap().angular_velocity - motion[k].imu().angular_velocity).x
    };
    assert!((drift(&mut effects, 0)).abs() < 1e-12);
    assert!((drift(&mut effects, 400) - 0.1).abs() < 1e-12);
    effects.reset();
    assert!((drift(&mut effects, 400)).abs() < 1e-12);
}

#[test]
fn noise_comes_before_the_limit_and_the_steps() {
    let motion = samples(&trajectory(wrist, 240.0, 3.0));
    let device = device(
        "- {effect: accel_saturation, limit: 20.0}\n- {effect: accel_quantization, lsb: 0.25}\n- {effect: accel_noise, density: 0.1}",
    );
    let mut effects = StreamingEffects::new(&device, RATE_HZ, 3, "wrist").unwrap();
    let quiet = readings(&device, &motion);
    let noisy: Vec<ImuSample> = motion
        .iter()
        .filter_map(|sample| effects.step(sample))
        .collect();
    assert!(
        noisy
            .iter()
            .flat_map(|sample| sample.specific_force.iter())
            .all(|v| v.abs() <= 20.0 && (v / 0.25).fract() == 0.0)
    );
    // 0.1 sqrt(400) = 2 m/s2, less where the limit cuts it.
    let inside = noisy
        .iter()
        .zip(&quiet)
        .filter(|(_, quiet)| quiet.specific_force.z.abs() < 10.0);
    let (n, sum) = inside.fold((0.0, 0.0), |(n, sum), (a, b)| {
        (
            n + 1.0,
            sum + (a.specific_force.z - b.specific_force.z).powi(2),
        )
    });
    assert!(
        ((sum / n).sqrt() - 2.0f64).abs() < 0.2,
        "{}",
        (sum / n).sqrt()
    );
}
