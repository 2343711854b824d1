#![allow(clippy::unwrap_used)]

use nalgebra::{Translation3, UnitQuaternion};

use super::*;
use crate::Device;

fn turned(angle: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(0.0, 0.0, 1.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle),
    )
}

fn field() -> Arc<AmbientField> {
    Arc::new(AmbientField::uniform(Vector3::new(0.0, 2e-5, -4e-5)))
}

fn device(lines: &str) -> Device {
    let text = format!(
        "schema: cromosim/device/1\ndeclared_noise: {{accel_density: 0, gyro_density: 0}}\nmagnetometer: {{{lines}}}"
    );
    Device::parse(&text, "d.yaml").unwrap()
}

#[test]
fn an_ideal_one_reads_the_field_in_its_own_axes() {
    let model = Magnetometer::default();
    let mut sensor = MagneticSensor::new(&model, field(), 100.0, Some((1, "wrist")));
    // The sensor's x points to the world's y: north is along x.
    let reading = sensor.read(&turned(std::f64::consts::FRAC_PI_2), Stamp::default());
    assert!(
        (reading - Vector3::new(2e-5, 0.0, -4e-5)).norm() < 1e-18,
        "{reading}"
    );
}

#[test]
fn iron_delay_step_and_limit_do_what_they_say() {
    let text = "hard_iron: [1e-6, -2e-6, 3e-6], soft_iron: [[1.1, 0.02, 0], [0, 0.9, 0], [0, 0, 1]], lsb: 1e-7, limit: 3.0e-5";
    let device = device(text);
    let mut sensor = MagneticSensor::new(device.magnetometer().unwrap(), field(), 100.0, None);
    let reading = sensor.read(&turned(0.0), Stamp::default());
    let expected = Vector3::new(0.02 * 2e-5 + 1e-6, 0.9 * 2e-5 - 2e-6, -3e-5);
    assert!((reading - expected).amax() <= 0.5e-7 + 1e-15, "{reading}");

    let late = Magnetometer {
        delay: 0.02,
        ..Magnetometer::default()
    };
    let mut sensor = MagneticSensor::new(&late, field(), 100.0, None);
    let mut on_time = MagneticSensor::new(&Magnetometer::default(), field(), 100.0, None);
    let mut expected = Vec::new();
    for k in 0..20 {
        let stamp = Stamp::from_seconds(f64::from(k) * 0.01);
        let pose = turned(f64::from(k) * 0.05);
        let reading = sensor.read(&pose, stamp);
        expected.push(on_time.read(&pose, stamp));
        if k >= 2 {
            let then = expected[k as usize - 2];
            assert!((reading - then).norm() < 1e-12, "{k}");
        }
    }
}

#[test]
fn noise_has_the_density_and_the_message_says_it() {
    let device = device("noise_density: 2e-8, hard_iron_deviation: [1e-6, 1e-6, 1e-6]");
    let model = device.magnetometer().unwrap();
    let rate_hz = 50.0;
    let spread = |seed| {
        let mut sensor = MagneticSensor::new(model, field(), rate_hz, Some((seed, "wrist")));
        let readings: Vec<_> = (0..2000)
            .map(|k| sensor.read(&turned(0.0), Stamp::from_seconds(f64::from(k) / rate_hz)))
            .collect();
        let mean = readings.iter().sum::<Vector3<f64>>() / 2000.0;
        let variance = readings
            .iter()
            .map(|it| (it - mean).norm_squared())
            .sum::<f64>()
            / 6000.0;
        (mean - Vector3::new(0.0, 2e-5, -4e-5), variance)
    };
    let expected = (2e-8f64).powi(2) * rate_hz;
    let (drawn, variance) = spread(1);
    assert!(
        (variance / expected - 1.0).abs() < 0.1,
        "{variance} {expected}"
    );
    let (other, _) = spread(2);
    assert!(
        (drawn - other).norm() > 1e-7 && drawn.norm() < 5e-6,
        "{drawn} {other}"
    );
    assert!((model.variance(rate_hz) - expected - 1e-12).abs() < 1e-18);
}

#[test]
fn a_device_file_is_written_as_it_is_read() {
    for lines in [
        "",
        "noise_density: 2e-8, hard_iron: [1e-6, 0, 0], soft_iron: [[1, 0.1, 0], [0, 1, 0], [0, 0, 0.9]], delay: 0.01, lsb: 1.5e-7, limit: 0.0049",
    ] {
        let device = device(lines);
        let text = device.to_yaml("made by hand");
        assert_eq!(Device::parse(&text, "again").unwrap(), device, "{text}");
    }
}

#[test]
fn what_is_no_magnetometer_is_said() {
    for (lines, word) in [
        ("hard_iron: [40, 0, 0]", "hard_iron: 40 is out of range"),
        ("noise_density: -1", "noise_density"),
        (
            "soft_iron: [[0, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "without an inverse",
        ),
        ("iron: 3", "unknown field"),
    ] {
        let text = format!(
            "schema: cromosim/device/1\ndeclared_noise: {{accel_density: 0, gyro_density: 0}}\nmagnetometer: {{{lines}}}"
        );
        let error = Device::parse(&text, "d.yaml").unwrap_err().to_string();
        assert!(
            error.contains(word) && error.starts_with("d.yaml"),
            "{lines}: {error}"
        );
    }
}
