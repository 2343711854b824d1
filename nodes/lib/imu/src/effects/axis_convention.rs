//! `axis_convention`: the device names its axes otherwise.

use nalgebra::Matrix3;

use super::search::Search;
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind};
use crate::{Channel, EffectError};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::AxisConvention,
    name: "axis_convention",
    stage: Stage::Sensor,
    owner: Owner::Device,
    summary: "The device's axes are swapped or turned in sign: both channels are the simulated ones with axes exchanged.",
    remedy: "Map the driver's axes to the sensor's drawing.",
    parameters: &[ParameterSpec {
        name: "matrix",
        unit: "",
        shape: Shape::Matrix3,
        neutral: &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        is_optional: false,
        lower: -1.0,
        upper: 1.0,
        fit: None,
    }],
    channels: &Channel::ALL,
    search: Search::Choice,
};

/// The orders in which three axes may stand.
pub const AXIS_ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// The signed permutation next to a matrix: of all assignments of axes the one with the greatest
/// sum of magnitudes, with the signs of its entries.
pub fn nearest_signed_permutation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let score = |order: &[usize; 3]| {
        (0..3)
            .map(|row| matrix[(row, order[row])].abs())
            .sum::<f64>()
    };
    let best = AXIS_ORDERS
        .into_iter()
        .max_by(|a, b| score(a).total_cmp(&score(b)))
        .unwrap_or(AXIS_ORDERS[0]);
    let mut permutation = Matrix3::zeros();
    for (row, column) in best.into_iter().enumerate() {
        permutation[(row, column)] = if matrix[(row, column)] < 0.0 {
            -1.0
        } else {
            1.0
        };
    }
    permutation
}

impl Effect {
    /// A device with axes exchanged: `matrix` is device_from_sensor.
    ///
    /// # Errors
    /// [`EffectError`] for what is no signed permutation.
    pub fn axis_convention(matrix: &Matrix3<f64>) -> Result<Self, EffectError> {
        let rows = matrix.transpose();
        effect(rows.as_slice().to_vec())
    }
}

/// The effect of a matrix, row by row, that has to be a signed permutation.
pub(super) fn effect(values: Vec<f64>) -> Result<Effect, EffectError> {
    let effect = SPEC.effect(values)?;
    if !is_signed_permutation(&effect.matrix()) {
        return Err(EffectError::Malformed {
            effect: SPEC.name,
            field: "matrix".to_owned(),
            expected: "a signed permutation: one 1 or -1 in each row and column",
        });
    }
    Ok(effect)
}

/// One 1 or -1 in each row and column, the rest 0.
fn is_signed_permutation(matrix: &Matrix3<f64>) -> bool {
    let entries = matrix.iter().all(|entry| [-1.0, 0.0, 1.0].contains(entry));
    entries && matrix.transpose() * matrix == Matrix3::identity()
}
