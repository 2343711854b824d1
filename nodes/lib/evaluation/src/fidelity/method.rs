//! The simulators that are compared.

use serde::{Deserialize, Serialize};

/// A way from a motion to readings. A further one gets a variant here, a place in [`Method::ALL`],
/// a title, and its kinematics in `Case::kinematics`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The skeleton's joint in place of the skin, as IMUTube has it; the scheme of `Analytic`.
    Joint,
    /// Splines of position and rotation, smoothed as IMUSim smooths.
    Imusim,
    /// The skin's frame by Richardson's extrapolation: the paper's analytic simulator.
    Analytic,
    /// Splines that choose one smoothing for a clip: what the networks rest on.
    Spline,
    /// The same splines with a smoothing that follows the motion: the suite's default scheme.
    AdaptiveSpline,
    /// The networks on top of the spline.
    Learned,
    /// The networks, then the distribution mapping.
    Mapped,
    /// What networks would leave that say exactly what was measured: the errors of the source's
    /// orientation, which they do not touch.
    Perfect,
}

impl Method {
    /// All, in the order of the tables.
    pub const ALL: [Self; 8] = [
        Self::Joint,
        Self::Imusim,
        Self::Analytic,
        Self::Spline,
        Self::AdaptiveSpline,
        Self::Learned,
        Self::Mapped,
        Self::Perfect,
    ];

    /// Whether it is `spline`, or networks that were trained on top of it: what truth that the same
    /// spline made does not rank.
    pub fn is_of_spline(self) -> bool {
        matches!(self, Self::Spline | Self::Learned | Self::Mapped)
    }

    /// The name in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::Joint => "joint (IMUTube)",
            Self::Imusim => "IMUSim-like",
            Self::Analytic => "analytic (Richardson)",
            Self::Spline => "spline",
            Self::AdaptiveSpline => "adaptive_spline",
            Self::Learned => "learned",
            Self::Mapped => "learned, mapped",
            Self::Perfect => "(perfect networks)",
        }
    }
}
