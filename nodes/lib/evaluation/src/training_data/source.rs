//! Where pairs come from, as a YAML file says it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_body::BodyModel;
use cromosim_imu::SensorFrame;
use cromosim_learned::{DeviceRanges, SourceErrors, WearerRanges};
use serde::Deserialize;

use super::files::matching_files;
use crate::EvaluationError;

/// Where the files of data sources are, and the body that they are for.
#[derive(Clone)]
pub struct DataFolder {
    /// Files of data sources are relative to it.
    pub folder: PathBuf,
    /// The body that motions and recordings are played on; without, the embedded one, and a
    /// recording that was made on another is refused.
    pub body: Option<Arc<BodyModel>>,
    /// The skeleton map of BVH and AMC files, as [`cromosim_motion::MotionOptions::skeleton_map`].
    pub skeleton_map: Option<String>,
}

impl DataFolder {
    /// The body that motions are played on.
    pub(crate) fn model(&self) -> Arc<BodyModel> {
        self.body.clone().unwrap_or_else(BodyModel::embedded)
    }
}

/// Pairs of one subject.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataSource {
    /// Motion files; a `*` stands for any part of a file's name. Devices and people are drawn.
    #[serde(default)]
    pub motions: Vec<String>,
    /// Recordings with references and IMUs: bags, or recordings of a data set (a trial of BROAD).
    #[serde(default)]
    pub recordings: Vec<String>,
    /// Who moves; data of one subject are held out together.
    pub subject: String,
    /// The licence that the data are under, for the model card.
    pub licence: String,
    /// With motions: the body's sites. With recordings: only IMUs of these names; all where none is
    /// named.
    #[serde(default)]
    pub sites: Vec<String>,
    /// With motions: draws of device and person for each motion and site.
    #[serde(default = "one")]
    pub repeats: u64,
    /// With motions: where their errors come from.
    #[serde(default)]
    pub source: PoseSource,
    /// With motions: frames per second that the source gives, Hz, rather than its own; a motion of
    /// fewer keeps its own.
    #[serde(default)]
    pub rate_hz: Option<f64>,
    /// With motions: what devices differ by.
    #[serde(default)]
    pub devices: DeviceRanges,
    /// With motions: the range of how many times as fast as recorded they are played.
    #[serde(default = "as_recorded")]
    pub speed: [f64; 2],
    /// With recordings: this part of their time, from 0 to 1.
    #[serde(default = "whole")]
    pub part: [f64; 2],
}

/// What poses are measured or estimated by, which decides how wrong they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseSource {
    /// Optical motion capture.
    #[default]
    Mocap,
    /// Video by VIBE.
    Vibe,
    /// Video by WHAM.
    Wham,
}

impl PoseSource {
    /// The errors of such poses.
    pub fn errors(self) -> SourceErrors {
        match self {
            Self::Mocap => SourceErrors::MOCAP,
            Self::Vibe => SourceErrors::VIBE,
            Self::Wham => SourceErrors::WHAM,
        }
    }
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

impl DataSource {
    /// How drawn people wear drawn devices.
    pub fn wearing(&self) -> WearerRanges {
        let errors = self.source.errors();
        let errors = SourceErrors {
            rate_hz: self.rate_hz.unwrap_or(errors.rate_hz),
            ..errors
        };
        WearerRanges {
            devices: self.devices.clone(),
            speed: self.speed,
            ..WearerRanges::with_source(errors)
        }
    }

    /// Whether everything that is needed is there and in its range.
    ///
    /// # Errors
    /// [`EvaluationError::DataSource`] with the first field that is wrong.
    pub fn check(&self) -> Result<(), EvaluationError> {
        let Self {
            subject,
            speed,
            part,
            ..
        } = self;
        let wrong = |problem: String| {
            Err(EvaluationError::DataSource {
                subject: subject.clone(),
                problem,
            })
        };
        if self.motions.is_empty() == self.recordings.is_empty() {
            return wrong("expected either motions or recordings".to_owned());
        }
        if !self.motions.is_empty() && self.sites.is_empty() {
            return wrong("motions need sites, such as [right_watch]".to_owned());
        }
        if !(speed[0] > 0.1 && speed[0] <= speed[1] && speed[1] < 10.0) {
            return wrong(format!(
                "speed {speed:?}: expected a range within 0.1 to 10"
            ));
        }
        if let Some(rate_hz) = self
            .rate_hz
            .filter(|rate_hz| !(5.0..=1000.0).contains(rate_hz))
        {
            return wrong(format!("rate_hz {rate_hz}: expected 5 to 1000"));
        }
        if !(part[0] >= 0.0 && part[0] < part[1] && part[1] <= 1.0) {
            return wrong(format!("part {part:?}: expected a range within 0 to 1"));
        }
        Ok(())
    }

    /// The frames of a recording's reference within [`DataSource::part`] of its time.
    pub fn frames_in_part(&self, frames: Vec<SensorFrame>) -> Vec<SensorFrame> {
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
    ///
    /// # Errors
    /// A folder that cannot be read, or a pattern that nothing matches.
    pub fn motion_files(&self, folder: &Path) -> Result<Vec<PathBuf>, EvaluationError> {
        matching_files(&self.motions, folder)
    }

    /// The recordings, in order; relative to a folder.
    ///
    /// # Errors
    /// A folder that cannot be read, or a pattern that nothing matches.
    pub fn recording_files(&self, folder: &Path) -> Result<Vec<PathBuf>, EvaluationError> {
        matching_files(&self.recordings, folder)
    }
}
