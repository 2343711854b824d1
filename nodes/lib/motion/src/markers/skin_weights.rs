//! The skin weights of a body's vertices, which no body file is asked for.

use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, JOINT_COUNT, Joint, ShapedBody};
use nalgebra::{UnitQuaternion, Vector3};

use crate::MotionError;

/// Shape coefficients of which one is 1 and the others are 0.
pub(super) fn unit(beta: usize) -> Vec<f64> {
    let mut betas = vec![0.0; beta + 1];
    betas[beta] = 1.0;
    betas
}

/// Skin weights of vertices, read off the body's motion: between two shapes in the same pose the
/// pose corrections are the same, so that, with one joint turned by R, `v(beta) - v(0) - d = W (R -
/// I) (d - D)`: d and D are how shape moves the vertex and the joint at rest, and W sums the
/// weights of the joint and all beyond it. Half turns about three axes and up to ten shapes give W
/// by least squares.
pub(super) fn skin_weights(
    body: &Arc<BodyModel>,
    vertices: &[u32],
) -> Result<Vec<Vec<(usize, f64)>>, MotionError> {
    let mean = ShapedBody::new(body.clone(), &[])?;
    let still = mean.subset(vertices)?;
    let (_, directions) = body.joint_shape_directions();
    let mut products = vec![[(0.0, 0.0); JOINT_COUNT]; vertices.len()];
    for (beta, joint_directions) in directions.iter().enumerate().take(10) {
        let shape = ShapedBody::new(body.clone(), &unit(beta))?;
        let moved = shape.subset(vertices)?;
        for joint in 0..JOINT_COUNT {
            for axis in 0..3 {
                let turn =
                    UnitQuaternion::from_scaled_axis(Vector3::ith(axis, std::f64::consts::PI));
                let mut pose = BodyPose::rest(Vector3::zeros());
                pose.local_rotations[joint] = turn;
                let (with, without) = (moved.positions(&pose), still.positions(&pose));
                // Poses hold the pelvis in place, shapes move it.
                for (index, &vertex) in vertices.iter().enumerate() {
                    let rest = shape.rest_vertices()[vertex as usize]
                        - mean.rest_vertices()[vertex as usize];
                    let pelvis = joint_directions[0];
                    let measured = with[index] - without[index] - (rest - pelvis);
                    let lever = rest - joint_directions[joint];
                    let expected = turn * lever - lever;
                    products[index][joint].0 += expected.dot(&measured);
                    products[index][joint].1 += expected.norm_squared();
                }
            }
        }
    }
    Ok(products.iter().map(own_weights).collect())
}

/// The joints' own weights of a vertex from `(expected . measured, expected^2)` of each joint.
fn own_weights(products: &[(f64, f64); JOINT_COUNT]) -> Vec<(usize, f64)> {
    let sums =
        products.map(|(measured, square)| if square > 0.0 { measured / square } else { 0.0 });
    let own = |joint: Joint| {
        let beyond = joint
            .children()
            .map(|child| sums[child.index()])
            .sum::<f64>();
        (joint.index(), sums[joint.index()] - beyond)
    };
    // What rounding leaves is a thousand times smaller.
    Joint::ALL
        .map(own)
        .into_iter()
        .filter(|(_, weight)| weight.abs() > 1e-7)
        .collect()
}
