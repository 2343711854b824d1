//! The 24 joints of SMPL.

use std::fmt;
use std::str::FromStr;

use cromosim_spatial::meant;
use serde::{Deserialize, Serialize};

use crate::BodyError;

/// Number of SMPL's joints, and so of its segments.
pub const JOINT_COUNT: usize = 24;

/// Joints that SMPL, SMPL-H and SMPL-X share; the others are fingers, jaw and eyes, or SMPL's hands.
pub(crate) const SHARED_JOINTS: usize = 22;

/// A joint of SMPL, and the segment whose frame stands there. The discriminant is SMPL's index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs)] // the names are the anatomical ones of SMPL
pub enum Joint {
    Pelvis,
    LeftHip,
    RightHip,
    Spine1,
    LeftKnee,
    RightKnee,
    Spine2,
    LeftAnkle,
    RightAnkle,
    Spine3,
    LeftFoot,
    RightFoot,
    Neck,
    LeftCollar,
    RightCollar,
    Head,
    LeftShoulder,
    RightShoulder,
    LeftElbow,
    RightElbow,
    LeftWrist,
    RightWrist,
    LeftHand,
    RightHand,
}

impl Joint {
    /// All joints in SMPL's order: parents stand before their children.
    pub const ALL: [Self; JOINT_COUNT] = [
        Self::Pelvis,
        Self::LeftHip,
        Self::RightHip,
        Self::Spine1,
        Self::LeftKnee,
        Self::RightKnee,
        Self::Spine2,
        Self::LeftAnkle,
        Self::RightAnkle,
        Self::Spine3,
        Self::LeftFoot,
        Self::RightFoot,
        Self::Neck,
        Self::LeftCollar,
        Self::RightCollar,
        Self::Head,
        Self::LeftShoulder,
        Self::RightShoulder,
        Self::LeftElbow,
        Self::RightElbow,
        Self::LeftWrist,
        Self::RightWrist,
        Self::LeftHand,
        Self::RightHand,
    ];

    const PARENTS: [u8; JOINT_COUNT] = [
        0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
    ];
    const MIRRORED: [u8; JOINT_COUNT] = [
        0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22,
    ];
    const NAMES: [&'static str; JOINT_COUNT] = [
        "pelvis",
        "left_hip",
        "right_hip",
        "spine1",
        "left_knee",
        "right_knee",
        "spine2",
        "left_ankle",
        "right_ankle",
        "spine3",
        "left_foot",
        "right_foot",
        "neck",
        "left_collar",
        "right_collar",
        "head",
        "left_shoulder",
        "right_shoulder",
        "left_elbow",
        "right_elbow",
        "left_wrist",
        "right_wrist",
        "left_hand",
        "right_hand",
    ];

    /// SMPL's index of the joint, 0 to 23.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The joint of SMPL's `index`; `None` from 24 on.
    pub fn from_index(index: usize) -> Option<Self> {
        Self::ALL.get(index).copied()
    }

    /// SMPL's name: `left_wrist`.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self.index()]
    }

    /// The joint that SMPL calls `name`; `None` for any other name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES
            .iter()
            .position(|&known| known == name)
            .and_then(Self::from_index)
    }

    /// The next joint towards the pelvis; `None` for the pelvis.
    pub const fn parent(self) -> Option<Self> {
        match self {
            Self::Pelvis => None,
            _ => Some(Self::ALL[Self::PARENTS[self.index()] as usize]),
        }
    }

    /// The same joint on the other side of the body; joints of the middle are their own.
    pub const fn mirrored(self) -> Self {
        Self::ALL[Self::MIRRORED[self.index()] as usize]
    }

    /// The joints whose parent this is.
    pub fn children(self) -> impl Iterator<Item = Self> {
        Self::ALL
            .into_iter()
            .filter(move |joint| joint.parent() == Some(self))
    }
}

impl fmt::Display for Joint {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl FromStr for Joint {
    type Err = BodyError;

    fn from_str(name: &str) -> Result<Self, BodyError> {
        Self::from_name(name).ok_or_else(|| BodyError::UnknownJoint {
            name: name.to_owned(),
            meant: meant(name, Self::ALL.iter().map(|joint| joint.name())),
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn names_indices_and_parents_agree() {
        for (index, joint) in Joint::ALL.into_iter().enumerate() {
            assert_eq!(joint.index(), index);
            assert_eq!(Joint::from_name(joint.name()), Some(joint));
            assert!(
                joint.parent().is_none_or(|parent| parent < joint),
                "{joint}: a parent stands before its child"
            );
            assert_eq!(joint.mirrored().mirrored(), joint);
            assert_eq!(
                joint.mirrored().parent(),
                joint.parent().map(Joint::mirrored)
            );
            assert_eq!(
                joint.mirrored().name(),
                joint
                    .name()
                    .replace("left", "?")
                    .replace("right", "left")
                    .replace('?', "right")
            );
        }
        assert_eq!(Joint::LeftWrist.parent(), Some(Joint::LeftElbow));
        assert_eq!(
            Joint::Spine3.children().collect::<Vec<_>>(),
            [Joint::Neck, Joint::LeftCollar, Joint::RightCollar]
        );
        assert!(
            "wrist"
                .parse::<Joint>()
                .unwrap_err()
                .to_string()
                .contains("wrist")
        );
    }
}
