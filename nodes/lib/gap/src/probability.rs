//! How sure a cause is.

use cromosim_imu::{Effect, Search};

use crate::findings::Findings;
use crate::policy::probability::{MARGIN_NATS, MOST, WITHOUT_MARGIN};

/// Probability that an effect named here is there.
///
/// From the margin m [nats] by which the set beats the best set without the effect: `0.95 (1 - 1 /
/// (2 + m / 2))`. What is read off the readings (clipping, rounding, dropped messages, units) has
/// no such margin, but a probability of its own.
pub(crate) fn probability_of(findings: &Findings, effect: &Effect) -> f64 {
    let margin = findings
        .scored
        .margins
        .iter()
        .find(|(kind, _)| *kind == effect.kind())
        .map(|(_, margin)| *margin);
    match (margin, effect.kind().spec().search) {
        (Some(margin), _) => MOST * (1.0 - 1.0 / (2.0 + margin.max(0.0) / MARGIN_NATS)),
        (None, Search::ReadOff(search)) => search.probability,
        (None, Search::Fitted(_) | Search::Choice) => WITHOUT_MARGIN,
    }
}
