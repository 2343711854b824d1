//! A data set's recording: what belongs to it, and which of its placements is taken.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use cromosim_recording::datasets::{DatasetFiles, DatasetRecording, PlacedImu};
use cromosim_recording::rigid::EurocGroundTruth;

use super::write::Target;
use super::{Arguments, Content};

/// Options of data sets.
#[derive(Args)]
pub struct DatasetArguments {
    /// Of a data set: this placement alone
    #[arg(long, value_name = "NAME")]
    placement: Option<String>,
    /// Of TotalCapture: the folder of gt_skel_gbl_pos.txt and gt_skel_gbl_ori.txt; default: looked
    /// for beside the file
    #[arg(long, value_name = "DIR")]
    reference: Option<PathBuf>,
    /// Of RealWorld: the gyroscope's zip; default: the one beside the accelerometer's
    #[arg(long, value_name = "FILE")]
    gyroscope: Option<PathBuf>,
}

impl DatasetArguments {
    /// What is given with the file.
    pub fn files(&self) -> DatasetFiles {
        DatasetFiles {
            reference: self.reference.clone(),
            gyroscope: self.gyroscope.clone(),
        }
    }

    /// The first option that was given.
    pub fn given(&self) -> Option<&'static str> {
        let given = [
            (self.placement.is_some(), "--placement"),
            (self.reference.is_some(), "--reference"),
            (self.gyroscope.is_some(), "--gyroscope"),
        ];
        given
            .into_iter()
            .find_map(|(given, option)| given.then_some(option))
    }

    /// The chosen part and placements, under another name where it is one and a name is given; of
    /// one placement what the target holds.
    pub fn chosen(
        &self,
        mut recording: DatasetRecording,
        target: Target,
        arguments: &Arguments,
    ) -> anyhow::Result<Content> {
        let (path, name) = (arguments.input.display(), arguments.name.as_deref());
        if let Some(option) = arguments.motion.given(false) {
            bail!(
                "{path}: {option} is for motions, and this is a recording of a data set; leave it out"
            );
        }
        let (start, duration) = arguments.motion.part()?;
        if let Some((first, last)) = recording.span() {
            let from = first.plus_seconds(start);
            if from > last {
                bail!(
                    "{path}: --start {start}: the recording ends after {:.3} s",
                    last - first
                );
            }
            recording.between(
                from,
                duration.map_or(last, |seconds| from.plus_seconds(seconds)),
            );
        }
        let known = recording
            .imus
            .iter()
            .map(|imu| imu.placement.as_str())
            .collect::<Vec<_>>()
            .join(", ");
        if let Some(placement) = &self.placement {
            if !recording.imus.iter().any(|imu| imu.placement == *placement) {
                bail!("{path}: --placement {placement}: no such placement; there are {known}");
            }
            recording.imus.retain(|imu| imu.placement == *placement);
        }
        if target != Target::Bag && recording.imus.len() != 1 {
            bail!("{path}: several placements; give --placement, one of {known}");
        }
        if let Some(name) = name {
            if recording.imus.len() != 1 {
                bail!(
                    "{path}: --name {name} is for one placement; give --placement, one of {known}"
                );
            }
            let old = std::mem::replace(&mut recording.imus[0].placement, name.to_owned());
            recording
                .references
                .iter_mut()
                .filter(|(of, _)| *of == old)
                .for_each(|(of, _)| name.clone_into(of));
        }
        let left_out: Vec<String> = recording
            .imus
            .iter()
            .filter(|imu| imu.rows_left_out > 0)
            .map(left_out)
            .collect();
        let content = match target {
            Target::Bag => Content::Recording(Box::new(recording)),
            Target::Tum => {
                let of = recording.imus[0].placement.clone();
                let Some((_, trajectory)) = recording
                    .references
                    .into_iter()
                    .find(|(name, _)| *name == of)
                else {
                    bail!(
                        "{path}: the recording has no reference of {of}, and a TUM trajectory holds no readings"
                    );
                };
                Content::Poses(EurocGroundTruth {
                    trajectory,
                    ..EurocGroundTruth::default()
                })
            }
            _ => Content::Imu(recording.imus.swap_remove(0).series),
        };
        left_out.iter().for_each(|line| eprintln!("{path}: {line}"));
        Ok(content)
    }
}

fn left_out(imu: &PlacedImu) -> String {
    format!(
        "{}: {} rows of the file without readings, or out of the order of time, are left out",
        imu.placement, imu.rows_left_out
    )
}
