//! What small effects leave in a residual, column by column, and how much of it they explain.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::pairs::{Both, Pairs};

/// Derivatives of both channels by P parameters, at one pair.
pub(super) type Columns<const P: usize> = [SMatrix<f64, 3, P>; 2];

/// How much of the whitened squared residual the best parameters explain: b^T A^-1 b with A = J^T W
/// J and b = J^T W r.
pub(super) fn explained<const P: usize>(
    pairs: &Pairs,
    sigmas: [f64; 2],
    columns: impl Fn(usize) -> Columns<P>,
) -> f64 {
    let mut normal = SMatrix::<f64, P, P>::zeros();
    let mut right = SMatrix::<f64, P, 1>::zeros();
    for index in 0..pairs.len() {
        let (columns, residual) = (columns(index), pairs.residual(index));
        for channel in 0..2 {
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

fn only_accel<const P: usize>(columns: SMatrix<f64, 3, P>) -> Columns<P> {
    [columns, SMatrix::zeros()]
}

fn only<const P: usize>(channel: usize, columns: SMatrix<f64, 3, P>) -> Columns<P> {
    let mut both = [SMatrix::zeros(); 2];
    both[channel] = columns;
    both
}

/// bias: x + b.
pub(super) fn bias(channel: usize) -> Columns<3> {
    only(channel, Matrix3::identity())
}

/// scale: diag(1 + k) x.
pub(super) fn scale(simulated: &Both, channel: usize) -> Columns<3> {
    only(channel, Matrix3::from_diagonal(&simulated[channel]))
}

/// misalignment: x + (xy y + xz z, yz z, 0).
pub(super) fn misalignment(simulated: &Both, channel: usize) -> Columns<3> {
    let (y, z) = (simulated[channel].y, simulated[channel].z);
    only(channel, Matrix3::new(y, z, 0.0, 0.0, 0.0, z, 0.0, 0.0, 0.0))
}

/// lever_arm: alpha x l + w x (w x l), here in sensor axes.
pub(super) fn lever_arm(rate: &Vector3<f64>, alpha: &Vector3<f64>) -> Columns<3> {
    let spin = rate.cross_matrix();
    only_accel(alpha.cross_matrix() + spin * spin)
}

/// gyro_g_sensitivity: w + G f, the entries of G row by row.
pub(super) fn g_sensitivity(force: &Vector3<f64>) -> Columns<9> {
    only(
        1,
        SMatrix::from_fn(|row, column| {
            if column / 3 == row {
                force[column % 3]
            } else {
                0.0
            }
        }),
    )
}

/// time_offset: x(t - tau).
pub(super) fn delay(slope: &Both) -> Columns<1> {
    [-slope[0], -slope[1]]
}
