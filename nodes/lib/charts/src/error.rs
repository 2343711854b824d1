//! What can go wrong.

use thiserror::Error;

/// Errors of this crate.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum ChartsError {
    /// A picture of no or of absurd size was asked for.
    #[error("a picture {width_px} pixels wide: at least {least} and at most {most} are possible")]
    Width {
        /// What was asked for.
        width_px: u32,
        /// The least.
        least: u32,
        /// The most.
        most: u32,
    },
    /// The text is no SVG picture.
    #[error("not a picture: {reason}")]
    NotSvg {
        /// What the parser says.
        reason: String,
    },
    /// The pixels could not be written.
    #[error("the picture of {width} by {height} pixels could not be written as PNG: {reason}")]
    Encode {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// What the encoder says.
        reason: String,
    },
}
