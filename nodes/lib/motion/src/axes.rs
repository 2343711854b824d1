//! The up axis of a file, and rotations between directions.

use nalgebra::{Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};
use serde::Deserialize;

/// The direction that points up in the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// Found from where the head is over the feet.
    #[default]
    Detect,
    /// x is up.
    X,
    /// y is up, as in most BVH files.
    Y,
    /// z is up.
    Z,
}

impl UpAxis {
    /// The direction in the file's axes; `None` for `Detect`.
    pub fn direction(self) -> Option<Vector3<f64>> {
        match self {
            Self::Detect => None,
            Self::X => Some(Vector3::x()),
            Self::Y => Some(Vector3::y()),
            Self::Z => Some(Vector3::z()),
        }
    }
}

/// The rotation whose x axis is `x` and whose y axis is `y` made perpendicular to it. Identity
/// where the two are parallel or zero.
pub(crate) fn frame_of(x: Vector3<f64>, y: Vector3<f64>) -> UnitQuaternion<f64> {
    let z = x.cross(&y);
    match (x.try_normalize(1e-12), z.try_normalize(1e-12)) {
        (Some(x), Some(z)) => {
            let columns = Matrix3::from_columns(&[x, z.cross(&x), z]);
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
        }
        _ => UnitQuaternion::identity(),
    }
}

/// The smallest rotation that takes the direction `from` to the direction `to`; about some
/// perpendicular axis where they are opposite, identity where one is zero.
pub(crate) fn minimal_rotation(from: Vector3<f64>, to: Vector3<f64>) -> UnitQuaternion<f64> {
    let (Some(from), Some(to)) = (from.try_normalize(1e-12), to.try_normalize(1e-12)) else {
        return UnitQuaternion::identity();
    };
    UnitQuaternion::rotation_between(&from, &to).unwrap_or_else(|| {
        let other = if from.x.abs() < 0.8 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        UnitQuaternion::from_axis_angle(
            &Unit::new_normalize(from.cross(&other)),
            std::f64::consts::PI,
        )
    })
}

/// Angle between two directions, rad; 0 where one is zero.
pub(crate) fn angle_between(left: Vector3<f64>, right: Vector3<f64>) -> f64 {
    left.cross(&right).norm().atan2(left.dot(&right))
}

/// The signed coordinate axis nearest to a direction.
pub(crate) fn nearest_axis(direction: Vector3<f64>) -> Vector3<f64> {
    let axis = direction.iamax();
    Vector3::ith(axis, direction[axis].signum())
}

/// `+y` for the axis nearest to a direction.
pub(crate) fn axis_name(direction: Vector3<f64>) -> String {
    let axis = direction.iamax();
    format!(
        "{}{}",
        if direction[axis] < 0.0 { '-' } else { '+' },
        ['x', 'y', 'z'][axis]
    )
}
