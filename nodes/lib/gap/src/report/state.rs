//! How a placement stands.

use crate::diagnosis::{PlacementDiagnosis, UNKNOWN};

/// How a placement stands, the most urgent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum State {
    /// Something is left that no effect explains.
    Unexplained,
    /// There is a gap, and its causes are named.
    Explained,
    /// Nothing beyond the noise.
    NoGap,
}

impl State {
    pub(super) fn new(placement: &PlacementDiagnosis) -> Self {
        if placement.unexplained.significant
            || placement.causes.iter().any(|cause| cause.effect == UNKNOWN)
        {
            Self::Unexplained
        } else if placement.causes.is_empty() {
            Self::NoGap
        } else {
            Self::Explained
        }
    }

    /// Class of its mark on the page.
    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Unexplained => "bad",
            Self::Explained => "warn",
            Self::NoGap => "good",
        }
    }

    /// What the mark says.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Unexplained => "partly unexplained",
            Self::Explained => "gap explained",
            Self::NoGap => "no gap",
        }
    }
}
