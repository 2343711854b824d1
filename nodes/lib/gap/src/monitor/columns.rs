//! What small effects leave in a residual, column by column, and how much of it they explain.
//!
//! Closed forms, beside the effects of `cromosim_imu`: a diagnosis takes its columns from the
//! measurement model itself, run on the reference's motion once for each value. A live window has
//! no such motion, only simulated readings, and no time for so many runs. A test holds each form
//! against the model.

use cromosim_imu::{Channel, PerChannel, Reading};
use nalgebra::{Matrix3, SMatrix, Vector3};

use super::pairs::Pairs;

/// Derivatives of both channels by P parameters, at one pair.
pub(super) type Columns<const P: usize> = PerChannel<SMatrix<f64, 3, P>>;

/// How much of the whitened squared residual the best parameters explain: b^T A^-1 b with A = J^T W
/// J and b = J^T W r.
pub(super) fn explained<const P: usize>(
    pairs: &Pairs,
    sigmas: PerChannel<f64>,
    columns: impl Fn(usize) -> Columns<P>,
) -> f64 {
    let mut normal = SMatrix::<f64, P, P>::zeros();
    let mut right = SMatrix::<f64, P, 1>::zeros();
    for index in 0..pairs.len() {
        let (columns, residual) = (columns(index), pairs.residual(index));
        for channel in Channel::ALL {
            let weighted = columns[channel].transpose() / sigmas[channel].powi(2);
            normal += weighted * columns[channel];
            right += weighted * residual[channel];
        }
    }
    // What the motion does not excite must not make the matrix singular.
    let ridge = 1e-9 * normal.trace() / P as f64;
    if ridge <= 0.0 {
        return 0.0;
    }
    for k in 0..P {
        normal[(k, k)] += ridge;
    }
    normal
        .cholesky()
        .map_or(0.0, |factor| right.dot(&factor.solve(&right)))
}

fn only<const P: usize>(channel: Channel, columns: SMatrix<f64, 3, P>) -> Columns<P> {
    let mut both = PerChannel::from_fn(|_| SMatrix::zeros());
    both[channel] = columns;
    both
}

/// bias: x + b.
pub(super) fn bias(channel: Channel) -> Columns<3> {
    only(channel, Matrix3::identity())
}

/// scale: diag(1 + k) x.
pub(super) fn scale(simulated: &Reading, channel: Channel) -> Columns<3> {
    only(channel, Matrix3::from_diagonal(&simulated[channel]))
}

/// misalignment: x + (xy y + xz z, yz z, 0).
pub(super) fn misalignment(simulated: &Reading, channel: Channel) -> Columns<3> {
    let (y, z) = (simulated[channel].y, simulated[channel].z);
    only(channel, Matrix3::new(y, z, 0.0, 0.0, 0.0, z, 0.0, 0.0, 0.0))
}

/// lever_arm: alpha x l + w x (w x l), here in sensor axes.
pub(super) fn lever_arm(
    angular_velocity: &Vector3<f64>,
    angular_acceleration: &Vector3<f64>,
) -> Columns<3> {
    let spin = angular_velocity.cross_matrix();
    let columns = angular_acceleration.cross_matrix() + spin * spin;
    only(Channel::Accelerometer, columns)
}

/// gyro_g_sensitivity: w + G f, the entries of G row by row.
pub(super) fn g_sensitivity(specific_force: &Vector3<f64>) -> Columns<9> {
    let columns = SMatrix::from_fn(|row, column| {
        if column / 3 == row {
            specific_force[column % 3]
        } else {
            0.0
        }
    });
    only(Channel::Gyroscope, columns)
}

/// time_offset: x(t - tau).
pub(super) fn delay(slope: &PerChannel<Vector3<f64>>) -> Columns<1> {
    PerChannel::from_fn(|channel| -slope[channel])
}
