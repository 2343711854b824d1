//! Axes that a device names otherwise, where the reference turns too little about one of them for a matrix.

use cromosim_imu::AXIS_ORDERS;
use nalgebra::Matrix3;

use crate::force_slopes::ForceSlopes;
use crate::turns::Turns;

/// Part of what the axes as they are leave unexplained that others may leave at most; no source.
const LEAVES: f64 = 0.5;

/// The signed permutation that leaves least of turns and forces unexplained, each as a part of its square about the mean;
/// none where the axes as they are do nearly as well. `slopes` are those of the forces under given axes.
pub(crate) fn exchanged_axes(
    turns: &Turns,
    slopes: impl Fn(&Matrix3<f64>) -> ForceSlopes,
) -> Option<Matrix3<f64>> {
    let unexplained =
        |axes: &Matrix3<f64>| turns.unexplained_by(axes) + slopes(axes).unexplained_part();
    let as_they_are = unexplained(&Matrix3::identity());
    signed_permutations()
        .map(|axes| (unexplained(&axes), axes))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(left, _)| *left < LEAVES * as_they_are)
        .map(|(_, axes)| axes)
}

/// All 48.
fn signed_permutations() -> impl Iterator<Item = Matrix3<f64>> {
    AXIS_ORDERS.into_iter().flat_map(|order| {
        (0..8).map(move |signs| {
            let mut axes = Matrix3::zeros();
            for (row, column) in order.into_iter().enumerate() {
                axes[(row, column)] = if signs >> row & 1 == 0 { 1.0 } else { -1.0 };
            }
            axes
        })
    })
}
