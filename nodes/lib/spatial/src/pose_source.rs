//! Where poses come from: what noise is expected of them, and what no smoothing can see of their errors.

use crate::adaptive::{ExpectedNoise, STATED_AT_HZ};
use crate::so3::QUATERNION_PER_ROTVEC;
use crate::{Bandwidth, Jitter, LowPassed, SampleVariance};

/// Where poses come from, which says what their errors are like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PoseSource {
    /// Tracked, as they are: their noise is white and shows in them.
    #[default]
    Tracked,
    /// Fitted to markers and smoothed before they were handed out, as AMASS: what is left of their
    /// noise looks like motion.
    Fitted,
    /// Of a suit of IMUs: orientations drift.
    InertialSuit,
    /// Estimated from a video: body and place are slowly off.
    Video,
}

/// Errors that wander: two first-order lags behind white noise, standard deviation along or about
/// each axis.
#[derive(Clone, Copy, Debug)]
struct SlowError {
    size: f64,
    /// Of each lag, s.
    memory_s: f64,
}

impl SlowError {
    const NONE: Self = Self {
        size: 0.0,
        memory_s: 1.0,
    };

    /// Of its first derivative.
    fn slope_variance(self) -> f64 {
        (self.size / self.memory_s).powi(2)
    }

    /// Of its second derivative below a cutoff: its density `8 s^2 T / (1 + w^2 T^2)^2` times w^4 is
    /// level beyond the memory.
    fn bend_variance(self, cutoff_hz: f64) -> f64 {
        8.0 * self.size.powi(2) / self.memory_s.powi(3) * cutoff_hz
    }
}

/// What a low-pass of second order, run both ways, has left of the errors of fitted poses: root mean square
/// over sizes of 0.5 to 1.5 mm and 0.2 to 0.5 degrees and corners of 6 to 10 Hz, uniform in their logarithms,
/// those that `evaluate fidelity` draws for marker fits.
const FITTED_POSITION_M: f64 = 0.95e-3;
const FITTED_ROTATION_DEG: f64 = 0.34;
const FITTED_CORNER_HZ: f64 = 8.1;

/// Slow errors of a video's poses: `size (jitter / own)^power` of position, m, and rotation, rad, jitter in 100 Hz's
/// terms. An estimator that scatters more is farther off, and so are segments at the end of a chain of joints. Fitted by
/// gamma likelihood and to means of one to what VIBE's and WHAM's errors leave of a sensor, on the motions of `tests/physics`
/// 1.12 and 0.9 times as fast and other draws of the errors than the studies' of `evaluate fidelity`: of all sensors 10 degrees and
/// 0.125 m were stated before, which is 3 times too much at a pelvis by WHAM.
const VIDEO_POSITION: ByJitter = ByJitter {
    size: 0.139,
    own: 9.1e-3,
    power: 0.75,
    within: [2e-3, 50e-3],
};
const VIDEO_ROTATION: ByJitter = ByJitter {
    size: 0.1815,
    own: 0.0319,
    power: 1.0 / 3.0,
    within: [2e-3, 0.1],
};

/// What grows with the jitter.
#[derive(Clone, Copy, Debug)]
struct ByJitter {
    /// At a jitter of `own`.
    size: f64,
    own: f64,
    power: f64,
    /// Jitter beyond is taken for these: poses that were smoothed show none. No source.
    within: [f64; 2],
}

impl ByJitter {
    fn size(self, jitter_variance: f64) -> f64 {
        let jitter = jitter_variance.sqrt().clamp(self.within[0], self.within[1]);
        self.size * (jitter / self.own).powf(self.power)
    }
}

impl PoseSource {
    /// All sources.
    pub const ALL: [Self; 4] = [Self::Tracked, Self::Fitted, Self::InertialSuit, Self::Video];

    /// The name in parameters.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracked => "tracked",
            Self::Fitted => "fitted",
            Self::InertialSuit => "inertial_suit",
            Self::Video => "video",
        }
    }

    /// The noise of position, m, and of a quaternion's component.
    ///
    /// Tracked: of the size that optical capture has, 0.3 mm and 0.1 degrees; the count was chosen
    /// among 0.003 to 0.1 on seeds 300 to 347 of `tests/bursts`, which scores others too, and on ten
    /// trials of a tracked IMU (BROAD). Suits and video show their white noise, as what is tracked.
    /// Fitted: a low-pass has left [`FITTED_POSITION_M`] and [`FITTED_ROTATION_DEG`]; the count was chosen
    /// among 0.03 to 1 on the motions of `tests/physics` with other paces, forces and sways.
    pub(crate) fn expected(self) -> [ExpectedNoise; 2] {
        let (sizes, count, low_passed) = match self {
            Self::Fitted => {
                let own = LowPassed {
                    corner_hz: FITTED_CORNER_HZ,
                };
                let sizes = [FITTED_POSITION_M, FITTED_ROTATION_DEG.to_radians()];
                let white = sizes.map(|size| own.white_std(size, STATED_AT_HZ));
                (white, 0.3, Some(own))
            }
            Self::Tracked | Self::InertialSuit | Self::Video => {
                ([3e-4, 0.1_f64.to_radians()], 0.01, None)
            }
        };
        let [position, rotation] = sizes;
        [position, rotation * QUATERNION_PER_ROTVEC].map(|std| ExpectedNoise {
            std,
            count,
            low_passed,
        })
    }

    /// What slow errors of position, m, and rotation, rad, are like: root mean square over the sizes
    /// that `evaluate fidelity` draws.
    ///
    /// Fitted: 2 to 5 mm and 0.5 to 1.5 degrees. Suit: 10 to 20 mm, and a drift of 1 to 3 degrees that
    /// magnetometer and contact pull back. Video: by the jitter, [`VIDEO_POSITION`] and [`VIDEO_ROTATION`].
    /// Tracked: none is known of.
    fn slow_errors(self, jitter: &Jitter) -> [SlowError; 2] {
        let slow = |size, memory_s| SlowError { size, memory_s };
        match self {
            Self::Tracked => [SlowError::NONE; 2],
            Self::Fitted => [slow(3.4e-3, 0.7), slow(0.95_f64.to_radians(), 0.7)],
            Self::InertialSuit => [slow(0.0147, 0.7), slow(1.91_f64.to_radians(), 4.0)],
            Self::Video => [
                slow(VIDEO_POSITION.size(jitter.position), 0.7),
                slow(VIDEO_ROTATION.size(jitter.rotation), 0.7),
            ],
        }
    }

    /// What errors that look like motion leave in samples of this bandwidth, from poses with this jitter, beside those
    /// that are learnt from the poses.
    #[inline]
    pub fn unseen_errors(self, bandwidth: &Bandwidth, jitter: &Jitter) -> SampleVariance {
        let [position, rotation] = self.slow_errors(jitter);
        unseen(
            position.bend_variance(bandwidth.acceleration_hz),
            rotation.slope_variance(),
            rotation.size.powi(2),
        )
    }
}

fn unseen(acceleration: f64, angular_velocity: f64, orientation: f64) -> SampleVariance {
    SampleVariance {
        acceleration,
        angular_velocity,
        orientation,
        unseen: [acceleration, angular_velocity],
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const BANDWIDTH: Bandwidth = Bandwidth {
        acceleration_hz: 10.0,
        angular_velocity_hz: 10.0,
    };

    #[test]
    fn nothing_is_known_of_beyond_what_tracked_poses_show() {
        let found = PoseSource::Tracked.unseen_errors(&BANDWIDTH, &jitter(1.0));
        assert_eq!(found, SampleVariance::default());
    }

    /// So many times that at which the sizes are stated.
    fn jitter(times: f64) -> Jitter {
        Jitter {
            position: (times * VIDEO_POSITION.own).powi(2),
            rotation: (times * VIDEO_ROTATION.own).powi(2),
        }
    }

    #[test]
    fn a_video_that_scatters_less_is_less_off_and_never_without_error() {
        let stated = |times| PoseSource::Video.unseen_errors(&BANDWIDTH, &jitter(times));
        let [usual, eighth, none] = [1.0, 0.125, 0.0].map(stated);
        assert!((usual.orientation.sqrt() - 0.1815).abs() < 1e-9);
        assert!((eighth.orientation.sqrt() - 0.5 * 0.1815).abs() < 1e-9);
        assert!(none.orientation > 0.0 && none.acceleration > 0.0);
        assert!(none.acceleration < usual.acceleration / 8.0);
    }

    /// Sums over the spectra of the errors themselves.
    #[test]
    fn variances_are_those_of_the_spectra() {
        let hz = |k: usize| 0.002 * (k as f64 + 0.5);
        let sum = |density: &dyn Fn(f64) -> f64| {
            (0..100_000).map(|k| 0.002 * density(hz(k))).sum::<f64>()
        };
        let slow = SlowError {
            size: 2.0,
            memory_s: 0.7,
        };
        let own = |f: f64| 8.0 * 4.0 * 0.7 / (1.0 + (TAU * f * 0.7).powi(2)).powi(2);
        assert!((sum(&own) / 4.0 - 1.0).abs() < 0.01);
        let slopes = sum(&|f| (TAU * f).powi(2) * own(f));
        assert!(
            (slopes / slow.slope_variance() - 1.0).abs() < 0.01,
            "{slopes}"
        );
        let passed = |f: f64| (1.0 + (f / 10.0).powi(10)).powi(-2);
        let bends = sum(&|f| (TAU * f).powi(4) * own(f) * passed(f));
        assert!(
            (bends / slow.bend_variance(10.0) - 1.0).abs() < 0.15,
            "{bends}"
        );
    }
}
