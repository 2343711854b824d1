//! The source's rest pose: which one, and how its joints' frames stand in the body's axes.

use std::fmt;

use cromosim_body::Joint;
use nalgebra::{UnitQuaternion, Vector3};

use super::stance::Stance;
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
    /// One rotation for every joint of the source.
    pub body_from_joint: Vec<UnitQuaternion<f64>>,
    /// One position for every joint of the source, file units, from an arbitrary origin.
    positions: Vec<Vector3<f64>>,
    /// The tips of bones that end in one, file units.
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
    let zero_stance = Stance::in_pose(&zero_pose, map);
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
            let name = &map.name;
            fail(format!("map {name} has no rest_axes for all its joints"))
        }),
        RestChoice::Frame(index) => chosen_frame(clip, map, index, up_in_file).map_err(fail),
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

/// The rest pose in a frame that the options name; what is wrong with it, else.
fn chosen_frame(
    clip: &BvhClip,
    map: &BoundMap,
    index: usize,
    up_in_file: Vector3<f64>,
) -> Result<Rest, String> {
    let last = clip.frame_count() - 1;
    if index > last {
        return Err(format!(
            "frame {index} asked for, but the last one is {last}"
        ));
    }
    from_frame(clip, map, index, up_in_file, Stance::stands).ok_or_else(|| {
        format!(
            "frame {index} is no standing human ({})",
            Stance::in_pose(&clip.pose_of_frame(index), map).describe()
        )
    })
}

/// Columns left, up, forward in the file's axes. A zero pose is drawn along the axes: a direction
/// near an axis is taken as that axis.
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

/// Columns left, up, forward, with `left` made perpendicular to `up`.
fn upright(left: Vector3<f64>, up: Vector3<f64>) -> UnitQuaternion<f64> {
    let up = up.normalize();
    frame_of(left - up * up.dot(&left), up)
}

/// The pose in which the joints have the map's axes.
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
    Stance::in_pose(&pose, map)
        .stands()
        .then(|| Rest::new(RestOrigin::Map, &pose, UnitQuaternion::identity()))
}

/// The pose of a frame, where it suits.
fn from_frame(
    clip: &BvhClip,
    map: &BoundMap,
    index: usize,
    up: Vector3<f64>,
    suits: impl Fn(&Stance) -> bool,
) -> Option<Rest> {
    let pose = clip.pose_of_frame(index);
    let stance = Stance::in_pose(&pose, map);
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
