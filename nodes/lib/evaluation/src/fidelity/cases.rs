//! Motions with a measured IMU, and what each simulator makes of them.

use std::collections::BTreeMap;

use cromosim_imu::{KinematicSample, Reading, Scheme, SensorTrajectory, simulate_kinematics};
use cromosim_learned::{LearnedSimulator, MappingFile, Pair, PlacementMapping, Target};
use cromosim_spatial::Stamp;

use super::imusim::imusim;
use super::method::Method;
use crate::EvaluationError;
use crate::error::At;
use crate::observer::Observer;
use crate::seeds::mixed_seed;
use crate::training_data::{DataFolder, DataSource, draw_wearers, recorded_pieces};

/// One recording of one placement.
pub(super) struct Case {
    /// With the motion by the spline.
    pair: Pair,
    trajectory: SensorTrajectory,
    /// The frames of the joint that carries the sensor; none for a rigid body.
    joint: Option<SensorTrajectory>,
}

impl Case {
    /// Where on the body the device was.
    pub fn position(&self) -> &str {
        &self.pair.position
    }

    /// One for each sample; none where nothing was measured.
    pub fn measured(&self) -> &[Option<Reading>] {
        &self.pair.measured
    }

    /// Readings at every sample, in the sensor's axes; none where the method does not apply.
    pub fn simulate(
        &self,
        method: Method,
        learned: Option<&LearnedSimulator>,
        mapping: &MappingFile,
    ) -> Result<Option<Vec<Reading>>, EvaluationError> {
        let Some(kinematics) = self.kinematics(method, learned)? else {
            return Ok(None);
        };
        let readings = kinematics
            .iter()
            .map(|sample| sample.imu().reading())
            .collect::<Vec<_>>();
        if method != Method::Mapped {
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

    /// The sensor's motion as a method sees it; none where it does not apply.
    fn kinematics(
        &self,
        method: Method,
        learned: Option<&LearnedSimulator>,
    ) -> Result<Option<Vec<KinematicSample>>, EvaluationError> {
        let stamps: Vec<Stamp> = self
            .pair
            .motion
            .kinematics
            .iter()
            .map(|sample| sample.stamp)
            .collect();
        Ok(Some(match method {
            Method::Joint => match &self.joint {
                Some(joint) => simulate_kinematics(joint, Scheme::Richardson, &stamps)?,
                None => return Ok(None),
            },
            Method::Imusim => imusim(&self.trajectory, &stamps)?,
            Method::Analytic => simulate_kinematics(&self.trajectory, Scheme::Richardson, &stamps)?,
            Method::Spline => self.pair.motion.kinematics.clone(),
            Method::AdaptiveSpline => {
                simulate_kinematics(&self.trajectory, Scheme::AdaptiveSpline, &stamps)?
            }
            Method::Learned | Method::Mapped => match learned {
                Some(networks) => networks.simulate(&self.pair.motion)?,
                None => return Ok(None),
            },
            Method::Perfect => self.perfect(),
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

/// All recordings of sources; people and devices drawn once for each motion and site where `quick`.
pub(super) fn cases(
    sources: &[DataSource],
    data: &DataFolder,
    seed: u64,
    quick: bool,
    observer: &dyn Observer,
) -> Result<Vec<Case>, EvaluationError> {
    let mut cases = Vec::new();
    for (index, source) in sources.iter().enumerate() {
        if source.motions.is_empty() {
            for piece in recorded_pieces(source, data)? {
                let pair = piece.pair(&source.subject).at(|| piece.name.clone())?;
                cases.push(Case {
                    pair,
                    trajectory: piece.trajectory,
                    joint: None,
                });
            }
            continue;
        }
        let mut source = source.clone();
        if quick {
            source.repeats = 1;
        }
        let seed = mixed_seed(&[seed, index as u64]);
        let drawn = draw_wearers(&source, data, seed, observer, |worn, names| {
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
pub(super) fn fit_mapping(
    cases: &[Case],
    learned: &LearnedSimulator,
) -> Result<MappingFile, EvaluationError> {
    let mut pooled: BTreeMap<&str, (Vec<Reading>, Vec<Reading>)> = BTreeMap::new();
    for case in cases {
        let simulated = case
            .simulate(Method::Learned, Some(learned), &MappingFile::default())?
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
