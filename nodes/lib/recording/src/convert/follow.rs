//! Where a joint or a site of a moving body is.

use std::sync::Arc;

use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_imu::{MountedSensor, Placement};
use cromosim_motion::SmplMotion;
use nalgebra::Isometry3;

use crate::rigid::PoseTrajectory;
use crate::{RecordingError, stamp_of_frame};

/// The frame of a joint's segment.
pub(super) fn joint(
    motion: &SmplMotion,
    model: &Arc<BodyModel>,
    name: &str,
) -> Result<PoseTrajectory, RecordingError> {
    let Some(joint) = Joint::from_name(name) else {
        return Err(RecordingError::UnknownJoint {
            name: name.to_owned(),
            known: Joint::ALL.iter().map(|joint| joint.name()).collect(),
        });
    };
    let shaped = ShapedBody::new(model.clone(), &motion.betas)?;
    let segments = motion
        .frames
        .iter()
        .map(|pose| shaped.world_from_segments(pose)[joint.index()]);
    Ok(trajectory(motion, segments))
}

/// The frame of a sensor on the skin: z outward, x along the bone.
pub(super) fn site(
    motion: &SmplMotion,
    model: &Arc<BodyModel>,
    name: &str,
) -> Result<PoseTrajectory, RecordingError> {
    let wrong = |problem: String| RecordingError::Site {
        name: name.to_owned(),
        problem,
    };
    let shaped = ShapedBody::new(model.clone(), &motion.betas)?;
    let placement = Placement::at_site("site", name, motion.rate_hz)
        .map_err(|(field, problem)| wrong(format!("{field}: {problem}")))?;
    let mounted =
        MountedSensor::new(&shaped, &placement).map_err(|error| wrong(error.to_string()))?;
    let frames = motion.frames.iter();
    Ok(trajectory(
        motion,
        frames.map(|pose| mounted.pose(pose).world_from_sensor),
    ))
}

fn trajectory(motion: &SmplMotion, poses: impl Iterator<Item = Isometry3<f64>>) -> PoseTrajectory {
    let mut trajectory = PoseTrajectory {
        frame: "world".to_owned(),
        ..PoseTrajectory::default()
    };
    for (frame, pose) in poses.enumerate() {
        let stamp = stamp_of_frame(motion, frame, 0.0);
        trajectory.push(stamp, pose.translation.vector, pose.rotation);
    }
    trajectory
}
