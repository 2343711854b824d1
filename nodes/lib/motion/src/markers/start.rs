//! A frame without a frame before it: the trunk's markers give the root, falling weights of the
//! prior the rest.

use cromosim_body::{BodyPose, Joint};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::frame::{Terms, solve};
use super::prior::PosePrior;
use super::skin::ShapedSkin;

/// Weight of the prior, where errors begin to count linearly (m), steps.
const STAGES: [(f64, f64, usize); 5] = [
    (4.0, 0.5, 10),
    (1.0, 0.1, 8),
    (0.25, 0.03, 8),
    (0.25, 0.01, 6),
    (0.25, 0.003, 6),
];

/// Which markers move with the trunk.
pub(super) fn trunk_markers(joints: &[Joint]) -> Vec<bool> {
    use Joint::{LeftCollar, LeftHip, Neck, Pelvis, RightCollar, RightHip, Spine1, Spine2, Spine3};
    joints
        .iter()
        .map(|joint| {
            [
                Pelvis,
                Spine1,
                Spine2,
                Spine3,
                Neck,
                LeftCollar,
                RightCollar,
                LeftHip,
                RightHip,
            ]
            .contains(joint)
        })
        .collect()
}

/// `pose` moved and turned as a whole so that its trunk's markers lie nearest to those seen; all
/// markers serve where fewer than three of the trunk's are seen. `None` where there are fewer than
/// three in all.
pub(super) fn placed(
    skin: &ShapedSkin<'_>,
    observed: &[Option<Vector3<f64>>],
    trunk: &[bool],
    pose: &BodyPose,
) -> Option<BodyPose> {
    let mut pose = pose.clone();
    (pose.root_position, pose.local_rotations[0]) = (Vector3::zeros(), UnitQuaternion::identity());
    let model = skin.posed(&pose).markers;
    let pairs = |only_trunk: bool| -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let chosen = |index: &usize| !only_trunk || trunk[*index];
        (0..model.len())
            .filter(chosen)
            .filter_map(|index| Some((model[index], observed[index]?)))
            .collect()
    };
    let trunk_pairs = pairs(true);
    let pairs = if trunk_pairs.len() >= 3 {
        trunk_pairs
    } else {
        pairs(false)
    };
    if pairs.len() < 3 {
        return None;
    }
    let (turn, shift) = fit_rigid(&pairs)?;
    (pose.root_position, pose.local_rotations[0]) = (shift, turn);
    Some(pose)
}

/// The rotation R and shift t that minimise the sum of squares of `R a + t - b` over pairs `(a, b)`
/// of points (Kabsch 1976); `None` where the singular values do not converge.
pub fn fit_rigid(
    pairs: &[(Vector3<f64>, Vector3<f64>)],
) -> Option<(UnitQuaternion<f64>, Vector3<f64>)> {
    let count = pairs.len() as f64;
    let mean_a = pairs.iter().map(|pair| pair.0).sum::<Vector3<f64>>() / count;
    let mean_b = pairs.iter().map(|pair| pair.1).sum::<Vector3<f64>>() / count;
    let product: Matrix3<f64> = pairs
        .iter()
        .map(|(a, b)| (b - mean_b) * (a - mean_a).transpose())
        .sum();
    let svd = product.try_svd(true, true, 1e-12, 200)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    Some((turn, mean_b - turn * mean_a))
}

/// The pose of a frame from nothing but its markers; `others` are poses seen elsewhere in the
/// recording, tried where the prior's mean leads nowhere. `None` with fewer than three markers.
pub(super) fn cold_start(
    skin: &ShapedSkin<'_>,
    observed: &[Option<Vector3<f64>>],
    trunk: &[bool],
    prior: &PosePrior,
    others: &[BodyPose],
) -> Option<BodyPose> {
    let from = |pose: &BodyPose| {
        let mut found = (placed(skin, observed, trunk, pose)?, f64::MAX);
        for (prior_weight, huber_m, steps) in STAGES {
            found = solve(
                skin,
                observed,
                &Terms {
                    prior,
                    prior_weight,
                    huber_m,
                    expected: None,
                },
                found.0,
                steps,
            );
        }
        Some(found)
    };
    let mut best = from(&prior.mean_pose())?;
    for other in others {
        if error(skin, observed, &best.0) < GOOD_M {
            break;
        }
        if let Some(found) = from(other).filter(|found| found.1 < best.1) {
            best = found;
        }
    }
    Some(best.0)
}

/// Largest error of a marker in a frame that counts as found, m.
const GOOD_M: f64 = 0.02;

/// Largest distance of a marker seen from where the body has it, m.
fn error(skin: &ShapedSkin<'_>, observed: &[Option<Vector3<f64>>], pose: &BodyPose) -> f64 {
    let markers = skin.posed(pose).markers;
    let distances = observed
        .iter()
        .zip(&markers)
        .filter_map(|(seen, marker)| Some((marker - (*seen)?).norm()));
    distances.fold(0.0, f64::max)
}
