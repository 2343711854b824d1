//! Virtual devices on drawn people who play the clips.

use std::sync::Arc;

use anyhow::bail;
use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_imu::{
    GridTrace, KinematicSample, MountedSensor, Placement, Scheme, SensorFrame, SensorTrajectory,
    normal_pair, simulate_kinematics,
};
use cromosim_learned::{Examples, LearnedSimulator, NETWORK_RATE_HZ, SiteMotion};
use cromosim_spatial::{Stamp, uniform_stamps};
use nalgebra::Isometry3;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use serde::Serialize;

use super::clips::{Clip, Draw};
use super::device::DeviceEstimate;
use super::settings::Settings;
use super::signal::{PER_DEVICE, Series};
use super::wear::{Wear, Worn};
use crate::train::data::mix;

/// Coefficients of shape that are drawn, and beyond how many standard deviations nobody is.
const SHAPES: usize = 10;
const WIDEST_SHAPE: f64 = 2.5;

/// How a motion becomes readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Simulator {
    /// No skin: the nearest joint moves the sensor (IMUTube's way).
    Joint,
    /// The skin's point, by Richardson's differences.
    Analytic,
    /// Networks on the skin's points.
    Learned,
}

impl Simulator {
    /// All.
    pub const ALL: [Self; 3] = [Self::Joint, Self::Analytic, Self::Learned];

    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Analytic => "analytic",
            Self::Learned => "learned",
        }
    }
}

/// What plays the clips.
pub struct Stage<'a> {
    /// The body.
    pub model: &'a Arc<BodyModel>,
    /// The clips.
    pub clips: &'a [Clip],
    /// What is worn.
    pub wears: &'a [&'static Wear],
    /// The networks, where there are.
    pub learned: Option<&'a LearnedSimulator>,
    /// Sizes.
    pub settings: &'a Settings,
}

/// Error-free readings of every device in a draw, from 0 s on.
pub struct Played {
    devices: Vec<GridTrace>,
}

impl Stage<'_> {
    /// One draw by one simulator; in place: the root does not travel.
    ///
    /// # Errors
    /// Those of bodies, sites and kinematics.
    pub fn play(
        &self,
        draw: &Draw,
        simulator: Simulator,
        in_place: bool,
    ) -> anyhow::Result<Played> {
        let clip = &self.clips[draw.clip];
        let mut random = ChaCha12Rng::seed_from_u64(draw.seed);
        let spread = self.settings.shape_std;
        let betas: Vec<f64> = (0..self.model.beta_count().min(SHAPES))
            .map(|_| (spread * normal_pair(&mut random)[0]).clamp(-WIDEST_SHAPE, WIDEST_SHAPE))
            .collect();
        let body = ShapedBody::new(self.model.clone(), &betas)?;
        let worn: Vec<Worn> = self
            .wears
            .iter()
            .map(|wear| wear.draw(&mut random))
            .collect();
        let rate_hz = clip.rate_hz * draw.speed;
        let stamps: Vec<Stamp> = (0..clip.poses.len())
            .map(|frame| Stamp::from_seconds(frame as f64 / rate_hz))
            .collect();
        let still: Vec<BodyPose>;
        let poses = if in_place {
            let root_position = clip.poses[0].root_position;
            still = clip
                .poses
                .iter()
                .map(|pose| BodyPose {
                    root_position,
                    ..pose.clone()
                })
                .collect();
            &still
        } else {
            &clip.poses
        };
        let devices = worn
            .iter()
            .map(|worn| self.device(&body, worn, simulator, &stamps, poses))
            .collect::<anyhow::Result<_>>()?;
        Ok(Played { devices })
    }

    fn device(
        &self,
        body: &ShapedBody,
        worn: &Worn,
        simulator: Simulator,
        stamps: &[Stamp],
        poses: &[BodyPose],
    ) -> anyhow::Result<GridTrace> {
        // The networks that come with the suite stand on the spline.
        let scheme = if simulator == Simulator::Learned {
            Scheme::Spline
        } else {
            Scheme::Richardson
        };
        let placement = match Placement::at_site(worn.site, worn.site, NETWORK_RATE_HZ) {
            Ok(placement) => placement.with_scheme(scheme).with_mount(worn.mount),
            Err((field, problem)) => bail!("site {}: {field}: {problem}", worn.site),
        };
        let on_grid = |trajectory: &SensorTrajectory| -> anyhow::Result<Vec<KinematicSample>> {
            let grid = uniform_stamps(trajectory.start(), trajectory.end(), NETWORK_RATE_HZ)?;
            Ok(simulate_kinematics(trajectory, placement.scheme(), &grid)?)
        };
        let kinematics = match (simulator, self.learned) {
            (Simulator::Joint, _) => {
                let site = MountedSensor::new(body, &placement)?;
                // As the sensor lies on the skin, but at the joint.
                let segment_from_sensor = site.segment_from_sensor().rotation;
                let frame = |(stamp, pose): (&Stamp, &BodyPose)| {
                    let segments = body.world_from_segments(pose);
                    let rotation = segments[site.joint().index()].rotation * segment_from_sensor;
                    SensorFrame::new(
                        *stamp,
                        Isometry3::from_parts(segments[worn.joint.index()].translation, rotation),
                    )
                };
                on_grid(&SensorTrajectory::new(
                    stamps.iter().zip(poses).map(frame).collect(),
                )?)?
            }
            (Simulator::Analytic, _) => {
                on_grid(&MountedSensor::new(body, &placement)?.trajectory(stamps, poses)?)?
            }
            (Simulator::Learned, Some(networks)) => {
                networks.simulate(&SiteMotion::on_body(body, &placement, stamps, poses)?)?
            }
            (Simulator::Learned, None) => {
                bail!("no networks were given; name their folder by --learned")
            }
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

/// The windows of all draws, with errors of devices where such are given.
///
/// # Errors
/// Those of the devices' effects.
pub fn windows(
    draws: &[Draw],
    played: &[Played],
    devices: Option<&[DeviceEstimate]>,
    settings: &Settings,
) -> anyhow::Result<Examples> {
    let grid = settings.grid();
    let width = played.first().map_or(0, |played| played.devices.len());
    let mut examples = Examples::new(settings.window, width * PER_DEVICE);
    for (draw, played) in draws.iter().zip(played) {
        let series = played
            .devices
            .iter()
            .enumerate()
            .map(|(index, ideal)| match devices {
                Some(devices) => devices[index].read(ideal, mix(&[draw.seed, 3, index as u64])),
                None => Ok(error_free(ideal)),
            });
        let series = series.collect::<anyhow::Result<Vec<Series>>>()?;
        grid.cut(
            &grid.sampled(&series, 0.0, draw.samples),
            &draw.windows,
            &mut examples,
        );
    }
    Ok(examples)
}

fn error_free(ideal: &GridTrace) -> Series {
    let values = ideal
        .specific_force
        .iter()
        .zip(&ideal.angular_velocity)
        .map(|(f, w)| [f.x, f.y, f.z, w.x, w.y, w.z]);
    Series {
        seconds: (0..ideal.specific_force.len())
            .map(|k| k as f64 / ideal.rate_hz)
            .collect(),
        values: values.collect(),
    }
}

#[cfg(test)]
#[path = "simulated_tests.rs"]
mod tests;
