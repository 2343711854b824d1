//! How sure a cause is.

use cromosim_imu::{Effect, EffectKind, Search};

use crate::confounding::is_calibration;
use crate::diagnosis::{Cause, UNKNOWN};
use crate::findings::Findings;
use crate::policy::probability::{
    Calibration, MARGIN_NATS, MOST, NAMED, OF_UNKNOWN, WITHOUT_MARGIN,
};

/// Probability that an effect named here is there, by its margin alone.
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
        (None, Search::Fitted(_) | Search::Choice | Search::Given) => WITHOUT_MARGIN,
    }
}

/// References whose own errors pass for effects.
const POOR_REFERENCES: [EffectKind; 3] = [
    EffectKind::ReferenceNoise,
    EffectKind::ReferenceSmoothing,
    EffectKind::ReferenceInterpolation,
];
/// Causes beside one that count at most: of more than three the generator of these answers never had.
const MOST_OTHERS: usize = 2;

/// From what the margins say of each cause to what has come true of such causes: the log-odds
/// `base + share log10(gap_share) + others (causes beside it) + poor_reference + takes_up_unknown +
/// margin (logit(p) - logit(0.95))`, the last where p, by the margin, is below 0.95.
pub(crate) fn calibrate(causes: &mut [Cause]) {
    let names: Vec<String> = causes.iter().map(|cause| cause.effect.clone()).collect();
    for cause in causes {
        let of: &Calibration = if cause.effect == UNKNOWN {
            &OF_UNKNOWN
        } else {
            &NAMED
        };
        let is_beside = |kind: &EffectKind| {
            kind.name() != cause.effect && names.iter().any(|name| name == kind.name())
        };
        let poor_reference = f64::from(u8::from(POOR_REFERENCES.iter().any(is_beside)));
        let takes_up = is_calibration_of(&cause.effect) && names.iter().any(|name| name == UNKNOWN);
        let takes_up = f64::from(u8::from(takes_up));
        let others = (names.len() - 1).min(MOST_OTHERS) as f64;
        let by_margin = cause.probability_by_margin.clamp(1e-4, of.sure);
        let log_odds = of.base
            + of.share * cause.gap_share.max(of.least_share).log10()
            + of.others * others
            + of.poor_reference * poor_reference
            + of.takes_up_unknown * takes_up
            + of.margin * (logit(by_margin) - logit(0.95));
        cause.probability = 1.0 / (1.0 + (-log_odds).exp());
    }
}

pub(crate) fn is_calibration_of(name: &str) -> bool {
    EffectKind::from_name(name).is_some_and(is_calibration)
}

fn logit(probability: f64) -> f64 {
    (probability / (1.0 - probability)).ln()
}
