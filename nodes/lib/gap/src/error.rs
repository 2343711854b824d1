//! What can go wrong.

use cromosim_spatial::SpatialError;
use thiserror::Error;

/// Errors of this crate. Each names the placement.
#[derive(Debug, Error)]
pub enum GapError {
    /// Nothing to compare with.
    #[error(
        "placement {placement}: the IMU has {messages} usable messages, at least {needed} are needed"
    )]
    TooFewMessages {
        /// Name.
        placement: String,
        /// How many there are.
        messages: usize,
        /// How many it takes.
        needed: usize,
    },
    /// Reference and IMU do not meet in time.
    #[error(
        "placement {placement}: only {overlap_s:.2} s of the IMU's {imu_s:.2} s lie within the reference; at least {needed_s} s are needed: check that both were recorded together and by one clock"
    )]
    NoOverlap {
        /// Name.
        placement: String,
        /// Common time, s.
        overlap_s: f64,
        /// The IMU's length, s.
        imu_s: f64,
        /// What it takes, s.
        needed_s: f64,
    },
    /// Readings that are not numbers.
    #[error("placement {placement}: all readings are NaN or infinite")]
    NotFinite {
        /// Name.
        placement: String,
    },
    /// A channel that never changes.
    #[error(
        "placement {placement}: {axes} never change; the sensor is stuck or not connected, nothing can be diagnosed"
    )]
    Stuck {
        /// Name.
        placement: String,
        /// Which axes.
        axes: String,
    },
    /// The reference's poses cannot be used.
    #[error("placement {placement}, reference: {source}")]
    Reference {
        /// Name.
        placement: String,
        /// Why.
        source: SpatialError,
    },
}
