//! A suit's recording as a skeleton's clip, which is retargeted like any other.

use nalgebra::Vector3;

use super::Mvnx;
use crate::bvh::zxy_degrees;
use crate::{BvhClip, BvhJoint, Channel, MotionError};

/// MVN's segments with their parents, parents first.
const TREE: [(&str, Option<&str>); 23] = [
    ("Pelvis", None),
    ("L5", Some("Pelvis")),
    ("L3", Some("L5")),
    ("T12", Some("L3")),
    ("T8", Some("T12")),
    ("Neck", Some("T8")),
    ("Head", Some("Neck")),
    ("RightShoulder", Some("T8")),
    ("RightUpperArm", Some("RightShoulder")),
    ("RightForeArm", Some("RightUpperArm")),
    ("RightHand", Some("RightForeArm")),
    ("LeftShoulder", Some("T8")),
    ("LeftUpperArm", Some("LeftShoulder")),
    ("LeftForeArm", Some("LeftUpperArm")),
    ("LeftHand", Some("LeftForeArm")),
    ("RightUpperLeg", Some("Pelvis")),
    ("RightLowerLeg", Some("RightUpperLeg")),
    ("RightFoot", Some("RightLowerLeg")),
    ("RightToe", Some("RightFoot")),
    ("LeftUpperLeg", Some("Pelvis")),
    ("LeftLowerLeg", Some("LeftUpperLeg")),
    ("LeftFoot", Some("LeftLowerLeg")),
    ("LeftToe", Some("LeftFoot")),
];

impl Mvnx {
    /// The segments of the body as joints, m, z up, at rest as in MVN's T-pose; bones are as long
    /// as in the first frame. Props are left out.
    ///
    /// # Errors
    /// [`MotionError::Mvnx`] where the pelvis is missing, or a segment that others hang from.
    pub fn clip(&self) -> Result<BvhClip, MotionError> {
        let index = |name: &str| self.segments.iter().position(|own| own == name);
        let mut found: Vec<(usize, Option<usize>)> = Vec::new();
        let mut joints = Vec::new();
        for (name, parent) in TREE {
            let Some(own) = index(name) else {
                continue;
            };
            let place = |parent| {
                joints
                    .iter()
                    .position(|joint: &BvhJoint| joint.name == parent)
            };
            let above = parent.and_then(place);
            if let Some(parent) = parent.filter(|_| above.is_none()) {
                return Err(self.missing(parent));
            }
            let rest_in_parent = match above.map(|above: usize| found[above].0) {
                None => Vector3::zeros(),
                Some(parent) => {
                    self.orientations[parent].inverse()
                        * (self.positions[own] - self.positions[parent])
                }
            };
            let turns = [2, 0, 1].map(Channel::Rotation);
            let moves = [0, 1, 2].map(Channel::Position);
            let moves = if above.is_none() { &moves[..] } else { &[] };
            found.push((own, above));
            joints.push(BvhJoint {
                name: name.to_owned(),
                parent: above,
                rest_in_parent,
                channels: moves.iter().chain(&turns).copied().collect(),
                tip: None,
            });
        }
        let Some(&(pelvis, None)) = found.first() else {
            return Err(self.missing("Pelvis"));
        };
        let mut values = Vec::new();
        for frame in 0..self.frames.len() {
            let start = frame * self.segments.len();
            values.extend(&self.positions[start + pelvis]);
            for (own, above) in &found {
                let turn = self.orientations[start + own];
                let local = match above {
                    Some(above) => self.orientations[start + found[*above].0].inverse() * turn,
                    None => turn,
                };
                values.extend(zxy_degrees(&local));
            }
        }
        let frame_time_s = self.rate_hz.recip();
        Ok(BvhClip::from_parts(
            &self.name,
            joints,
            frame_time_s,
            values,
        ))
    }

    fn missing(&self, segment: &str) -> MotionError {
        MotionError::Mvnx {
            name: self.name.clone(),
            segment: segment.to_owned(),
            found: self.segments.clone(),
        }
    }
}
