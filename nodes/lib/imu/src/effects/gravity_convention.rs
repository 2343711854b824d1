//! `gravity_convention`: what a device calls acceleration.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::GravityConvention,
    name: "gravity_convention",
    stage: Stage::Segment,
    summary: "The device reports acceleration without gravity, or with gravity's sign turned: the residual is one or two g along the vertical.",
    remedy: "Switch the driver to specific force (+g upwards at rest, as REP-145 asks), or convert the readings.",
    parameters: &[ParameterSpec {
        name: "mode",
        unit: "",
        // What the contract asks for comes first, so that a neutral value exists.
        shape: Shape::Choice(&["kept", "removed", "negated"]),
        neutral: &[0.0],
        lower: 0.0,
        upper: 2.0,
        step: 1.0,
    }],
    random: false,
    continuous: false,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![1.0], vec![2.0]]
}

/// c in `f = R^T (a - c g)`: 1 kept, 0 removed, -1 negated.
pub(super) fn gravity_factor(mode: f64) -> f64 {
    1.0 - mode
}
