//! Ways to differentiate a sensor's frames, one file each.

use std::fmt;
use std::str::FromStr;

use cromosim_spatial::{PoseSmoothing, PoseSource};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use self::stencil::Stencil;
use crate::{ImuError, SensorFrame};

mod normal_tracking;
mod richardson;
mod second_difference;
pub(crate) mod spline;
pub(crate) mod stencil;
mod triangle;

/// A way to get acceleration and angular velocity from frames; h is the frames' interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// Richardson's extrapolation of central differences over five frames; errors O(h^4). Amplifies
    /// jitter the most.
    Richardson,
    /// The paper's baseline: the turning of the skin's normal alone, blind to rotation about it;
    /// central differences, O(h^2).
    NormalTracking,
    /// The triangle's full frame by central differences of its rotation matrix; O(h^2).
    Triangle,
    /// Smoothing quintic splines of position and quaternion, the smoothing chosen from the frames,
    /// at any output rate; O(h^4) for acceleration, O(h^5) for angular velocity.
    Spline,
    /// The same splines, but they follow the motion: much is smoothed at rest, little in a burst, as
    /// the frames around each time ask for; samples state how far they may be off.
    #[default]
    AdaptiveSpline,
    /// Plain second difference of the position and the turn between the neighbours; O(h^2).
    SecondDifference,
}

impl Scheme {
    /// All schemes.
    pub const ALL: [Self; 6] = [
        Self::Richardson,
        Self::NormalTracking,
        Self::Triangle,
        Self::Spline,
        Self::AdaptiveSpline,
        Self::SecondDifference,
    ];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Richardson => "richardson",
            Self::NormalTracking => "normal_tracking",
            Self::Triangle => "triangle",
            Self::Spline => "spline",
            Self::AdaptiveSpline => "adaptive_spline",
            Self::SecondDifference => "second_difference",
        }
    }

    /// What it does, in a line.
    pub fn summary(self) -> &'static str {
        match self {
            Self::Richardson => {
                "extrapolated central differences over five frames; O(h^4), loudest on jitter"
            }
            Self::NormalTracking => {
                "the paper's baseline: the turning of the skin's normal alone; O(h^2)"
            }
            Self::Triangle => "central differences of the skin triangle's rotation; O(h^2)",
            Self::Spline => "smoothing quintic splines, one smoothing for the whole motion",
            Self::AdaptiveSpline => "splines that smooth rest much and bursts little; the default",
            Self::SecondDifference => "plain differences of position and rotation; O(h^2)",
        }
    }

    /// How a spline smooths by this scheme.
    pub(crate) fn smoothing(self, source: PoseSource) -> PoseSmoothing {
        match self {
            Self::AdaptiveSpline => PoseSmoothing::adaptive(source),
            _ => PoseSmoothing::default(),
        }
    }

    /// The scheme as one that estimates at a frame from its neighbours; `None` for the
    /// splines, which are fitted to all frames and have no estimate of a single one.
    pub(crate) fn stencil(self) -> Option<StencilScheme> {
        match self {
            Self::Richardson => Some(StencilScheme::Richardson),
            Self::NormalTracking => Some(StencilScheme::NormalTracking),
            Self::Triangle => Some(StencilScheme::Triangle),
            Self::SecondDifference => Some(StencilScheme::SecondDifference),
            Self::Spline | Self::AdaptiveSpline => None,
        }
    }
}

/// A scheme that estimates at a frame from the frames around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StencilScheme {
    /// [`Scheme::Richardson`].
    Richardson,
    /// [`Scheme::NormalTracking`].
    NormalTracking,
    /// [`Scheme::Triangle`].
    Triangle,
    /// [`Scheme::SecondDifference`].
    SecondDifference,
}

impl StencilScheme {
    /// Frames that an estimate needs after its own frame, and as many before it.
    pub(crate) fn reach(self) -> usize {
        match self {
            Self::Richardson => 2,
            Self::NormalTracking | Self::Triangle | Self::SecondDifference => 1,
        }
    }

    /// Acceleration and angular velocity (world axes) at frame `k` of `frames`; at the ends the
    /// stencil is one-sided and has one frame more.
    pub(crate) fn at_frame(self, frames: &[SensorFrame], k: usize) -> (Vector3<f64>, Vector3<f64>) {
        let stencil = Stencil::new(frames, k, self.reach());
        let angular_velocity = match self {
            Self::NormalTracking => normal_tracking::angular_velocity(&stencil),
            Self::Triangle => triangle::angular_velocity(&stencil),
            Self::SecondDifference => second_difference::angular_velocity(&stencil),
            Self::Richardson => richardson::angular_velocity(&stencil),
        };
        (stencil.acceleration(), angular_velocity)
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl FromStr for Scheme {
    type Err = ImuError;

    fn from_str(name: &str) -> Result<Self, ImuError> {
        Self::ALL
            .into_iter()
            .find(|scheme| scheme.name() == name)
            .ok_or_else(|| ImuError::UnknownScheme {
                name: name.to_owned(),
                known: Self::ALL.map(Self::name).join(", "),
            })
    }
}
