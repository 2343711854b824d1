//! What must be known of a real IMU before its readings can be turned into the world: its clock
//! against the reference's, and its mount.

use cromosim_imu::{GRAVITY_IN_WORLD, KinematicSample, Reading};
use cromosim_spatial::{Stamp, greatest_near};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::LearnedError;

/// Seconds that a clock may be off.
const WIDEST: f64 = 0.25;
/// Steps of the first search, s.
const STEP: f64 = 0.005;
/// Sharpness of the time offset, s.
const PRECISION: f64 = 1e-6;
/// Fewer samples say nothing of a mount.
const LEAST: usize = 50;

/// How an IMU stands against its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// An event at reference time t carries the IMU stamp t + this, s.
    pub time_offset: f64,
    /// Turns the chip's axes into those of the reference's sensor frame.
    pub reference_from_chip: UnitQuaternion<f64>,
}

/// Time offset and mount of measured readings against analytic kinematics (sorted by time).
///
/// The offset minimises what a rotation leaves of the angular velocity, `min_R sum |w_ref(t) - R
/// w(t + offset)|^2` (Wahba's problem, solved by Markley's singular value method); the mount is
/// then the R of angular velocity and specific force together, each divided by its own mean square.
///
/// # Errors
/// [`LearnedError::TooFew`] for less than half a second in common.
pub fn align(
    kinematics: &[KinematicSample],
    stamps: &[Stamp],
    readings: &[Reading],
) -> Result<Alignment, LearnedError> {
    let cost = |offset: f64| {
        let both = matched(kinematics, stamps, readings, offset);
        (both.len() >= LEAST).then(|| {
            wahba(
                both.iter()
                    .map(|(sample, reading)| (sample.1, reading.angular_velocity, 1.0)),
            )
            .1 / both.len() as f64
        })
    };
    let steps = (WIDEST / STEP) as i32;
    let coarse =
        (-steps..=steps).filter_map(|k| Some((f64::from(k) * STEP, cost(f64::from(k) * STEP)?)));
    let best = coarse.min_by(|a, b| a.1.total_cmp(&b.1));
    let too_few = || LearnedError::TooFew {
        what: "time and mount of an IMU against its reference".to_owned(),
        found: matched(kinematics, stamps, readings, 0.0).len(),
        needed: LEAST,
    };
    let (coarse, _) = best.ok_or_else(too_few)?;
    let likeness = |offset| -cost(offset).unwrap_or(f64::INFINITY);
    let time_offset = greatest_near(likeness, coarse, STEP, PRECISION);
    let both = matched(kinematics, stamps, readings, time_offset);
    let mean_square = |of: &dyn Fn(&Both) -> Vector3<f64>| {
        both.iter().map(|pair| of(pair).norm_squared()).sum::<f64>() / both.len() as f64
    };
    let force_weight = mean_square(&|(sample, _)| sample.0).recip();
    let rate_weight = mean_square(&|(sample, _)| sample.1).max(1e-6).recip();
    let forces = both
        .iter()
        .map(|(sample, reading)| (sample.0, reading.specific_force, force_weight));
    let rates = both
        .iter()
        .map(|(sample, reading)| (sample.1, reading.angular_velocity, rate_weight));
    Ok(Alignment {
        time_offset,
        reference_from_chip: wahba(forces.chain(rates)).0,
    })
}

/// Specific force and angular velocity of the reference in its sensor frame, and the reading of the
/// same time.
type Both = ((Vector3<f64>, Vector3<f64>), Reading);

fn matched(
    kinematics: &[KinematicSample],
    stamps: &[Stamp],
    readings: &[Reading],
    offset: f64,
) -> Vec<Both> {
    kinematics
        .iter()
        .filter_map(|sample| {
            let reading = reading_at(stamps, readings, sample.stamp.plus_seconds(offset))?;
            let sensor_from_world = sample.world_from_sensor.rotation.inverse();
            let force = sensor_from_world * (sample.acceleration_in_world - GRAVITY_IN_WORLD);
            Some((
                (force, sensor_from_world * sample.angular_velocity_in_world),
                reading,
            ))
        })
        .collect()
}

/// Between two readings at most this far apart, s, the one of a time is theirs in proportion.
const LONGEST_GAP: f64 = 0.05;

/// The reading at a time, linear between neighbours; none outside the series or in a gap.
pub(crate) fn reading_at(stamps: &[Stamp], readings: &[Reading], stamp: Stamp) -> Option<Reading> {
    let after = stamps.partition_point(|other| *other < stamp);
    let (to, last) = (stamps.get(after)?, readings.get(after)?);
    if *to == stamp {
        return Some(*last);
    }
    let before = after.checked_sub(1)?;
    let (from, first) = (stamps[before], readings.get(before)?);
    if *to - from > LONGEST_GAP {
        return None;
    }
    let part = (stamp - from) / (*to - from);
    let between = |a: &Vector3<f64>, b: &Vector3<f64>| a.lerp(b, part);
    let reading = Reading {
        specific_force: between(&first.specific_force, &last.specific_force),
        angular_velocity: between(&first.angular_velocity, &last.angular_velocity),
    };
    (reading.specific_force + reading.angular_velocity)
        .iter()
        .all(|value| value.is_finite())
        .then_some(reading)
}

/// The rotation R with the least `sum w |a - R b|^2`, and that sum.
fn wahba(
    pairs: impl Iterator<Item = (Vector3<f64>, Vector3<f64>, f64)>,
) -> (UnitQuaternion<f64>, f64) {
    let (mut cross, mut squares) = (Matrix3::zeros(), 0.0);
    for (a, b, weight) in pairs {
        cross += weight * a * b.transpose();
        squares += weight * (a.norm_squared() + b.norm_squared());
    }
    let svd = cross.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return (UnitQuaternion::identity(), squares);
    };
    let sign = (u.determinant() * v_t.determinant()).signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let most = svd.singular_values[0] + svd.singular_values[1] + sign * svd.singular_values[2];
    (UnitQuaternion::from_matrix(&rotation), squares - 2.0 * most)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_imu::{Scheme, SensorFrame, SensorTrajectory, simulate_kinematics};
    use cromosim_spatial::uniform_stamps;
    use nalgebra::Isometry3;

    use super::*;

    fn kinematics() -> Vec<KinematicSample> {
        let frame = |k: u32| {
            let t = f64::from(k) / 120.0;
            let position = Vector3::new(
                0.3 * (3.0 * t).sin(),
                0.2 * (4.1 * t).cos(),
                0.1 * (5.3 * t).sin(),
            );
            let turn = Vector3::new(
                (2.0 * t).sin(),
                0.8 * (3.1 * t).cos(),
                0.6 * (1.7 * t).sin(),
            );
            SensorFrame::new(Stamp::from_seconds(t), Isometry3::new(position, turn))
        };
        let trajectory = SensorTrajectory::new((0..1200).map(frame).collect()).unwrap();
        let grid = uniform_stamps(trajectory.start(), trajectory.end(), 100.0).unwrap();
        simulate_kinematics(&trajectory, Scheme::Spline, &grid).unwrap()
    }

    #[test]
    fn time_and_mount_are_found_again() {
        let kinematics = kinematics();
        let mount = UnitQuaternion::from_euler_angles(0.4, -1.2, 2.9);
        let offset = 0.0873;
        let readings: Vec<Reading> = kinematics
            .iter()
            .map(|sample| {
                let ideal = sample.imu();
                Reading {
                    specific_force: mount.inverse() * ideal.specific_force,
                    angular_velocity: mount.inverse() * ideal.angular_velocity,
                }
            })
            .collect();
        let stamps: Vec<Stamp> = kinematics
            .iter()
            .map(|sample| sample.stamp.plus_seconds(offset))
            .collect();
        let found = align(&kinematics, &stamps, &readings).unwrap();
        assert!(
            (found.time_offset - offset).abs() < 2e-4,
            "{}",
            found.time_offset
        );
        assert!(found.reference_from_chip.angle_to(&mount) < 1e-3);
    }

    #[test]
    fn nothing_in_common_is_an_error() {
        let kinematics = kinematics();
        let stamps: Vec<Stamp> = kinematics
            .iter()
            .map(|sample| sample.stamp.plus_seconds(100.0))
            .collect();
        let readings = vec![
            Reading {
                specific_force: Vector3::z(),
                angular_velocity: Vector3::x()
            };
            stamps.len()
        ];
        assert!(
            align(&kinematics, &stamps, &readings)
                .unwrap_err()
                .to_string()
                .contains("0 samples, at least 50")
        );
    }

    #[test]
    fn no_reading_is_made_up_in_a_gap() {
        let stamps = [0.0, 0.01, 0.5, 0.51].map(Stamp::from_seconds);
        let readings = [1.0, 2.0, 3.0, 4.0].map(|x| Reading {
            specific_force: Vector3::repeat(x),
            angular_velocity: Vector3::zeros(),
        });
        let at = |seconds| {
            reading_at(&stamps, &readings, Stamp::from_seconds(seconds))
                .map(|reading| reading.specific_force.x)
        };
        assert_eq!(
            (at(0.005), at(0.3), at(0.505), at(0.6), at(-0.1)),
            (Some(1.5), None, Some(3.5), None, None)
        );
    }
}
