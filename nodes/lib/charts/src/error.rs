//! Errors of this crate.

use thiserror::Error;

/// Errors of this crate.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum ChartsError {
    /// A picture of no or of absurd size was asked for.
    #[error("a picture {width_px} pixels wide: at least {least} and at most {most} are possible")]
    Width {
        /// The width that was asked for, pixels.
        width_px: u32,
        /// The least width, pixels.
        least: u32,
        /// The largest width, pixels.
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
        /// Width of the picture, pixels.
        width: u32,
        /// Height of the picture, pixels.
        height: u32,
        /// What the encoder says.
        reason: String,
    },
}
