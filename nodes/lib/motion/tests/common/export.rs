//! Writes an SMPL motion as BVH in another skeleton: its names, its rest pose, its bones, its
//! frames.

use std::fmt::Write;

use cromosim_body::{BodyPose, JOINT_COUNT, Joint, ShapedBody};
use nalgebra::{UnitQuaternion, Vector3};

/// A joint of the skeleton: its name, its parent's name (empty for the root), the SMPL segment that
/// it moves with, and how far its frame is rolled: body_from_joint in the rest pose.
pub struct Bone {
    pub name: &'static str,
    pub parent: &'static str,
    pub segment: Joint,
    pub body_from_joint: UnitQuaternion<f64>,
}

/// A skeleton and how it is written.
pub struct Exporter<'a> {
    pub bones: Vec<Bone>,
    pub prefix: &'static str,
    /// SMPL's local rotations in the skeleton's rest pose; the pelvis unturned.
    pub rest: [UnitQuaternion<f64>; JOINT_COUNT],
    /// The skeleton's bones come from this body; `joint_shift` adds what makes it nobody's body.
    pub body: &'a ShapedBody,
    pub joint_shift: [Vector3<f64>; JOINT_COUNT],
    pub unit_m: f64,
    /// Turns the world (z up) into the file's axes.
    pub file_from_world: UnitQuaternion<f64>,
    /// Rotation channels, axes 0 to 2 in order.
    pub order: [usize; 3],
    /// Frames of the rest pose before the motion.
    pub leading_rest_frames: usize,
    pub rate_hz: f64,
}

impl Exporter<'_> {
    /// The BVH text of the frames.
    pub fn write(&self, frames: &[BodyPose]) -> String {
        let mut text = "HIERARCHY\n".to_owned();
        let positions = self.rest_positions();
        self.write_bone(&mut text, 0, &positions);
        let rest = BodyPose {
            root_position: Vector3::new(0.3, -0.2, 0.95),
            local_rotations: self.rest_in_world(),
        };
        let frames: Vec<&BodyPose> = std::iter::repeat_n(&rest, self.leading_rest_frames)
            .chain(frames)
            .collect();
        writeln!(
            text,
            "MOTION\nFrames: {}\nFrame Time: {:.8}",
            frames.len(),
            1.0 / self.rate_hz
        )
        .unwrap();
        let rest_rotations = world_rotations(&self.rest);
        for pose in frames {
            let world_from_segment = pose.world_rotations();
            let file_from_joint: Vec<UnitQuaternion<f64>> = self
                .bones
                .iter()
                .map(|bone| {
                    let segment = bone.segment.index();
                    self.file_from_world
                        * world_from_segment[segment]
                        * rest_rotations[segment].inverse()
                        * bone.body_from_joint
                })
                .collect();
            let root = self.file_from_world * pose.root_position / self.unit_m;
            let mut numbers: Vec<f64> = root.iter().copied().collect();
            for (bone, own) in self.bones.iter().zip(&file_from_joint) {
                let parent = self
                    .bones
                    .iter()
                    .position(|parent| parent.name == bone.parent);
                let local = parent.map_or(*own, |parent| file_from_joint[parent].inverse() * own);
                numbers.extend(euler_degrees(&local, self.order));
            }
            let words: Vec<String> = numbers
                .iter()
                .map(|number| format!("{number:.6}"))
                .collect();
            writeln!(text, "{}", words.join(" ")).unwrap();
        }
        text
    }

    /// The rest pose standing in the world, facing x: model x (left) to y, y (up) to z.
    fn rest_in_world(&self) -> [UnitQuaternion<f64>; JOINT_COUNT] {
        let mut rotations = self.rest;
        rotations[0] =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2)
                * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        rotations
    }

    /// The skeleton's joints in the rest pose, body axes, by SMPL joint.
    fn rest_positions(&self) -> [Vector3<f64>; JOINT_COUNT] {
        let rotations = world_rotations(&self.rest);
        let joints: [Vector3<f64>; JOINT_COUNT] = std::array::from_fn(|joint| {
            self.body.joints_in_model()[joint] + self.joint_shift[joint]
        });
        let mut positions = joints;
        for joint in Joint::ALL {
            if let Some(parent) = joint.parent() {
                let (joint, parent) = (joint.index(), parent.index());
                positions[joint] =
                    positions[parent] + rotations[parent] * (joints[joint] - joints[parent]);
            }
        }
        positions
    }

    fn write_bone(&self, text: &mut String, index: usize, positions: &[Vector3<f64>; JOINT_COUNT]) {
        let bone = &self.bones[index];
        let parent = self.bones.iter().find(|parent| parent.name == bone.parent);
        let place = positions[bone.segment.index()];
        let in_parent = parent.map_or_else(Vector3::zeros, |parent| {
            parent.body_from_joint.inverse() * (place - positions[parent.segment.index()])
                / self.unit_m
        });
        let keyword = if parent.is_some() { "JOINT" } else { "ROOT" };
        let vector = |v: Vector3<f64>| format!("OFFSET {:.6} {:.6} {:.6}", v.x, v.y, v.z);
        writeln!(
            text,
            "{keyword} {}{}\n{{\n{}",
            self.prefix,
            bone.name,
            vector(in_parent)
        )
        .unwrap();
        let rotations = self
            .order
            .map(|axis| format!("{}rotation", ["X", "Y", "Z"][axis]))
            .join(" ");
        match parent {
            Some(_) => writeln!(text, "CHANNELS 3 {rotations}").unwrap(),
            None => writeln!(text, "CHANNELS 6 Xposition Yposition Zposition {rotations}").unwrap(),
        }
        let children: Vec<usize> = (0..self.bones.len())
            .filter(|&child| self.bones[child].parent == bone.name)
            .collect();
        for &child in &children {
            self.write_bone(text, child, positions);
        }
        if children.is_empty() {
            let tip = bone
                .segment
                .children()
                .next()
                .map_or(Vector3::zeros(), |child| positions[child.index()] - place);
            writeln!(
                text,
                "End Site\n{{\n{}\n}}",
                vector(bone.body_from_joint.inverse() * tip / self.unit_m)
            )
            .unwrap();
        }
        writeln!(text, "}}").unwrap();
    }
}

fn world_rotations(
    local: &[UnitQuaternion<f64>; JOINT_COUNT],
) -> [UnitQuaternion<f64>; JOINT_COUNT] {
    BodyPose {
        root_position: Vector3::zeros(),
        local_rotations: *local,
    }
    .world_rotations()
}

/// Angles so that the rotation is the product of rotations about the axes in their order.
fn euler_degrees(rotation: &UnitQuaternion<f64>, [i, j, k]: [usize; 3]) -> [f64; 3] {
    let r = rotation.to_rotation_matrix();
    let sign = if (j + 3 - i) % 3 == 1 { 1.0 } else { -1.0 };
    let middle = (sign * r[(i, k)]).clamp(-1.0, 1.0).asin();
    [
        (-sign * r[(j, k)]).atan2(r[(k, k)]),
        middle,
        (-sign * r[(i, j)]).atan2(r[(i, i)]),
    ]
    .map(f64::to_degrees)
}
