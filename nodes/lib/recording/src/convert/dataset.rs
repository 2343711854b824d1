//! A data set's recording: which part and which of its placements is taken.

use cromosim_spatial::meant;
use std::path::Path;

use super::{Content, Read, ReadOptions, Target};
use crate::RecordingError;
use crate::datasets::{DatasetFormat, DatasetRecording, PlacedImu};
use crate::rigid::EurocGroundTruth;

/// The chosen part and placements, under another name where it is one and a name is given; of one
/// placement what the target holds.
pub(super) fn chosen(
    path: &Path,
    (format, mut recording): (DatasetFormat, DatasetRecording),
    target: Target,
    options: &ReadOptions,
) -> Result<Read, RecordingError> {
    let unsuitable = |problem: String| RecordingError::Unsuitable {
        path: path.to_owned(),
        problem,
    };
    let takes = |option: &&str| !(*option == "--up-axis" && format.takes_up_axis());
    if let Some(option) = options.motion_settings(false).find(takes) {
        return Err(unsuitable(format!(
            "{option} is for motions, and this is a recording; leave it out"
        )));
    }
    cut(path, &mut recording, options)?;
    choose_placements(&mut recording, target, options).map_err(unsuitable)?;
    let left_out = recording.imus.iter().filter(|imu| imu.rows_left_out > 0);
    let left_out = left_out.map(|imu| note_left_out(path, imu));
    let said = recording.notes.iter();
    let said = said.map(|note| format!("{}: {note}", path.display()));
    let notes = said.chain(left_out).collect();
    let content = held_by(target, recording).map_err(unsuitable)?;
    Ok(Read { content, notes })
}

/// Keeps the placement that is asked for, under the name that is given; `Err` says what does not
/// fit.
fn choose_placements(
    recording: &mut DatasetRecording,
    target: Target,
    options: &ReadOptions,
) -> Result<(), String> {
    let known = recording.placements().join(", ");
    if let Some(placement) = &options.placement {
        recording.imus.retain(|imu| imu.placement == *placement);
        recording.references.retain(|(name, _)| name == placement);
        if recording.placements().is_empty() {
            return Err(format!(
                "--placement {placement}: no such placement; there are {known}{}",
                meant(placement, known.split(", "))
            ));
        }
    }
    let holds_all = matches!(target, Target::Bag | Target::Columns);
    let is_one = recording.placements().len() == 1;
    if !holds_all && !is_one {
        return Err(format!(
            "several placements; give --placement, one of {known}"
        ));
    }
    if let Some(name) = &options.name {
        if !is_one {
            return Err(format!(
                "--name {name} is for one placement; give --placement, one of {known}"
            ));
        }
        rename(recording, name);
    }
    Ok(())
}

/// What the target holds of the recording; `Err` says what is missing.
fn held_by(target: Target, mut recording: DatasetRecording) -> Result<Content, String> {
    if target == Target::Bag {
        return Ok(Content::Recording(Box::new(recording)));
    }
    if target == Target::Columns {
        return match recording.imus.is_empty() {
            true => Err("it has no IMU, and columns hold readings alone".to_owned()),
            false => Ok(Content::Recording(Box::new(recording))),
        };
    }
    if target != Target::Tum
        && let Some(imu) = recording.imus.pop()
    {
        return Ok(Content::Imu(imu.series));
    }
    let placements = recording.placements();
    let placement = placements.first().copied().unwrap_or_default().to_owned();
    let mut references = recording.references.into_iter();
    let Some((_, trajectory)) = references.find(|(name, _)| *name == placement) else {
        return Err(format!(
            "the recording has no reference of {placement}, and a TUM trajectory holds no readings"
        ));
    };
    Ok(Content::Poses(EurocGroundTruth {
        trajectory,
        ..EurocGroundTruth::default()
    }))
}

/// The part of the recording from `start_s` on, `duration_s` long.
fn cut(
    path: &Path,
    recording: &mut DatasetRecording,
    options: &ReadOptions,
) -> Result<(), RecordingError> {
    let (start, duration) = (options.motion.start_s, options.motion.duration_s);
    if !(start >= 0.0 && start.is_finite()) {
        return Err(RecordingError::BadStart { start_s: start });
    }
    if let Some(duration_s) = duration.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
        return Err(RecordingError::BadDuration { duration_s });
    }
    let Some((first, last)) = recording.span() else {
        return Ok(());
    };
    let from = first.plus_seconds(start);
    if from > last {
        return Err(RecordingError::Unsuitable {
            path: path.to_owned(),
            problem: format!(
                "--start {start}: the recording ends after {:.3} s",
                last - first
            ),
        });
    }
    let to = duration.map_or(last, |seconds| from.plus_seconds(seconds));
    recording.between(from, to);
    Ok(())
}

/// Another name for the only placement and its reference.
fn rename(recording: &mut DatasetRecording, name: &str) {
    let placements = recording.placements();
    let old = placements.first().copied().unwrap_or_default().to_owned();
    for imu in &mut recording.imus {
        name.clone_into(&mut imu.placement);
    }
    for (reference, _) in &mut recording.references {
        if *reference == old {
            name.clone_into(reference);
        }
    }
}

fn note_left_out(path: &Path, imu: &PlacedImu) -> String {
    format!(
        "{}: {}: {} rows of the file without readings, or out of the order of time, are left out",
        path.display(),
        imu.placement,
        imu.rows_left_out
    )
}
