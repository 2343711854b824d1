//! `soft_tissue`: the sensor rides on a mass, spring and damper.

use super::residual_view::ResidualView;
use super::search::{FirstGuess, FittedSearch, Kept, Search};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind, EffectSet};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::SoftTissue,
    name: "soft_tissue",
    stage: Stage::Tissue,
    owner: Owner::Device,
    summary: "The sensor rides on soft tissue: the specific force rings at the natural frequency after impacts and is damped above it.",
    remedy: "Move the sensor to where bone lies under the skin, tighten the strap, or make the sensor lighter.",
    parameters: &[
        ParameterSpec {
            name: "natural_hz",
            unit: "Hz",
            shape: Shape::Scalar,
            neutral: &[1e4],
            is_optional: false,
            lower: 0.2,
            upper: 1e4,
            fit: Some(ParameterFit {
                step: 1e-3,
                prior_deviation: 20.0,
            }),
        },
        ParameterSpec {
            name: "damping_ratio",
            unit: "",
            shape: Shape::Scalar,
            neutral: &[0.3],
            is_optional: false,
            lower: 0.001,
            upper: 2.0,
            fit: Some(ParameterFit {
                step: 1e-4,
                prior_deviation: 0.5,
            }),
        },
    ],
    channels: &[Channel::Accelerometer],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::FromResidual(starts),
        companion: None,
        is_plausible,
        ordinary: None,
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[],
        identifiability: None,
    }),
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    [[5.0, 0.3], [9.0, 0.3], [15.0, 0.3]]
        .map(Vec::from)
        .to_vec()
}

/// Stiffest tissue that is one, Hz. Without a measurement on record: markers on legs ring at 23 to
/// 51 Hz, but a reference that was smoothed looks like such a tissue.
const STIFFEST_HZ: f64 = 22.0;
/// Damping ratios of tissue.
const DAMPING_RATIOS: std::ops::RangeInclusive<f64> = 0.04..=1.5;

fn is_plausible(effect: &Effect, _: &EffectSet) -> bool {
    let (natural_hz, damping_ratio) = (effect.scalar(0), effect.scalar(1));
    natural_hz <= STIFFEST_HZ && DAMPING_RATIOS.contains(&damping_ratio)
}
