//! What a training takes: a YAML file.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use cromosim_imu::SensorFrame;
use cromosim_learned::train::{Loss, Schedule, TrainOptions};
use cromosim_learned::{
    DeviceRanges, Direction, Input, NetworkShape, SourceErrors, Turns, Wearing,
};
use serde::Deserialize;

use super::engine::Choice;

const SCHEMA: &str = "cromosim/training/1";

/// A training's file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    schema: String,
    /// What the networks see: points, residual, differences or streaming.
    pub input: Input,
    /// Sizes of the networks.
    pub network: Sizes,
    /// Where pairs of motion and measured IMU come from.
    pub data: Vec<Source>,
    /// Subjects that are not learned from but decide when to stop.
    pub validation: Vec<String>,
    /// How windows are turned.
    pub turns: Turns,
    /// How the training runs.
    pub training: Running,
}

/// Sizes of the networks; their inputs, outputs and direction follow from what they see.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sizes {
    channels: usize,
    kernel: usize,
    convolutions: usize,
    hidden: usize,
    layers: usize,
}

/// Pairs of one subject.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Motion files; a `*` stands for any part of a file's name. Devices and people are drawn.
    #[serde(default)]
    pub motions: Vec<String>,
    /// A recording with references and IMUs: a bag, or a trial of BROAD.
    #[serde(default)]
    pub recordings: Vec<String>,
    /// Whose: what is held out together.
    pub subject: String,
    /// Under which licence, for the model card.
    pub licence: String,
    /// With motions: the body's sites. With recordings: only IMUs of these names; all where none is
    /// named.
    #[serde(default)]
    pub sites: Vec<String>,
    /// With motions: draws of device and person for each motion and site.
    #[serde(default = "one")]
    pub repeats: u64,
    /// With motions: errors of the source.
    #[serde(default)]
    pub source: SourceChoice,
    /// With motions: frames per second that the source gives, Hz, rather than its own; a motion of
    /// fewer keeps its own.
    #[serde(default)]
    pub rate_hz: Option<f64>,
    /// With motions: what devices differ by.
    #[serde(default)]
    pub devices: DeviceRanges,
    /// With motions: played so many times as fast.
    #[serde(default = "as_recorded")]
    pub speed: [f64; 2],
    /// With recordings: this part of their time, from 0 to 1.
    #[serde(default = "whole")]
    pub part: [f64; 2],
}

/// Errors by the name of their source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SourceChoice {
    /// Optical motion capture.
    #[default]
    Mocap,
    /// Video by VIBE.
    Vibe,
    /// Video by WHAM.
    Wham,
}

impl SourceChoice {
    /// Their size.
    pub fn errors(self) -> SourceErrors {
        match self {
            Self::Mocap => SourceErrors::MOCAP,
            Self::Vibe => SourceErrors::VIBE,
            Self::Wham => SourceErrors::WHAM,
        }
    }
}

/// How the training runs.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Running {
    /// Steps of one batch each.
    pub steps: u64,
    /// Windows in a batch.
    pub windows: usize,
    learning_rate: f64,
    validate_every: u64,
    patience: u64,
    /// Of weights, batches, devices and people.
    pub seed: u64,
    /// What computes the gradients.
    #[serde(default)]
    pub engine: Choice,
}

fn one() -> u64 {
    1
}

fn as_recorded() -> [f64; 2] {
    [1.0, 1.0]
}

fn whole() -> [f64; 2] {
    [0.0, 1.0]
}

impl Config {
    /// Reads a file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        let config: Self =
            serde_norway::from_str(&text).with_context(|| path.display().to_string())?;
        if config.schema != SCHEMA {
            bail!(
                "{}: schema: expected `{SCHEMA}`, found `{}`",
                path.display(),
                config.schema
            );
        }
        for source in &config.data {
            source.check().with_context(|| path.display().to_string())?;
        }
        if let Some(unknown) = config
            .validation
            .iter()
            .find(|subject| !config.data.iter().any(|source| source.subject == **subject))
        {
            bail!(
                "{}: validation: no data of subject {unknown}",
                path.display()
            );
        }
        config
            .options()
            .check(&config.shape())
            .with_context(|| path.display().to_string())?;
        Ok(config)
    }

    /// The networks' shape.
    pub fn shape(&self) -> NetworkShape {
        let Sizes {
            channels,
            kernel,
            convolutions,
            hidden,
            layers,
        } = self.network;
        let direction = if self.input == Input::Streaming {
            Direction::Forward
        } else {
            Direction::Both
        };
        NetworkShape {
            inputs: self.input.channels(),
            channels,
            kernel,
            convolutions,
            hidden,
            layers,
            direction,
            outputs: 3,
        }
    }

    /// The training's options.
    pub fn options(&self) -> TrainOptions {
        let Running {
            steps,
            learning_rate,
            validate_every,
            patience,
            seed,
            ..
        } = self.training;
        TrainOptions {
            losses: vec![Loss::Huber { delta: 1.0 }],
            learning_rate,
            schedule: Schedule::Cosine { floor: 0.02 },
            clip: Some(1.0),
            steps,
            validate_every,
            patience: Some(patience),
            checkpoint_every: validate_every,
            seed,
        }
    }
}

impl Source {
    /// How drawn people wear drawn devices.
    pub fn wearing(&self) -> Wearing {
        let errors = self.source.errors();
        let errors = SourceErrors {
            rate_hz: self.rate_hz.unwrap_or(errors.rate_hz),
            ..errors
        };
        Wearing {
            devices: self.devices.clone(),
            speed: self.speed,
            ..Wearing::of(errors)
        }
    }

    /// Whether everything that is needed is there and in its range.
    pub fn check(&self) -> anyhow::Result<()> {
        let Self {
            subject,
            speed,
            part,
            ..
        } = self;
        if self.motions.is_empty() == self.recordings.is_empty() {
            bail!("data of subject {subject}: expected either motions or recordings");
        }
        if !self.motions.is_empty() && self.sites.is_empty() {
            bail!("data of subject {subject}: motions need sites, such as [right_watch]");
        }
        if !(speed[0] > 0.1 && speed[0] <= speed[1] && speed[1] < 10.0) {
            bail!("data of subject {subject}: speed {speed:?}: expected a range within 0.1 to 10");
        }
        if let Some(rate_hz) = self
            .rate_hz
            .filter(|rate_hz| !(5.0..=1000.0).contains(rate_hz))
        {
            bail!("data of subject {subject}: rate_hz {rate_hz}: expected 5 to 1000");
        }
        if !(part[0] >= 0.0 && part[0] < part[1] && part[1] <= 1.0) {
            bail!("data of subject {subject}: part {part:?}: expected a range within 0 to 1");
        }
        Ok(())
    }

    /// The frames of a recording's reference within its part of the time.
    pub fn part_of(&self, frames: Vec<SensorFrame>) -> Vec<SensorFrame> {
        let (Some(first), Some(last)) = (frames.first(), frames.last()) else {
            return frames;
        };
        let [from, to] = self
            .part
            .map(|part| first.stamp.plus_seconds(part * (last.stamp - first.stamp)));
        frames
            .into_iter()
            .filter(|frame| frame.stamp >= from && frame.stamp <= to)
            .collect()
    }

    /// The motion files, in order; relative to a folder.
    pub fn motion_files(&self, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
        files(&self.motions, folder)
    }

    /// The recordings, in order; relative to a folder.
    pub fn recording_files(&self, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
        files(&self.recordings, folder)
    }
}

/// Files of patterns with `*` in their names.
fn files(patterns: &[String], folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for pattern in patterns {
        let path = folder.join(pattern);
        if !pattern.contains('*') {
            found.push(path);
            continue;
        }
        let (parent, name) = (
            path.parent().unwrap_or(folder),
            path.file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
        );
        let parent = if parent.as_os_str().is_empty() {
            Path::new(".")
        } else {
            parent
        };
        let entries = std::fs::read_dir(parent)
            .with_context(|| format!("{}: cannot be read", parent.display()))?;
        let mut matching: Vec<PathBuf> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| {
                path.file_name()
                    .is_some_and(|own| matches(&name, &own.to_string_lossy()))
            })
            .collect();
        if matching.is_empty() {
            bail!("{}: no file matches {name}", parent.display());
        }
        matching.sort();
        found.extend(matching);
    }
    Ok(found)
}

/// Whether a name is the pattern with something in place of each `*`.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, rest)) => {
            let Some(tail) = name.strip_prefix(head) else {
                return false;
            };
            (0..=tail.len())
                .filter(|at| tail.is_char_boundary(*at))
                .any(|at| matches(rest, &tail[at..]))
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn files_that_come_with_the_suite_are_sound() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/training");
        let mut count = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let config = Config::read(&entry.unwrap().path()).unwrap();
            assert!(
                config
                    .data
                    .iter()
                    .any(|source| !config.validation.contains(&source.subject))
            );
            count += 1;
        }
        assert_eq!(count, 6);
    }

    #[test]
    fn patterns_match_names() {
        for (pattern, name, expected) in [
            ("02_*.npz", "02_01.npz", true),
            ("02_*.npz", "03_01.npz", false),
            ("*", "a", true),
            ("a*b*c", "abc", true),
            ("a*b", "ac", false),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }
}
