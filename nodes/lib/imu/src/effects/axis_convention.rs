//! `axis_convention`: the device names its axes otherwise.

use nalgebra::Matrix3;

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::AxisConvention,
    name: "axis_convention",
    stage: Stage::Sensor,
    summary: "The device's axes are swapped or turned in sign: both channels are the simulated ones with axes exchanged.",
    remedy: "Map the driver's axes to the sensor's drawing.",
    parameters: &[ParameterSpec {
        name: "matrix",
        unit: "",
        shape: Shape::Matrix3,
        neutral: &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        lower: -1.0,
        upper: 1.0,
        step: 1.0,
    }],
    random: false,
    continuous: false,
    starts,
};

/// The signed permutation M with the least `sum |m - M s|^2`.
fn starts(view: &ResidualView) -> Vec<Vec<f64>> {
    let sum: Matrix3<f64> = view.outer_products().sum();
    // trace(M^T C) is greatest: for each order of the columns the signs of C's entries are best.
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let score = |order: &[usize; 3]| {
        order
            .iter()
            .enumerate()
            .map(|(row, column)| sum[(row, *column)].abs())
            .sum::<f64>()
    };
    let order = ORDERS
        .into_iter()
        .max_by(|a, b| score(a).total_cmp(&score(b)))
        .unwrap_or(ORDERS[0]);
    let mut flat = vec![0.0; 9];
    for (row, column) in order.into_iter().enumerate() {
        flat[3 * row + column] = if sum[(row, column)] < 0.0 { -1.0 } else { 1.0 };
    }
    vec![flat]
}

/// One 1 or -1 in each row and column, the rest 0.
pub(super) fn is_signed_permutation(matrix: &Matrix3<f64>) -> bool {
    let entries = matrix.iter().all(|entry| [-1.0, 0.0, 1.0].contains(entry));
    entries && matrix.transpose() * matrix == Matrix3::identity()
}
