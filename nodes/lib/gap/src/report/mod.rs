//! A diagnosis as one HTML page: what is wrong, how sure that is, and how it looks; all in one
//! file, with nothing to load.

mod causes;
mod figures;
mod location;
mod magnetometer;
mod markup;
mod page;
mod recordings;
mod state;
#[cfg(test)]
mod tests;
mod text;

use std::collections::BTreeMap;

use crate::diagnosis::{Diagnosis, PlacementDiagnosis};
use crate::evidence::Evidence;
use state::State;

/// The page. `evidence` is by placement; a placement without any has no pictures. The same input
/// gives the same bytes.
pub fn html(diagnosis: &Diagnosis, evidence: &BTreeMap<String, Evidence>, title: &str) -> String {
    let mut placements: Vec<(&String, &PlacementDiagnosis)> = diagnosis.placements.iter().collect();
    // What needs attention first; by name among equals.
    placements.sort_by_key(|(name, placement)| (State::new(placement), *name));
    page::page(&placements, evidence, title)
}
