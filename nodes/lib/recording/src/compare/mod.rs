//! What differs between two diagnoses, or between the IMUs of two recordings: for people and for
//! programs.

mod diagnoses;
mod recordings;
mod text;

use serde_json::Value;

pub use diagnoses::compare_diagnoses;
pub use recordings::compare_recordings;

use crate::RecordingError;

/// A comparison of A with B.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// For people: lines of text, in SI units.
    pub text: String,
    /// For programs: `kind` (`diagnoses` or `recordings`), `placements`, `only_in_a`, `only_in_b`.
    pub json: Value,
}
