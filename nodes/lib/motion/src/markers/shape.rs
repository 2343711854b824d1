//! The person: shape coefficients and where the markers are stuck, from a few frames at once.
//!
//! Minimised over shape, placements and the poses of all chosen frames. The poses are eliminated
//! frame by frame (Schur complement), so that a step costs one factorisation of a pose's matrix per
//! frame and one of the shape's.

use cromosim_body::BodyPose;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::frame::{
    MARKER_SIGMA_M, POSE, Terms, cost, damped, huber, normal_equations, pose_blocks, solve, stepped,
};
use super::prior::PosePrior;
use super::skin::{Posed, ShapedSkin, Skin};
use crate::MotionError;

/// A frame that the shape is fitted to.
pub(super) struct Keyframe {
    pub observed: Vec<Option<Vector3<f64>>>,
    pub pose: BodyPose,
}

/// Weight of the prior, where errors begin to count linearly (m), whether markers may move, steps.
const STAGES: [(f64, f64, bool, usize); 5] = [
    (4.0, 0.3, false, 8),
    (1.0, 0.1, false, 8),
    (0.25, 0.03, false, 8),
    (0.25, 0.01, true, 8),
    (0.25, 0.003, true, 15),
];
/// How far markers are stuck from their places, m: along the skin and along its normal.
const PLACEMENT_SIGMA_M: [f64; 3] = [0.01, 0.01, 0.005];
/// Shapes beyond are no shapes of people, standard deviations.
const LARGEST_BETA: f64 = 5.0;
/// A cost that falls by a smaller share has fallen.
const SMALL_GAIN: f64 = 1e-5;

/// What is fitted.
pub(super) struct Person {
    pub betas: Vec<f64>,
    /// l of each marker, m.
    pub placements: Vec<Vector3<f64>>,
}

struct Problem<'a> {
    skin: &'a Skin,
    stuck_at: &'a [Vector3<f64>],
    prior: &'a PosePrior,
    prior_weight: f64,
    huber_m: f64,
    moves: bool,
    frame_count: f64,
}

/// Fits shape, placements (where `fit_placement`) and the keyframes' poses.
pub(super) fn fit_person(
    skin: &Skin,
    stuck_at: &[Vector3<f64>],
    prior: &PosePrior,
    keyframes: &mut [Keyframe],
    fit_placement: bool,
) -> Result<Person, MotionError> {
    let mut person = Person {
        betas: vec![0.0; skin.beta_count()],
        placements: stuck_at.to_vec(),
    };
    for (prior_weight, huber_m, moves, steps) in STAGES {
        let moves = moves && fit_placement;
        let problem = Problem {
            skin,
            stuck_at,
            prior,
            prior_weight,
            huber_m,
            moves,
            frame_count: keyframes.len() as f64,
        };
        let shaped = skin.shaped(&person.betas, &person.placements)?;
        for frame in keyframes.iter_mut() {
            frame.pose = solve(
                &shaped,
                &frame.observed,
                &problem.terms(),
                frame.pose.clone(),
                3,
            )
            .0;
        }
        problem.minimise(&mut person, keyframes, steps)?;
    }
    Ok(person)
}

/// A frame's part of the normal equations.
struct FramePart {
    pose_hessian: DMatrix<f64>,
    pose_gradient: DVector<f64>,
    /// (POSE, shape).
    mixed: DMatrix<f64>,
}

impl<'a> Problem<'a> {
    fn terms(&self) -> Terms<'a> {
        Terms {
            prior: self.prior,
            prior_weight: self.prior_weight,
            huber_m: self.huber_m,
            expected: None,
        }
    }

    /// Number of shape coefficients and, after them, of placements' coordinates.
    fn size(&self) -> usize {
        self.skin.beta_count()
            + if self.moves {
                3 * self.stuck_at.len()
            } else {
                0
            }
    }

    /// Precisions of the shape's and placements' priors, times the number of frames: how many
    /// frames are chosen does not matter then.
    fn precisions(&self) -> DVector<f64> {
        let betas = self.skin.beta_count();
        DVector::from_fn(self.size(), |index, _| {
            let sigma = if index < betas {
                1.0
            } else {
                PLACEMENT_SIGMA_M[(index - betas) % 3]
            };
            self.frame_count / (sigma * sigma)
        })
    }

    /// Shape and placements as one vector, less the means of their priors.
    fn departure(&self, person: &Person) -> DVector<f64> {
        let moved = person
            .placements
            .iter()
            .zip(self.stuck_at)
            .flat_map(|(own, stuck)| [own.x - stuck.x, own.y - stuck.y, own.z - stuck.z]);
        DVector::from_iterator(
            self.size(),
            person.betas.iter().copied().chain(moved).take(self.size()),
        )
    }

    fn total_cost(
        &self,
        person: &Person,
        shaped: &ShapedSkin<'_>,
        frames: &[(&Keyframe, BodyPose)],
    ) -> f64 {
        let departure = self.departure(person);
        let prior = 0.5 * departure.component_mul(&departure).dot(&self.precisions());
        let frame_cost = |(frame, pose): &(&Keyframe, BodyPose)| {
            cost(&frame.observed, &self.terms(), pose, &shaped.posed(pose))
        };
        prior + frames.iter().map(frame_cost).sum::<f64>()
    }

    fn minimise(
        &self,
        person: &mut Person,
        keyframes: &mut [Keyframe],
        steps: usize,
    ) -> Result<(), MotionError> {
        let mut shaped = self.skin.shaped(&person.betas, &person.placements)?;
        let with_poses = |frames: &[Keyframe]| {
            frames
                .iter()
                .map(|frame| frame.pose.clone())
                .collect::<Vec<_>>()
        };
        let mut damping = 1e-4;
        for _ in 0..steps {
            let before: Vec<_> = keyframes.iter().zip(with_poses(keyframes)).collect();
            let least = self.total_cost(person, &shaped, &before);
            let (shape_hessian, shape_gradient, parts) = self.equations(person, &shaped, keyframes);
            let gain = loop {
                if let Some((shape_step, pose_steps)) =
                    reduced_step(&shape_hessian, &shape_gradient, &parts, damping)
                {
                    let next = self.stepped(person, &shape_step);
                    let next_shaped = self.skin.shaped(&next.betas, &next.placements)?;
                    let poses: Vec<BodyPose> = keyframes
                        .iter()
                        .zip(&pose_steps)
                        .map(|(frame, step)| stepped(&frame.pose, step))
                        .collect();
                    let next_cost = self.total_cost(
                        &next,
                        &next_shaped,
                        &keyframes.iter().zip(poses.clone()).collect::<Vec<_>>(),
                    );
                    if next_cost <= least {
                        (*person, shaped) = (next, next_shaped);
                        keyframes
                            .iter_mut()
                            .zip(poses)
                            .for_each(|(frame, pose)| frame.pose = pose);
                        damping = f64::max(damping / 10.0, 1e-7);
                        break 1.0 - next_cost / least.max(f64::MIN_POSITIVE);
                    }
                }
                damping *= 10.0;
                if damping > 1e6 {
                    break 0.0;
                }
            };
            if gain < SMALL_GAIN {
                break;
            }
        }
        Ok(())
    }

    fn stepped(&self, person: &Person, step: &DVector<f64>) -> Person {
        let betas = person
            .betas
            .iter()
            .zip(step.iter())
            .map(|(beta, step)| (beta + step).clamp(-LARGEST_BETA, LARGEST_BETA))
            .collect();
        let moved = |(marker, placement): (usize, &Vector3<f64>)| {
            let first = person.betas.len() + 3 * marker;
            if self.moves {
                placement + Vector3::new(step[first], step[first + 1], step[first + 2])
            } else {
                *placement
            }
        };
        Person {
            betas,
            placements: person.placements.iter().enumerate().map(moved).collect(),
        }
    }

    /// Hessian (full) and gradient of the shape, and each frame's part.
    fn equations(
        &self,
        person: &Person,
        shaped: &ShapedSkin<'_>,
        keyframes: &[Keyframe],
    ) -> (DMatrix<f64>, DVector<f64>, Vec<FramePart>) {
        let precisions = self.precisions();
        let mut hessian = DMatrix::from_diagonal(&precisions);
        let mut gradient = precisions.component_mul(&self.departure(person));
        let parts = keyframes
            .iter()
            .map(|frame| self.frame_part(shaped, frame, &mut hessian, &mut gradient))
            .collect();
        (hessian, gradient, parts)
    }

    fn frame_part(
        &self,
        shaped: &ShapedSkin<'_>,
        frame: &Keyframe,
        hessian: &mut DMatrix<f64>,
        gradient: &mut DVector<f64>,
    ) -> FramePart {
        let posed = shaped.posed(&frame.pose);
        let normal = normal_equations(shaped, &frame.observed, &self.terms(), &frame.pose, &posed);
        let mut mixed = DMatrix::zeros(POSE, self.size());
        let joint_motion = shaped.joint_shape_motion(&posed);
        let mut blocks = Vec::new();
        for (marker, seen) in frame.observed.iter().enumerate() {
            let Some(seen) = seen else { continue };
            let residual = posed.markers[marker] - seen;
            let weight = huber(residual.norm(), self.huber_m).1;
            let columns = self.columns(shaped, marker, &posed, &joint_motion);
            pose_blocks(shaped, marker, &posed, &mut blocks);
            for (index, column) in &columns {
                gradient[*index] += weight * column.dot(&residual);
                for (other, other_column) in &columns {
                    hessian[(*index, *other)] += weight * column.dot(other_column);
                }
                for (offset, block) in &blocks {
                    let product = block.transpose() * column * weight;
                    let mut part = mixed.fixed_view_mut::<3, 1>(*offset, *index);
                    part += product;
                }
            }
        }
        FramePart {
            pose_hessian: normal.hessian,
            pose_gradient: normal.gradient,
            mixed,
        }
    }

    /// How a marker moves with shape and placement: indices and columns.
    fn columns(
        &self,
        shaped: &ShapedSkin<'_>,
        marker: usize,
        posed: &Posed,
        joint_motion: &[[Vector3<f64>; cromosim_body::JOINT_COUNT]],
    ) -> Vec<(usize, Vector3<f64>)> {
        let betas = self.skin.beta_count();
        let shape = |(beta, motion)| (beta, shaped.shape_column(marker, beta, posed, motion));
        let mut columns: Vec<_> = joint_motion.iter().enumerate().map(shape).collect();
        if self.moves {
            let frame: &Matrix3<f64> = &posed.frames[marker];
            columns.extend(
                (0..3).map(|axis| (betas + 3 * marker + axis, frame.column(axis).into_owned())),
            );
        }
        columns
    }
}

/// The step of the shape and of each pose: with `L L^T` a pose's damped Hessian, `X = L^-1 mixed`
/// and `y = L^-1 g`, the shape's equations are `(H - sum X^T X) s = -(g - sum X^T y)`, and the
/// pose's step is `-L^-T (y + X s)`.
fn reduced_step(
    hessian: &DMatrix<f64>,
    gradient: &DVector<f64>,
    parts: &[FramePart],
    damping: f64,
) -> Option<(DVector<f64>, Vec<DVector<f64>>)> {
    let (mut reduced, mut right) = (damped(hessian, damping), gradient.clone());
    let mut eliminated = Vec::with_capacity(parts.len());
    for part in parts {
        let lower = damped(&part.pose_hessian, damping).cholesky()?.unpack();
        let x = lower.solve_lower_triangular(&part.mixed)?;
        let y = lower.solve_lower_triangular(&part.pose_gradient)?;
        reduced -= x.tr_mul(&x);
        right -= x.tr_mul(&y);
        eliminated.push((lower, x, y));
    }
    let shape_step = -reduced.cholesky()?.solve(&right);
    let pose_step = |(lower, x, y): &(DMatrix<f64>, DMatrix<f64>, DVector<f64>)| {
        let right = y + x * &shape_step;
        lower.tr_solve_lower_triangular(&right).map(|step| -step)
    };
    let pose_steps = eliminated
        .iter()
        .map(pose_step)
        .collect::<Option<Vec<_>>>()?;
    Some((shape_step, pose_steps))
}

/// Joints' standard deviations in the keyframes (root mean square over them), m: markers that err
/// independently by `error_m` along each axis, the prior as it is; shape and placements taken as
/// known.
pub(super) fn joint_sigmas(
    shaped: &ShapedSkin<'_>,
    prior: &PosePrior,
    keyframes: &[Keyframe],
    error_m: f64,
) -> Vec<f64> {
    use cromosim_body::{JOINT_COUNT, Joint};
    let mut variances = [0.0; JOINT_COUNT];
    let terms = Terms {
        prior,
        prior_weight: 0.25,
        huber_m: f64::MAX,
        expected: None,
    };
    for frame in keyframes {
        let posed = shaped.posed(&frame.pose);
        let normal = normal_equations(shaped, &frame.observed, &terms, &frame.pose, &posed);
        let Some(covariance) = damped(&normal.hessian, 0.0)
            .cholesky()
            .map(|cholesky| cholesky.inverse())
        else {
            continue;
        };
        for joint in Joint::ALL {
            let mut jacobian = DMatrix::zeros(3, POSE);
            jacobian
                .fixed_view_mut::<3, 3>(0, 0)
                .copy_from(&Matrix3::identity());
            let position = posed.segments[joint.index()].translation.vector;
            let mut ancestor = joint.parent();
            while let Some(turning) = ancestor {
                let segment = &posed.segments[turning.index()];
                let block = -(position - segment.translation.vector).cross_matrix()
                    * segment.rotation.to_rotation_matrix().matrix();
                jacobian
                    .fixed_view_mut::<3, 3>(0, 3 + 3 * turning.index())
                    .copy_from(&block);
                ancestor = turning.parent();
            }
            let scale = (error_m / MARKER_SIGMA_M).powi(2);
            variances[joint.index()] +=
                (&jacobian * &covariance * jacobian.transpose()).trace() * scale;
        }
    }
    variances
        .iter()
        .map(|variance| (variance / keyframes.len().max(1) as f64).sqrt())
        .collect()
}
