//! Where a joint or a site of a moving body is.

use std::sync::Arc;

use anyhow::{anyhow, bail};
use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_imu::{MountedSensor, Placement};
use cromosim_motion::SmplMotion;
use cromosim_recording::rigid::PoseTrajectory;
use cromosim_recording::stamp_of_frame;
use nalgebra::Isometry3;

/// The segment's frame of a joint.
pub fn joint(
    motion: &SmplMotion,
    model: &Arc<BodyModel>,
    name: &str,
) -> anyhow::Result<PoseTrajectory> {
    let Some(joint) = Joint::from_name(name) else {
        let known: Vec<&str> = Joint::ALL.iter().map(|joint| joint.name()).collect();
        bail!(
            "--joint {name}: SMPL has no such joint; it has {}",
            known.join(", ")
        );
    };
    let shaped = ShapedBody::new(model.clone(), &motion.betas)?;
    Ok(trajectory(
        motion,
        motion
            .frames
            .iter()
            .map(|pose| shaped.world_from_segments(pose)[joint.index()]),
    ))
}

/// The frame of a sensor on the skin: z outward, x along the bone.
pub fn site(
    motion: &SmplMotion,
    model: &Arc<BodyModel>,
    name: &str,
) -> anyhow::Result<PoseTrajectory> {
    let shaped = ShapedBody::new(model.clone(), &motion.betas)?;
    let placement = Placement::at_site("site", name, motion.rate_hz)
        .map_err(|(field, problem)| anyhow!("--site {name}: {field}: {problem}"))?;
    let mounted = MountedSensor::new(&shaped, &placement)
        .map_err(|error| anyhow!("--site {name}: {error}"))?;
    Ok(trajectory(
        motion,
        motion
            .frames
            .iter()
            .map(|pose| mounted.pose(pose).world_from_sensor),
    ))
}

fn trajectory(motion: &SmplMotion, frames: impl Iterator<Item = Isometry3<f64>>) -> PoseTrajectory {
    let mut trajectory = PoseTrajectory {
        frame: "world".to_owned(),
        ..PoseTrajectory::default()
    };
    for (index, frame) in frames.enumerate() {
        trajectory.stamps.push(stamp_of_frame(motion, index, 0.0));
        trajectory.positions.push(frame.translation.vector);
        trajectory.rotations.push(frame.rotation);
    }
    trajectory
}
