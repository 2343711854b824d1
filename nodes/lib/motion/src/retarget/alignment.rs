//! How SMPL's T-pose is turned into the source's rest pose, segment by segment.

use cromosim_body::{JOINT_COUNT, Joint};
use nalgebra::{UnitQuaternion, Vector3};

use super::rest::Rest;
use crate::axes::{frame_of, minimal_rotation};
use crate::skeleton_map::{BoundMap, FeetAtRest, Point};

type Joints = [Vector3<f64>; JOINT_COUNT];

/// One side's joints, from the trunk outwards.
struct Limb {
    collar: Joint,
    shoulder: Joint,
    elbow: Joint,
    wrist: Joint,
    hand: Joint,
    hip: Joint,
    knee: Joint,
    ankle: Joint,
    foot: Joint,
}

const LEFT: Limb = Limb {
    collar: Joint::LeftCollar,
    shoulder: Joint::LeftShoulder,
    elbow: Joint::LeftElbow,
    wrist: Joint::LeftWrist,
    hand: Joint::LeftHand,
    hip: Joint::LeftHip,
    knee: Joint::LeftKnee,
    ankle: Joint::LeftAnkle,
    foot: Joint::LeftFoot,
};

const RIGHT: Limb = Limb {
    collar: Joint::RightCollar,
    shoulder: Joint::RightShoulder,
    elbow: Joint::RightElbow,
    wrist: Joint::RightWrist,
    hand: Joint::RightHand,
    hip: Joint::RightHip,
    knee: Joint::RightKnee,
    ankle: Joint::RightAnkle,
    foot: Joint::RightFoot,
};

/// For each SMPL segment the rotation, in the body's axes, from SMPL's T-pose to the source's rest
/// pose.
///
/// Trunk: two vectors, from the hips to the neck and across the hips (pelvis) or shoulders (spine
/// and collars). Arms and legs: the smallest rotation from bone to bone, going out from what the
/// segment before it has: a bent elbow keeps the roll of a hinge. Hands: the bone and the thumb's
/// side where the source has fingers. Feet: heading and sole, since the toe joint's height differs
/// from skeleton to skeleton.
pub(super) fn alignments(
    map: &BoundMap,
    rest: &Rest,
    joints: &Joints,
) -> [UnitQuaternion<f64>; JOINT_COUNT] {
    let mut alignments = [UnitQuaternion::identity(); JOINT_COUNT];
    let pelvis = trunk(map, rest, joints, Joint::LeftHip, Joint::RightHip);
    let chest = trunk(map, rest, joints, Joint::LeftShoulder, Joint::RightShoulder);
    alignments[Joint::Pelvis.index()] = pelvis;
    for joint in [Joint::Spine1, Joint::Spine2, Joint::Spine3] {
        alignments[joint.index()] = chest;
    }
    alignments[Joint::Neck.index()] = bone(
        map,
        rest,
        joints,
        Joint::Neck,
        Joint::Head,
        UnitQuaternion::identity(),
    );
    let sides = [
        (&LEFT, map.hands.left, map.toes.left, map.thumb_sides.left),
        (
            &RIGHT,
            map.hands.right,
            map.toes.right,
            map.thumb_sides.right,
        ),
    ];
    for (limb, hand_point, toe_point, thumb_side) in sides {
        alignments[limb.collar.index()] = chest;
        let [upper_arm, forearm, hand] = arm(map, rest, joints, limb, hand_point, thumb_side);
        alignments[limb.shoulder.index()] = upper_arm;
        alignments[limb.elbow.index()] = forearm;
        alignments[limb.wrist.index()] = hand;
        alignments[limb.hand.index()] = hand;
        let [thigh, shin, foot] = leg(map, rest, joints, limb, toe_point);
        alignments[limb.hip.index()] = thigh;
        alignments[limb.knee.index()] = shin;
        alignments[limb.ankle.index()] = foot;
        alignments[limb.foot.index()] = foot;
    }
    alignments
}

/// Upper arm, forearm and hand.
fn arm(
    map: &BoundMap,
    rest: &Rest,
    joints: &Joints,
    limb: &Limb,
    hand_point: Option<Point>,
    thumb_side: Option<[Point; 2]>,
) -> [UnitQuaternion<f64>; 3] {
    let unturned = UnitQuaternion::identity();
    let upper_arm = bone(map, rest, joints, limb.shoulder, limb.elbow, unturned);
    let forearm = bone(map, rest, joints, limb.elbow, limb.wrist, upper_arm);
    let hand = rest
        .joint(map, limb.wrist)
        .zip(hand_point.and_then(|point| rest.point(point)))
        .map(|(wrist, point)| point - wrist);
    let side = thumb_side.and_then(|[from, to]| Some(rest.point(to)? - rest.point(from)?));
    let ours = joints[limb.hand.index()] - joints[limb.wrist.index()];
    let hand = hand_alignment(ours, hand, side, forearm);
    [upper_arm, forearm, hand]
}

/// Thigh, shin and foot.
fn leg(
    map: &BoundMap,
    rest: &Rest,
    joints: &Joints,
    limb: &Limb,
    toe_point: Option<Point>,
) -> [UnitQuaternion<f64>; 3] {
    let unturned = UnitQuaternion::identity();
    let thigh = bone(map, rest, joints, limb.hip, limb.knee, unturned);
    let shin = bone(map, rest, joints, limb.knee, limb.ankle, thigh);
    let toe = rest
        .joint(map, limb.ankle)
        .zip(toe_point.and_then(|point| rest.point(point)))
        .map(|(ankle, toe)| toe - ankle);
    let level = if map.feet == FeetAtRest::WithShins {
        shin
    } else {
        unturned
    };
    let ours = joints[limb.foot.index()] - joints[limb.ankle.index()];
    [thigh, shin, foot_alignment(ours, toe, level)]
}

/// From the lines mid-hips to neck (exactly) and right to left.
fn trunk(
    map: &BoundMap,
    rest: &Rest,
    joints: &Joints,
    left: Joint,
    right: Joint,
) -> UnitQuaternion<f64> {
    let top = if map.joints[Joint::Neck.index()].is_some() {
        Joint::Neck
    } else {
        Joint::Head
    };
    let frame = |at: &dyn Fn(Joint) -> Option<Vector3<f64>>| {
        let up = at(top)? - (at(Joint::LeftHip)? + at(Joint::RightHip)?) / 2.0;
        Some(frame_of(up, at(left)? - at(right)?))
    };
    let theirs = frame(&|joint| rest.joint(map, joint));
    let ours = frame(&|joint| Some(joints[joint.index()]));
    theirs
        .zip(ours)
        .map_or_else(UnitQuaternion::identity, |(theirs, ours)| {
            theirs * ours.inverse()
        })
}

/// The smallest rotation, after `before`, that lays SMPL's bone on the source's.
fn bone(
    map: &BoundMap,
    rest: &Rest,
    joints: &Joints,
    from: Joint,
    to: Joint,
    before: UnitQuaternion<f64>,
) -> UnitQuaternion<f64> {
    match rest.joint(map, from).zip(rest.joint(map, to)) {
        Some((start, end)) => {
            minimal_rotation(
                before * (joints[to.index()] - joints[from.index()]),
                end - start,
            ) * before
        }
        None => before,
    }
}

/// SMPL's palms look down in the T-pose, so the thumbs' side is forward.
fn hand_alignment(
    ours: Vector3<f64>,
    theirs: Option<Vector3<f64>>,
    thumb_side: Option<Vector3<f64>>,
    forearm: UnitQuaternion<f64>,
) -> UnitQuaternion<f64> {
    match (theirs, thumb_side) {
        (Some(theirs), Some(side))
            if theirs.cross(&side).norm() > 0.1 * theirs.norm() * side.norm() =>
        {
            frame_of(theirs, side) * frame_of(ours, Vector3::z()).inverse()
        }
        (Some(theirs), _) => minimal_rotation(forearm * ours, theirs) * forearm,
        (None, _) => forearm,
    }
}

/// `level` says how the sole stands; about its normal the foot is turned to the toe's heading. A
/// foot that points far down has no heading: it is laid bone on bone.
fn foot_alignment(
    ours: Vector3<f64>,
    theirs: Option<Vector3<f64>>,
    level: UnitQuaternion<f64>,
) -> UnitQuaternion<f64> {
    let Some(theirs) = theirs else { return level };
    let in_sole = level.inverse() * theirs;
    let flat = |foot: Vector3<f64>| Vector3::new(foot.x, 0.0, foot.z);
    if flat(in_sole).norm() < 0.5 * in_sole.norm() {
        return minimal_rotation(level * ours, theirs) * level;
    }
    level * minimal_rotation(flat(ours), flat(in_sole))
}
