//! The derivative for whose sake a spline is smoothed.

/// The derivative that a spline is meant for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivative {
    /// As an angular velocity is of a rotation.
    First,
    /// As an acceleration is of a position.
    Second,
}

impl Derivative {
    pub(crate) fn order(self) -> usize {
        match self {
            Self::First => 1,
            Self::Second => 2,
        }
    }

    /// Variance of the derivative (per sample interval) that white noise of variance one leaves at
    /// a weight, away from the ends: `1/pi integral of w^2k / (1 + weight w^10)^2 = weight^-a B(a,
    /// 2 - a) / (10 pi)`, a = (2 k + 1) / 10, k the order.
    pub(crate) fn variance(self, weight: f64) -> f64 {
        // a and the beta function B(a, 2 - a) for k = 1 and 2.
        let (a, beta) = match self {
            Self::First => (0.3, 2.718_255_454_215_654),
            Self::Second => (0.5, std::f64::consts::FRAC_PI_2),
        };
        weight.powf(-a) * beta / (10.0 * std::f64::consts::PI)
    }
}
