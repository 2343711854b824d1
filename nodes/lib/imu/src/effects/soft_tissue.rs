//! `soft_tissue`: the sensor rides on a mass, spring and damper.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::SoftTissue,
    name: "soft_tissue",
    stage: Stage::Tissue,
    summary: "The sensor rides on soft tissue: the specific force rings at the natural frequency after impacts and is damped above it.",
    remedy: "Move the sensor to where bone lies under the skin, tighten the strap, or make the sensor lighter.",
    parameters: &[
        ParameterSpec {
            name: "natural_hz",
            unit: "Hz",
            shape: Shape::Scalar,
            neutral: &[1e4],
            lower: 0.2,
            upper: 1e4,
            step: 1e-3,
        },
        ParameterSpec {
            name: "damping_ratio",
            unit: "",
            shape: Shape::Scalar,
            neutral: &[0.3],
            lower: 0.001,
            upper: 2.0,
            step: 1e-4,
        },
    ],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    [[5.0, 0.3], [9.0, 0.3], [15.0, 0.3]]
        .map(Vec::from)
        .to_vec()
}
