//! `reference_tilt`: the reference's world is not level.

use std::f64::consts::PI;

use cromosim_spatial::so3;
use nalgebra::Vector3;

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};
use crate::GRAVITY_IN_WORLD;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceTilt,
    name: "reference_tilt",
    stage: Stage::Reference,
    summary: "The reference's vertical is not gravity's: the residual's specific force is constant in the world and turns with the segment.",
    remedy: "Level the motion capture's world, or turn the reference by the inverse of this rotation.",
    parameters: &[ParameterSpec {
        name: "rotvec",
        unit: "rad",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -PI,
        upper: PI,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![0.0; 3]]
}

/// Gravity in the reported world, m/s2: `T g`, with T reported world from true world.
pub(super) fn gravity(rotvec: &Vector3<f64>) -> Vector3<f64> {
    so3::exp(rotvec) * GRAVITY_IN_WORLD
}
