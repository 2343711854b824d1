//! Shape coefficients from bone lengths.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::{BodyModel, JOINT_COUNT, Joint};

/// How well a bone length is known, m: skeletons put their joints about a centimetre apart. No source
/// for the number.
const LENGTH_SIGMA_M: f64 = 0.01;
/// Largest beta, standard deviations: of a thousand people three lie beyond it in one beta.
const LARGEST_BETA: f64 = 3.0;
/// Lengths are nearly linear in betas: the steps halve the remaining error many times over.
const STEPS: usize = 4;

/// Lengths that differ by more from the mean body's, once that has the source's size, are no
/// property of the person: the skeletons put their joints at different places (Daz figures have
/// their shoulder joints a third nearer to the spine). No source for the number.
const LARGEST_DEPARTURE: f64 = 0.2;

/// A length of the skeleton and its measure in the source, m.
type Target = (Length, f64);
/// A length of the skeleton: between two points, each the middle of one or two joints.
type Length = ([Joint; 2], [Joint; 2]);

const LENGTHS: [Length; 11] = [
    (
        [Joint::LeftHip, Joint::LeftHip],
        [Joint::LeftKnee, Joint::LeftKnee],
    ),
    (
        [Joint::RightHip, Joint::RightHip],
        [Joint::RightKnee, Joint::RightKnee],
    ),
    (
        [Joint::LeftKnee, Joint::LeftKnee],
        [Joint::LeftAnkle, Joint::LeftAnkle],
    ),
    (
        [Joint::RightKnee, Joint::RightKnee],
        [Joint::RightAnkle, Joint::RightAnkle],
    ),
    (
        [Joint::LeftShoulder, Joint::LeftShoulder],
        [Joint::LeftElbow, Joint::LeftElbow],
    ),
    (
        [Joint::RightShoulder, Joint::RightShoulder],
        [Joint::RightElbow, Joint::RightElbow],
    ),
    (
        [Joint::LeftElbow, Joint::LeftElbow],
        [Joint::LeftWrist, Joint::LeftWrist],
    ),
    (
        [Joint::RightElbow, Joint::RightElbow],
        [Joint::RightWrist, Joint::RightWrist],
    ),
    (
        [Joint::LeftHip, Joint::LeftHip],
        [Joint::RightHip, Joint::RightHip],
    ),
    (
        [Joint::LeftShoulder, Joint::LeftShoulder],
        [Joint::RightShoulder, Joint::RightShoulder],
    ),
    (
        [Joint::LeftHip, Joint::RightHip],
        [Joint::Neck, Joint::Neck],
    ),
];

/// A shape found from bone lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeFit {
    /// The body's shape coefficients, standard deviations.
    pub betas: Vec<f64>,
    /// Root mean square of the differences that remain, m.
    pub length_rms_m: f64,
}

impl BodyModel {
    /// This body's betas for a person whose joints at rest are known: those that minimise sum
    /// ((length(beta) - person's) / sigma)^2 + |beta|^2 over 11 lengths (thighs, shanks, arms,
    /// hips, shoulders, trunk; sigma 1 cm) by Gauss-Newton steps, each a linear least-squares
    /// problem, since joints are linear in betas.
    ///
    /// `joint` gives a rest joint's position in any frame, `None` where the source has none;
    /// `metres_per_unit` scales it. This is how a person whom a motion file describes by betas of
    /// another body, or not at all, comes to this body.
    pub fn fit_bone_lengths(
        &self,
        joint: impl Fn(Joint) -> Option<Vector3<f64>>,
        metres_per_unit: f64,
    ) -> ShapeFit {
        let (mean, directions) = self.joint_shape_directions();
        let targets = targets(joint, metres_per_unit, &mean);
        let shaped = |betas: &DVector<f64>| -> [Vector3<f64>; JOINT_COUNT] {
            std::array::from_fn(|joint| {
                mean[joint]
                    + directions
                        .iter()
                        .zip(betas.iter())
                        .map(|(d, beta)| d[joint] * *beta)
                        .sum::<Vector3<f64>>()
            })
        };
        let mut betas = DVector::zeros(directions.len());
        for _ in 0..STEPS {
            let joints = shaped(&betas);
            step(&mut betas, &joints, &directions, &targets);
        }
        ShapeFit {
            length_rms_m: remaining(&shaped(&betas), &targets),
            betas: betas.iter().copied().collect(),
        }
    }

    /// The mean body for that person, all betas 0, and the differences that remain; arguments as of
    /// [`Self::fit_bone_lengths`].
    pub fn mean_for_bone_lengths(
        &self,
        joint: impl Fn(Joint) -> Option<Vector3<f64>>,
        metres_per_unit: f64,
    ) -> ShapeFit {
        let (mean, directions) = self.joint_shape_directions();
        let length_rms_m = remaining(&mean, &targets(joint, metres_per_unit, &mean));
        ShapeFit {
            betas: vec![0.0; directions.len()],
            length_rms_m,
        }
    }
}

/// The person's lengths, m.
fn targets(
    joint: impl Fn(Joint) -> Option<Vector3<f64>>,
    metres_per_unit: f64,
    mean: &[Vector3<f64>; JOINT_COUNT],
) -> Vec<Target> {
    let lengths = LENGTHS.into_iter().filter_map(|(from, to)| {
        let middle = |[left, right]: [Joint; 2]| Some((joint(left)? + joint(right)?) / 2.0);
        Some((
            (from, to),
            (middle(to)? - middle(from)?).norm() * metres_per_unit,
        ))
    });
    without_conventions(lengths.collect(), mean)
}

/// Root mean square of the lengths' differences, m.
fn remaining(joints: &[Vector3<f64>; JOINT_COUNT], targets: &[Target]) -> f64 {
    let squares: f64 = targets
        .iter()
        .map(|&(length, target)| (span(joints, length).norm() - target).powi(2))
        .sum();
    (squares / targets.len().max(1) as f64).sqrt()
}

/// One Gauss-Newton step of the betas, which are then held within [`LARGEST_BETA`].
fn step(
    betas: &mut DVector<f64>,
    joints: &[Vector3<f64>; JOINT_COUNT],
    directions: &[[Vector3<f64>; JOINT_COUNT]],
    targets: &[Target],
) {
    let residuals = DVector::from_iterator(
        targets.len(),
        targets
            .iter()
            .map(|&(length, target)| (target - span(joints, length).norm()) / LENGTH_SIGMA_M),
    );
    let jacobian = DMatrix::from_fn(targets.len(), directions.len(), |row, beta| {
        let length = targets[row].0;
        span(joints, length)
            .normalize()
            .dot(&span(&directions[beta], length))
            / LENGTH_SIGMA_M
    });
    let normal = jacobian.tr_mul(&jacobian) + DMatrix::identity(directions.len(), directions.len());
    let gradient = jacobian.tr_mul(&residuals) - &*betas;
    // The identity makes the matrix positive definite; only NaN keeps it from being factored.
    let Some(cholesky) = normal.cholesky() else {
        return;
    };
    *betas += cholesky.solve(&gradient);
    betas.apply(|beta| *beta = beta.clamp(-LARGEST_BETA, LARGEST_BETA));
}

/// From one end of a length to the other.
fn span(joints: &[Vector3<f64>; JOINT_COUNT], (from, to): Length) -> Vector3<f64> {
    let middle = |[left, right]: [Joint; 2]| (joints[left.index()] + joints[right.index()]) / 2.0;
    middle(to) - middle(from)
}

/// Leaves out the lengths that no person has: see [`LARGEST_DEPARTURE`].
fn without_conventions(targets: Vec<Target>, mean: &[Vector3<f64>; JOINT_COUNT]) -> Vec<Target> {
    let theirs: f64 = targets.iter().map(|(_, target)| target).sum();
    let ours: f64 = targets
        .iter()
        .map(|(length, _)| span(mean, *length).norm())
        .sum();
    let departure = |&(length, target): &Target| {
        (target * ours / (theirs * span(mean, length).norm()) - 1.0).abs()
    };
    targets
        .into_iter()
        .filter(|target| departure(target) <= LARGEST_DEPARTURE)
        .collect()
}
