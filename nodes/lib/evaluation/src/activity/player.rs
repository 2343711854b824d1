//! Virtual devices on drawn people who play the clips.

use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_imu::{
    GridTrace, KinematicSample, MountedSensor, Placement, Scheme, SensorFrame, SensorTrajectory,
    simulate_kinematics,
};
use cromosim_learned::{Examples, LearnedSimulator, NETWORK_RATE_HZ, SiteMotion, draw_shape};
use cromosim_spatial::{Stamp, uniform_stamps};
use nalgebra::Isometry3;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;

use super::clips::{ActivityClip, ClipDraw};
use super::device::DeviceEstimate;
use super::settings::Settings;
use super::simulator::Simulator;
use super::wearing::{DeviceWearing, WornDevice};
use super::windows::{CHANNELS_PER_DEVICE, DeviceReadings};
use crate::EvaluationError;
use crate::seeds::mixed_seed;

/// Plays clips on drawn people who wear devices.
pub(super) struct ClipPlayer<'a> {
    /// The body.
    pub model: &'a Arc<BodyModel>,
    /// The clips that draws name by their index.
    pub clips: &'a [ActivityClip],
    /// How the devices are worn, one each.
    pub wearings: &'a [&'static DeviceWearing],
    /// The networks of the learned simulator.
    pub learned: Option<&'a LearnedSimulator>,
    /// Sizes and numbers of the evaluation.
    pub settings: &'a Settings,
}

/// Error-free readings of every device in a draw, from 0 s on.
pub(super) struct PlayedClip {
    devices: Vec<GridTrace>,
}

/// A drawn person's motion.
struct PlayedMotion<'a> {
    body: &'a ShapedBody,
    stamps: &'a [Stamp],
    poses: &'a [BodyPose],
}

impl ClipPlayer<'_> {
    /// One draw by one simulator; in place: the root does not travel.
    ///
    /// # Errors
    /// Those of bodies, sites and kinematics.
    pub fn play(
        &self,
        draw: &ClipDraw,
        simulator: Simulator,
        in_place: bool,
    ) -> Result<PlayedClip, EvaluationError> {
        let clip = &self.clips[draw.clip];
        let mut random = ChaCha12Rng::seed_from_u64(draw.seed);
        let spread = self.settings.shape_std;
        let betas = draw_shape(&mut random, self.model, spread);
        let body = ShapedBody::new(self.model.clone(), &betas)?;
        let worn: Vec<WornDevice> = self
            .wearings
            .iter()
            .map(|wearing| wearing.draw(&mut random))
            .collect();
        let rate_hz = clip.rate_hz * draw.speed;
        let stamps: Vec<Stamp> = (0..clip.poses.len())
            .map(|frame| Stamp::from_seconds(frame as f64 / rate_hz))
            .collect();
        let still;
        let motion = PlayedMotion {
            body: &body,
            stamps: &stamps,
            poses: if in_place {
                still = standing(&clip.poses);
                &still
            } else {
                &clip.poses
            },
        };
        let devices = worn
            .iter()
            .map(|worn| self.device(&motion, worn, simulator))
            .collect::<Result<_, _>>()?;
        Ok(PlayedClip { devices })
    }

    /// The error-free readings of one device.
    fn device(
        &self,
        motion: &PlayedMotion<'_>,
        worn: &WornDevice,
        simulator: Simulator,
    ) -> Result<GridTrace, EvaluationError> {
        // The networks that come with the suite stand on the spline.
        let scheme = if simulator == Simulator::Learned {
            Scheme::Spline
        } else {
            Scheme::Richardson
        };
        let placement = Placement::at_site(worn.site, worn.site, NETWORK_RATE_HZ)
            .map_err(|(field, problem)| EvaluationError::Site {
                site: worn.site.to_owned(),
                field,
                problem: problem.to_string(),
            })?
            .with_scheme(scheme)
            .with_mount(worn.mount);
        let PlayedMotion {
            body,
            stamps,
            poses,
        } = motion;
        let kinematics = match (simulator, self.learned) {
            (Simulator::Joint, _) => on_grid(&at_joint(motion, &placement, worn)?, scheme)?,
            (Simulator::Analytic, _) => on_grid(
                &MountedSensor::new(body, &placement)?.trajectory(stamps, poses)?,
                scheme,
            )?,
            (Simulator::Learned, Some(networks)) => {
                networks.simulate(&SiteMotion::on_body(body, &placement, stamps, poses)?)?
            }
            (Simulator::Learned, None) => return Err(EvaluationError::NoNetworks),
        };
        let ideal = kinematics.iter().map(KinematicSample::imu);
        let (specific_force, angular_velocity) = ideal
            .map(|sample| (sample.specific_force, sample.angular_velocity))
            .unzip();
        Ok(GridTrace {
            start: Stamp::default(),
            rate_hz: NETWORK_RATE_HZ,
            specific_force,
            angular_velocity,
        })
    }
}

/// Poses whose root stays where it is at the start.
fn standing(poses: &[BodyPose]) -> Vec<BodyPose> {
    let root_position = poses[0].root_position;
    poses
        .iter()
        .map(|pose| BodyPose {
            root_position,
            ..pose.clone()
        })
        .collect()
}

/// The frames of the joint next to a device, turned as the sensor lies on the skin.
fn at_joint(
    motion: &PlayedMotion<'_>,
    placement: &Placement,
    worn: &WornDevice,
) -> Result<SensorTrajectory, EvaluationError> {
    let site = MountedSensor::new(motion.body, placement)?;
    let segment_from_sensor = site.segment_from_sensor().rotation;
    let frame = |(stamp, pose): (&Stamp, &BodyPose)| {
        let segments = motion.body.world_from_segments(pose);
        let rotation = segments[site.joint().index()].rotation * segment_from_sensor;
        SensorFrame::new(
            *stamp,
            Isometry3::from_parts(segments[worn.joint.index()].translation, rotation),
        )
    };
    let frames = motion.stamps.iter().zip(motion.poses).map(frame).collect();
    Ok(SensorTrajectory::new(frames)?)
}

/// The sensor's motion on the networks' grid of time.
fn on_grid(
    trajectory: &SensorTrajectory,
    scheme: Scheme,
) -> Result<Vec<KinematicSample>, EvaluationError> {
    let grid = uniform_stamps(trajectory.start(), trajectory.end(), NETWORK_RATE_HZ)?;
    Ok(simulate_kinematics(trajectory, scheme, &grid)?)
}

/// The windows of all draws, with errors of devices where such are given.
///
/// # Errors
/// Those of the devices' effects.
pub(super) fn windows(
    draws: &[ClipDraw],
    played: &[PlayedClip],
    devices: Option<&[DeviceEstimate]>,
    settings: &Settings,
) -> Result<Examples, EvaluationError> {
    let grid = settings.grid();
    let width = played.first().map_or(0, |played| played.devices.len());
    let mut examples = Examples::new(settings.window, width * CHANNELS_PER_DEVICE);
    for (draw, played) in draws.iter().zip(played) {
        let series = played
            .devices
            .iter()
            .enumerate()
            .map(|(index, ideal)| match devices {
                Some(devices) => {
                    devices[index].simulate(ideal, mixed_seed(&[draw.seed, 3, index as u64]))
                }
                None => Ok(error_free(ideal)),
            });
        let series = series.collect::<Result<Vec<DeviceReadings>, EvaluationError>>()?;
        grid.cut(
            &grid.sampled(&series, 0.0, draw.samples),
            &draw.windows,
            &mut examples,
        );
    }
    Ok(examples)
}

/// The readings of a device without errors.
fn error_free(ideal: &GridTrace) -> DeviceReadings {
    let values = ideal
        .specific_force
        .iter()
        .zip(&ideal.angular_velocity)
        .map(|(f, w)| [f.x, f.y, f.z, w.x, w.y, w.z]);
    DeviceReadings {
        seconds: (0..ideal.specific_force.len())
            .map(|k| k as f64 / ideal.rate_hz)
            .collect(),
        values: values.collect(),
    }
}

#[cfg(test)]
#[path = "player_tests.rs"]
mod tests;
