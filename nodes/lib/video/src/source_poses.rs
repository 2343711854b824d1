//! Poses from the camera's axes into the world of the reconstruction ("source").

use cromosim_body::BodyPose;
use cromosim_motion::slerp;
use nalgebra::{Isometry3, UnitQuaternion};

use crate::clip::CameraClip;
use crate::pinhole::Camera;

/// Poses with their root orientation in the reconstruction's world, root at its origin, and how
/// many poses and cameras were bridged.
pub(crate) struct SourcePoses {
    pub poses: Vec<BodyPose>,
    /// Positions in the reconstruction's unit.
    pub cameras: Vec<Camera>,
    pub poses_bridged: usize,
    pub cameras_bridged: usize,
}

/// world_from_pelvis = world_from_camera camera_from_pelvis. Frames without a pose, or without a
/// camera, take what lies between the neighbours that have one. `None` where there is no pose or no
/// camera at all.
pub(crate) fn source_poses(clip: &CameraClip) -> Option<SourcePoses> {
    let (cameras, cameras_bridged) = bridged(&clip.cameras, between_cameras)?;
    let own: Vec<Option<BodyPose>> = clip
        .poses
        .iter()
        .zip(&cameras)
        .zip(&clip.pose_confidence)
        .map(|((pose, camera), confidence)| {
            let mut pose = BodyPose {
                root_position: nalgebra::Vector3::zeros(),
                ..pose.clone()
            };
            pose.local_rotations[0] = camera.world_from_camera.rotation * pose.local_rotations[0];
            (*confidence > 0.0).then_some(pose)
        })
        .collect();
    let (poses, poses_bridged) = bridged(&own, between_poses)?;
    Some(SourcePoses {
        poses,
        cameras,
        poses_bridged,
        cameras_bridged,
    })
}

/// Every item, gaps filled between the items around them, and how many were filled. `None` without
/// any item.
fn bridged<T: Clone>(
    items: &[Option<T>],
    between: impl Fn(&T, &T, f64) -> T,
) -> Option<(Vec<T>, usize)> {
    let known: Vec<(usize, &T)> = items
        .iter()
        .enumerate()
        .filter_map(|(index, item)| Some((index, item.as_ref()?)))
        .collect();
    let (first, last) = (known.first()?.1, known.last()?.1);
    let mut next = 0;
    let filled = (0..items.len())
        .map(|index| {
            while known.get(next).is_some_and(|(place, _)| *place < index) {
                next += 1;
            }
            match (
                next.checked_sub(1).and_then(|before| known.get(before)),
                known.get(next),
            ) {
                (_, Some((place, item))) if *place == index => (*item).clone(),
                (Some((from, before)), Some((to, after))) => {
                    between(before, after, (index - from) as f64 / (to - from) as f64)
                }
                (None, _) => first.clone(),
                (_, None) => last.clone(),
            }
        })
        .collect();
    Some((filled, items.len() - known.len()))
}

fn between_poses(from: &BodyPose, to: &BodyPose, fraction: f64) -> BodyPose {
    let rotation = |joint: usize| -> UnitQuaternion<f64> {
        slerp(
            &from.local_rotations[joint],
            &to.local_rotations[joint],
            fraction,
        )
    };
    BodyPose {
        root_position: from.root_position,
        local_rotations: std::array::from_fn(rotation),
    }
}

fn between_cameras(from: &Camera, to: &Camera, fraction: f64) -> Camera {
    let (a, b) = (from.world_from_camera, to.world_from_camera);
    let position = a.translation.vector.lerp(&b.translation.vector, fraction);
    Camera {
        world_from_camera: Isometry3::from_parts(
            position.into(),
            slerp(&a.rotation, &b.rotation, fraction),
        ),
        ..*from
    }
}
