//! What is stated of a sample: how far it may be off, and up to which frequency it is resolved.

/// Variances, along or about each axis, that errors of the poses leave in a sample; 0 where none
/// are known of, infinite where the sample rests on poses that are not known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleVariance {
    /// (m/s2)2.
    pub acceleration: f64,
    /// (rad/s)2.
    pub angular_velocity: f64,
    /// Of the body's orientation, rad2.
    pub orientation: f64,
    /// What of the first two is not learnt from the poses around: motion beyond the bandwidth, what a source or a tracker's
    /// smoothing hides, and what noise leaves beyond what white noise would; below 0 where less motion is beyond than the
    /// smoothing expects.
    pub unseen: [f64; 2],
}

/// Up to which frequency a sample resolves the motion: where the smoothing's response is one half,
/// at most half the rate of the poses, Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bandwidth {
    /// Of the acceleration.
    pub acceleration_hz: f64,
    /// Of the angular velocity.
    pub angular_velocity_hz: f64,
}

/// Variances of the poses' noise along or about each axis, as white noise of the same density has them at 100 Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jitter {
    /// m2.
    pub position: f64,
    /// rad2.
    pub rotation: f64,
}

impl SampleVariance {
    /// The larger of each: two statements about the same errors.
    #[must_use]
    #[inline]
    pub fn larger(self, other: Self) -> Self {
        let of_larger = |own: f64, others: f64, k: usize| {
            let larger = if own < others { other } else { self };
            larger.unseen[k]
        };
        Self {
            unseen: [
                of_larger(self.acceleration, other.acceleration, 0),
                of_larger(self.angular_velocity, other.angular_velocity, 1),
            ],
            acceleration: self.acceleration.max(other.acceleration),
            angular_velocity: self.angular_velocity.max(other.angular_velocity),
            orientation: self.orientation.max(other.orientation),
        }
    }

    /// The sum of each: of errors that know nothing of each other.
    #[must_use]
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        Self {
            unseen: [0, 1].map(|k| self.unseen[k] + other.unseen[k]),
            acceleration: self.acceleration + other.acceleration,
            angular_velocity: self.angular_velocity + other.angular_velocity,
            orientation: self.orientation + other.orientation,
        }
    }
}
