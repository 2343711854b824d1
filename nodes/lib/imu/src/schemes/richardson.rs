//! Richardson's extrapolation of central differences, fourth order.
//!
//! With D(h) the central difference, (4 D(h) - D(2h)) / 3: for even frames `p'' = (-p[-2] + 16
//! p[-1] - 30 p[0] + 16 p[1] - p[2]) / (12 h^2)` and `f' = (f[-2] - 8 f[-1] + 8 f[1] - f[2]) / (12
//! h)`. On uneven frames the stencil is that of the polynomial through the five frames, which is
//! the same thing where they are even.

use cromosim_spatial::so3;
use nalgebra::Vector3;

use super::stencil::Stencil;

/// First derivative of `log(R(t) R(t_k)^-1)`: it is the angular velocity at t_k, since the
/// logarithm's Jacobian is the identity there.
pub(super) fn angular_velocity(stencil: &Stencil<'_>) -> Vector3<f64> {
    let centre_inverse = stencil.centre.world_from_sensor.rotation.inverse();
    stencil.sum(1, |frame| {
        so3::log(&(frame.world_from_sensor.rotation * centre_inverse))
    })
}
