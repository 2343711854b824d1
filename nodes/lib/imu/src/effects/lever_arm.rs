//! `lever_arm`: the sensor sits beside the reference frame.

use nalgebra::Vector3;

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::LeverArm,
    name: "lever_arm",
    stage: Stage::Segment,
    summary: "The sensor sits away from the reference frame: the residual's specific force follows the square of the angular velocity and its derivative.",
    remedy: "Measure the sensor's position on its segment and enter it in the placement.",
    parameters: &[ParameterSpec {
        name: "offset",
        unit: "m",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        lower: -5.0,
        upper: 5.0,
        step: 1e-5,
    }],
    random: false,
    continuous: true,
    starts,
};

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    vec![vec![0.0; 3]]
}

/// `alpha x l + w x (w x l)`, m/s2, all in segment axes.
#[inline]
pub(super) fn acceleration(
    offset: &Vector3<f64>,
    angular_velocity: &Vector3<f64>,
    angular_acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    angular_acceleration.cross(offset) + angular_velocity.cross(&angular_velocity.cross(offset))
}
