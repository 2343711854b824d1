//! What can go wrong.

use cromosim_spatial::SpatialError;
use thiserror::Error;

/// Why a placement cannot be diagnosed. Each message names the placement.
#[derive(Debug, Error)]
pub enum GapError {
    /// Nothing to compare with.
    #[error(
        "placement {placement}: the IMU has {messages} usable messages, at least {needed} are needed"
    )]
    TooFewMessages {
        /// Name of the placement.
        placement: String,
        /// Messages with finite readings and a stamp of their own.
        messages: usize,
        /// Messages that a diagnosis takes at least.
        needed: usize,
    },
    /// Reference and IMU do not meet in time.
    #[error(
        "placement {placement}: only {overlap_s:.2} s of the IMU's {imu_s:.2} s lie within the reference; at least {needed_s} s are needed: check that both were recorded together and by one clock"
    )]
    NoOverlap {
        /// Name of the placement.
        placement: String,
        /// Time of the IMU's messages that the reference covers, s.
        overlap_s: f64,
        /// From the IMU's first message to its last, s.
        imu_s: f64,
        /// Covered time that a diagnosis takes at least, s.
        needed_s: f64,
    },
    /// Readings that are not numbers.
    #[error("placement {placement}: all readings are NaN or infinite")]
    NotFinite {
        /// Name of the placement.
        placement: String,
    },
    /// A channel that never changes.
    #[error(
        "placement {placement}: {axes} never change; the sensor is stuck or not connected, nothing can be diagnosed"
    )]
    Stuck {
        /// Name of the placement.
        placement: String,
        /// Names of the axes, with commas.
        axes: String,
    },
    /// The reference's poses cannot be used.
    #[error("placement {placement}, reference: {source}")]
    Reference {
        /// Name of the placement.
        placement: String,
        /// What the fit of its trajectory refused.
        source: SpatialError,
    },
}
