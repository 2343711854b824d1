#![allow(clippy::unwrap_used)]
use cromosim_spatial::Stamp;
use nalgebra::UnitQuaternion;

use super::*;
use crate::{EMBEDDED_DEVICES, ImuSample};

const YAML: &str = "schema: cromosim/device/1\ndeclared_noise: {accel_density: 0.002, gyro_density: 0.0003, orientation_stddev: 0.01}\n\
                    effects:\n- {effect: accel_bias, bias: [0.1, 0.2, 0.3]}\n- {effect: gyro_bias, bias: [-0.01, 0.0, 0.02]}\n";

fn device() -> Device {
    Device::parse(YAML, "mine.yaml").unwrap()
}

fn still(k: i64) -> ImuSample {
    let stamp = Stamp::from_nanos(k * 10_000_000);
    ImuSample {
        stamp,
        world_from_sensor: UnitQuaternion::identity(),
        specific_force: Vector3::new(0.0, 0.0, 9.80665),
        angular_velocity: Vector3::zeros(),
    }
}

fn noisy(device: &Device, seed: u64, name: &str, count: i64) -> Vec<ImuSample> {
    let mut source = source(device, 100.0, seed, name).unwrap();
    let noisy = |k| {
        let (still, drawn) = (still(k), source.draw());
        ImuSample {
            stamp: still.stamp,
            world_from_sensor: still.world_from_sensor * source.draw_turn(),
            specific_force: still.specific_force + drawn.specific_force,
            angular_velocity: still.angular_velocity + drawn.angular_velocity,
        }
    };
    (0..count).map(noisy).collect()
}

fn source(device: &Device, rate_hz: f64, seed: u64, name: &str) -> Result<NoiseSource, ImuError> {
    let (noise, orientation_stddev) = (device.declared_noise(), device.orientation_stddev());
    NoiseSource::white(&noise, orientation_stddev, rate_hz, seed, name)
}

#[test]
fn noise_has_the_data_sheets_density() {
    let count = 40_000;
    let samples = noisy(&device(), 1, "wrist", count);
    let n = count as f64;
    // Mean within 5 and sigma within 4 of their own standard errors; sigma = density sqrt(100 Hz).
    let check = |of: &dyn Fn(&ImuSample) -> f64, mean: f64, sigma: f64| {
        let found = samples.iter().map(of).sum::<f64>() / n;
        let deviation = (samples.iter().map(|s| (of(s) - found).powi(2)).sum::<f64>() / n).sqrt();
        assert!(
            (found - mean).abs() < 5.0 * sigma / n.sqrt(),
            "{found} against {mean}"
        );
        assert!(
            (deviation / sigma - 1.0).abs() < 4.0 / (2.0 * n).sqrt(),
            "{deviation} against {sigma}"
        );
    };
    for axis in 0..3 {
        check(&|s| s.specific_force[axis], [0.0, 0.0, 9.80665][axis], 0.02);
        check(&|s| s.angular_velocity[axis], 0.0, 0.003);
        check(&|s| s.world_from_sensor.scaled_axis()[axis], 0.0, 0.01);
    }
    let cross: f64 = samples
        .iter()
        .map(|s| s.specific_force.x * s.specific_force.y)
        .sum::<f64>()
        / n
        / 0.0004;
    let lagged: f64 = samples
        .windows(2)
        .map(|w| w[0].specific_force.x * w[1].specific_force.x)
        .sum::<f64>()
        / n
        / 0.0004;
    assert!(
        cross.abs() < 4.0 / n.sqrt() && lagged.abs() < 4.0 / n.sqrt(),
        "white: {cross} {lagged}"
    );
}

#[test]
fn noise_depends_on_seed_and_name_alone() {
    let wrist = noisy(&device(), 1, "wrist", 50);
    assert_eq!(wrist, noisy(&device(), 1, "wrist", 50));
    assert_ne!(wrist, noisy(&device(), 2, "wrist", 50));
    assert_ne!(wrist, noisy(&device(), 1, "ankle", 50));
    let in_threads: Vec<_> = std::thread::scope(|scope| {
        let names = ["ankle", "wrist", "head"];
        let handles: Vec<_> = names
            .map(|name| scope.spawn(move || noisy(&device(), 1, name, 50)))
            .into_iter()
            .collect();
        handles
            .into_iter()
            .map(|handle| handle.join().unwrap())
            .collect()
    });
    assert_eq!(in_threads[1], wrist);
    // The very numbers, so that no new version changes recordings unnoticed.
    let first = wrist[0].specific_force - Vector3::new(0.0, 0.0, 9.80665);
    assert!((first - FIRST_DRAW).norm() < 1e-12, "{first:?}");
}

const FIRST_DRAW: Vector3<f64> = Vector3::new(
    0.0241159696835406,
    -0.014761299141022033,
    -0.020284809834530293,
);

#[test]
fn a_device_without_error_changes_nothing() {
    assert_eq!(
        noisy(&Device::ideal(), 3, "wrist", 20),
        (0..20).map(still).collect::<Vec<_>>()
    );
}

#[test]
fn covariances_follow_rep_145() {
    let covariances = Covariances::for_device(&device(), 100.0);
    assert!(
        (covariances.linear_acceleration[4] - 4e-4).abs() < 1e-15
            && covariances.linear_acceleration[1] == 0.0
    );
    assert!((covariances.angular_velocity[8] - 9e-6).abs() < 1e-18);
    assert!((covariances.orientation[0] - 1e-4).abs() < 1e-18);
    let raw = covariances.without_orientation();
    assert_eq!(
        raw.orientation,
        [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    );
    assert_eq!(raw.linear_acceleration, covariances.linear_acceleration);
    let unknown = Covariances::for_device(&Device::ideal(), 100.0);
    assert_eq!(
        (unknown.orientation, unknown.linear_acceleration),
        ([0.0; 9], [0.0; 9])
    );
}

#[test]
fn shipped_devices_are_sound_and_bad_ones_refused() {
    for (name, _) in EMBEDDED_DEVICES {
        Device::embedded(name).unwrap();
    }
    assert!(
        (Device::embedded("consumer_mems").unwrap().gyro_density() - 0.007_f64.to_radians()).abs()
            < 5e-7
    );
    let unknown = Device::embedded("bmi999").unwrap_err().to_string();
    assert!(
        unknown.contains("`bmi999`") && unknown.contains("consumer_mems"),
        "{unknown}"
    );
    let refusal = |text: &str| Device::parse(text, "d.yaml").unwrap_err().to_string();
    let negative = refusal(&YAML.replace("0.002", "-0.002"));
    assert_eq!(
        negative,
        "d.yaml: accel_density: -0.002 is not a finite number of at least zero"
    );
    assert!(
        refusal(&YAML.replace("[0.1,", "[.nan,")).contains("accel_bias: bias: NaN is out of range")
    );
    assert!(refusal(&YAML.replace("bias: [0.1", "bais: [0.1")).starts_with("d.yaml: "));
    assert!(
        refusal(&YAML.replace("accel_bias, bias", "reference_tilt, rotvec"))
            .contains("`reference_tilt` is an effect of a recording")
    );
    assert!(
        refusal(&format!("{YAML}\nunexplained: {{gyro_late: -0.001}}\n"))
            .contains("`gyro_late` is an effect of a recording")
    );
    assert!(refusal(&YAML.replace("accel_density", "accel_densty")).starts_with("d.yaml: "));
    assert!(refusal(&YAML.replace("device/1", "device/2")).contains("found `cromosim/device/2`"));
    assert!(
        Device::resolve(Some("none.yaml"), std::path::Path::new("nowhere"))
            .unwrap_err()
            .to_string()
            .contains("none.yaml")
    );
    assert_eq!(
        Device::resolve(None, std::path::Path::new("")).unwrap(),
        Device::ideal()
    );
    assert!(source(&device(), 0.0, 1, "x").is_err());
}
