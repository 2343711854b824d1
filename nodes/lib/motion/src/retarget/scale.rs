//! The source's up axis and unit of length.

use std::sync::Arc;

use cromosim_body::{BodyModel, Joint};
use nalgebra::Vector3;

use super::rest::Rest;
use super::stance::Stance;
use crate::axes::{UpAxis, nearest_axis};
use crate::skeleton_map::BoundMap;
use crate::{BvhClip, MotionError};

/// Metres per unit: metre, centimetre, millimetre, inch, foot, and CMU's own (inches times 0.45).
const USUAL_UNITS_M: [f64; 6] = [1.0, 0.01, 0.001, 0.0254, 0.3048, 0.0254 / 0.45];
/// Heights that a skeleton may have, m; the usual units are so far apart that at most one fits.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 1.2..=2.2;
/// Enough frames to tell which way is up.
const SAMPLES: usize = 200;

/// The up axis in the file: as chosen; else that of a standing zero pose, if the motion agrees;
/// else +y or +z, whichever points from feet to head on average.
pub(super) fn up_axis(
    clip: &BvhClip,
    map: &BoundMap,
    choice: UpAxis,
) -> Result<Vector3<f64>, MotionError> {
    if let Some(direction) = choice.direction() {
        return Ok(direction);
    }
    let mean = mean_upward(clip, map);
    let zero = Stance::in_pose(&clip.zero_pose(), map);
    let by_zero_pose = zero.stands().then(|| nearest_axis(zero.trunk));
    let agreed = by_zero_pose.filter(|axis| axis.dot(&mean) > 0.3);
    let by_motion = [Vector3::y(), Vector3::z()]
        .into_iter()
        .find(|axis| axis.dot(&mean) > 0.6);
    agreed
        .or(by_motion)
        .or(by_zero_pose)
        .ok_or_else(|| MotionError::UpAxis {
            name: clip.name().to_owned(),
            mean: mean.into(),
        })
}

/// Mean of the directions from between the ankles to the neck or head.
fn mean_upward(clip: &BvhClip, map: &BoundMap) -> Vector3<f64> {
    let step = clip.frame_count().div_ceil(SAMPLES);
    let mut sum = Vector3::zeros();
    for index in (0..clip.frame_count()).step_by(step) {
        let frames = clip.world_from_joints(index);
        let at =
            |joint: Joint| map.joints[joint.index()].map(|index| frames[index].translation.vector);
        let (Some(left), Some(right), Some(top)) = (
            at(Joint::LeftAnkle),
            at(Joint::RightAnkle),
            at(Joint::Neck).or(at(Joint::Head)),
        ) else {
            continue;
        };
        sum += (top - (left + right) / 2.0)
            .try_normalize(0.0)
            .unwrap_or_default();
    }
    sum / clip.frame_count().div_ceil(step) as f64
}

/// Metres per unit, and the height in metres that the source then has.
pub(super) fn unit_scale(
    name: &str,
    map: &BoundMap,
    rest: &Rest,
    body: &Arc<BodyModel>,
    choice: Option<f64>,
) -> Result<(f64, f64), MotionError> {
    let height_units = height_in_units(map, rest, body);
    if let Some(scale) = choice {
        if scale > 0.0 && scale.is_finite() {
            return Ok((scale, height_units * scale));
        }
        let expected = "metres per unit, more than 0".to_owned();
        return Err(MotionError::Setting {
            name: name.to_owned(),
            setting: "unit_scale_m",
            value: scale,
            expected,
        });
    }
    let plausible = |scale: &f64| HEIGHTS_M.contains(&(height_units * scale));
    let scale = map
        .unit_scale_m
        .into_iter()
        .chain(USUAL_UNITS_M)
        .find(plausible);
    scale
        .map(|scale| (scale, height_units * scale))
        .ok_or_else(|| MotionError::Unit {
            name: name.to_owned(),
            height_units,
        })
}

/// The body's height times the ratio of bones: legs, trunk and, where both have it, neck.
fn height_in_units(map: &BoundMap, rest: &Rest, body: &Arc<BodyModel>) -> f64 {
    let (joints, _) = body.joint_shape_directions();
    let ours = |joint: Joint| Some(joints[joint.index()]);
    let theirs = |joint: Joint| rest.joint(map, joint);
    let top = [Joint::Neck, Joint::Head]
        .into_iter()
        .filter(|joint| map.joints[joint.index()].is_some())
        .collect::<Vec<_>>();
    let sum = |at: &dyn Fn(Joint) -> Option<Vector3<f64>>| {
        let distance = |from: Option<Vector3<f64>>, to: Option<Vector3<f64>>| {
            from.zip(to).map_or(0.0, |(from, to)| (to - from).norm())
        };
        let mid_hips = at(Joint::LeftHip)
            .zip(at(Joint::RightHip))
            .map(|(left, right)| (left + right) / 2.0);
        let trunk = distance(mid_hips, top.first().and_then(|&joint| at(joint)));
        let neck: f64 = top
            .windows(2)
            .map(|pair| distance(at(pair[0]), at(pair[1])))
            .sum();
        leg_length(at) + trunk + neck
    };
    let heights = body.template().iter().map(|vertex| vertex.y);
    let height_m = heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min);
    height_m * sum(&theirs) / sum(&ours)
}

/// Thigh and shin, mean of both sides; 0 where a joint is missing.
pub(crate) fn leg_length(at: &dyn Fn(Joint) -> Option<Vector3<f64>>) -> f64 {
    let bone = |from: Joint, to: Joint| {
        at(from)
            .zip(at(to))
            .map_or(0.0, |(from, to)| (to - from).norm())
    };
    let left = bone(Joint::LeftHip, Joint::LeftKnee) + bone(Joint::LeftKnee, Joint::LeftAnkle);
    (left + bone(Joint::RightHip, Joint::RightKnee) + bone(Joint::RightKnee, Joint::RightAnkle))
        / 2.0
}
