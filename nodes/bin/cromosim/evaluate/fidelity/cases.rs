//! Motions with a measured IMU, and what each simulator makes of them.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use cromosim_body::BodyModel;
use cromosim_imu::{KinematicSample, Reading, Scheme, SensorTrajectory, simulate_kinematics};
use cromosim_learned::{LearnedSimulator, MappingFile, Pair, PlacementMapping, Target};
use cromosim_spatial::{PoseSmoothing, PoseSpline, Smoothing, Stamp};
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use crate::progress::Interrupt;
use crate::train::config::Source;
use crate::train::data;

/// IMUSim takes positions for good to 1 mm and quaternion components for good to 0.001 (its
/// defaults `positionStdDev`, `rotationStdDev`).
const IMUSIM_STD: f64 = 0.001;

/// Ways from a motion to readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Simulator {
    /// The skeleton's joint in place of the skin, as IMUTube has it; the scheme of `Analytic`.
    Joint,
    /// Splines of position and rotation, smoothed as IMUSim smooths.
    Imusim,
    /// The skin's frame by Richardson's extrapolation: the paper's analytic simulator.
    Analytic,
    /// Splines that choose their smoothing themselves: our analytic simulator.
    Spline,
    /// The networks on top of it.
    Learned,
    /// The networks, then the distribution mapping.
    Mapped,
    /// What networks would leave that say exactly what was measured: the errors of the source's
    /// orientation, which they do not touch.
    Perfect,
}

impl Simulator {
    /// In the table's order.
    pub const ALL: [Self; 7] = [
        Self::Joint,
        Self::Imusim,
        Self::Analytic,
        Self::Spline,
        Self::Learned,
        Self::Mapped,
        Self::Perfect,
    ];

    /// As the table says it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Joint => "joint (IMUTube)",
            Self::Imusim => "IMUSim-like",
            Self::Analytic => "analytic (Richardson)",
            Self::Spline => "spline",
            Self::Learned => "learned",
            Self::Mapped => "learned, mapped",
            Self::Perfect => "(perfect networks)",
        }
    }
}

/// One recording of one placement.
pub struct Case {
    /// With the motion by the spline.
    pair: Pair,
    trajectory: SensorTrajectory,
    joint: Option<SensorTrajectory>,
}

impl Case {
    /// Where on the body.
    pub fn position(&self) -> &str {
        &self.pair.position
    }

    /// One for each sample; none where nothing was measured.
    pub fn measured(&self) -> &[Option<Reading>] {
        &self.pair.measured
    }

    /// Readings at every sample, in the sensor's axes; none where the simulator does not apply.
    pub fn simulate(
        &self,
        simulator: Simulator,
        learned: Option<&LearnedSimulator>,
        mapping: &MappingFile,
    ) -> anyhow::Result<Option<Vec<Reading>>> {
        let stamps: Vec<Stamp> = self
            .pair
            .motion
            .kinematics
            .iter()
            .map(|sample| sample.stamp)
            .collect();
        let kinematics = match simulator {
            Simulator::Joint => match &self.joint {
                Some(joint) => simulate_kinematics(joint, Scheme::Richardson, &stamps)?,
                None => return Ok(None),
            },
            Simulator::Imusim => imusim(&self.trajectory, &stamps)?,
            Simulator::Analytic => {
                simulate_kinematics(&self.trajectory, Scheme::Richardson, &stamps)?
            }
            Simulator::Spline => self.pair.motion.kinematics.clone(),
            Simulator::Learned | Simulator::Mapped => match learned {
                Some(networks) => networks.simulate(&self.pair.motion)?,
                None => return Ok(None),
            },
            Simulator::Perfect => self.perfect(),
        };
        let readings = kinematics.iter().map(reading).collect::<Vec<_>>();
        if simulator != Simulator::Mapped {
            return Ok(Some(readings));
        }
        let mapping = mapping.placements.get(&self.pair.position);
        Ok(mapping.map(|mapping| {
            readings
                .iter()
                .map(|reading| mapping.apply(reading))
                .collect()
        }))
    }

    /// The frames as the source gives them, moved as was measured.
    fn perfect(&self) -> Vec<KinematicSample> {
        let moved = |(sample, target): (&KinematicSample, &Option<Target>)| match target {
            Some(Target {
                acceleration,
                angular_velocity,
            }) => KinematicSample {
                acceleration_in_world: *acceleration,
                angular_velocity_in_world: *angular_velocity,
                ..*sample
            },
            None => *sample,
        };
        self.pair
            .motion
            .kinematics
            .iter()
            .zip(&self.pair.targets)
            .map(moved)
            .collect()
    }
}

fn reading(sample: &KinematicSample) -> Reading {
    let imu = sample.imu();
    Reading {
        specific_force: imu.specific_force,
        angular_velocity: imu.angular_velocity,
    }
}

/// Smoothing splines that stay within 1 mm and 0.001 of the frames, root mean square.
fn imusim(trajectory: &SensorTrajectory, stamps: &[Stamp]) -> anyhow::Result<Vec<KinematicSample>> {
    let smoothing = PoseSmoothing {
        position: Smoothing::ResidualStd(IMUSIM_STD),
        rotation: Smoothing::ResidualStd(IMUSIM_STD),
    };
    let frames = trajectory.frames();
    let at: Vec<Stamp> = frames.iter().map(|frame| frame.stamp).collect();
    let poses: Vec<Isometry3<f64>> = frames.iter().map(|frame| frame.world_from_sensor).collect();
    let spline = PoseSpline::fit(&at, &poses, smoothing)?;
    let sample = |stamp: &Stamp| {
        let motion = spline.evaluate(*stamp);
        KinematicSample {
            stamp: *stamp,
            world_from_sensor: Isometry3::from_parts(motion.position.into(), motion.rotation),
            acceleration_in_world: motion.acceleration,
            angular_velocity_in_world: motion.angular_velocity,
            angular_acceleration_in_world: Some(motion.angular_acceleration),
            variance: Default::default(),
        }
    };
    Ok(stamps.iter().map(sample).collect())
}

/// All recordings of sources; drawn ones once each where `quick`.
pub fn all(
    sources: &[Source],
    folder: &Path,
    model: &Arc<BodyModel>,
    given: Option<&Arc<BodyModel>>,
    seed: u64,
    quick: bool,
    interrupt: &Interrupt,
) -> anyhow::Result<Vec<Case>> {
    let mut cases = Vec::new();
    for (index, source) in sources.iter().enumerate() {
        if source.motions.is_empty() {
            for piece in data::recorded(source, folder, given)? {
                let pair = piece
                    .pair(&source.subject)
                    .with_context(|| piece.name.clone())?;
                cases.push(Case {
                    pair,
                    trajectory: piece.trajectory,
                    joint: None,
                });
            }
            continue;
        }
        let source = if quick {
            &Source {
                repeats: 1,
                ..source.clone()
            }
        } else {
            source
        };
        let seed = data::mix(&[seed, index as u64]);
        let drawn = data::draw(source, folder, model, seed, interrupt, |worn, names| {
            let pair = worn.pair(names, worn.motion(Scheme::Spline)?)?;
            Ok(Case {
                pair,
                trajectory: worn.trajectory()?,
                joint: Some(worn.joint_trajectory()?),
            })
        })?;
        cases.extend(drawn);
    }
    Ok(cases)
}

/// For each position, the mapping of what the networks say onto what was measured.
pub fn fit_mapping(cases: &[Case], learned: &LearnedSimulator) -> anyhow::Result<MappingFile> {
    let mut pooled: BTreeMap<&str, (Vec<Reading>, Vec<Reading>)> = BTreeMap::new();
    for case in cases {
        let simulated = case
            .simulate(Simulator::Learned, Some(learned), &MappingFile::default())?
            .unwrap_or_default();
        let (all_simulated, all_measured) = pooled.entry(case.position()).or_default();
        for (simulated, measured) in simulated.iter().zip(case.measured()) {
            let Some(measured) = measured else { continue };
            all_simulated.push(*simulated);
            all_measured.push(*measured);
        }
    }
    let mut file = MappingFile::default();
    for (position, (simulated, measured)) in pooled {
        file.placements.insert(
            position.to_owned(),
            PlacementMapping::fit(&simulated, &measured, position)?,
        );
    }
    Ok(file)
}
