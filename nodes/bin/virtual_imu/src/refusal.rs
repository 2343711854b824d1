//! What the node does not take.

use cromosim_body::BodyError;
use cromosim_imu::ImuError;
use cromosim_learned::LearnedError;
use cromosim_msgs::NotABody;
use cromosim_spatial::Stamp;

/// Why a state was left out.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The state is no body.
    #[error(transparent)]
    State(#[from] NotABody),
    /// The shape does not suit the body.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A state of the same time has been there.
    #[error("a second state at {} ns", .0.nanos)]
    Repeated(Stamp),
    /// A frame cannot be used.
    #[error(transparent)]
    Imu(#[from] ImuError),
    /// Networks or a mapping that cannot be used.
    #[error(transparent)]
    Learned(#[from] LearnedError),
    /// A source of poses that there is not.
    #[error(
        "parameter 'pose_source': `{0}`; expected tracked, fitted, inertial_suit, video or nothing"
    )]
    Source(String),
    /// A mapping for other placements.
    #[error("mapping {file}: it names {known}, none of the placements")]
    Unmapped {
        /// The file.
        file: String,
        /// The placements that it names.
        known: String,
    },
}
