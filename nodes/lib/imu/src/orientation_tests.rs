#![allow(clippy::unwrap_used)]

use super::*;
use crate::STANDARD_GRAVITY;

const FILTERS: [OrientationSource; 3] = [
    OrientationSource::Vqf,
    OrientationSource::Madgwick,
    OrientationSource::Mahony,
];

/// The earth's field at 52 degrees north, T: east, north, up.
const FIELD: Vector3<f64> = Vector3::new(0.0, 1.9e-5, -4.5e-5);

/// A sensor that rolls and turns by a radian about all axes, at 100 Hz.
fn orientation(seconds: f64) -> UnitQuaternion<f64> {
    let angle = |rate: f64| (rate * seconds).sin();
    UnitQuaternion::from_euler_angles(angle(1.3), 0.7 * angle(0.9), 2.0 + angle(0.5))
}

fn reading(seconds: f64) -> (Reading, Vector3<f64>) {
    let (now, next) = (orientation(seconds), orientation(seconds + 1e-4));
    let reading = Reading {
        specific_force: now.inverse() * Vector3::new(0.0, 0.0, STANDARD_GRAVITY),
        angular_velocity: (now.inverse() * next).scaled_axis() / 1e-4,
    };
    (reading, now.inverse() * FIELD)
}

#[test]
fn a_device_that_only_turns_knows_its_orientation() {
    for source in FILTERS {
        let mut filter = OrientationFilter::new(source, 100.0).unwrap();
        for k in 0..6000 {
            let seconds = f64::from(k) * 0.01;
            let (reading, field) = reading(seconds);
            let estimate = filter.update(&reading, Some(&field), Stamp::from_seconds(seconds));
            assert!((estimate.norm() - 1.0).abs() < 1e-12);
            let error = estimate.angle_to(&orientation(seconds)).to_degrees();
            assert!(k == 0 || error < 3.0, "{source} {k}: {error} degrees");
        }
    }
}

#[test]
fn without_a_magnetometer_the_tilt_is_known_and_the_heading_is_not() {
    for source in FILTERS {
        let mut filter = OrientationFilter::new(source, 100.0).unwrap();
        let mut headings = Vec::new();
        for k in 0..3000 {
            let seconds = f64::from(k) * 0.01;
            let (mut reading, _) = reading(seconds);
            reading.angular_velocity.z += 0.01;
            let estimate = filter.update(&reading, None, Stamp::from_seconds(seconds));
            let truth = orientation(seconds);
            let up = |of: UnitQuaternion<f64>| of.inverse() * Vector3::z();
            let tilt = up(estimate).angle(&up(truth)).to_degrees();
            assert!(tilt < 3.0, "{source} {k}: {tilt} degrees");
            headings.push((estimate * truth.inverse()).euler_angles().2);
        }
        assert!((headings[0] + 2.0).abs() < 0.5, "{source}: {}", headings[0]);
        let covariance = filter.covariance(false);
        assert!(covariance[8] > 3.0 && covariance[0] < 0.01);
    }
}

#[test]
fn a_source_that_starts_over_starts_the_filter_over() {
    for source in FILTERS {
        let mut filter = OrientationFilter::new(source, 100.0).unwrap();
        let (first, field) = reading(0.0);
        let at = |seconds| Stamp::from_seconds(seconds);
        let begun = filter.update(&first, Some(&field), at(5.0));
        for k in 1..500 {
            let (reading, field) = reading(f64::from(k) * 0.01);
            filter.update(&reading, Some(&field), at(5.0 + f64::from(k) * 0.01));
        }
        assert_eq!(
            filter.update(&first, Some(&field), at(1.0)),
            begun,
            "{source}"
        );
    }
}

#[test]
fn names_are_known() {
    for source in OrientationSource::ALL {
        assert_eq!(source.name().parse::<OrientationSource>().unwrap(), source);
    }
    let error = "magdwick"
        .parse::<OrientationSource>()
        .unwrap_err()
        .to_string();
    assert!(error.contains("the nearest is madgwick"), "{error}");
}
