//! The paper's baseline: one normal of the skin is tracked.
//!
//! A direction n moves by `n' = w x n`, so `w = n x n'` is all that it tells: the rotation about n
//! itself is lost. Only the angular velocity suffers; acceleration and sensor frame are those of
//! the other schemes.

use nalgebra::Vector3;

use super::stencil::Stencil;

/// `w = n x n'`, n' by central differences.
pub(super) fn angular_velocity(stencil: &Stencil<'_>) -> Vector3<f64> {
    stencil
        .centre
        .normal_in_world
        .cross(&stencil.sum(1, |frame| frame.normal_in_world))
}
