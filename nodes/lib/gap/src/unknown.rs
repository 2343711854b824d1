//! Whether what is left is noise.

use crate::Place;
use crate::diagnose::Findings;

/// Structure that no named effect explains.
#[derive(Clone, Debug)]
pub(crate) struct Unknown {
    pub place: Place,
    pub channel: String,
    pub axes: Vec<String>,
    pub depends_on: String,
    pub probability: f64,
}

/// Looks for structure in the whitened residual.
pub(crate) fn look(findings: &Findings) -> Option<Unknown> {
    let _ = findings;
    None
}
