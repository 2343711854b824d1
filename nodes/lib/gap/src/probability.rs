//! How sure a cause is.

use cromosim_imu::{Effect, EffectKind};

use crate::diagnose::Findings;

/// Of the fitted effects that were certain by their margin, so many were right on withheld cases:
/// what no model of the library describes imitates one of its effects now and then, whatever the
/// margin.
const MOST: f64 = 0.95;

/// Probability that an effect named here is there.
///
/// From the margin m [nats] by which the set beats the best set without the effect: `0.95 (1 - 1 /
/// (2 + m / 2))`. What is read off the readings (clipping, rounding, dropped messages, units) has
/// no such margin.
pub(crate) fn of(findings: &Findings, effect: &Effect) -> f64 {
    let margin = findings
        .state
        .margins
        .iter()
        .find(|(kind, _)| *kind == effect.kind())
        .map(|(_, margin)| *margin);
    match (margin, effect.kind()) {
        (Some(margin), _) => MOST * (1.0 - 1.0 / (2.0 + margin.max(0.0) / 2.0)),
        (None, EffectKind::ReferenceSmoothing) => 0.9,
        (None, EffectKind::AccelNoise | EffectKind::GyroNoise | EffectKind::ReferenceNoise) => 0.95,
        (None, _) => 0.98,
    }
}
