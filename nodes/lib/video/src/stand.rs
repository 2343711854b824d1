//! From the reconstruction's world into one with z up and the floor at z = 0.

use cromosim_body::{BodyPose, Joint, ShapedBody};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use crate::clip::CameraClip;
use crate::error::VideoError;
use crate::filter::RootState;
use crate::ground::{Soles, UpHints, floor_height, floor_normal, upright};
use crate::options::TrajectoryOptions;
use crate::pinhole::Camera;
use crate::source_poses::SourcePoses;

/// Poses and the root's track in the reconstruction's world, m.
pub(crate) struct SourceMotion {
    pub poses: SourcePoses,
    pub metres_per_unit: f64,
    /// The root, one state a frame; `None` without a trajectory.
    pub smoothed: Option<Vec<RootState>>,
}

impl SourceMotion {
    /// The poses with the root on its track; at the origin without one.
    fn poses_on_track(&self) -> Vec<BodyPose> {
        let root = |frame: usize| {
            self.smoothed
                .as_ref()
                .map_or_else(Vector3::zeros, |states| states[frame].position)
        };
        self.poses
            .poses
            .iter()
            .enumerate()
            .map(|(frame, pose)| BodyPose {
                root_position: root(frame),
                ..pose.clone()
            })
            .collect()
    }

    /// See [`floor_normal`]; feet that move in place tell nothing, and the hints decide.
    fn floor_normal(
        &self,
        shaped: &ShapedBody,
        soles: &Soles,
        poses: &[BodyPose],
        rate_hz: f64,
        depth_scale_std: f64,
    ) -> Vector3<f64> {
        let camera = mean_up(&self.poses.cameras);
        let trunk = |pose: &BodyPose| {
            let segments = shaped.world_from_segments(pose);
            let along = segments[Joint::Neck.index()].translation.vector
                - segments[Joint::Pelvis.index()].translation.vector;
            along.try_normalize(1e-9).unwrap_or_else(Vector3::zeros)
        };
        let trunk = poses.iter().map(trunk).sum::<Vector3<f64>>() / poses.len().max(1) as f64;
        let foot = |(pose, own): (&BodyPose, &Camera)| {
            let lowest = soles.lowest(pose, &camera)?;
            Some((
                lowest,
                (lowest - own.world_from_camera.translation.vector * self.metres_per_unit)
                    * depth_scale_std,
            ))
        };
        let feet: Vec<_> = match self.smoothed {
            Some(_) => poses
                .iter()
                .zip(&self.poses.cameras)
                .filter_map(foot)
                .collect(),
            None => Vec::new(),
        };
        floor_normal(&feet, &UpHints { camera, trunk }, rate_hz)
    }
}

/// Up as the cameras are held on average.
pub(crate) fn mean_up(cameras: &[Camera]) -> Vector3<f64> {
    cameras
        .iter()
        .map(|camera| camera.world_from_camera.rotation * -Vector3::y())
        .sum()
}

/// Poses and track in a world with z up and the floor at z = 0.
pub(crate) struct Upright {
    pub poses: Vec<BodyPose>,
    /// The root, one state a frame; empty without a trajectory.
    pub states: Vec<RootState>,
    /// m in both worlds.
    pub world_from_source: Isometry3<f64>,
    pub up_in_source: Vector3<f64>,
    /// Root mean square height of the lowest foot points, m.
    pub floor_rms_m: f64,
}

/// Turns poses and track to z up and sets them on the floor.
pub(crate) fn stand_up(
    clip: &CameraClip,
    source: &SourceMotion,
    shaped: &ShapedBody,
    options: &TrajectoryOptions,
) -> Result<Upright, VideoError> {
    let soles = Soles::new(shaped)?;
    let poses = source.poses_on_track();
    let no_frames = || VideoError::Gravity {
        name: clip.name.clone(),
        problem: "the clip has no frames".to_owned(),
    };
    let first_camera = source
        .poses
        .cameras
        .first()
        .ok_or_else(no_frames)?
        .world_from_camera
        .rotation;
    let up = source.floor_normal(
        shaped,
        &soles,
        &poses,
        clip.rate_hz,
        options.depth_scale_std,
    );
    let turn = upright(&up, &(first_camera * Vector3::z()));
    let mut poses: Vec<BodyPose> = poses.into_iter().map(|pose| turned(pose, &turn)).collect();
    let (shift, floor_rms_m) = set_on_floor(&mut poses, &soles).ok_or_else(no_frames)?;
    let world_from_source = Isometry3::from_parts(shift.into(), turn);
    let smoothed = source.smoothed.as_deref().unwrap_or_default();
    let states = smoothed.iter().zip(&source.poses.cameras);
    let states = states.map(|(state, camera)| {
        in_world(
            state,
            camera,
            source.metres_per_unit,
            &world_from_source,
            options.depth_scale_std,
        )
    });
    Ok(Upright {
        poses,
        states: states.collect(),
        world_from_source,
        up_in_source: up,
        floor_rms_m,
    })
}

/// Moves all poses so that the first root stands over the origin and the floor is z = 0. Returns
/// the shift and the root mean square height of the lowest foot points after it, m; `None` without
/// poses.
fn set_on_floor(poses: &mut [BodyPose], soles: &Soles) -> Option<(Vector3<f64>, f64)> {
    let mut lowest: Vec<Vector3<f64>> = poses
        .iter()
        .filter_map(|pose| soles.lowest(pose, &Vector3::z()))
        .collect();
    let start = poses.first()?.root_position;
    let shift = -Vector3::new(start.x, start.y, floor_height(&lowest));
    poses
        .iter_mut()
        .for_each(|pose| pose.root_position += shift);
    lowest.iter_mut().for_each(|point| *point += shift);
    let floor_rms_m = (lowest.iter().map(|point| point.z * point.z).sum::<f64>()
        / lowest.len().max(1) as f64)
        .sqrt();
    Some((shift, floor_rms_m))
}

fn turned(mut pose: BodyPose, turn: &UnitQuaternion<f64>) -> BodyPose {
    pose.root_position = turn * pose.root_position;
    pose.local_rotations[0] = turn * pose.local_rotations[0];
    pose
}

/// A state in the world, the slow error of the depth maps' scale added along the view.
fn in_world(
    state: &RootState,
    camera: &Camera,
    metres_per_unit: f64,
    world_from_source: &Isometry3<f64>,
    depth_scale_std: f64,
) -> RootState {
    let view = (state.position - camera.world_from_camera.translation.vector * metres_per_unit)
        * depth_scale_std;
    let rotation = world_from_source.rotation.to_rotation_matrix();
    let turned = |covariance: &Matrix3<f64>| rotation * covariance * rotation.transpose();
    RootState {
        position: (world_from_source * nalgebra::Point3::from(state.position)).coords,
        velocity: rotation * state.velocity,
        acceleration: rotation * state.acceleration,
        position_covariance: turned(&(state.position_covariance + view * view.transpose())),
        velocity_covariance: turned(&state.velocity_covariance),
    }
}
