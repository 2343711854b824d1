//! A pair of networks as a simulator.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cromosim_imu::{KinematicSample, MotionCorrection, Scheme};
use cromosim_spatial::{Stamp, derivative_weights};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    Blend, Direction, Input, LearnedError, NETWORK_RATE_HZ, Network, PreparedNetwork, Quantity,
    SiteMotion, WINDOW, window_starts,
};

/// Notes in the weights' files that say what a network is for.
const INPUT: &str = "input";
const QUANTITY: &str = "quantity";

/// An accelerometer's and a gyroscope's network with the same input.
#[derive(Clone, Debug)]
pub struct LearnedSimulator {
    input: Input,
    networks: [Network; 2],
    prepared: [PreparedNetwork; 2],
}

/// The scheme that networks correct: `scheme`, but where that is the default the one that they were
/// trained on.
pub fn scheme_for_networks(scheme: Scheme) -> Scheme {
    if scheme == Scheme::default() {
        Scheme::Spline
    } else {
        scheme
    }
}

impl LearnedSimulator {
    /// Networks in the order of [`Quantity::BOTH`].
    ///
    /// # Errors
    /// [`LearnedError::WrongNetwork`] for other widths than the input's, or a streaming network
    /// that reads both ways.
    pub fn new(input: Input, networks: [Network; 2]) -> Result<Self, LearnedError> {
        for (network, quantity) in networks.iter().zip(Quantity::BOTH) {
            let shape = network.shape();
            let wrong = |problem: String| LearnedError::WrongNetwork {
                network: quantity.name(),
                problem,
            };
            if (shape.inputs, shape.outputs) != (input.channels(), 3) {
                let (inputs, outputs) = (shape.inputs, shape.outputs);
                return Err(wrong(format!(
                    "{inputs} inputs and {outputs} outputs, {input:?} needs {} and 3",
                    input.channels()
                )));
            }
            if input == Input::Streaming && shape.direction == Direction::Both {
                return Err(wrong(
                    "it reads both ways; live it needs `direction: forward`".to_owned(),
                ));
            }
        }
        let prepared = [networks[0].prepare(), networks[1].prepare()];
        Ok(Self {
            input,
            networks,
            prepared,
        })
    }

    /// Reads FOLDER/acceleration.safetensors and FOLDER/angular_velocity.safetensors.
    ///
    /// # Errors
    /// Those of [`Network::read`] and [`LearnedSimulator::new`]; a note on input or quantity that
    /// is absent or differs.
    pub fn read(folder: &Path) -> Result<Self, LearnedError> {
        let [acceleration, angular_velocity] = Quantity::BOTH.map(|quantity| {
            let path = folder.join(format!("{}.safetensors", quantity.name()));
            Network::read(&path).map(|(network, notes)| (path, network, notes))
        });
        Self::from_files([acceleration?, angular_velocity?])
    }

    /// Files in the order of [`Quantity::BOTH`], with their notes.
    pub(crate) fn from_files(
        files: [(PathBuf, Network, BTreeMap<String, String>); 2],
    ) -> Result<Self, LearnedError> {
        let mut inputs = Vec::new();
        for ((path, _, notes), quantity) in files.iter().zip(Quantity::BOTH) {
            let wrong = |reason: String| LearnedError::Metadata {
                path: path.clone(),
                key: "cromosim",
                reason,
            };
            let note = |key: &str| {
                notes
                    .get(key)
                    .ok_or_else(|| wrong(format!("no note `{key}`")))
            };
            let stated = note(QUANTITY)?;
            if stated != quantity.name() {
                return Err(wrong(format!(
                    "it predicts `{stated}`, not `{}`",
                    quantity.name()
                )));
            }
            let stated = note(INPUT)?;
            let known = || {
                wrong(format!(
                    "input `{stated}`, known are points, residual, differences and streaming"
                ))
            };
            inputs.push(Input::from_name(stated).ok_or_else(known)?);
        }
        if inputs[0] != inputs[1] {
            let problem = format!("its input is {:?}, the other's {:?}", inputs[1], inputs[0]);
            return Err(LearnedError::WrongNetwork {
                network: Quantity::AngularVelocity.name(),
                problem,
            });
        }
        Self::new(inputs[0], files.map(|(_, network, _)| network))
    }

    /// Writes both files into a folder that exists.
    ///
    /// # Errors
    /// As [`Network::write`].
    pub fn write(
        &self,
        folder: &Path,
        notes: &BTreeMap<String, String>,
    ) -> Result<(), LearnedError> {
        for (network, quantity) in self.networks.iter().zip(Quantity::BOTH) {
            let mut notes = notes.clone();
            notes.insert(INPUT.to_owned(), self.input.name().to_owned());
            notes.insert(QUANTITY.to_owned(), quantity.name().to_owned());
            network.write(
                &folder.join(format!("{}.safetensors", quantity.name())),
                &notes,
            )?;
        }
        Ok(())
    }

    /// What the networks are fed.
    pub fn input(&self) -> Input {
        self.input
    }

    /// The networks, in the order of [`Quantity::BOTH`].
    pub fn networks(&self) -> &[Network; 2] {
        &self.networks
    }

    /// The motion's kinematics with acceleration and angular velocity as the networks say; frames
    /// stay as they are. Windows of 2 s that overlap by 80 % are blended; a streaming network runs
    /// through.
    ///
    /// # Errors
    /// None but what [`PreparedNetwork::forward`] names.
    pub fn simulate(&self, motion: &SiteMotion) -> Result<Vec<KinematicSample>, LearnedError> {
        let [accelerations, rates] = [self.predict(motion, 0)?, self.predict(motion, 1)?];
        let samples = motion
            .kinematics
            .iter()
            .zip(accelerations.iter().zip(&rates));
        let learned =
            |(sample, (acceleration, rate)): (&KinematicSample, (&Vector3<f64>, &Vector3<f64>))| {
                let (base_acceleration, base_rate) = if self.input.on_top_of_analytic() {
                    (
                        sample.acceleration_in_world,
                        sample.angular_velocity_in_world,
                    )
                } else {
                    Default::default()
                };
                KinematicSample {
                    acceleration_in_world: base_acceleration + acceleration,
                    angular_velocity_in_world: base_rate + rate,
                    angular_acceleration_in_world: None,
                    ..*sample
                }
            };
        Ok(samples.map(learned).collect())
    }

    /// Kinematics at any stamps: `analytic` there, corrected by what the networks change on their
    /// own grid of 100 Hz, in between by cubics.
    ///
    /// # Errors
    /// As [`LearnedSimulator::simulate`].
    pub fn correct(
        &self,
        motion: &SiteMotion,
        analytic: &[KinematicSample],
    ) -> Result<Vec<KinematicSample>, LearnedError> {
        let learned = self.simulate(motion)?;
        let corrections: Vec<[Vector3<f64>; 2]> = learned
            .iter()
            .zip(&motion.kinematics)
            .map(|(new, old)| {
                [
                    new.acceleration_in_world - old.acceleration_in_world,
                    new.angular_velocity_in_world - old.angular_velocity_in_world,
                ]
            })
            .collect();
        let Some(start) = motion.kinematics.first().map(|sample| sample.stamp) else {
            return Ok(analytic.to_vec());
        };
        let corrected = |sample: &KinematicSample| {
            let [acceleration, rate] = between(&corrections, start, sample.stamp);
            KinematicSample {
                acceleration_in_world: sample.acceleration_in_world + acceleration,
                angular_velocity_in_world: sample.angular_velocity_in_world + rate,
                angular_acceleration_in_world: None,
                ..*sample
            }
        };
        Ok(analytic.iter().map(corrected).collect())
    }

    /// The correction of one placement's whole motion, as a step of its simulation.
    pub fn correction(&self, motion: SiteMotion) -> WholeMotionCorrection<'_> {
        WholeMotionCorrection {
            networks: self,
            motion,
        }
    }

    /// The network's own output, SI units.
    fn predict(
        &self,
        motion: &SiteMotion,
        which: usize,
    ) -> Result<Vec<Vector3<f64>>, LearnedError> {
        let (network, scale) = (&self.prepared[which], Quantity::BOTH[which].scale());
        let none = UnitQuaternion::identity();
        let samples = motion.len();
        let mut features = Vec::new();
        if self.input == Input::Streaming {
            self.input.fill(motion, 0, samples, &none, &mut features);
            let output = network.forward(&features, 1, samples)?;
            return Ok(output
                .as_chunks::<3>()
                .0
                .iter()
                .map(|value| Vector3::from(value.map(f64::from)) * scale)
                .collect());
        }
        let (starts, steps) = (window_starts(samples), samples.min(WINDOW));
        for start in &starts {
            self.input.fill(motion, *start, steps, &none, &mut features);
        }
        let output = network.forward(&features, starts.len(), steps)?;
        let mut blend = Blend::new(samples);
        for (start, window) in starts.iter().zip(output.chunks(3 * steps.max(1))) {
            blend.add(*start, window);
        }
        Ok(blend
            .finish()
            .into_iter()
            .map(|value| Vector3::from(value) * scale)
            .collect())
    }
}

/// What networks change in the samples of one placement, whose whole motion they see.
#[derive(Clone, Debug)]
pub struct WholeMotionCorrection<'a> {
    networks: &'a LearnedSimulator,
    motion: SiteMotion,
}

impl MotionCorrection for WholeMotionCorrection<'_> {
    type Error = LearnedError;

    fn correct(&mut self, motions: &mut [Vec<KinematicSample>]) -> Result<(), LearnedError> {
        for samples in motions {
            *samples = self.networks.correct(&self.motion, samples)?;
        }
        Ok(())
    }
}

/// Cubic through the four samples around; held beyond the ends.
fn between(values: &[[Vector3<f64>; 2]], start: Stamp, stamp: Stamp) -> [Vector3<f64>; 2] {
    let last = values.len() - 1;
    let position = ((stamp - start) * NETWORK_RATE_HZ).clamp(0.0, last as f64);
    let nearest = position.round();
    if (position - nearest).abs() < 1e-6 {
        return values[nearest as usize];
    }
    let width = values.len().min(4);
    let first = (position.floor() as usize)
        .saturating_sub(1)
        .min(values.len() - width);
    let mut places = [0.0; 4];
    for (index, place) in places.iter_mut().enumerate() {
        *place = (first + index) as f64 - position;
    }
    let weights = derivative_weights(&places[..width], 0.0)[0];
    std::array::from_fn(|which| {
        values[first..first + width]
            .iter()
            .zip(weights)
            .map(|(value, weight)| value[which] * weight)
            .sum()
    })
}
