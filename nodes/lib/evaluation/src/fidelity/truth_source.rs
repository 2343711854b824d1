//! What the measured side of a study rests on.

use serde::{Deserialize, Serialize};

/// Where readings come from that simulated ones are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TruthSource {
    /// Drawn devices on what `Scheme::Spline` makes of a clip at its true motion, as
    /// `WearerRanges::draw` of `cromosim_learned` has them: such truth moves only as that spline can.
    OwnSpline,
    /// A real IMU, whose clock and mount are fitted to what `Scheme::Spline` makes of the poses.
    MeasuredBesideSpline,
    /// A real IMU, whose clock and mount are fitted for each method alike.
    Measured,
    /// A physics engine's accelerations and angular velocities.
    Physics,
    /// Derivatives of motions that are closed forms.
    ClosedForm,
}

impl TruthSource {
    /// As tables say it; marked where it does not rank `spline`.
    pub fn title(self) -> &'static str {
        match self {
            Self::OwnSpline => "our spline of the clip †",
            Self::MeasuredBesideSpline => "measured; clock and mount by our spline",
            Self::Measured => "measured",
            Self::Physics => "physics",
            Self::ClosedForm => "closed form",
        }
    }
}

/// What † means, below tables.
pub(super) const MARK_EXPLAINED: &str = "† The measured side was made by `spline`, of the clip without errors of a source. Such a row says how a source's errors come through, but \
     does not rank `spline`, nor the networks that were trained on top of it and on such truth, against other simulators; `adaptive_spline` is of the \
     same family. The studies of rigid bodies rank them.";
