//! The skin under the markers: where they are in a pose, and how they move with pose, shape and
//! placement.
//!
//! A marker stands at `m = sum_i b_i v_i + F l`: v_i are its triangle's corners (SMPL with pose
//! corrections), b_i its barycentrics, F the triangle's frame [tangent, binormal, normal] and l the
//! placement, (0, 0, height) as stuck on.
//!
//! Derivatives are those of linear blend skinning. Turning joint j by the small world vector d
//! moves the marker by `d x Y_j`, with `Y_j = sum over segments s below j of (q_s - w_s o_j + w_s F
//! l)`, where w_s is the marker's weight on s, o_j the joint and `q_s = sum_i b_i w_is (G_s v_i)`.
//! Left out are the pose corrections' own derivatives, and that F turns with its corners rather
//! than with the mean of their segments; the positions leave nothing out.

use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, JOINT_COUNT, Joint, ShapedBody, Site, VertexSubset};
use nalgebra::{Isometry3, Matrix3, Vector3};

use super::skin_weights::{skin_weights, unit};
use crate::MotionError;

/// A marker's skin, before it has a shape.
struct Patch {
    barycentrics: [f64; 3],
    /// Joints that move it, children before parents.
    slots: Vec<Slot>,
}

/// One joint that moves a marker.
struct Slot {
    joint: usize,
    /// Index of the nearest joint towards the pelvis among the slots.
    parent: Option<usize>,
    /// The corner and b_i w_is of the corners that this segment carries.
    shares: Vec<(usize, f64)>,
}

/// The patches of a marker set on a body.
pub(super) struct Skin {
    pub body: Arc<BodyModel>,
    patches: Vec<Patch>,
    /// The triangles' corners, three a marker.
    vertices: Vec<u32>,
    /// For each corner how each shape coefficient moves it at rest, m.
    corner_directions: Vec<Vec<Vector3<f64>>>,
    /// How each shape coefficient moves the joints at rest, m.
    joint_directions: Vec<[Vector3<f64>; JOINT_COUNT]>,
}

/// The patches of a person.
pub(super) struct ShapedSkin<'a> {
    pub skin: &'a Skin,
    pub shaped: ShapedBody,
    subset: VertexSubset,
    corners: Vec<Vector3<f64>>,
    /// l of each marker, m.
    pub placements: Vec<Vector3<f64>>,
}

/// The markers in a pose.
pub(super) struct Posed {
    /// m, world.
    pub markers: Vec<Vector3<f64>>,
    /// The triangles' frames [tangent, binormal, normal].
    pub frames: Vec<Matrix3<f64>>,
    pub segments: [Isometry3<f64>; JOINT_COUNT],
}

impl Skin {
    /// `beta_count` shape coefficients will be fitted.
    pub fn new(
        body: &Arc<BodyModel>,
        sites: &[Site],
        beta_count: usize,
    ) -> Result<Self, MotionError> {
        let mut vertices = Vec::with_capacity(3 * sites.len());
        for site in sites {
            vertices.extend(body.triangle(site)?);
        }
        let corner = |shaped: &ShapedBody, vertex: u32| shaped.rest_vertices()[vertex as usize];
        let mean = ShapedBody::new(body.clone(), &[])?;
        let mut corner_directions = vec![Vec::with_capacity(beta_count); vertices.len()];
        for beta in 0..beta_count {
            let one = ShapedBody::new(body.clone(), &unit(beta))?;
            for (directions, &vertex) in corner_directions.iter_mut().zip(&vertices) {
                directions.push(corner(&one, vertex) - corner(&mean, vertex));
            }
        }
        // A body of one shape does not tell its weights: there a marker moves with its site's joint
        // alone.
        let rigid = || {
            sites
                .iter()
                .flat_map(|site| std::iter::repeat_n(vec![(site.joint.index(), 1.0)], 3))
                .collect()
        };
        let weights = if body.beta_count() > 0 {
            skin_weights(body, &vertices)?
        } else {
            rigid()
        };
        let patches = sites
            .iter()
            .zip(weights.as_chunks::<3>().0)
            .map(|(site, weights)| Patch::new(site.barycentrics, weights))
            .collect();
        let (_, mut joint_directions) = body.joint_shape_directions();
        joint_directions.truncate(beta_count);
        Ok(Self {
            body: body.clone(),
            patches,
            vertices,
            corner_directions,
            joint_directions,
        })
    }

    /// How many shape coefficients are fitted.
    pub fn beta_count(&self) -> usize {
        self.joint_directions.len()
    }

    pub fn shaped(
        &self,
        betas: &[f64],
        placements: &[Vector3<f64>],
    ) -> Result<ShapedSkin<'_>, MotionError> {
        let shaped = ShapedBody::new(self.body.clone(), betas)?;
        let corners = self
            .vertices
            .iter()
            .map(|&vertex| shaped.rest_vertices()[vertex as usize])
            .collect();
        Ok(ShapedSkin {
            skin: self,
            subset: shaped.subset(&self.vertices)?,
            shaped,
            corners,
            placements: placements.to_vec(),
        })
    }
}

impl Patch {
    fn new(barycentrics: [f64; 3], weights: &[Vec<(usize, f64)>; 3]) -> Self {
        let mut moves = [false; JOINT_COUNT];
        for &(joint, _) in weights.iter().flatten() {
            let mut ancestor = Joint::from_index(joint);
            while let Some(joint) = ancestor {
                moves[joint.index()] = true;
                ancestor = joint.parent();
            }
        }
        // SMPL numbers parents before children.
        let joints: Vec<usize> = (0..JOINT_COUNT)
            .rev()
            .filter(|&joint| moves[joint])
            .collect();
        let slot = |&joint: &usize| {
            let parent = Joint::ALL[joint]
                .parent()
                .and_then(|parent| joints.iter().position(|&other| other == parent.index()));
            let share = |(corner, weights): (usize, &Vec<(usize, f64)>)| {
                let weight: f64 = weights
                    .iter()
                    .filter(|(other, _)| *other == joint)
                    .map(|(_, weight)| weight)
                    .sum();
                (corner, weight * barycentrics[corner])
            };
            let shares = weights
                .iter()
                .enumerate()
                .map(share)
                .filter(|(_, share)| *share != 0.0)
                .collect();
            Slot {
                joint,
                parent,
                shares,
            }
        };
        Self {
            barycentrics,
            slots: joints.iter().map(slot).collect(),
        }
    }
}

impl ShapedSkin<'_> {
    pub fn posed(&self, pose: &BodyPose) -> Posed {
        let mut corners = Vec::with_capacity(self.corners.len());
        let segments = self.subset.positions_and_segments_into(pose, &mut corners);
        let frames: Vec<Matrix3<f64>> = corners
            .as_chunks::<3>()
            .0
            .iter()
            .map(triangle_frame)
            .collect();
        let position = |marker: usize| {
            let [a, b, c] = self.skin.patches[marker].barycentrics;
            corners[3 * marker] * a
                + corners[3 * marker + 1] * b
                + corners[3 * marker + 2] * c
                + frames[marker] * self.placements[marker]
        };
        let markers = (0..frames.len()).map(position).collect();
        Posed {
            markers,
            frames,
            segments,
        }
    }

    /// Hands every joint that moves `marker` to `use_block`, with the derivative of the marker by a
    /// small turn of the joint in its own axes, (3, 3) m/rad.
    pub fn turn_blocks(
        &self,
        marker: usize,
        posed: &Posed,
        mut use_block: impl FnMut(usize, Matrix3<f64>),
    ) {
        let patch = &self.skin.patches[marker];
        let arm = posed.frames[marker] * self.placements[marker];
        let mut moments = [(Vector3::zeros(), 0.0); JOINT_COUNT];
        for (index, slot) in patch.slots.iter().enumerate() {
            let segment = &posed.segments[slot.joint];
            let joint = segment.translation.vector;
            for &(corner, share) in &slot.shares {
                let in_segment =
                    self.corners[3 * marker + corner] - self.shaped.joints_in_model()[slot.joint];
                moments[index].0 += (segment.rotation * in_segment + joint + arm) * share;
                moments[index].1 += share;
            }
            let (moment, weight) = moments[index];
            let lever = moment - joint * weight;
            let axes = segment.rotation.to_rotation_matrix();
            use_block(slot.joint, -lever.cross_matrix() * axes.matrix());
            if let Some(parent) = slot.parent {
                moments[parent].0 += moment;
                moments[parent].1 += weight;
            }
        }
    }

    /// How the joints move with each shape coefficient in a pose, m, the pelvis held: (betas, 24).
    pub fn joint_shape_motion(&self, posed: &Posed) -> Vec<[Vector3<f64>; JOINT_COUNT]> {
        let moved = |directions: &[Vector3<f64>; JOINT_COUNT]| {
            let mut motion = [Vector3::zeros(); JOINT_COUNT];
            for joint in Joint::ALL {
                if let Some(parent) = joint.parent() {
                    let bone = directions[joint.index()] - directions[parent.index()];
                    motion[joint.index()] =
                        motion[parent.index()] + posed.segments[parent.index()].rotation * bone;
                }
            }
            motion
        };
        self.skin.joint_directions.iter().map(moved).collect()
    }

    /// The derivative of `marker` by shape coefficient `beta`, m; `joint_motion` is
    /// [`Self::joint_shape_motion`]'s row of that coefficient.
    pub fn shape_column(
        &self,
        marker: usize,
        beta: usize,
        posed: &Posed,
        joint_motion: &[Vector3<f64>; JOINT_COUNT],
    ) -> Vector3<f64> {
        let mut column = Vector3::zeros();
        for slot in &self.skin.patches[marker].slots {
            for &(corner, share) in &slot.shares {
                let direction = self.skin.corner_directions[3 * marker + corner][beta]
                    - self.skin.joint_directions[beta][slot.joint];
                column += (posed.segments[slot.joint].rotation * direction
                    + joint_motion[slot.joint])
                    * share;
            }
        }
        column
    }
}

/// [tangent, binormal, normal] of a triangle, counter-clockwise seen from outside.
fn triangle_frame(corners: &[Vector3<f64>; 3]) -> Matrix3<f64> {
    let tangent = (corners[1] - corners[0])
        .try_normalize(1e-12)
        .unwrap_or_else(Vector3::x);
    let normal = tangent
        .cross(&(corners[2] - corners[0]))
        .try_normalize(1e-12)
        .unwrap_or_else(Vector3::zeros);
    Matrix3::from_columns(&[tangent, normal.cross(&tangent), normal])
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    fn pose() -> BodyPose {
        let mut pose = BodyPose::rest(Vector3::new(0.3, -0.2, 1.1));
        for (joint, rotation) in pose.local_rotations.iter_mut().enumerate() {
            let wave = |phase: f64| (1.7 * joint as f64 + phase).sin() * 0.4;
            *rotation =
                UnitQuaternion::from_scaled_axis(Vector3::new(wave(0.0), wave(1.0), wave(2.0)));
        }
        pose
    }

    fn skin() -> Skin {
        let body = BodyModel::embedded();
        let names = [
            "left_watch",
            "left_shoulder",
            "right_asis",
            "c7",
            "left_knee",
            "right_heel",
            "head_top",
        ];
        let sites: Vec<Site> = names.iter().map(|name| body.site(name).unwrap()).collect();
        Skin::new(&body, &sites, 10).unwrap()
    }

    #[test]
    fn weights_are_those_of_the_body() {
        let skin = skin();
        let weights = skin_weights(&skin.body, &skin.vertices).unwrap();
        for weights in &weights {
            assert!(
                (weights.iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-6,
                "{weights:?}"
            );
            assert!(weights.iter().all(|(_, weight)| *weight > 0.0));
        }
        let watch = weights[0]
            .iter()
            .find(|(joint, _)| *joint == Joint::LeftElbow.index())
            .unwrap()
            .1;
        assert!(watch > 0.8, "{watch}");
    }

    /// Turns without pose corrections' derivatives: within what these are; shape and placement:
    /// exact but for the triangle's frame.
    #[test]
    fn derivatives_agree_with_differences() {
        let skin = skin();
        let placements = vec![Vector3::new(0.002, -0.003, 0.0095); skin.patches.len()];
        let betas = [0.5, -0.4, 0.3, 0.2, -0.1, 0.6, 0.0, -0.2, 0.1, 0.3];
        let shaped = skin.shaped(&betas, &placements).unwrap();
        let (pose, step) = (pose(), 1e-6);
        let posed = shaped.posed(&pose);
        let (mut error, mut size) = (0.0, 0.0);
        for marker in 0..skin.patches.len() {
            shaped.turn_blocks(marker, &posed, |joint, block| {
                for axis in 0..3 {
                    let mut turned = pose.clone();
                    turned.local_rotations[joint] *=
                        UnitQuaternion::from_scaled_axis(Vector3::ith(axis, step));
                    let difference =
                        (shaped.posed(&turned).markers[marker] - posed.markers[marker]) / step;
                    error += (difference - block.column(axis)).norm_squared();
                    size += difference.norm_squared();
                }
            });
        }
        println!(
            "turns: {:.4} of the derivative left out",
            f64::sqrt(error / size)
        );
        assert!(error < 0.03 * 0.03 * size, "{error} {size}");
        let motion = shaped.joint_shape_motion(&posed);
        for beta in 0..10 {
            let mut more = betas;
            more[beta] += step;
            let moved = skin.shaped(&more, &placements).unwrap().posed(&pose);
            for marker in 0..skin.patches.len() {
                let difference = (moved.markers[marker] - posed.markers[marker]) / step;
                let column = shaped.shape_column(marker, beta, &posed, &motion[beta]);
                assert!(
                    (difference - column).norm() < 1.5e-3,
                    "{marker} {beta} {difference} {column}"
                );
            }
        }
    }
}
