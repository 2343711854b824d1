//! The practice: poses smoothed by one low-pass, then differences.

use cromosim_imu::{KinematicSample, Scheme, SensorFrame, SensorTrajectory, simulate_kinematics};
use cromosim_spatial::{Stamp, so3};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::EvaluationError;
use crate::low_pass::ZeroPhaseLowPass;

/// Cutoffs that are usual for poses of people (4 and 6 Hz for walking, Winter 2009; 10 and 20 Hz for
/// what is faster), Hz.
pub(super) const USUAL_CUTOFFS_HZ: [f64; 4] = [4.0, 6.0, 10.0, 20.0];
/// Cutoffs among which the best is chosen in hindsight, Hz.
pub(super) const CUTOFFS_HZ: [f64; 7] = [4.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0];
/// A cutoff nearer to half the rate smooths nothing; as a part of the rate.
const HIGHEST_CUTOFF: f64 = 0.45;

/// Whether poses of this rate can be smoothed with this cutoff.
pub(super) fn is_below_half(cutoff_hz: f64, rate_hz: f64) -> bool {
    cutoff_hz <= HIGHEST_CUTOFF * rate_hz
}

/// Motion at `stamps` as most people compute it from evenly spaced poses: positions and
/// sign-continuous quaternions through a Butterworth low-pass of second order, forward and back;
/// quaternions to length 1; then `p'' = (p[-1] - 2 p[0] + p[1]) / h^2`, the mean turn from and to the
/// neighbours for the angular velocity, and cubics in between.
///
/// # Errors
/// Those of differences of fewer than two frames.
pub(super) fn practice(
    trajectory: &SensorTrajectory,
    cutoff_hz: f64,
    stamps: &[Stamp],
) -> Result<Vec<KinematicSample>, EvaluationError> {
    let smooth = low_passed(trajectory, cutoff_hz)?;
    Ok(simulate_kinematics(
        &smooth,
        Scheme::SecondDifference,
        stamps,
    )?)
}

/// The frames after the low-pass.
fn low_passed(
    trajectory: &SensorTrajectory,
    cutoff_hz: f64,
) -> Result<SensorTrajectory, EvaluationError> {
    let frames = trajectory.frames();
    let rate_hz = (frames.len() - 1) as f64 / (trajectory.end() - trajectory.start());
    let filter = ZeroPhaseLowPass::new(cutoff_hz, rate_hz);
    let rotations: Vec<_> = frames
        .iter()
        .map(|frame| frame.world_from_sensor.rotation)
        .collect();
    let quaternions = so3::sign_continuous(&rotations);
    let positions: [Vec<f64>; 3] = std::array::from_fn(|axis| {
        let of = |frame: &SensorFrame| frame.world_from_sensor.translation.vector[axis];
        smoothed(&filter, frames.iter().map(of))
    });
    let components: [Vec<f64>; 4] =
        std::array::from_fn(|k| smoothed(&filter, quaternions.iter().map(|q| q.coords[k])));
    let frame = |k: usize| {
        let position = Vector3::from(positions.each_ref().map(|axis| axis[k]));
        let [x, y, z, w] = components.each_ref().map(|component| component[k]);
        let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let world_from_sensor = Isometry3::from_parts(position.into(), rotation);
        SensorFrame::new(frames[k].stamp, world_from_sensor)
    };
    Ok(SensorTrajectory::new(
        (0..frames.len()).map(frame).collect(),
    )?)
}

fn smoothed(filter: &ZeroPhaseLowPass, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    filter.both_ways(&mut values);
    values
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::PI;

    use super::*;

    /// A point on a circle whose frame turns with it.
    fn circle(rate_hz: f64, turns_hz: f64) -> SensorTrajectory {
        let frame = |k: u32| {
            let angle = 2.0 * PI * turns_hz * f64::from(k) / rate_hz;
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
            let place = rotation * Vector3::new(0.3, 0.0, 0.0);
            SensorFrame::new(
                Stamp::from_seconds(f64::from(k) / rate_hz),
                Isometry3::from_parts(place.into(), rotation),
            )
        };
        SensorTrajectory::new((0..(6.0 * rate_hz) as u32).map(frame).collect()).unwrap()
    }

    #[test]
    fn slow_turns_stay_and_fast_ones_lose_what_the_filter_takes() {
        let at = [Stamp::from_seconds(3.004)];
        for (turns_hz, cutoff_hz) in [(0.5, 20.0), (1.0, 6.0), (4.0, 4.0)] {
            let trajectory = circle(120.0, turns_hz);
            let reading = practice(&trajectory, cutoff_hz, &at).unwrap()[0].imu();
            let rate = 2.0 * PI * turns_hz;
            let gain = 1.0 / (1.0 + (turns_hz / cutoff_hz).powi(4));
            // In the sensor's axes the centripetal acceleration points along -x.
            let expected = Vector3::new(-0.3 * rate * rate * gain, 0.0, 9.80665);
            let away = (reading.specific_force - expected).norm();
            assert!(away < 0.02 * (1.0 + expected.x.abs()), "{turns_hz}: {away}");
            // Filtering both of cos and sin of the half angle shrinks the quaternion alone.
            let away = (reading.angular_velocity - Vector3::z() * rate).norm();
            assert!(away < 0.02 * rate, "{turns_hz}: {away}");
        }
    }

    #[test]
    fn cutoffs_need_room_below_half_the_rate() {
        assert!(is_below_half(10.0, 30.0) && !is_below_half(15.0, 30.0));
    }
}
