//! Rotations: exponential and logarithm, angular velocity, series of quaternions.
//!
//! Rotation vectors are axis times angle, rad. `world_from_body` is written q below, and a product
//! acts right to left.
//!
//! [`exp`] and [`log`] are those of nalgebra (`UnitQuaternion::from_scaled_axis`, `scaled_axis`) to
//! within 3e-16 of the angle, from tiny angles to half a turn (measured; a test holds it). They stay
//! because their last bits differ, in one rotation of four and three logarithms of four, and with
//! them every output that is on record; and because nalgebra takes a rotation of less than 4.4e-16
//! rad for none.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::SpatialError;

/// Variance of a rotation vector per axis over the mean of a quaternion's four components: `q = (1, v
/// / 2)` for a small v, so that their sum is 3 / 4 of the former.
pub(crate) const ROTVEC_PER_QUATERNION: f64 = 16.0 / 3.0;
/// Standard deviation of a quaternion's component over that of a rotation vector: the root of 3 /
/// 16.
pub(crate) const QUATERNION_PER_ROTVEC: f64 = 0.433_012_701_892_219_3;

/// Below this square of an angle, rad^2, the series of [`exp`] are exact: their next terms are 1e-19 of
/// the first.
const SERIES_BELOW: f64 = 1e-8;
/// Below this sine of half the angle the arc tangent in [`log`] is its argument, to 1e-16 of it.
const SMALL_SINE: f64 = 1e-8;

/// Rotation of a rotation vector: `q = (cos(|v|/2), sin(|v|/2) v/|v|)`, by its series near zero.
pub fn exp(rotvec: &Vector3<f64>) -> UnitQuaternion<f64> {
    let squared = rotvec.norm_squared();
    let (real, factor) = if squared < SERIES_BELOW {
        (1.0 - squared / 8.0, 0.5 - squared / 48.0)
    } else {
        let angle = squared.sqrt();
        ((0.5 * angle).cos(), (0.5 * angle).sin() / angle)
    };
    UnitQuaternion::new_normalize(Quaternion::from_parts(real, rotvec * factor))
}

/// Rotation vector of a rotation, the shorter way round: `|v| <= pi`.
pub fn log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let imaginary = rotation.imag() * sign;
    let real = rotation.w * sign;
    let sine = imaginary.norm();
    if sine < SMALL_SINE {
        // 2 atan2(s, c) / s = 2/c (1 - s^2 / 3c^2 ...)
        return imaginary * (2.0 / real);
    }
    imaginary * (2.0 * sine.atan2(real) / sine)
}

/// The vector of a matrix's antisymmetric part: the inverse of `v.cross_matrix()`.
pub fn vee(m: &Matrix3<f64>) -> Vector3<f64> {
    0.5 * Vector3::new(m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12)
}

/// Angular velocity in world axes, rad/s, of a quaternion `s` (world_from_body, of any length but
/// zero) with time derivative `s'`: with `q = s/|s|`, `w = 2 vec(q' q*) = 2 vec(s' s*) / |s|^2`
/// (the change of length only enters the real part).
#[inline]
pub fn angular_velocity_in_world(s: &Quaternion<f64>, s_dot: &Quaternion<f64>) -> Vector3<f64> {
    (s_dot * s.conjugate()).imag() * (2.0 / s.norm_squared())
}

/// As [`angular_velocity_in_world`], in body axes: `w = 2 vec(q* q')`.
pub fn angular_velocity_in_body(s: &Quaternion<f64>, s_dot: &Quaternion<f64>) -> Vector3<f64> {
    (s.conjugate() * s_dot).imag() * (2.0 / s.norm_squared())
}

/// Angular acceleration in world axes, rad/s2: the time derivative of
/// [`angular_velocity_in_world`], `alpha = 2 vec(s'' s*) / |s|^2 - w (|s|^2)' / |s|^2` (`s' s'*` is
/// real).
#[inline]
pub fn angular_acceleration_in_world(
    s: &Quaternion<f64>,
    s_dot: &Quaternion<f64>,
    s_ddot: &Quaternion<f64>,
) -> Vector3<f64> {
    let squared = s.norm_squared();
    let growth = 2.0 * s.coords.dot(&s_dot.coords) / squared;
    (s_ddot * s.conjugate()).imag() * (2.0 / squared) - angular_velocity_in_world(s, s_dot) * growth
}

/// The smallest rotation that turns the direction `from` into `to`; where they are opposite, about
/// some axis at right angles to them.
pub fn minimal_rotation(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(from, to).unwrap_or_else(|| {
        // Any axis that is not nearly parallel to `from`.
        let across = if from.x.abs() < 0.7 * from.norm() {
            Vector3::x()
        } else {
            Vector3::y()
        };
        exp(&(from.cross(&across).normalize() * std::f64::consts::PI))
    })
}

/// The quaternions of a series of rotations with signs chosen so that each lies within 90 degrees
/// (on the 3-sphere) of the one before; the first has `w >= 0`. Components are then smooth wherever
/// the rotation is, as long as it turns by under 180 degrees per sample.
pub fn sign_continuous(rotations: &[UnitQuaternion<f64>]) -> Vec<Quaternion<f64>> {
    with_continuous_signs(rotations.iter().copied()).collect()
}

/// As [`sign_continuous`], one after the other.
pub(crate) fn with_continuous_signs(
    rotations: impl Iterator<Item = UnitQuaternion<f64>>,
) -> impl Iterator<Item = Quaternion<f64>> {
    let mut previous = Quaternion::identity();
    rotations.map(move |rotation| {
        let q = rotation.into_inner();
        previous = if q.coords.dot(&previous.coords) < 0.0 {
            -q
        } else {
            q
        };
        previous
    })
}

/// Parses a matrix as a rotation: `|R^T R - I|` (Frobenius) and `|det R - 1|` at most `tolerance`,
/// the rest is projected away.
///
/// # Errors
/// [`SpatialError::NotARotation`], also for NaN.
pub fn rotation_from_matrix(
    matrix: &Matrix3<f64>,
    tolerance: f64,
) -> Result<UnitQuaternion<f64>, SpatialError> {
    let orthogonality_error = (matrix.transpose() * matrix - Matrix3::identity()).norm();
    let determinant = matrix.determinant();
    let near = orthogonality_error <= tolerance && (determinant - 1.0).abs() <= tolerance;
    if !near {
        return Err(SpatialError::NotARotation {
            orthogonality_error,
            determinant,
        });
    }
    Ok(UnitQuaternion::from_matrix(matrix))
}

#[cfg(test)]
#[path = "so3_tests.rs"]
mod tests;
