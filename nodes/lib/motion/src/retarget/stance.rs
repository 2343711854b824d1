//! How a skeleton stands: what tells a human pose from a heap of bones.

use cromosim_body::Joint;
use nalgebra::Vector3;

use crate::SkeletonPose;
use crate::axes::angle_between;
use crate::skeleton_map::{BoundMap, Point};

/// Directions and angles of a skeleton in one pose.
pub(super) struct Stance {
    /// From between the hips to the neck or head, file units.
    pub trunk: Vector3<f64>,
    /// From right to left, hips and shoulders together; length at most 2.
    pub left: Vector3<f64>,
    /// Angle between the line across the hips and that across the shoulders, degrees.
    hips_against_shoulders: f64,
    /// Larger angle of the two legs from the trunk's line downwards, degrees.
    legs_from_down: f64,
    /// Larger bend of the two knees, degrees.
    knees: f64,
    /// Larger bend of the two elbows, degrees.
    elbows: f64,
    /// Angles of the arms from the trunk's direction, degrees: 90 in a T-pose.
    arms_from_up: [f64; 2],
    arms_outward: bool,
    toes_forward: bool,
}

impl Stance {
    pub fn in_pose(pose: &SkeletonPose, map: &BoundMap) -> Self {
        let at = |joint: Joint| {
            map.joints[joint.index()].map_or_else(Vector3::zeros, |index| {
                pose.world_from_joint[index].translation.vector
            })
        };
        let bone = |from: Joint, to: Joint| at(to) - at(from);
        let top = if map.joints[Joint::Neck.index()].is_some() {
            Joint::Neck
        } else {
            Joint::Head
        };
        let trunk = at(top) - (at(Joint::LeftHip) + at(Joint::RightHip)) / 2.0;
        let hips = at(Joint::LeftHip) - at(Joint::RightHip);
        let shoulders = at(Joint::LeftShoulder) - at(Joint::RightShoulder);
        let left = hips.normalize() + shoulders.normalize();
        let arms = [
            bone(Joint::LeftShoulder, Joint::LeftWrist),
            bone(Joint::RightShoulder, Joint::RightWrist),
        ];
        let legs = [
            bone(Joint::LeftHip, Joint::LeftAnkle),
            bone(Joint::RightHip, Joint::RightAnkle),
        ];
        let bend = |joints: [[Joint; 3]; 2]| {
            largest(joints.map(|[a, b, c]| degrees(bone(a, b), bone(b, c))))
        };
        let forward = left.cross(&trunk);
        let toes = toes(pose, map, [at(Joint::LeftAnkle), at(Joint::RightAnkle)]);
        Self {
            trunk,
            left,
            hips_against_shoulders: degrees(hips, shoulders),
            legs_from_down: largest(legs.map(|leg| degrees(leg, -trunk))),
            knees: bend([
                [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle],
                [Joint::RightHip, Joint::RightKnee, Joint::RightAnkle],
            ]),
            elbows: bend([
                [Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist],
                [Joint::RightShoulder, Joint::RightElbow, Joint::RightWrist],
            ]),
            arms_from_up: arms.map(|arm| degrees(arm, trunk)),
            arms_outward: arms[0].dot(&left) > -0.2 * arms[0].norm()
                && arms[1].dot(&left) < 0.2 * arms[1].norm(),
            toes_forward: toes
                .into_iter()
                .flatten()
                .all(|toe| toe.dot(&forward) > 0.0),
        }
    }

    /// A human who stands straight: T-pose, A-pose or arms hanging.
    pub fn stands(&self) -> bool {
        let upright = self.trunk.norm() > 0.0 && self.legs_from_down < 35.0 && self.knees < 25.0;
        let square = self.hips_against_shoulders < 30.0
            && (angle_between(self.trunk, self.left).to_degrees() - 90.0).abs() < 25.0;
        upright
            && square
            && self.elbows < 40.0
            && self.arms_outward
            && self.toes_forward
            && self.arms_from_up.iter().all(|&up| up > 60.0)
    }

    /// A T-pose: stands, arms level.
    pub fn is_t_pose(&self) -> bool {
        self.stands() && self.arms_from_up.iter().all(|&up| (up - 90.0).abs() < 25.0)
    }

    /// The angles in words, for an error.
    pub fn describe(&self) -> String {
        format!(
            "legs {:.0} deg from the trunk's line, knees bent {:.0}, elbows {:.0}, arms {:.0} and {:.0} from up",
            self.legs_from_down,
            self.knees,
            self.elbows,
            self.arms_from_up[0],
            self.arms_from_up[1]
        )
    }
}

fn degrees(from: Vector3<f64>, to: Vector3<f64>) -> f64 {
    angle_between(from, to).to_degrees()
}

fn largest(values: [f64; 2]) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// From the ankles to the toes, left and right, file units, where the map has toes.
fn toes(
    pose: &SkeletonPose,
    map: &BoundMap,
    ankles: [Vector3<f64>; 2],
) -> [Option<Vector3<f64>>; 2] {
    let toe = |ankle: Vector3<f64>, point: Option<Point>| match point? {
        Point::Joint(index) => Some(pose.world_from_joint[index].translation.vector - ankle),
        Point::Tip(index) => pose.tips[index].map(|tip| tip - ankle),
    };
    [
        toe(ankles[0], map.toes.left),
        toe(ankles[1], map.toes.right),
    ]
}
