//! Plain second differences.
//!
//! `p'' = (p[-1] - 2 p[0] + p[1]) / h^2`; the angular velocity is the mean of the turns from and to
//! the neighbours.

use cromosim_spatial::so3;
use nalgebra::Vector3;

use super::stencil::Stencil;

/// `w = (log(R[1] R[0]^-1) - log(R[-1] R[0]^-1)) / 2h`.
pub(super) fn angular_velocity(stencil: &Stencil<'_>) -> Vector3<f64> {
    let centre_inverse = stencil.centre.world_from_sensor.rotation.inverse();
    stencil.sum(1, |frame| {
        so3::log(&(frame.world_from_sensor.rotation * centre_inverse))
    })
}
