//! Errors of poses.

use cromosim_spatial::{CONFIDENCE_LENGTH_M, std_of_confidence};

/// Standard deviations of a frame's error, along and about each axis. Errors of frames dt apart
/// have the correlation `exp(-(dt / correlation_s)^2 / 2)`; none at all with 0, the worst case for
/// derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseStd {
    /// m; infinite where the place is not known.
    pub position_m: f64,
    /// rad; infinite where the rotation is not known.
    pub rotation_rad: f64,
    /// How long errors hold, s.
    pub correlation_s: f64,
}

impl PoseStd {
    /// No error, or none that is known of.
    pub const NONE: Self = Self {
        position_m: 0.0,
        rotation_rad: 0.0,
        correlation_s: 0.0,
    };

    /// That of a message's confidence: `s = 0.1 m sqrt(1 / c - 1)` and `s / 0.5 m` in rad. NaN says
    /// nothing of errors, 0 that nothing is known.
    pub fn from_confidence(confidence: f64, correlation_s: f64) -> Self {
        let position_m = if confidence.is_nan() {
            0.0
        } else {
            std_of_confidence(confidence)
        };
        Self {
            position_m,
            rotation_rad: position_m / CONFIDENCE_LENGTH_M,
            correlation_s,
        }
    }
}
