//! `reference_scale`: positions of the reference in wrong units of length.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceScale,
    name: "reference_scale",
    stage: Stage::Reference,
    summary: "Positions of the reference are too large or too small: the residual's specific force is proportional to the acceleration, gravity left out.",
    remedy: "Calibrate the motion capture's scale, or divide the reference's positions by this factor.",
    parameters: &[ParameterSpec {
        name: "factor",
        unit: "",
        shape: Shape::Scalar,
        neutral: &[1.0],
        lower: 0.01,
        upper: 100.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![1.0]]
}
