//! The source's rest pose: which one, and how its joints' frames stand in the body's axes.

use std::fmt;

use cromosim_body::Joint;
use nalgebra::{UnitQuaternion, Vector3};

use crate::axes::{angle_between, frame_of, minimal_rotation, nearest_axis};
use crate::skeleton_map::{BoundMap, Point};
use crate::{BvhClip, MotionError, RestChoice, SkeletonPose};

/// Where a rest pose was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RestOrigin {
    ZeroPose,
    Map,
    Frame(usize),
}

impl fmt::Display for RestOrigin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ZeroPose => formatter.write_str("zero pose"),
            Self::Map => formatter.write_str("map"),
            Self::Frame(index) => write!(formatter, "frame {index}"),
        }
    }
}

/// A rest pose in the body's axes: x left, y up, z forward.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    pub origin: RestOrigin,
    /// Of every source joint.
    pub body_from_joint: Vec<UnitQuaternion<f64>>,
    /// Of every source joint, file units, from an arbitrary origin.
    positions: Vec<Vector3<f64>>,
    tips: Vec<Option<Vector3<f64>>>,
}

impl Rest {
    /// A mapped joint's position, file units.
    pub fn joint(&self, map: &BoundMap, joint: Joint) -> Option<Vector3<f64>> {
        map.joints[joint.index()].map(|index| self.positions[index])
    }

    /// A point's position, file units.
    pub fn point(&self, point: Point) -> Option<Vector3<f64>> {
        match point {
            Point::Joint(index) => Some(self.positions[index]),
            Point::Tip(index) => self.tips[index],
        }
    }

    fn new(origin: RestOrigin, pose: &SkeletonPose, file_from_body: UnitQuaternion<f64>) -> Self {
        let body_from_file = file_from_body.inverse();
        Self {
            origin,
            body_from_joint: pose
                .world_from_joint
                .iter()
                .map(|frame| body_from_file * frame.rotation)
                .collect(),
            positions: pose
                .world_from_joint
                .iter()
                .map(|frame| body_from_file * frame.translation.vector)
                .collect(),
            tips: pose
                .tips
                .iter()
                .map(|tip| tip.map(|tip| body_from_file * tip))
                .collect(),
        }
    }
}

/// How a skeleton stands: what tells a human pose from a heap of bones.
pub(super) struct Stance {
    /// From between the hips to the neck.
    pub trunk: Vector3<f64>,
    /// Right to left, hips and shoulders together.
    left: Vector3<f64>,
    /// Largest angles, degrees.
    hips_against_shoulders: f64,
    legs_from_down: f64,
    knees: f64,
    elbows: f64,
    /// Angles of the arms from the trunk's direction, degrees: 90 in a T-pose.
    arms_from_up: [f64; 2],
    arms_outward: bool,
    toes_forward: bool,
}

impl Stance {
    pub fn of(pose: &SkeletonPose, map: &BoundMap) -> Self {
        let at = |joint: Joint| {
            map.joints[joint.index()].map_or_else(Vector3::zeros, |index| {
                pose.world_from_joint[index].translation.vector
            })
        };
        let top = if map.joints[Joint::Neck.index()].is_some() {
            Joint::Neck
        } else {
            Joint::Head
        };
        let trunk = at(top) - (at(Joint::LeftHip) + at(Joint::RightHip)) / 2.0;
        let hips = at(Joint::LeftHip) - at(Joint::RightHip);
        let shoulders = at(Joint::LeftShoulder) - at(Joint::RightShoulder);
        let left = hips.normalize() + shoulders.normalize();
        let degrees = |from: Vector3<f64>, to: Vector3<f64>| angle_between(from, to).to_degrees();
        let bone = |from: Joint, to: Joint| at(to) - at(from);
        let arms = [
            bone(Joint::LeftShoulder, Joint::LeftWrist),
            bone(Joint::RightShoulder, Joint::RightWrist),
        ];
        let toe = |ankle: Joint, point: Option<Point>| match point {
            Some(Point::Joint(index)) => {
                Some(pose.world_from_joint[index].translation.vector - at(ankle))
            }
            Some(Point::Tip(index)) => pose.tips[index].map(|tip| tip - at(ankle)),
            None => None,
        };
        let toes = [
            toe(Joint::LeftAnkle, map.toes.left),
            toe(Joint::RightAnkle, map.toes.right),
        ];
        let bend = |joints: [[Joint; 3]; 2]| {
            joints
                .map(|[a, b, c]| degrees(bone(a, b), bone(b, c)))
                .into_iter()
                .fold(0.0, f64::max)
        };
        let legs = [
            bone(Joint::LeftHip, Joint::LeftAnkle),
            bone(Joint::RightHip, Joint::RightAnkle),
        ];
        Self {
            trunk,
            left,
            hips_against_shoulders: degrees(hips, shoulders),
            legs_from_down: legs
                .map(|leg| degrees(leg, -trunk))
                .into_iter()
                .fold(0.0, f64::max),
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
                .all(|toe| toe.dot(&left.cross(&trunk)) > 0.0),
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

    fn describe(&self) -> String {
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

/// The rest pose: as chosen, or else the zero pose if it is a standing human, the map's axes, or a
/// T-pose in the first frame.
pub(super) fn choose(
    clip: &BvhClip,
    map: &BoundMap,
    choice: RestChoice,
    up_in_file: Vector3<f64>,
) -> Result<Rest, MotionError> {
    let fail = |problem: String| MotionError::RestPose {
        name: clip.name().to_owned(),
        problem,
    };
    let zero_pose = clip.zero_pose();
    let zero_stance = Stance::of(&zero_pose, map);
    let zero = || {
        Rest::new(
            RestOrigin::ZeroPose,
            &zero_pose,
            body_of_zero_pose(&zero_stance),
        )
    };
    match choice {
        RestChoice::ZeroPose if zero_stance.stands() => Ok(zero()),
        RestChoice::ZeroPose => Err(fail(format!(
            "the zero pose is no standing human ({})",
            zero_stance.describe()
        ))),
        RestChoice::Map => from_map(clip, map).ok_or_else(|| {
            fail(format!(
                "map {} has no rest_axes for all its joints",
                map.name
            ))
        }),
        RestChoice::Frame(index) => {
            let last = clip.frame_count() - 1;
            if index > last {
                return Err(fail(format!(
                    "frame {index} asked for, but the last one is {last}"
                )));
            }
            from_frame(clip, map, index, up_in_file, Stance::stands).ok_or_else(|| {
                fail(format!(
                    "frame {index} is no standing human ({})",
                    Stance::of(&clip.pose_of_frame(index), map).describe()
                ))
            })
        }
        RestChoice::Detect => {
            let first = from_frame(clip, map, 0, up_in_file, Stance::is_t_pose);
            if zero_stance.stands() {
                let zero = zero();
                return Ok(first
                    .filter(|first| rolled(map, &zero, first))
                    .unwrap_or(zero));
            }
            let no_rest = || {
                format!(
                    "the zero pose is no standing human ({}), and frame 0 no T-pose",
                    zero_stance.describe()
                )
            };
            from_map(clip, map).or(first).ok_or_else(|| fail(no_rest()))
        }
    }
}

/// Columns left, up, forward in the file's axes. A zero pose is drawn along the axes: directions
/// near one are taken as it.
fn body_of_zero_pose(stance: &Stance) -> UnitQuaternion<f64> {
    let snapped = |direction: Vector3<f64>| {
        let axis = nearest_axis(direction);
        if angle_between(direction, axis).to_degrees() < 20.0 {
            axis
        } else {
            direction
        }
    };
    let up = snapped(stance.trunk);
    upright(snapped(stance.left), up)
}

/// `left` made level.
fn upright(left: Vector3<f64>, up: Vector3<f64>) -> UnitQuaternion<f64> {
    let up = up.normalize();
    frame_of(left - up * up.dot(&left), up)
}

fn from_map(clip: &BvhClip, map: &BoundMap) -> Option<Rest> {
    let axes = map.rest_axes.as_ref()?;
    // Joints that the map does not name move with their parents.
    let mut rotations: Vec<UnitQuaternion<f64>> = Vec::with_capacity(axes.len());
    for (joint, axes) in clip.joints().iter().zip(axes) {
        let parent = joint
            .parent
            .map_or_else(UnitQuaternion::identity, |parent| rotations[parent]);
        rotations.push(axes.unwrap_or(parent));
    }
    let pose = clip.with_rotations(&rotations);
    Stance::of(&pose, map)
        .stands()
        .then(|| Rest::new(RestOrigin::Map, &pose, UnitQuaternion::identity()))
}

fn from_frame(
    clip: &BvhClip,
    map: &BoundMap,
    index: usize,
    up: Vector3<f64>,
    suits: impl Fn(&Stance) -> bool,
) -> Option<Rest> {
    let pose = clip.pose_of_frame(index);
    let stance = Stance::of(&pose, map);
    suits(&stance).then(|| Rest::new(RestOrigin::Frame(index), &pose, upright(stance.left, up)))
}

/// Whether a limb's frame is rolled about its bone between two rest poses: then the zero pose only
/// looks like a human, for its frames do not stand as a human's would, and the pose that a human
/// was seen in is to be trusted.
fn rolled(map: &BoundMap, zero: &Rest, first: &Rest) -> bool {
    const LIMBS: [(Joint, Joint); 8] = [
        (Joint::LeftHip, Joint::LeftKnee),
        (Joint::RightHip, Joint::RightKnee),
        (Joint::LeftKnee, Joint::LeftAnkle),
        (Joint::RightKnee, Joint::RightAnkle),
        (Joint::LeftShoulder, Joint::LeftElbow),
        (Joint::RightShoulder, Joint::RightElbow),
        (Joint::LeftElbow, Joint::LeftWrist),
        (Joint::RightElbow, Joint::RightWrist),
    ];
    LIMBS.iter().any(|&(from, to)| {
        let bone = |rest: &Rest| Some(rest.joint(map, to)? - rest.joint(map, from)?);
        let (Some(joint), Some(bone_zero), Some(bone_first)) =
            (map.joints[from.index()], bone(zero), bone(first))
        else {
            return false;
        };
        let turn = first.body_from_joint[joint] * zero.body_from_joint[joint].inverse();
        (turn * minimal_rotation(bone_zero, bone_first).inverse())
            .angle()
            .to_degrees()
            > 30.0
    })
}
