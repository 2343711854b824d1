//! A data set's recording: what belongs to it, and which of its placements is taken.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use cromosim_motion::datasets::{DatasetFiles, DatasetRecording};
use cromosim_motion::rigid::EurocGroundTruth;

use super::Content;
use super::write::Target;

/// Options of data sets.
#[derive(Args)]
pub struct DatasetArguments {
    /// Of a data set: this placement alone
    #[arg(long, value_name = "NAME")]
    placement: Option<String>,
    /// Of TotalCapture: the folder of gt_skel_gbl_pos.txt and gt_skel_gbl_ori.txt; default: looked for beside the file
    #[arg(long, value_name = "DIR")]
    reference: Option<PathBuf>,
    /// Of RealWorld: the gyroscope's zip; default: the one beside the accelerometer's
    #[arg(long, value_name = "FILE")]
    gyroscope: Option<PathBuf>,
}

impl DatasetArguments {
    /// What is given with the file.
    pub fn files(&self) -> DatasetFiles {
        DatasetFiles { reference: self.reference.clone(), gyroscope: self.gyroscope.clone() }
    }

    /// The first option that was given.
    pub fn given(&self) -> Option<&'static str> {
        let given = [(self.placement.is_some(), "--placement"), (self.reference.is_some(), "--reference"), (self.gyroscope.is_some(), "--gyroscope")];
        given.into_iter().find_map(|(given, option)| given.then_some(option))
    }

    /// The chosen placements, under `name` where it is one and a name is given; of one placement what the target holds.
    pub fn chosen(&self, mut recording: DatasetRecording, name: Option<&str>, target: Target, path: &Path) -> anyhow::Result<Content> {
        let path = path.display();
        let known = recording.imus.iter().map(|imu| imu.placement.as_str()).collect::<Vec<_>>().join(", ");
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
                bail!("{path}: --name {name} is for one placement; give --placement, one of {known}");
            }
            let old = std::mem::replace(&mut recording.imus[0].placement, name.to_owned());
            recording.references.iter_mut().filter(|(of, _)| *of == old).for_each(|(of, _)| name.clone_into(of));
        }
        for imu in recording.imus.iter().filter(|imu| imu.rows_left_out > 0) {
            eprintln!("{path}: {}: {} rows without readings, or out of the order of time, are left out", imu.placement, imu.rows_left_out);
        }
        Ok(match target {
            Target::Bag => Content::Recording(Box::new(recording)),
            Target::Tum => {
                let of = recording.imus[0].placement.clone();
                let Some((_, trajectory)) = recording.references.into_iter().find(|(name, _)| *name == of) else {
                    bail!("{path}: the recording has no reference of {of}, and a TUM trajectory holds no readings");
                };
                Content::Poses(EurocGroundTruth { trajectory, ..EurocGroundTruth::default() })
            }
            _ => Content::Imu(recording.imus.swap_remove(0).series),
        })
    }
}
