//! A real IMU beside simulated readings: its clock, mount, biases and lever arm by least squares.

use cromosim_imu::{KinematicSample, Reading};
use cromosim_spatial::{Stamp, derivative_weights};
use nalgebra::{Matrix3, Matrix4, Matrix4x3, SMatrix, SVector, Vector3, Vector4};

/// Clocks are tried this far apart, s, and in such steps.
const WIDEST_S: f64 = 0.012;
const STEP_S: f64 = 0.001;
/// Readings farther apart have a gap between them, in intervals.
const LONGEST_GAP: f64 = 1.5;

/// What an IMU measured, as if its clock were late by so much.
pub(super) struct Lagged {
    /// One for each wanted stamp.
    readings: Vec<Option<Reading>>,
}

/// The readings at `wanted` stamps for every clock on the grid of [`STEP_S`], by cubics through the
/// four around.
pub(super) fn all_lags(stamps: &[Stamp], readings: &[Reading], wanted: &[Stamp]) -> Vec<Lagged> {
    let steps = (WIDEST_S / STEP_S).round() as i32;
    let lagged = |step: i32| Lagged {
        readings: wanted
            .iter()
            .map(|stamp| {
                between(
                    stamps,
                    readings,
                    stamp.plus_seconds(f64::from(step) * STEP_S),
                )
            })
            .collect(),
    };
    (-steps..=steps).map(lagged).collect()
}

/// The reading at a time; none outside of the series or near a gap.
fn between(stamps: &[Stamp], readings: &[Reading], stamp: Stamp) -> Option<Reading> {
    let after = stamps.partition_point(|other| *other < stamp);
    let first = after.checked_sub(2)?;
    let near = stamps.get(first..first + 4)?;
    let interval = (stamps[stamps.len() - 1] - stamps[0]) / (stamps.len() - 1) as f64;
    if near[3] - near[0] > (2.0 + LONGEST_GAP) * interval {
        return None;
    }
    let seconds: [f64; 4] = std::array::from_fn(|k| near[k] - stamp);
    let weights = derivative_weights(&seconds, 0.0)[0];
    let sum = |of: fn(&Reading) -> Vector3<f64>| -> Vector3<f64> {
        readings[first..first + 4]
            .iter()
            .zip(weights)
            .map(|(reading, weight)| of(reading) * weight)
            .sum()
    };
    Some(Reading {
        specific_force: sum(|reading| reading.specific_force),
        angular_velocity: sum(|reading| reading.angular_velocity),
    })
}

/// The IMU's readings in the axes and at the place of the simulated sensor, as the simulation explains
/// them best: with g(t), a(t) measured and w(t), f(t) simulated,
///
/// ```text
/// g(t + lag) = A w + b_g                                            lag on a grid, A a rotation
/// a(t + lag) = A (f + dw/dt x l + w x (w x l)) + b_a - (A f) x d    lever arm l, small turn d
/// ```
/// both by least squares over the samples that `fitted` names; the same for every method. None where
/// nothing was measured; none at all where too little was.
pub(super) fn aligned(
    samples: &[KinematicSample],
    lags: &[Lagged],
    fitted: &[bool],
) -> Option<Vec<Option<Reading>>> {
    let moved = moved(samples);
    let fits = lags
        .iter()
        .filter_map(|lag| Some((RateFit::new(&moved, lag, fitted)?, lag)));
    let (rate, lag) = fits.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost))?;
    let force = force_fit(&moved, lag, fitted, &rate)?;
    let explained = |(own, reading): (&Moved, &Option<Reading>)| {
        let Reading {
            specific_force,
            angular_velocity,
        } = (*reading)?;
        // What the fit adds to the simulation is taken off the measurement.
        let added = force_rows(own, &rate.rotation) * force;
        Some(Reading {
            specific_force: rate.rotation.transpose() * (specific_force - added),
            angular_velocity: rate.rotation.transpose() * (angular_velocity - rate.bias),
        })
    };
    Some(moved.iter().zip(&lag.readings).map(explained).collect())
}

/// A simulated sample in the sensor's axes.
struct Moved {
    force: Vector3<f64>,
    rate: Vector3<f64>,
    rate_derivative: Vector3<f64>,
}

/// Derivatives by central differences of the neighbours; one-sided at the ends.
fn moved(samples: &[KinematicSample]) -> Vec<Moved> {
    let readings: Vec<_> = samples.iter().map(KinematicSample::imu).collect();
    let at = |k: usize| {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(readings.len() - 1));
        let seconds = (readings[after].stamp - readings[before].stamp).max(1e-9);
        Moved {
            force: readings[k].specific_force,
            rate: readings[k].angular_velocity,
            rate_derivative: (readings[after].angular_velocity - readings[before].angular_velocity)
                / seconds,
        }
    };
    (0..readings.len()).map(at).collect()
}

/// Samples that count with what was measured there.
fn counted<'a>(
    moved: &'a [Moved],
    lag: &'a Lagged,
    fitted: &'a [bool],
) -> impl Iterator<Item = (&'a Moved, Reading)> + Clone {
    moved
        .iter()
        .zip(&lag.readings)
        .zip(fitted)
        .filter_map(|((own, reading), fitted)| Some((own, (*reading).filter(|_| *fitted)?)))
}

/// Rotation and bias of the gyroscope.
struct RateFit {
    /// measured from simulated.
    rotation: Matrix3<f64>,
    bias: Vector3<f64>,
    /// Mean square of what is left, (rad/s)2.
    cost: f64,
}

impl RateFit {
    fn new(moved: &[Moved], lag: &Lagged, fitted: &[bool]) -> Option<Self> {
        let (mut normal, mut right) = (Matrix4::zeros(), Matrix4x3::zeros());
        let (mut mean, mut mean_measured, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (own, reading) in counted(moved, lag, fitted) {
            let row = Vector4::new(own.rate.x, own.rate.y, own.rate.z, 1.0);
            normal += row * row.transpose();
            right += row * reading.angular_velocity.transpose();
            mean += own.rate;
            mean_measured += reading.angular_velocity;
            count += 1.0;
        }
        let linear = normal.cholesky()?.solve(&right);
        let svd = linear.fixed_rows::<3>(0).transpose().svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let sign = (u * v_t).determinant().signum();
        let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
        let bias = (mean_measured - rotation * mean) / count;
        let left = |(own, reading): (&Moved, Reading)| {
            (reading.angular_velocity - rotation * own.rate - bias).norm_squared()
        };
        let cost = counted(moved, lag, fitted).map(left).sum::<f64>() / count;
        Some(Self {
            rotation,
            bias,
            cost,
        })
    }
}

/// Lever arm, bias of the accelerometer and a small turn of its axes.
fn force_fit(
    moved: &[Moved],
    lag: &Lagged,
    fitted: &[bool],
    rate: &RateFit,
) -> Option<SVector<f64, 9>> {
    let (mut normal, mut right) = (SMatrix::<f64, 9, 9>::zeros(), SVector::<f64, 9>::zeros());
    for (own, reading) in counted(moved, lag, fitted) {
        let rows = force_rows(own, &rate.rotation);
        normal += rows.transpose() * rows;
        right += rows.transpose() * (reading.specific_force - rate.rotation * own.force);
    }
    normal.lu().solve(&right)
}

/// What the parameters of [`force_fit`] add to a sample's `A f`.
fn force_rows(own: &Moved, rotation: &Matrix3<f64>) -> SMatrix<f64, 3, 9> {
    let turning = own.rate.cross_matrix();
    let lever = rotation * (own.rate_derivative.cross_matrix() + turning * turning);
    let mut rows = SMatrix::<f64, 3, 9>::zeros();
    rows.fixed_columns_mut::<3>(0).copy_from(&lever);
    rows.fixed_columns_mut::<3>(3)
        .copy_from(&Matrix3::identity());
    rows.fixed_columns_mut::<3>(6)
        .copy_from(&-(rotation * own.force).cross_matrix());
    rows
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_imu::{Scheme, SensorFrame, SensorTrajectory, simulate_kinematics};
    use cromosim_spatial::uniform_stamps;
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;

    fn samples() -> Vec<KinematicSample> {
        let frame = |k: u32| {
            let t = f64::from(k) / 200.0;
            let place = Vector3::new((3.0 * t).sin(), (2.1 * t).cos(), (1.3 * t).sin()) * 0.3;
            let turn = Vector3::new((2.0 * t).sin(), (3.1 * t).cos(), 0.7 * (1.7 * t).sin());
            SensorFrame::new(Stamp::from_seconds(t), Isometry3::new(place, turn))
        };
        let trajectory = SensorTrajectory::new((0..2000).map(frame).collect()).unwrap();
        let grid = uniform_stamps(trajectory.start(), trajectory.end(), 200.0).unwrap();
        simulate_kinematics(&trajectory, Scheme::Richardson, &grid).unwrap()
    }

    #[test]
    fn clock_mount_biases_and_lever_arm_are_taken_off() {
        let samples = samples();
        let rotation = UnitQuaternion::from_euler_angles(0.4, -1.2, 2.9).to_rotation_matrix();
        let lever = Vector3::new(0.03, -0.05, 0.02);
        let measure = |own: &Moved| Reading {
            specific_force: rotation
                * (own.force
                    + own.rate_derivative.cross(&lever)
                    + own.rate.cross(&own.rate.cross(&lever)))
                + Vector3::new(0.1, -0.2, 0.05),
            angular_velocity: rotation * own.rate + Vector3::new(0.01, 0.02, -0.03),
        };
        let readings: Vec<Reading> = moved(&samples).iter().map(measure).collect();
        // Late by 5 ms.
        let stamps: Vec<Stamp> = samples
            .iter()
            .map(|sample| sample.stamp.plus_seconds(0.005))
            .collect();
        let wanted: Vec<Stamp> = samples.iter().map(|sample| sample.stamp).collect();
        let lags = all_lags(&stamps, &readings, &wanted);
        let fitted = vec![true; wanted.len()];
        let found = aligned(&samples, &lags, &fitted).unwrap();
        for (sample, reading) in samples.iter().zip(&found).skip(20).take(1900) {
            let (own, reading) = (sample.imu(), reading.unwrap());
            assert!((own.specific_force - reading.specific_force).norm() < 2e-3);
            assert!((own.angular_velocity - reading.angular_velocity).norm() < 1e-3);
        }
        assert!(aligned(&samples, &lags, &vec![false; wanted.len()]).is_none());
    }

    #[test]
    fn nothing_is_made_up_in_a_gap() {
        let stamps: Vec<Stamp> = (0..40)
            .filter(|k| !(20..25).contains(k))
            .map(|k| Stamp::from_seconds(f64::from(k) * 0.01))
            .collect();
        let readings = vec![
            Reading {
                specific_force: Vector3::z(),
                angular_velocity: Vector3::x()
            };
            stamps.len()
        ];
        let at = |seconds| between(&stamps, &readings, Stamp::from_seconds(seconds)).is_some();
        assert!(at(0.104) && !at(0.221) && !at(-0.1) && !at(0.5));
    }
}
