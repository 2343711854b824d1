//! How much real IMUs show above what poses resolve.

use cromosim_body::Joint;

/// What an IMU is worn on, as far as its texture goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureSegment {
    /// A foot or shoe.
    Foot,
    /// A lower leg.
    Shank,
    /// An upper leg.
    Thigh,
    /// Pelvis, back and chest.
    Trunk,
    /// The head.
    Head,
    /// Any part of an arm, the hand too.
    Arm,
    /// A rigid thing in the hand.
    Held,
}

/// Density of a channel, mean over its axes, in (m/s2)2/Hz or (rad/s)2/Hz: `exp(level) v^power (f / 20
/// Hz)^-slope`, v the mean square per axis, (m/s2)2 or (rad/s)2, of what the channel reads below 8 Hz
/// in 1.28 s.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChannelTexture {
    level: f64,
    power: f64,
    slope: f64,
    /// The 99th percentile of v in the recordings; beyond it the density grows as v itself.
    most_vigour: f64,
}

/// Below this frequency the density stays what it is there, Hz: the fit begins here.
pub(super) const LOWEST_FITTED_HZ: f64 = 5.0;
/// Above this one nothing is drawn, Hz: the fit ends here.
pub(super) const HIGHEST_FITTED_HZ: f64 = 50.0;
const REFERENCE_HZ: f64 = 20.0;

const fn texture(level: f64, power: f64, slope: f64, most_vigour: f64) -> ChannelTexture {
    ChannelTexture {
        level,
        power,
        slope,
        most_vigour,
    }
}

impl TextureSegment {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Foot,
        Self::Shank,
        Self::Thigh,
        Self::Trunk,
        Self::Head,
        Self::Arm,
        Self::Held,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Foot => "foot",
            Self::Shank => "shank",
            Self::Thigh => "thigh",
            Self::Trunk => "trunk",
            Self::Head => "head",
            Self::Arm => "arm",
            Self::Held => "held",
        }
    }

    /// That of a joint's segment.
    pub fn of_joint(joint: Joint) -> Self {
        match joint {
            Joint::LeftHip | Joint::RightHip => Self::Thigh,
            Joint::LeftKnee | Joint::RightKnee => Self::Shank,
            Joint::LeftAnkle | Joint::RightAnkle | Joint::LeftFoot | Joint::RightFoot => Self::Foot,
            Joint::Pelvis | Joint::Spine1 | Joint::Spine2 | Joint::Spine3 => Self::Trunk,
            Joint::LeftCollar | Joint::RightCollar => Self::Trunk,
            Joint::Neck | Joint::Head => Self::Head,
            Joint::LeftShoulder | Joint::RightShoulder => Self::Arm,
            Joint::LeftElbow | Joint::RightElbow => Self::Arm,
            Joint::LeftWrist | Joint::RightWrist | Joint::LeftHand | Joint::RightHand => Self::Arm,
        }
    }

    /// Of specific force and angular velocity. `python tests/texture/spectra.py DATA` fits them: body-worn
    /// ones to 50 s of one person with 16 IMUs (qmt's example, MIT), feet also to one person's walk (MTw,
    /// MovingReality, MIT), held ones to five trials of BROAD (CC BY 4.0).
    pub(super) fn channels(self) -> [ChannelTexture; 2] {
        match self {
            Self::Foot => [
                texture(-6.05, 1.72, 1.39, 13.82),
                texture(-8.34, 1.57, 2.96, 2.50),
            ],
            Self::Shank => [
                texture(-5.55, 1.58, 2.41, 10.90),
                texture(-5.19, 1.28, 2.61, 4.48),
            ],
            Self::Thigh => [
                texture(-6.38, 1.33, 3.63, 7.24),
                texture(-6.16, 1.40, 4.26, 2.54),
            ],
            Self::Trunk => [
                texture(-7.13, 0.68, 2.55, 3.32),
                texture(-7.34, 1.08, 2.67, 0.39),
            ],
            Self::Head => [
                texture(-7.83, 0.34, 2.46, 10.41),
                texture(-9.55, 0.77, 2.56, 0.55),
            ],
            Self::Arm => [
                texture(-7.75, 0.69, 3.38, 32.38),
                texture(-8.93, 0.77, 4.43, 7.90),
            ],
            Self::Held => [
                texture(-6.23, 0.34, 3.07, 38.53),
                texture(-9.24, 0.35, 5.44, 57.20),
            ],
        }
    }
}

impl ChannelTexture {
    /// Density at a frequency for a vigour of one.
    pub(super) fn density(&self, frequency_hz: f64) -> f64 {
        let frequency_hz = frequency_hz.max(LOWEST_FITTED_HZ);
        (self.level - self.slope * (frequency_hz / REFERENCE_HZ).ln()).exp()
    }

    /// What the density grows by with the vigour.
    pub(super) fn growth(&self, vigour: f64) -> f64 {
        let beyond = (vigour / self.most_vigour).max(1.0);
        vigour.min(self.most_vigour).powf(self.power) * beyond
    }
}
