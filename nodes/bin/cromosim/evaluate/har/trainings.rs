//! One training: whose real windows, which virtual ones, and on whom it is tested.

use std::collections::BTreeMap;

use cromosim_imu::Reading;
use cromosim_learned::{Examples, PlacementMapping, train_classifier};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::clips::Draw;
use super::device::DeviceEstimate;
use super::real::{Real, Subject};
use super::results::{Run, Training, Variant};
use super::scores::Confusion;
use super::settings::Settings;
use super::signal::PER_DEVICE;
use super::simulated::{self, Played, Simulator};
use super::wear;
use crate::progress::Interrupt;
use crate::train::data::mix;

/// Turned copies of a window.
const COPIES: usize = 4;
/// Windows of each class that a mapping is fitted to, on both sides.
const MAPPED_WINDOWS: usize = 60;

/// The draws of a seed as a simulator plays them.
pub struct Virtual {
    /// Played.
    pub played: Vec<Played>,
    /// Windows without devices' errors.
    pub windows: Examples,
}

/// Everything that trainings share.
pub struct Ground<'a> {
    /// Sizes.
    pub settings: &'a Settings,
    /// People.
    pub real: &'a Real,
    /// For each seed.
    pub draws: &'a [Vec<Draw>],
    /// By seed, simulator, and whether the root stays in place.
    pub simulated: &'a BTreeMap<(usize, Simulator, bool), Virtual>,
    /// The end.
    pub interrupt: &'a Interrupt,
}

/// One training.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// What is learned from.
    pub training: Training,
    /// How virtual windows are made.
    pub variant: Option<Variant>,
    /// Share of the training subjects.
    pub share: f64,
    /// Which repetition.
    pub seed: usize,
    /// People whose real windows may be seen.
    pub known: Vec<usize>,
    /// People who are tested.
    pub tested: Vec<usize>,
}

/// The training subjects for a tested one: so large a share of the others, at least one, in an
/// order drawn for the seed; a smaller share's are among a larger one's.
pub fn training_subjects(count: usize, tested: usize, share: f64, seed: u64) -> Vec<usize> {
    let mut others: Vec<usize> = (0..count).filter(|subject| *subject != tested).collect();
    let mut random = ChaCha12Rng::seed_from_u64(mix(&[seed, 11, tested as u64]));
    for last in (1..others.len()).rev() {
        others.swap(last, random.random_range(0..=last));
    }
    others.truncate(((share * others.len() as f64).round() as usize).max(1));
    others.sort_unstable();
    others
}

impl Ground<'_> {
    /// Trains and tests.
    pub fn run(&self, job: &Job) -> anyhow::Result<Vec<Run>> {
        self.interrupt.check()?;
        let known: Vec<&Subject> = job
            .known
            .iter()
            .map(|index| &self.real.subjects[*index])
            .collect();
        let mut pools = Vec::new();
        if job.training != Training::Virtual {
            pools.push(together(&known));
        }
        // The same for all that is compared.
        let seed = mix(&[
            self.settings.seed,
            12,
            job.seed as u64,
            job.tested[0] as u64,
        ]);
        if job.training == Training::Turned {
            pools.push(turned(&pools[0], &self.real.placements, mix(&[seed, 1])));
        }
        if let Some(variant) = job.variant {
            pools.push(self.virtual_windows(variant, job.seed, &known)?);
        }
        let scale = Scale::of(&pools);
        pools
            .iter_mut()
            .for_each(|pool| scale.apply(&mut pool.values));
        let classes = self.real.activities.classes().len();
        let shape = self
            .settings
            .shape(self.real.placements.len() * PER_DEVICE, classes);
        let pools: Vec<&Examples> = pools.iter().collect();
        let classifier = train_classifier(
            &shape,
            &self.settings.training,
            &pools,
            seed,
            self.interrupt.flag(),
        )?;
        let Some(classifier) = classifier else {
            self.interrupt.check()?;
            return Ok(Vec::new());
        };
        let test = |index: &usize| {
            let subject = &self.real.subjects[*index];
            let mut values = subject.windows.values.clone();
            scale.apply(&mut values);
            let said = classifier.classes(&values, subject.windows.len(), subject.windows.steps)?;
            let confusion = Confusion::new(&subject.windows.labels, &said, classes);
            let known = known.iter().map(|subject| subject.name.clone()).collect();
            Ok(Run {
                seed: job.seed,
                subject: subject.name.clone(),
                known,
                f1: confusion.macro_f1(),
                confusion,
            })
        };
        job.tested.iter().map(test).collect()
    }

    fn virtual_windows(
        &self,
        variant: Variant,
        seed: usize,
        known: &[&Subject],
    ) -> anyhow::Result<Examples> {
        let side = &self.simulated[&(seed, variant.simulator, variant.in_place)];
        let mut windows = if variant.effects {
            let devices: Vec<DeviceEstimate> = (0..self.real.placements.len())
                .map(|device| estimate(known, device))
                .collect();
            simulated::windows(
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

/// What is known of a device from people's recordings.
pub fn estimate(known: &[&Subject], device: usize) -> DeviceEstimate {
    let stretches: Vec<_> = known
        .iter()
        .flat_map(|subject| &subject.stretches)
        .map(|devices| &devices[device])
        .collect();
    DeviceEstimate::of(&stretches)
}

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
) -> anyhow::Result<()> {
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

/// As many windows of a class on either side, spread evenly; where there are fewer, some twice.
fn picked(examples: &Examples, class: usize) -> Vec<usize> {
    let own: Vec<usize> = (0..examples.len())
        .filter(|index| usize::from(examples.labels[*index]) == class)
        .collect();
    (0..MAPPED_WINDOWS)
        .map(|k| own[k * own.len() / MAPPED_WINDOWS])
        .collect()
}

/// Copies of windows whose devices are worn another way, drawn for each copy as the virtual
/// people's are.
fn turned(real: &Examples, placements: &[String], seed: u64) -> Examples {
    let wears: Vec<_> = placements
        .iter()
        .filter_map(|name| wear::wear(name))
        .collect();
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let mut all = Examples::new(real.steps, real.channels);
    for window in (0..COPIES).flat_map(|_| 0..real.len()) {
        let mut values = real.window(window).to_vec();
        let turns: Vec<_> = wears.iter().map(|wear| wear.turn(&mut random)).collect();
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

fn write(
    row: &mut [f32],
    device: usize,
    Reading {
        specific_force,
        angular_velocity,
    }: &Reading,
) {
    let values = specific_force
        .iter()
        .chain(angular_velocity.iter())
        .map(|value| *value as f32);
    row[device * PER_DEVICE..(device + 1) * PER_DEVICE]
        .iter_mut()
        .zip(values)
        .for_each(|(old, value)| *old = value);
}

fn reading(row: &[f32], device: usize) -> Reading {
    let at = |channel: usize| f64::from(row[device * PER_DEVICE + channel]);
    Reading {
        specific_force: [at(0), at(1), at(2)].into(),
        angular_velocity: [at(3), at(4), at(5)].into(),
    }
}

/// Each channel less its mean, by its standard deviation; of all pools together, each counting
/// alike.
struct Scale {
    mean: Vec<f32>,
    inverse_std: Vec<f32>,
}

impl Scale {
    fn of(pools: &[Examples]) -> Self {
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
#[path = "trainings_tests.rs"]
mod tests;
