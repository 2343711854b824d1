//! One training: whose real windows, which virtual ones, and on whom it is tested.

use std::collections::BTreeMap;

use cromosim_imu::Reading;
use cromosim_learned::{Classifier, Examples, PlacementMapping, train_classifier};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::clips::ClipDraw;
use super::condition::{Condition, TrainingData, Variant};
use super::dataset::{RealDataset, Subject};
use super::device::DeviceEstimate;
use super::player::{self, PlayedClip};
use super::results::Run;
use super::scores::ConfusionMatrix;
use super::settings::Settings;
use super::simulator::Simulator;
use super::wearing::DeviceWearing;
use super::windows::CHANNELS_PER_DEVICE;
use crate::EvaluationError;
use crate::observer::{self, Observer};
use crate::seeds::mixed_seed;

/// Turned copies of a window.
const COPIES: usize = 4;
/// Windows of each class that a mapping is fitted to, on both sides.
const MAPPED_WINDOWS: usize = 60;

/// The draws of a seed as a simulator plays them.
pub(super) struct VirtualSet {
    /// Readings of each draw.
    pub played: Vec<PlayedClip>,
    /// Windows without devices' errors.
    pub windows: Examples,
}

/// Everything that trainings share.
pub(super) struct Experiment<'a> {
    /// Sizes and numbers.
    pub settings: &'a Settings,
    /// The people who are learned from and tested.
    pub real: &'a RealDataset,
    /// What virtual people play, for each seed.
    pub draws: &'a [Vec<ClipDraw>],
    /// By seed, simulator, and whether the root stays in place.
    pub simulated: &'a BTreeMap<(usize, Simulator, bool), VirtualSet>,
    /// Who waits.
    pub observer: &'a dyn Observer,
}

/// One training.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Job {
    /// What is learned from.
    pub condition: Condition,
    /// The repetition, from 0 on.
    pub seed: usize,
    /// People whose real windows may be seen, as indices.
    pub known: Vec<usize>,
    /// People who are tested, as indices.
    pub tested: Vec<usize>,
}

/// The training subjects for a tested one: so large a share of the others, at least one, in an
/// order drawn for the seed; a smaller share's are among a larger one's.
pub(super) fn training_subjects(count: usize, tested: usize, share: f64, seed: u64) -> Vec<usize> {
    let mut others: Vec<usize> = (0..count).filter(|subject| *subject != tested).collect();
    let mut random = ChaCha12Rng::seed_from_u64(mixed_seed(&[seed, 11, tested as u64]));
    for last in (1..others.len()).rev() {
        others.swap(last, random.random_range(0..=last));
    }
    others.truncate(((share * others.len() as f64).round() as usize).max(1));
    others.sort_unstable();
    others
}

impl Experiment<'_> {
    /// Trains and tests; a run for each tested person.
    pub fn run(&self, job: &Job) -> Result<Vec<Run>, EvaluationError> {
        observer::check(self.observer)?;
        let known: Vec<&Subject> = job
            .known
            .iter()
            .map(|index| &self.real.subjects[*index])
            .collect();
        // The same for all that is compared.
        let seed = mixed_seed(&[
            self.settings.seed,
            12,
            job.seed as u64,
            job.tested[0] as u64,
        ]);
        let mut pools = self.pools(job, &known, seed)?;
        let scaling = ChannelScaling::fit(&pools);
        pools
            .iter_mut()
            .for_each(|pool| scaling.apply(&mut pool.values));
        let classes = self.real.activities.classes().len();
        let shape = self
            .settings
            .shape(self.real.placements.len() * CHANNELS_PER_DEVICE, classes);
        let pools: Vec<&Examples> = pools.iter().collect();
        let classifier = train_classifier(&shape, &self.settings.training, &pools, seed, &|| {
            self.observer.interrupted()
        })?;
        let classifier = classifier.ok_or(EvaluationError::Interrupted)?;
        let known: Vec<String> = known.iter().map(|subject| subject.name.clone()).collect();
        job.tested
            .iter()
            .map(|index| {
                let subject = &self.real.subjects[*index];
                let confusion = test(&classifier, &scaling, subject, classes)?;
                Ok(Run {
                    seed: job.seed,
                    subject: subject.name.clone(),
                    known: known.clone(),
                    f1: confusion.macro_f1(),
                    confusion,
                })
            })
            .collect()
    }

    /// The pools that half of every batch each comes from.
    fn pools(
        &self,
        job: &Job,
        known: &[&Subject],
        seed: u64,
    ) -> Result<Vec<Examples>, EvaluationError> {
        let Condition {
            training, variant, ..
        } = job.condition;
        let mut pools = Vec::new();
        if training != TrainingData::Virtual {
            pools.push(together(known));
        }
        if training == TrainingData::Turned {
            let seed = mixed_seed(&[seed, 1]);
            pools.push(turned(&pools[0], &self.real.placements, seed));
        }
        if let Some(variant) = variant {
            pools.push(self.virtual_windows(variant, job.seed, known)?);
        }
        Ok(pools)
    }

    /// A seed's virtual windows; mapping and effects see the known people alone.
    fn virtual_windows(
        &self,
        variant: Variant,
        seed: usize,
        known: &[&Subject],
    ) -> Result<Examples, EvaluationError> {
        let side = &self.simulated[&(seed, variant.simulator, variant.in_place)];
        let mut windows = if variant.effects {
            let devices: Vec<DeviceEstimate> = (0..self.real.placements.len())
                .map(|device| estimate(known, device))
                .collect();
            player::windows(
                &self.draws[seed],
                &side.played,
                Some(&devices),
                self.settings,
            )?
        } else {
            side.windows.clone()
        };
        if variant.mapped {
            map(
                &mut windows,
                &together(known),
                &self.real.placements,
                self.real.activities.classes().len(),
            )?;
        }
        Ok(windows)
    }
}

/// How well a classifier tells a person's activities.
fn test(
    classifier: &Classifier,
    scaling: &ChannelScaling,
    subject: &Subject,
    classes: usize,
) -> Result<ConfusionMatrix, EvaluationError> {
    let windows = &subject.windows;
    let mut values = windows.values.clone();
    scaling.apply(&mut values);
    let predicted = classifier.classes(&values, windows.len(), windows.steps)?;
    Ok(ConfusionMatrix::new(&windows.labels, &predicted, classes))
}

/// What is known of a device from people's recordings; `device` is the index of its placement.
pub(super) fn estimate(known: &[&Subject], device: usize) -> DeviceEstimate {
    let stretches: Vec<_> = known
        .iter()
        .flat_map(|subject| &subject.stretches)
        .map(|devices| &devices[device])
        .collect();
    DeviceEstimate::from_stretches(&stretches)
}

/// All windows of people.
fn together(subjects: &[&Subject]) -> Examples {
    let mut all = Examples::new(0, 0);
    for subject in subjects {
        (all.steps, all.channels) = (subject.windows.steps, subject.windows.channels);
        all.values.extend_from_slice(&subject.windows.values);
        all.labels.extend_from_slice(&subject.windows.labels);
    }
    all
}

/// Maps virtual windows to the distributions of real ones, channel by channel; all classes that
/// both have count alike in the fit, so that it is not the mixture of activities that is mapped.
fn map(
    windows: &mut Examples,
    real: &Examples,
    placements: &[String],
    classes: usize,
) -> Result<(), EvaluationError> {
    let (own, others) = (windows.counts(classes), real.counts(classes));
    let shared: Vec<usize> = (0..classes)
        .filter(|class| own[*class] > 0 && others[*class] > 0)
        .collect();
    let maps = placements.iter().enumerate().map(|(device, name)| {
        let readings = |examples: &Examples| -> Vec<Reading> {
            let picked = shared.iter().flat_map(|class| picked(examples, *class));
            picked
                .flat_map(|window| {
                    examples
                        .window(window)
                        .chunks_exact(examples.channels)
                        .map(|row| reading(row, device))
                        .collect::<Vec<_>>()
                })
                .collect()
        };
        PlacementMapping::fit(&readings(windows), &readings(real), name)
    });
    let maps = maps.collect::<Result<Vec<_>, _>>()?;
    for row in windows.values.chunks_exact_mut(windows.channels.max(1)) {
        for (device, map) in maps.iter().enumerate() {
            let mapped = map.apply(&reading(row, device));
            write(row, device, &mapped);
        }
    }
    Ok(())
}

/// Indices of [`MAPPED_WINDOWS`] windows of a class, spread evenly; where there are fewer, some come
/// twice.
fn picked(examples: &Examples, class: usize) -> Vec<usize> {
    let own: Vec<usize> = (0..examples.len())
        .filter(|index| usize::from(examples.labels[*index]) == class)
        .collect();
    (0..MAPPED_WINDOWS)
        .map(|k| own[k * own.len() / MAPPED_WINDOWS])
        .collect()
}

/// Copies of windows whose devices are worn in another way, drawn for each copy as virtual people's
/// are.
fn turned(real: &Examples, placements: &[String], seed: u64) -> Examples {
    let wearings = DeviceWearing::for_placements(placements);
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let mut all = Examples::new(real.steps, real.channels);
    for window in (0..COPIES).flat_map(|_| 0..real.len()) {
        let mut values = real.window(window).to_vec();
        let turns: Vec<_> = wearings
            .iter()
            .map(|wearing| wearing.draw_turn(&mut random))
            .collect();
        for row in values.chunks_exact_mut(real.channels.max(1)) {
            for (device, turn) in turns.iter().enumerate() {
                let Reading {
                    specific_force,
                    angular_velocity,
                } = reading(row, device);
                write(
                    row,
                    device,
                    &Reading {
                        specific_force: turn * specific_force,
                        angular_velocity: turn * angular_velocity,
                    },
                );
            }
        }
        all.push(&values, real.labels[window]);
    }
    all
}

/// Puts a device's reading into a row of a window.
fn write(row: &mut [f32], device: usize, reading: &Reading) {
    let values = reading
        .specific_force
        .iter()
        .chain(reading.angular_velocity.iter())
        .map(|value| *value as f32);
    row[device * CHANNELS_PER_DEVICE..(device + 1) * CHANNELS_PER_DEVICE]
        .iter_mut()
        .zip(values)
        .for_each(|(old, value)| *old = value);
}

/// A device's reading in a row of a window.
fn reading(row: &[f32], device: usize) -> Reading {
    let at = |channel: usize| f64::from(row[device * CHANNELS_PER_DEVICE + channel]);
    Reading {
        specific_force: [at(0), at(1), at(2)].into(),
        angular_velocity: [at(3), at(4), at(5)].into(),
    }
}

/// Brings each channel to mean 0 and standard deviation 1 over all pools, each counting alike.
struct ChannelScaling {
    mean: Vec<f32>,
    inverse_std: Vec<f32>,
}

impl ChannelScaling {
    fn fit(pools: &[Examples]) -> Self {
        let channels = pools.first().map_or(0, |pool| pool.channels);
        let (mut means, mut squares) = (vec![0.0; channels], vec![0.0; channels]);
        for pool in pools {
            let weight = 1.0 / (pools.len() * (pool.values.len() / channels.max(1)).max(1)) as f64;
            for row in pool.values.chunks_exact(channels.max(1)) {
                for (channel, value) in row.iter().enumerate() {
                    means[channel] += weight * f64::from(*value);
                    squares[channel] += weight * f64::from(*value).powi(2);
                }
            }
        }
        let inverse =
            |(square, mean): (&f64, &f64)| 1.0 / (square - mean * mean).max(1e-12).sqrt() as f32;
        Self {
            inverse_std: squares.iter().zip(&means).map(inverse).collect(),
            mean: means.iter().map(|mean| *mean as f32).collect(),
        }
    }

    fn apply(&self, values: &mut [f32]) {
        for row in values.chunks_exact_mut(self.mean.len().max(1)) {
            for (value, (mean, inverse)) in
                row.iter_mut().zip(self.mean.iter().zip(&self.inverse_std))
            {
                *value = (*value - mean) * inverse;
            }
        }
    }
}

#[cfg(test)]
#[path = "experiment_tests.rs"]
mod tests;
