#![allow(clippy::unwrap_used)]

use super::*;
use crate::Device;

fn device() -> Device {
    Device::parse(
        "schema: cromosim/device/1\ndeclared_noise: {accel_density: 0, gyro_density: 0}\neffects:\n  - {effect: warm_up, start: 21.5, rise: 12.0, time_constant: 240.0, accel_per_kelvin: [0.002, 0, -0.001], gyro_per_kelvin: [0, 1.0e-4, 0]}\n",
        "d.yaml",
    )
    .unwrap()
}

#[test]
fn temperature_and_biases_level_off_together() {
    let course = WarmUp::new(device().effects()).unwrap();
    assert_eq!(course.temperature(0.0), 21.5);
    assert_eq!(course.temperature(-5.0), 21.5);
    assert!((course.temperature(240.0) - 21.5 - 12.0 * (1.0 - (-1f64).exp())).abs() < 1e-12);
    assert!((course.temperature(1e5) - 33.5).abs() < 1e-12);
    let bias = course.bias(1e5);
    assert!((bias.specific_force - Vector3::new(0.024, 0.0, -0.012)).norm() < 1e-12);
    assert!((bias.angular_velocity - Vector3::new(0.0, 1.2e-3, 0.0)).norm() < 1e-12);
}

#[test]
fn a_thermometer_speaks_once_a_second() {
    let mut thermometer = Thermometer::new(device().effects()).unwrap();
    let at = |k: i64| Stamp::from_nanos(1_700_000_000_000_000_000 + k * 10_000_000);
    let said: Vec<(i64, f64)> = (0..1000)
        .filter_map(|k| thermometer.read(at(k)).map(|value| (k, value)))
        .collect();
    assert_eq!(
        said.iter().map(|(k, _)| *k).collect::<Vec<_>>(),
        (0..10).map(|k| 100 * k).collect::<Vec<_>>()
    );
    assert!(said.windows(2).all(|pair| pair[0].1 < pair[1].1));
    // After a pause it does not catch up.
    assert!(thermometer.read(at(5000)).is_some() && thermometer.read(at(5001)).is_some());
    assert!(thermometer.read(at(5002)).is_none());
}
