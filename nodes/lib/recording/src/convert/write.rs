//! Content in a target's form, in a file that takes its name when it is complete.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use cromosim_bag::{BagOptions, BagWriter, Compression};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_imu::Placement;
use cromosim_motion::{
    MotionOptions, SmplMotion, place_markers, write_amass, write_bvh, write_trc,
};

use super::{Content, Conversion, Target};
use crate::columns::{ColumnsHeader, write_recording_columns};
use crate::datasets::{DatasetRecording, PlacedImu};
use crate::rigid::{
    ImuSeries, write_euroc_ground_truth, write_euroc_imu, write_imu_csv, write_pose_csv, write_tum,
};
use crate::{
    MessageHeader, PlacementTrace, RecordingError, activities_csv, first_stamp,
    seconds_to_first_stamp, smpl_pose, stamp_of_frame, write_file, write_traces,
};

/// Writes the content in the conversion's form; `imu` stands beside a trajectory in a bag.
pub(super) fn write(
    content: &Content,
    conversion: &Conversion,
    model: &Arc<BodyModel>,
    imu: Option<&ImuSeries>,
) -> Result<(), RecordingError> {
    let Conversion {
        input,
        out,
        target,
        options,
        replace,
        ..
    } = conversion;
    if imu.is_some() && !matches!(content, Content::Poses(_)) {
        return Err(RecordingError::ImuBesideNoTrajectory {
            path: input.clone(),
            content: content.name(),
        });
    }
    let text = match (content, target) {
        (Content::Motion(motion), _) => {
            let written = MotionFile {
                target: *target,
                options: &options.motion,
                command: "convert",
                replace: *replace,
            };
            return write_motion(motion, model, &written, out);
        }
        (_, Target::Bag) => return write_bag(content, conversion, imu),
        (Content::Imu(_) | Content::Recording(_), Target::Columns) => {
            return write_columns(content, conversion);
        }
        (Content::Poses(poses), Target::Tum) => write_tum(&poses.trajectory),
        (Content::Poses(poses), Target::Euroc) => write_euroc_ground_truth(poses),
        (Content::Poses(poses), Target::Csv) => write_pose_csv(&poses.trajectory),
        (Content::Imu(series), Target::Euroc) => write_euroc_imu(series),
        (Content::Imu(series), Target::Csv) => write_imu_csv(series),
        (other, target) => {
            return Err(RecordingError::Unsuitable {
                path: input.clone(),
                problem: format!("{} cannot become {}", other.name(), target.describe()),
            });
        }
    };
    write_file(out, text.as_bytes(), *replace)
}

/// How a motion is written.
#[derive(Clone, Copy, Debug)]
pub struct MotionFile<'a> {
    /// The format: one that holds whole bodies.
    pub target: Target,
    /// For TRC: which marker is where.
    pub options: &'a MotionOptions,
    /// The command that a bag names as its origin.
    pub command: &'a str,
    /// Replaces the file where it exists.
    pub replace: bool,
}

/// Writes a motion of `model`'s body; into a bag its poses and their confidence as `/smpl/pose`,
/// which `replay` plays.
///
/// # Errors
/// A target that holds no whole bodies, betas that are not the body's, and what cannot be written.
pub fn write_motion(
    motion: &SmplMotion,
    model: &Arc<BodyModel>,
    file: &MotionFile<'_>,
    out: &Path,
) -> Result<(), RecordingError> {
    let shaped = || ShapedBody::new(model.clone(), &motion.betas);
    let bytes = match file.target {
        Target::Bag => return write_motion_bag(motion, model, file, out),
        Target::Amass => write_amass(motion, &shaped()?, Cursor::new(Vec::new()))
            .map_err(|source| RecordingError::Write {
                path: out.to_owned(),
                source,
            })?
            .into_inner(),
        Target::Bvh => write_bvh(motion, &shaped()?).into_bytes(),
        Target::Trc => {
            let set = file.options.markers_set()?;
            write_trc(&place_markers(motion, model, &set)?).into_bytes()
        }
        other => {
            return Err(RecordingError::Unsuitable {
                path: motion.name.clone().into(),
                problem: format!(
                    "a motion cannot become {}; give --joint or --site",
                    other.describe()
                ),
            });
        }
    };
    write_file(out, &bytes, file.replace)
}

fn write_motion_bag(
    motion: &SmplMotion,
    model: &BodyModel,
    file: &MotionFile<'_>,
    out: &Path,
) -> Result<(), RecordingError> {
    let mut bag = create_bag(out, file.command, Some(model), file.replace)?;
    for frame in 0..motion.frames.len() {
        let stamp = stamp_of_frame(motion, frame, 0.0);
        let header = MessageHeader {
            stamp,
            frame_id: "world",
            body_id: "0",
        };
        bag.write("/smpl/pose", stamp, &smpl_pose(motion, frame, header))?;
    }
    bag.finish()?;
    Ok(())
}

/// Writes `/reference/NAME` and `/imu/NAME/data_raw` in order of time, and `/imu/NAME/data` where
/// the device gave orientations.
fn write_bag(
    content: &Content,
    conversion: &Conversion,
    imu: Option<&ImuSeries>,
) -> Result<(), RecordingError> {
    let name = conversion.options.name.as_deref().unwrap_or("body");
    let trace = |reference, imu| PlacementTrace {
        name,
        reference,
        imu,
        orientations: &[],
        magnetic_field: &[],
    };
    let (traces, recording): (_, Option<&DatasetRecording>) = match content {
        Content::Motion(_) => (Vec::new(), None),
        Content::Poses(poses) => (vec![trace(Some(&poses.trajectory), imu)], None),
        Content::Imu(series) => (vec![trace(None, Some(series))], None),
        Content::Recording(recording) => (recording.traces(), Some(recording)),
    };
    for trace in &traces {
        // A placement's name is what a topic's part may be.
        Placement::at_site(trace.name, "left_watch", 1.0).map_err(|(_, problem)| {
            RecordingError::PlacementName {
                option: "--name",
                name: trace.name.to_owned(),
                problem: problem.to_string(),
            }
        })?;
    }
    let Some(first) = first_stamp(&traces) else {
        return Err(RecordingError::NothingRecorded {
            name: conversion.input.display().to_string(),
        });
    };
    // A data set's stamps may begin at 0, which TF takes for "the latest".
    let shift_s = recording.map_or(0.0, |_| seconds_to_first_stamp(first));
    let mut bag = create_bag(&conversion.out, "convert", None, conversion.replace)?;
    if let Some(recording) = recording.filter(|recording| !recording.activities.is_empty()) {
        bag.attach(
            "activities.csv",
            "text/csv",
            first.plus_seconds(shift_s),
            activities_csv(recording, shift_s).as_bytes(),
        )?;
    }
    write_traces(&mut bag, &traces, shift_s)?;
    bag.finish()?;
    Ok(())
}

/// Every IMU of the content in a table; the recording is named after the input.
fn write_columns(content: &Content, conversion: &Conversion) -> Result<(), RecordingError> {
    let of_series = |series: &ImuSeries| DatasetRecording {
        imus: vec![PlacedImu {
            placement: conversion
                .options
                .name
                .as_deref()
                .unwrap_or("body")
                .to_owned(),
            series: series.clone(),
            ..PlacedImu::default()
        }],
        ..DatasetRecording::default()
    };
    let (alone, recording);
    recording = match content {
        Content::Recording(recording) => recording.as_ref(),
        Content::Imu(series) => {
            alone = of_series(series);
            &alone
        }
        _ => return Ok(()),
    };
    let stem = conversion.input.file_stem().unwrap_or_default();
    let entry = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    let header = ColumnsHeader {
        recording: stem.to_string_lossy().into_owned(),
        metadata: BTreeMap::from([
            entry("version", env!("CARGO_PKG_VERSION")),
            entry("command", "convert"),
        ]),
    };
    write_recording_columns(recording, &header, &conversion.out, conversion.replace)
}

fn create_bag(
    out: &Path,
    command: &str,
    model: Option<&BodyModel>,
    replace: bool,
) -> Result<BagWriter, RecordingError> {
    let options = BagOptions {
        compression: Compression::Zstd,
        replace,
        ..BagOptions::default()
    };
    let mut bag = BagWriter::create(out, options)?;
    let entry = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    let mut metadata = BTreeMap::from([
        entry("version", env!("CARGO_PKG_VERSION")),
        entry("command", command),
    ]);
    metadata.extend(model.map(|model| entry("body", model.id())));
    bag.write_metadata("cromosim", metadata)?;
    Ok(bag)
}
