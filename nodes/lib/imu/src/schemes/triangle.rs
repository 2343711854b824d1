//! The triangle's full frame: normal and tangents are differentiated as three vectors.
//!
//! The acceleration is the plain second difference of the sensor's position, which moves with the
//! triangle's vertices.

use cromosim_spatial::so3;
use nalgebra::{Matrix3, Vector3};

use super::stencil::Stencil;

/// `hat(w) = R' R^T` by central differences of the rotation matrix.
pub(super) fn angular_velocity(stencil: &Stencil<'_>) -> Vector3<f64> {
    let matrix = |frame: &crate::SensorFrame| {
        frame
            .world_from_sensor
            .rotation
            .to_rotation_matrix()
            .into_inner()
    };
    let derivative: Matrix3<f64> = stencil
        .frames
        .iter()
        .zip(stencil.weights[1])
        .map(|(frame, weight)| matrix(frame) * weight)
        .sum();
    so3::vee(&(derivative * matrix(stencil.centre).transpose()))
}
