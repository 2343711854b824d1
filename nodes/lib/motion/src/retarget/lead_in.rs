//! A T-pose before the motion, and the jump or blend from it.

use cromosim_body::{BodyPose, JOINT_COUNT, Joint, ShapedBody};
use nalgebra::Vector3;

use super::source::Source;
use super::stance::Stance;

/// How long a blend from the T-pose may last, s.
const LONGEST_BLEND_S: f64 = 0.25;
/// The motion after that which a blend is compared with, s.
const COMPARED_S: f64 = 0.5;
/// By how much a blend exceeds it.
const EXCESS: f64 = 2.0;

/// Leading frames that are no motion: those in T-pose, and those after them, up to a quarter of a
/// second, in which a wrist, ankle or the head is accelerated against the pelvis twice as much as
/// ever in the half second after it. 0 for a clip that does not start with a T-pose, or that is one
/// for the greater part.
pub(super) fn frames_to_leave_out(
    source: &Source<'_>,
    shaped: &ShapedBody,
    frames: &[BodyPose],
) -> usize {
    let t_pose =
        |index: usize| Stance::in_pose(&source.clip.pose_of_frame(index), &source.map).is_t_pose();
    let leading = (0..frames.len()).take_while(|&index| t_pose(index)).count();
    if leading == 0 || leading * 2 > frames.len() {
        return 0;
    }
    let window_end = leading + (LONGEST_BLEND_S * source.clip.rate_hz()).ceil() as usize;
    if window_end + 10 > frames.len() {
        return leading;
    }
    let tracks: Vec<[Vector3<f64>; JOINT_COUNT]> = frames
        .iter()
        .map(|pose| relative_to_pelvis(shaped, pose))
        .collect();
    let jolt = |index: usize| {
        [
            Joint::LeftWrist,
            Joint::RightWrist,
            Joint::LeftAnkle,
            Joint::RightAnkle,
            Joint::Head,
        ]
        .map(|joint| {
            let at = |index: usize| tracks[index][joint.index()];
            (at(index + 1) - 2.0 * at(index) + at(index - 1)).norm()
        })
        .into_iter()
        .fold(0.0, f64::max)
    };
    let compared_end =
        (window_end + (COMPARED_S * source.clip.rate_hz()).ceil() as usize).min(frames.len() - 1);
    let usual = (window_end..compared_end).map(jolt).fold(0.0, f64::max);
    // A jolt at a frame means that the frame before it does not belong to the same motion.
    (leading..window_end)
        .rev()
        .find(|&index| jolt(index) > EXCESS * usual)
        .unwrap_or(leading)
}

/// Joints in the pelvis' axes: a blend of the root's heading is not in the way.
fn relative_to_pelvis(shaped: &ShapedBody, pose: &BodyPose) -> [Vector3<f64>; JOINT_COUNT] {
    let segments = shaped.world_from_segments(pose);
    std::array::from_fn(|joint| {
        segments[0].rotation.inverse()
            * (segments[joint].translation.vector - segments[0].translation.vector)
    })
}
