//! Shape coefficients from bone lengths.

use std::sync::Arc;

use cromosim_body::{BodyModel, JOINT_COUNT, Joint};
use nalgebra::{DMatrix, DVector, Vector3};

use super::rest::Rest;
use crate::skeleton_map::BoundMap;

/// How well a bone length is known, m: skeletons put their joints up to a centimetre or so apart.
const LENGTH_SIGMA_M: f64 = 0.01;
/// Shapes beyond are no shapes of people, standard deviations.
const LARGEST_BETA: f64 = 3.0;
/// Lengths are nearly linear in betas: the steps halve the remaining error many times over.
const STEPS: usize = 4;

/// Lengths that differ by more from the mean body's, once that has the source's size, are no property of the person: the skeletons put their
/// joints at different places (Daz figures have their shoulder joints a third nearer to the spine).
const LARGEST_DEPARTURE: f64 = 0.2;

/// A length of the skeleton and its measure in the source, m.
type Target = (Length, f64);
/// A length of the skeleton: between two points, each the middle of one or two joints.
type Length = ([Joint; 2], [Joint; 2]);

const LENGTHS: [Length; 11] = [
    ([Joint::LeftHip, Joint::LeftHip], [Joint::LeftKnee, Joint::LeftKnee]),
    ([Joint::RightHip, Joint::RightHip], [Joint::RightKnee, Joint::RightKnee]),
    ([Joint::LeftKnee, Joint::LeftKnee], [Joint::LeftAnkle, Joint::LeftAnkle]),
    ([Joint::RightKnee, Joint::RightKnee], [Joint::RightAnkle, Joint::RightAnkle]),
    ([Joint::LeftShoulder, Joint::LeftShoulder], [Joint::LeftElbow, Joint::LeftElbow]),
    ([Joint::RightShoulder, Joint::RightShoulder], [Joint::RightElbow, Joint::RightElbow]),
    ([Joint::LeftElbow, Joint::LeftElbow], [Joint::LeftWrist, Joint::LeftWrist]),
    ([Joint::RightElbow, Joint::RightElbow], [Joint::RightWrist, Joint::RightWrist]),
    ([Joint::LeftHip, Joint::LeftHip], [Joint::RightHip, Joint::RightHip]),
    ([Joint::LeftShoulder, Joint::LeftShoulder], [Joint::RightShoulder, Joint::RightShoulder]),
    ([Joint::LeftHip, Joint::RightHip], [Joint::Neck, Joint::Neck]),
];

/// Betas that minimise sum ((length(beta) - source's) / sigma)^2 + |beta|^2 by Gauss-Newton steps (each a linear least-squares problem;
/// joints are linear in betas), and the root mean square of the remaining differences in m.
pub(super) fn fit_betas(map: &BoundMap, rest: &Rest, body: &Arc<BodyModel>, unit_scale_m: f64) -> (Vec<f64>, f64) {
    let (mean, directions) = body.joint_shape_directions();
    let targets: Vec<Target> = LENGTHS
        .into_iter()
        .filter_map(|(from, to)| {
            let middle = |[left, right]: [Joint; 2]| Some((rest.joint(map, left)? + rest.joint(map, right)?) / 2.0);
            Some(((from, to), (middle(to)? - middle(from)?).norm() * unit_scale_m))
        })
        .collect();
    let targets = without_conventions(targets, &mean);
    let shaped = |betas: &DVector<f64>| -> [Vector3<f64>; JOINT_COUNT] {
        std::array::from_fn(|joint| {
            mean[joint] + directions.iter().zip(betas.iter()).map(|(d, beta)| d[joint] * *beta).sum::<Vector3<f64>>()
        })
    };
    let mut betas = DVector::zeros(directions.len());
    for _ in 0..STEPS {
        let joints = shaped(&betas);
        let residuals = DVector::from_iterator(
            targets.len(),
            targets.iter().map(|&(length, target)| (target - span(&joints, length).norm()) / LENGTH_SIGMA_M),
        );
        let jacobian = DMatrix::from_fn(targets.len(), directions.len(), |row, beta| {
            let length = targets[row].0;
            span(&joints, length).normalize().dot(&span(&directions[beta], length)) / LENGTH_SIGMA_M
        });
        let normal = jacobian.tr_mul(&jacobian) + DMatrix::identity(directions.len(), directions.len());
        let gradient = jacobian.tr_mul(&residuals) - &betas;
        // The identity makes the matrix positive definite.
        let Some(cholesky) = normal.cholesky() else { break };
        betas += cholesky.solve(&gradient);
        betas.apply(|beta| *beta = beta.clamp(-LARGEST_BETA, LARGEST_BETA));
    }
    let joints = shaped(&betas);
    let squares: f64 = targets.iter().map(|&(length, target)| (span(&joints, length).norm() - target).powi(2)).sum();
    let rms_m = (squares / targets.len().max(1) as f64).sqrt();
    (betas.iter().copied().collect(), rms_m)
}

/// From one end of a length to the other.
fn span(joints: &[Vector3<f64>; JOINT_COUNT], (from, to): Length) -> Vector3<f64> {
    let middle = |[left, right]: [Joint; 2]| (joints[left.index()] + joints[right.index()]) / 2.0;
    middle(to) - middle(from)
}

/// Leaves out the lengths that no person has: see [`LARGEST_DEPARTURE`].
fn without_conventions(targets: Vec<Target>, mean: &[Vector3<f64>; JOINT_COUNT]) -> Vec<Target> {
    let theirs: f64 = targets.iter().map(|(_, target)| target).sum();
    let ours: f64 = targets.iter().map(|(length, _)| span(mean, *length).norm()).sum();
    let departure = |&(length, target): &Target| (target * ours / (theirs * span(mean, length).norm()) - 1.0).abs();
    targets.into_iter().filter(|target| departure(target) <= LARGEST_DEPARTURE).collect()
}
