//! Errors of this crate.

use thiserror::Error;

/// Errors of this crate. `index` counts samples from zero.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SpatialError {
    /// Too few samples for the operation.
    #[error("{got} samples given, at least {needed} needed")]
    TooFewSamples {
        /// Number of samples given.
        got: usize,
        /// Number of samples needed.
        needed: usize,
    },
    /// A time equals the one before it or goes backwards.
    #[error(
        "sample {index}: time {next} s does not come after {previous} s; sort the samples and drop duplicates"
    )]
    TimeNotIncreasing {
        /// Index of the later sample.
        index: usize,
        /// Time of the sample before it, s.
        previous: f64,
        /// Its own time, s.
        next: f64,
    },
    /// A NaN or an infinity.
    #[error("sample {index}: {what} is not finite")]
    NotFinite {
        /// Index of the sample.
        index: usize,
        /// What is not finite: "time", "value" …
        what: &'static str,
    },
    /// Two series that belong together differ in length.
    #[error("{what}: expected {expected} entries, found {found}")]
    LengthMismatch {
        /// Name of the second series.
        what: &'static str,
        /// Entries of the first series.
        expected: usize,
        /// Entries of the second.
        found: usize,
    },
    /// A matrix that is not a rotation.
    #[error(
        "the matrix is not a rotation: |R^T R - I| = {orthogonality_error:.3e}, det R = {determinant:.6}; its columns must be orthonormal and right-handed"
    )]
    NotARotation {
        /// Frobenius norm of `R^T R - I`.
        orthogonality_error: f64,
        /// det R, 1 for a rotation.
        determinant: f64,
    },
    /// A rate that is zero, negative or not finite.
    #[error("a rate of {rate_hz} Hz; give a positive one")]
    BadRate {
        /// The rate given, Hz.
        rate_hz: f64,
    },
    /// More samples than fit into memory.
    #[error(
        "{count:.3e} samples at {rate_hz} Hz; at most {limit:.0e} are made at once: lower the rate or cut the motion"
    )]
    TooManyStamps {
        /// Number of samples that it would be.
        count: f64,
        /// Most samples that are made at once.
        limit: f64,
        /// The rate given, Hz.
        rate_hz: f64,
    },
    /// A smoothing weight that is negative or not finite.
    #[error("a smoothing weight of {weight}; give zero or a positive number")]
    BadWeight {
        /// The weight as given, no unit.
        weight: f64,
    },
    /// A distance from the samples that is negative or not finite.
    #[error("a distance of {std} from the samples; give zero or a positive number")]
    BadDistance {
        /// The distance given, in the samples' unit.
        std: f64,
    },
    /// The normal equations are numerically singular: the times are too unevenly spaced.
    #[error(
        "the spline's equations are singular at sample {index}: intervals of very different lengths; split the series at its gaps"
    )]
    Singular {
        /// Row at which the factorisation broke down.
        index: usize,
    },
}
