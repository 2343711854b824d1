//! One frame: the pose that explains its markers, by damped Gauss-Newton steps (Levenberg 1944,
//! Marquardt 1963).

use cromosim_body::{BodyPose, JOINT_COUNT};
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};

use super::prior::{HINGES, PosePrior, right_jacobian_inverse};
use super::skin::{Posed, ShapedSkin};

/// Parameters of a pose: root position, and a turn of each joint in its own axes.
pub(super) const POSE: usize = 3 + 3 * JOINT_COUNT;
/// How far a marker is believed to be from its place on the skin, m.
pub(super) const MARKER_SIGMA_M: f64 = 0.003;
/// Steps smaller than this end the iteration, rad and m.
const SMALL_STEP: f64 = 1e-4;
/// How often a step may be refused, each time for a shorter one.
const REFUSALS: usize = 4;

/// A pose that the neighbouring frames make likely.
pub(super) struct Expected {
    pub pose: BodyPose,
    /// 1 / variance of the joints' turns about their axes, 1/rad^2.
    pub turn_precisions: [Vector3<f64>; JOINT_COUNT],
    /// Standard deviation of the root's position, m.
    pub position_sigma_m: f64,
}

/// What stands beside the markers in a frame's cost.
pub(super) struct Terms<'a> {
    pub prior: &'a PosePrior,
    /// Factor on the prior.
    pub prior_weight: f64,
    /// Errors beyond count linearly (Huber), m.
    pub huber_m: f64,
    pub expected: Option<&'a Expected>,
}

/// Half the cost's Hessian (Gauss-Newton, lower triangle) and gradient.
pub(super) struct Normal {
    pub hessian: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

impl Normal {
    pub fn zeros() -> Self {
        Self {
            hessian: DMatrix::zeros(POSE, POSE),
            gradient: DVector::zeros(POSE),
        }
    }

    /// A residual with derivative blocks at parameter offsets; offsets descend but for the first.
    fn add(&mut self, blocks: &[(usize, Matrix3<f64>)], residual: Vector3<f64>, weight: f64) {
        for (index, (offset, block)) in blocks.iter().enumerate() {
            let weighted = block.transpose() * weight;
            let mut part = self.gradient.fixed_rows_mut::<3>(*offset);
            part += weighted * residual;
            for (other_offset, other) in &blocks[..=index] {
                let product = weighted * other;
                // Lower triangle only.
                if offset >= other_offset {
                    let mut part = self.hessian.fixed_view_mut::<3, 3>(*offset, *other_offset);
                    part += product;
                } else {
                    let mut part = self.hessian.fixed_view_mut::<3, 3>(*other_offset, *offset);
                    part += product.transpose();
                }
            }
        }
    }

    /// A turn away from `mean` with a precision about each axis.
    fn add_turn(
        &mut self,
        joint: usize,
        mean: &UnitQuaternion<f64>,
        own: &UnitQuaternion<f64>,
        precisions: Vector3<f64>,
    ) {
        let away = (mean.inverse() * own).scaled_axis();
        let jacobian = right_jacobian_inverse(away);
        let weighted = jacobian.transpose() * Matrix3::from_diagonal(&precisions);
        let mut part = self.gradient.fixed_rows_mut::<3>(3 + 3 * joint);
        part += weighted * away;
        let mut part = self
            .hessian
            .fixed_view_mut::<3, 3>(3 + 3 * joint, 3 + 3 * joint);
        part += weighted * jacobian;
    }
}

/// Cost of an error of `size_m` and the weight of its square in the next step, both per
/// [`MARKER_SIGMA_M`]^2.
pub(super) fn huber(size_m: f64, limit_m: f64) -> (f64, f64) {
    let scale = MARKER_SIGMA_M.powi(-2);
    if size_m <= limit_m {
        (0.5 * size_m * size_m * scale, scale)
    } else {
        (
            limit_m * (size_m - 0.5 * limit_m) * scale,
            limit_m / size_m * scale,
        )
    }
}

/// The derivative blocks of a marker by root position and turns.
pub(super) fn pose_blocks(
    skin: &ShapedSkin<'_>,
    marker: usize,
    posed: &Posed,
    blocks: &mut Vec<(usize, Matrix3<f64>)>,
) {
    blocks.clear();
    blocks.push((0, Matrix3::identity()));
    skin.turn_blocks(marker, posed, |joint, block| {
        blocks.push((3 + 3 * joint, block))
    });
}

/// Markers, prior and expectation.
pub(super) fn normal_equations(
    skin: &ShapedSkin<'_>,
    observed: &[Option<Vector3<f64>>],
    terms: &Terms<'_>,
    pose: &BodyPose,
    posed: &Posed,
) -> Normal {
    let mut normal = Normal::zeros();
    let mut blocks = Vec::with_capacity(1 + JOINT_COUNT);
    for (marker, seen) in observed.iter().enumerate() {
        let Some(seen) = seen else { continue };
        let residual = posed.markers[marker] - seen;
        pose_blocks(skin, marker, posed, &mut blocks);
        normal.add(&blocks, residual, huber(residual.norm(), terms.huber_m).1);
    }
    for (joint, own) in pose.local_rotations.iter().enumerate() {
        normal.add_turn(
            joint,
            &terms.prior.means[joint],
            own,
            terms.prior.precisions[joint] * terms.prior_weight,
        );
        if let Some(expected) = terms.expected {
            normal.add_turn(
                joint,
                &expected.pose.local_rotations[joint],
                own,
                expected.turn_precisions[joint],
            );
        }
    }
    for hinge in &HINGES {
        let (over, row, precision) = hinge.overstretch(&pose.local_rotations[hinge.joint]);
        let mut part = normal.gradient.fixed_rows_mut::<3>(3 + 3 * hinge.joint);
        part += row * (precision * over);
        let mut part = normal
            .hessian
            .fixed_view_mut::<3, 3>(3 + 3 * hinge.joint, 3 + 3 * hinge.joint);
        part += row * row.transpose() * precision;
    }
    if let Some(expected) = terms.expected {
        let weight = expected.position_sigma_m.powi(-2);
        normal.add(
            &[(0, Matrix3::identity())],
            pose.root_position - expected.pose.root_position,
            weight,
        );
    }
    normal
}

/// What [`normal_equations`] is the derivative of.
pub(super) fn cost(
    observed: &[Option<Vector3<f64>>],
    terms: &Terms<'_>,
    pose: &BodyPose,
    posed: &Posed,
) -> f64 {
    let marker_cost = |(seen, marker): (&Option<Vector3<f64>>, &Vector3<f64>)| {
        seen.map_or(0.0, |seen| huber((marker - seen).norm(), terms.huber_m).0)
    };
    let markers: f64 = observed.iter().zip(&posed.markers).map(marker_cost).sum();
    let mut turns = 0.0;
    for (joint, own) in pose.local_rotations.iter().enumerate() {
        let away = (terms.prior.means[joint].inverse() * own).scaled_axis();
        turns += 0.5
            * terms.prior_weight
            * away
                .component_mul(&away)
                .dot(&terms.prior.precisions[joint]);
        if let Some(expected) = terms.expected {
            let away = (expected.pose.local_rotations[joint].inverse() * own).scaled_axis();
            turns += 0.5
                * away
                    .component_mul(&away)
                    .dot(&expected.turn_precisions[joint]);
        }
    }
    for hinge in &HINGES {
        let (over, _, precision) = hinge.overstretch(&pose.local_rotations[hinge.joint]);
        turns += 0.5 * precision * over * over;
    }
    let root = terms.expected.map_or(0.0, |expected| {
        0.5 * (pose.root_position - expected.pose.root_position).norm_squared()
            / expected.position_sigma_m.powi(2)
    });
    markers + turns + root
}

/// The pose a step away.
pub(super) fn stepped(pose: &BodyPose, step: &DVector<f64>) -> BodyPose {
    let part = |offset: usize| Vector3::new(step[offset], step[offset + 1], step[offset + 2]);
    BodyPose {
        root_position: pose.root_position + part(0),
        local_rotations: std::array::from_fn(|joint| {
            UnitQuaternion::new_normalize(
                (pose.local_rotations[joint]
                    * UnitQuaternion::from_scaled_axis(part(3 + 3 * joint)))
                .into_inner(),
            )
        }),
    }
}

/// `hessian` with its diagonal enlarged by the damping, and by a trace where nothing is known.
pub(super) fn damped(hessian: &DMatrix<f64>, damping: f64) -> DMatrix<f64> {
    let mut damped = hessian.clone();
    for index in 0..damped.nrows() {
        damped[(index, index)] += damping * hessian[(index, index)] + 1e-6;
    }
    damped
}

/// Improves `pose` by at most `steps` steps; returns it with its cost.
pub(super) fn solve(
    skin: &ShapedSkin<'_>,
    observed: &[Option<Vector3<f64>>],
    terms: &Terms<'_>,
    mut pose: BodyPose,
    steps: usize,
) -> (BodyPose, f64) {
    let mut posed = skin.posed(&pose);
    let mut least = cost(observed, terms, &pose, &posed);
    let mut damping = 1e-4;
    for _ in 0..steps {
        let normal = normal_equations(skin, observed, terms, &pose, &posed);
        let mut improved = false;
        for _ in 0..=REFUSALS {
            let step = damped(&normal.hessian, damping)
                .cholesky()
                .map(|cholesky| -cholesky.solve(&normal.gradient));
            if let Some(step) = step {
                if step.amax() < SMALL_STEP {
                    return (pose, least);
                }
                let next = stepped(&pose, &step);
                let next_posed = skin.posed(&next);
                let next_cost = cost(observed, terms, &next, &next_posed);
                if next_cost <= least {
                    (pose, posed, least, improved) = (next, next_posed, next_cost, true);
                    damping = f64::max(damping / 10.0, 1e-6);
                    break;
                }
            }
            damping *= 30.0;
        }
        if !improved {
            break;
        }
    }
    (pose, least)
}
