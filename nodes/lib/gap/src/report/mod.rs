//! A diagnosis as one HTML page: what is wrong, how sure that is, and how it looks; all in one
//! file, with nothing to load.

mod causes;
mod figures;
mod page;
mod place;
#[cfg(test)]
mod tests;
mod text;

use std::collections::BTreeMap;

use crate::{Diagnosis, Evidence, PlacementDiagnosis};

/// How a placement stands, the most urgent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum State {
    /// Something is left that no effect explains.
    Unexplained,
    /// There is a gap, and its causes are named.
    Explained,
    /// Nothing beyond the noise.
    NoGap,
}

impl State {
    pub(crate) fn of(placement: &PlacementDiagnosis) -> Self {
        if placement.unexplained.significant
            || placement
                .causes
                .iter()
                .any(|cause| cause.effect == "unknown")
        {
            Self::Unexplained
        } else if placement.causes.is_empty() {
            Self::NoGap
        } else {
            Self::Explained
        }
    }

    fn class(self) -> &'static str {
        match self {
            Self::Unexplained => "bad",
            Self::Explained => "warn",
            Self::NoGap => "good",
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Unexplained => "partly unexplained",
            Self::Explained => "gap explained",
            Self::NoGap => "no gap",
        }
    }
}

/// The page. `evidence` is by placement; a placement without any has no pictures. The same input
/// gives the same bytes.
pub fn html(diagnosis: &Diagnosis, evidence: &BTreeMap<String, Evidence>, title: &str) -> String {
    let mut placements: Vec<(&String, &PlacementDiagnosis)> = diagnosis.placements.iter().collect();
    // What needs attention first; by name among equals.
    placements.sort_by_key(|(name, placement)| (State::of(placement), *name));
    page::page(&placements, evidence, title)
}
