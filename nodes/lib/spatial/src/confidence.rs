//! The confidence of a pose and the standard deviation of its position, each from the other.

/// Standard deviation per axis at which the confidence is one half, m: about the width of a hand. A
/// convention, not a measurement.
pub const HALF_CONFIDENCE_STD_M: f64 = 0.1;

/// Length by which a position's standard deviation is divided to give that of a rotation, m: that of a
/// limb, which misses by the one at its end when it turns by the other. A convention.
pub const CONFIDENCE_LENGTH_M: f64 = 0.5;

/// Confidence in [0, 1] of a position whose standard deviation per axis is `std_m` (root of a third
/// of the covariance's trace): `c = 1 / (1 + (s / 0.1 m)^2)`. 1 is exact, 0.5 is 10 cm, 0.2 is 20
/// cm, 0 is unknown.
pub fn confidence_of_std(std_m: f64) -> f64 {
    if std_m.is_nan() {
        0.0
    } else {
        1.0 / (1.0 + (std_m / HALF_CONFIDENCE_STD_M).powi(2))
    }
}

/// Standard deviation per axis, m, of a position with this confidence: `s = 0.1 m sqrt(1 / c - 1)`,
/// the inverse of [`confidence_of_std`]. Infinite for 0, and 0 from 1 on.
pub fn std_of_confidence(confidence: f64) -> f64 {
    if confidence > 0.0 {
        HALF_CONFIDENCE_STD_M * (1.0 / confidence - 1.0).max(0.0).sqrt()
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_the_inverse_of_the_other() {
        for std_m in [0.0, 0.001, 0.1, 0.7, 30.0] {
            assert!(
                (std_of_confidence(confidence_of_std(std_m)) - std_m).abs() < 1e-9 * (1.0 + std_m)
            );
        }
        assert_eq!(
            (
                confidence_of_std(0.0),
                confidence_of_std(0.1),
                confidence_of_std(f64::INFINITY)
            ),
            (1.0, 0.5, 0.0)
        );
        assert_eq!(
            (
                std_of_confidence(1.0),
                std_of_confidence(0.0),
                confidence_of_std(f64::NAN)
            ),
            (0.0, f64::INFINITY, 0.0)
        );
    }
}
