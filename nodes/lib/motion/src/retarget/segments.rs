//! Rotations of all 24 segments from those that the source has.

use cromosim_body::{JOINT_COUNT, Joint};
use nalgebra::UnitQuaternion;

use crate::motion::slerp;

/// The spine, from below: segments that a source skips share the rotation between their neighbours.
const SPINE: [Joint; 6] = [
    Joint::Pelvis,
    Joint::Spine1,
    Joint::Spine2,
    Joint::Spine3,
    Joint::Neck,
    Joint::Head,
];

/// World rotations of all segments. A skipped segment of the spine stands between the nearest known
/// ones below and above, in equal steps; any other moves with its parent. The pelvis must be known,
/// or it is taken as unturned.
pub(super) fn complete(
    known: [Option<UnitQuaternion<f64>>; JOINT_COUNT],
) -> [UnitQuaternion<f64>; JOINT_COUNT] {
    let mut world_from_segment = known.map(Option::unwrap_or_default);
    for joint in Joint::ALL {
        if known[joint.index()].is_none() {
            let from_spine = SPINE
                .iter()
                .position(|&spine| spine == joint)
                .and_then(|place| between(&known, place));
            let parent = joint
                .parent()
                .map_or_else(UnitQuaternion::identity, |parent| {
                    world_from_segment[parent.index()]
                });
            world_from_segment[joint.index()] = from_spine.unwrap_or(parent);
        }
    }
    world_from_segment
}

fn between(
    known: &[Option<UnitQuaternion<f64>>; JOINT_COUNT],
    place: usize,
) -> Option<UnitQuaternion<f64>> {
    let at = |place: usize| known[SPINE[place].index()];
    let below = (0..place).rev().find(|&place| at(place).is_some())?;
    let above = (place + 1..SPINE.len()).find(|&place| at(place).is_some())?;
    Some(slerp(
        &at(below)?,
        &at(above)?,
        (place - below) as f64 / (above - below) as f64,
    ))
}

/// parent_from_joint of every joint, and world_from_pelvis.
pub(super) fn local_rotations(
    world_from_segment: &[UnitQuaternion<f64>; JOINT_COUNT],
) -> [UnitQuaternion<f64>; JOINT_COUNT] {
    std::array::from_fn(|index| {
        let own = world_from_segment[index];
        let local = Joint::ALL[index].parent().map_or(own, |parent| {
            world_from_segment[parent.index()].inverse() * own
        });
        UnitQuaternion::new_normalize(local.into_inner())
    })
}
