//! How far the retargeted bones point away from the source's.

use cromosim_body::{BodyPose, JOINT_COUNT, Joint, ShapedBody};
use nalgebra::Vector3;

use super::floor::quantile;
use super::source::Source;
use crate::RetargetReport;
use crate::axes::angle_between;
use crate::skeleton_map::Point;

/// Angles over all frames, degrees.
struct BoneDirections {
    median_deg: f64,
    max_deg: f64,
    /// Median of each bone, worst first.
    bones: Vec<(String, f64)>,
}

/// A bone or line: its name, and where it begins and ends in both skeletons.
struct Line {
    name: &'static str,
    ours: ([Joint; 2], [Joint; 2]),
    theirs: ([Point; 2], [Point; 2]),
}

/// The report as far as source and bones tell it; `frames` are compared with the clip's frames from
/// `first` on.
pub(super) fn report(
    source: &Source<'_>,
    shaped: &ShapedBody,
    frames: &[BodyPose],
    first: usize,
) -> RetargetReport {
    let directions = bone_directions(source, shaped, frames, first);
    RetargetReport {
        map: source.map.name.clone(),
        up_axis: String::new(),
        unit_scale_m: source.unit_scale_m,
        source_height_m: 0.0,
        rest: source.rest.origin.to_string(),
        leg_ratio: 0.0,
        frames_left_out: first,
        bone_direction_median_deg: directions.median_deg,
        bone_direction_max_deg: directions.max_deg,
        bones: directions.bones,
        betas: Vec::new(),
        bone_length_rms_m: 0.0,
        floor_shift_m: 0.0,
    }
}

/// Compares `frames` with the clip's frames from `first` on.
fn bone_directions(
    source: &Source<'_>,
    shaped: &ShapedBody,
    frames: &[BodyPose],
    first: usize,
) -> BoneDirections {
    let lines = lines(source);
    let mut angles: Vec<Vec<f64>> = vec![Vec::with_capacity(frames.len()); lines.len()];
    for (index, pose) in frames.iter().enumerate() {
        let segments = shaped.world_from_segments(pose);
        let joints: [Vector3<f64>; JOINT_COUNT] =
            segments.map(|segment| segment.translation.vector);
        let skeleton = source.clip.pose_of_frame(first + index);
        let point = |point: Point| match point {
            Point::Joint(joint) => skeleton.world_from_joint[joint].translation.vector,
            Point::Tip(joint) => skeleton.tips[joint].unwrap_or_default(),
        };
        for (line, angles) in lines.iter().zip(&mut angles) {
            let ours = |[a, b]: [Joint; 2]| (joints[a.index()] + joints[b.index()]) / 2.0;
            let theirs = |[a, b]: [Point; 2]| (point(a) + point(b)) / 2.0;
            let direction =
                source.world_from_file * (theirs(line.theirs.1) - theirs(line.theirs.0));
            angles
                .push(angle_between(ours(line.ours.1) - ours(line.ours.0), direction).to_degrees());
        }
    }
    let mut all: Vec<f64> = angles.iter().flatten().copied().collect();
    let mut bones: Vec<_> = lines
        .iter()
        .zip(&mut angles)
        .map(|(line, angles)| (line.name.to_owned(), quantile(angles, 0.5)))
        .collect();
    bones.sort_by(|left, right| right.1.total_cmp(&left.1));
    let median_deg = quantile(&mut all, 0.5);
    BoneDirections {
        median_deg,
        max_deg: all.last().copied().unwrap_or(0.0),
        bones,
    }
}

/// The lines that both skeletons have.
fn lines(source: &Source<'_>) -> Vec<Line> {
    use Joint::{
        Head, LeftAnkle, LeftElbow, LeftFoot, LeftHand, LeftHip, LeftKnee, LeftShoulder, LeftWrist,
        Neck, RightAnkle, RightElbow, RightFoot, RightHand, RightHip, RightKnee, RightShoulder,
        RightWrist,
    };
    let map = &source.map;
    let joint = |joint: Joint| map.joints[joint.index()].map(Point::Joint);
    let bones = [
        ("left upper arm", LeftShoulder, LeftElbow, joint(LeftElbow)),
        (
            "right upper arm",
            RightShoulder,
            RightElbow,
            joint(RightElbow),
        ),
        ("left forearm", LeftElbow, LeftWrist, joint(LeftWrist)),
        ("right forearm", RightElbow, RightWrist, joint(RightWrist)),
        ("left hand", LeftWrist, LeftHand, map.hands.left),
        ("right hand", RightWrist, RightHand, map.hands.right),
        ("left thigh", LeftHip, LeftKnee, joint(LeftKnee)),
        ("right thigh", RightHip, RightKnee, joint(RightKnee)),
        ("left shin", LeftKnee, LeftAnkle, joint(LeftAnkle)),
        ("right shin", RightKnee, RightAnkle, joint(RightAnkle)),
        ("left foot", LeftAnkle, LeftFoot, map.toes.left),
        ("right foot", RightAnkle, RightFoot, map.toes.right),
        ("neck", Neck, Head, joint(Head)),
        ("across the hips", RightHip, LeftHip, joint(LeftHip)),
        (
            "across the shoulders",
            RightShoulder,
            LeftShoulder,
            joint(LeftShoulder),
        ),
    ];
    let bone = |(name, from, to, end): (&'static str, Joint, Joint, Option<Point>)| {
        let (start, end) = (joint(from)?, end?);
        Some(Line {
            name,
            ours: ([from; 2], [to; 2]),
            theirs: ([start; 2], [end; 2]),
        })
    };
    let mut lines: Vec<Line> = bones.into_iter().filter_map(bone).collect();
    if let (Some(left), Some(right), Some(neck)) = (joint(LeftHip), joint(RightHip), joint(Neck)) {
        lines.push(Line {
            name: "trunk",
            ours: ([LeftHip, RightHip], [Neck; 2]),
            theirs: ([left, right], [neck; 2]),
        });
    }
    lines
}
