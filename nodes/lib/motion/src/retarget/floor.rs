//! Feet on the floor.

use cromosim_body::{BodyPose, Joint, ShapedBody};
use nalgebra::Vector3;

/// A foot slower than this stands, m/s.
const STANDING_SPEED: f64 = 0.25;
/// Vertices within this height of the lowest one belong to the sole, m.
const SOLE_THICKNESS_M: f64 = 0.012;

/// Points of a sole, each fixed to a segment.
pub(crate) struct Sole {
    ankle: Joint,
    points: Vec<(Joint, Vector3<f64>)>,
}

impl Sole {
    /// The soles of a shaped body, left and right: the outermost low vertices before and behind the
    /// toe joint, fixed to toes and foot.
    pub fn both(shaped: &ShapedBody) -> [Self; 2] {
        let sole = |ankle: Joint, foot: Joint, side: f64| {
            let joints = shaped.joints_in_model();
            let own = shaped
                .rest_vertices()
                .iter()
                .filter(|vertex| vertex.x * side > 0.0);
            let lowest = own.clone().map(|vertex| vertex.y).fold(f64::MAX, f64::min);
            let low: Vec<&Vector3<f64>> = own
                .filter(|vertex| vertex.y < lowest + SOLE_THICKNESS_M)
                .collect();
            let toe_z = joints[foot.index()].z;
            let mut points = Vec::new();
            for (segment, toes) in [(ankle, false), (foot, true)] {
                let part = || low.iter().filter(|vertex| (vertex.z > toe_z) == toes);
                for axis in [
                    Vector3::x(),
                    -Vector3::x(),
                    Vector3::z(),
                    -Vector3::z(),
                    -Vector3::y(),
                ] {
                    let outermost = part().max_by(|a, b| a.dot(&axis).total_cmp(&b.dot(&axis)));
                    points.extend(
                        outermost.map(|vertex| (segment, **vertex - joints[segment.index()])),
                    );
                }
            }
            Self { ankle, points }
        };
        [
            sole(Joint::LeftAnkle, Joint::LeftFoot, 1.0),
            sole(Joint::RightAnkle, Joint::RightFoot, -1.0),
        ]
    }

    /// Height of the lowest point of the sole in a pose, m.
    pub fn height(&self, shaped: &ShapedBody, pose: &BodyPose) -> f64 {
        let segments = shaped.world_from_segments(pose);
        let heights = self.points.iter().map(|(segment, point)| {
            let frame = &segments[segment.index()];
            (frame.rotation * point + frame.translation.vector).z
        });
        heights.fold(f64::MAX, f64::min)
    }
}

/// How far soles on the same floor are apart, m: noise of the recording and the roll of the foot.
const SAME_FLOOR_M: f64 = 0.03;

/// Raises all frames so that standing soles are at z = 0, and says by how much, m. The floor is the
/// lowest level on which soles stand (who climbs stairs stands on several): the median of the
/// heights near their lowest tenth. Where hardly a foot stands still, the floor is where the lowest
/// twentieth of all soles ends.
pub(crate) fn stand_on_floor(shaped: &ShapedBody, frames: &mut [BodyPose], rate_hz: f64) -> f64 {
    let soles = Sole::both(shaped);
    let ankles: Vec<[Vector3<f64>; 2]> = frames
        .iter()
        .map(|pose| {
            let segments = shaped.world_from_segments(pose);
            [0, 1].map(|side| segments[soles[side].ankle.index()].translation.vector)
        })
        .collect();
    let (mut standing, mut lowest) = (Vec::new(), Vec::new());
    for (index, pose) in frames.iter().enumerate() {
        let heights = [0, 1].map(|side| soles[side].height(shaped, pose));
        lowest.push(heights[0].min(heights[1]));
        let next = (index + 1).min(frames.len() - 1);
        for side in 0..2 {
            if frames.len() > 1
                && (ankles[next][side] - ankles[index][side]).norm() * rate_hz < STANDING_SPEED
            {
                standing.push(heights[side]);
            }
        }
    }
    let floor = if standing.len() * 20 >= frames.len() {
        let level = quantile(&mut standing, 0.1);
        standing.retain(|height| (height - level).abs() < SAME_FLOOR_M);
        quantile(&mut standing, 0.5)
    } else {
        quantile(&mut lowest, 0.05)
    };
    for pose in frames.iter_mut() {
        pose.root_position.z -= floor;
    }
    -floor
}

/// The value below which `fraction` of the values lie; 0 without values.
pub(super) fn quantile(values: &mut [f64], fraction: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values
        .get(((values.len().saturating_sub(1)) as f64 * fraction).round() as usize)
        .copied()
        .unwrap_or(0.0)
}
