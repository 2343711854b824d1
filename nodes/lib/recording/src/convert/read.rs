//! What the input is, by its content, and what it holds.

use std::path::Path;

use cromosim_bag::starts_like_bag;
use cromosim_body::BodyModel;
use cromosim_motion::{MotionFormat, read_motion_for};

use super::{Content, Read, ReadOptions, Target, bag_topic, dataset};
use crate::datasets::{DatasetFiles, open_dataset};
use crate::rigid::{RigidContent, parse_rigid, sniff_rigid};
use crate::{RecordingError, read_head, read_whole};

/// Reads whatever the file is; of a bag and of a data set what `target` can hold.
///
/// # Errors
/// What is wrong with the file; settings that its kind does not take.
pub fn read_content(
    path: &Path,
    options: &ReadOptions,
    target: Target,
) -> Result<Read, RecordingError> {
    let unsuitable = |problem: String| RecordingError::Unsuitable {
        path: path.to_owned(),
        problem,
    };
    let head = if path.is_dir() {
        Vec::new()
    } else {
        read_head(path)?
    };
    if path.is_dir() || starts_like_bag(&head) {
        // Columns hold all IMUs of a bag, from which one can be chosen.
        if target != Target::Columns || options.placement.is_none() {
            refuse_dataset_settings(path, options)?;
        }
        let read = bag_topic::read(path, options, target)?;
        refuse_motion_settings(path, &read.content, options)?;
        return Ok(read);
    }
    if let Some(option) = options.bag_setting() {
        return Err(unsuitable(format!(
            "{option} chooses from a bag, which this file is not"
        )));
    }
    if head.is_empty() {
        return Err(unsuitable("the file is empty".to_owned()));
    }
    read_file(path, &head, options, target)
}

/// Reads a file that is no bag; `head` is its beginning.
fn read_file(
    path: &Path,
    head: &[u8],
    options: &ReadOptions,
    target: Target,
) -> Result<Read, RecordingError> {
    let files = DatasetFiles {
        up_axis: options.motion.up_axis,
        ..options.files.clone()
    };
    let motion_format = MotionFormat::of(head);
    // Some recordings are motions, too; a bag takes what was recorded.
    let wants_motion =
        options.followed.is_some() || (target.takes_motions() && target != Target::Bag);
    if !(motion_format.is_some() && wants_motion)
        && let Some((format, recording)) = open_dataset(path, &files)?
    {
        return dataset::chosen(path, (format, recording), target, options);
    }
    refuse_dataset_settings(path, options)?;
    // Motions first: an AMC's frame can look like a row of numbers.
    if motion_format.is_none()
        && sniff_rigid(head).is_some()
        && let Some(rigid) = parse_rigid(&read_whole(path)?, &path.display().to_string())?
    {
        let content = match rigid {
            RigidContent::Poses(poses) => Content::Poses(poses),
            RigidContent::Imu(series) => Content::Imu(series),
        };
        refuse_motion_settings(path, &content, options)?;
        return Ok(content.into());
    }
    let model = options.body.clone().unwrap_or_else(BodyModel::embedded);
    let motion = read_motion_for(path, &model, &options.motion)?;
    let notes = motion.oddities();
    Ok(Read {
        notes: notes
            .iter()
            .map(|oddity| format!("warning: {}: {oddity}", path.display()))
            .collect(),
        content: Content::Motion(Box::new(motion)),
    })
}

fn refuse_motion_settings(
    path: &Path,
    content: &Content,
    options: &ReadOptions,
) -> Result<(), RecordingError> {
    match options.motion_setting(true) {
        Some(option) if !matches!(content, Content::Motion(_)) => Err(RecordingError::Unsuitable {
            path: path.to_owned(),
            problem: format!(
                "{option} is for motions, and this is {}; leave it out",
                content.name()
            ),
        }),
        _ => Ok(()),
    }
}

fn refuse_dataset_settings(path: &Path, options: &ReadOptions) -> Result<(), RecordingError> {
    match options.dataset_setting() {
        Some(option) => Err(RecordingError::Unsuitable {
            path: path.to_owned(),
            problem: format!(
                "{option} is for recordings of data sets, which this file is not; leave it out"
            ),
        }),
        None => Ok(()),
    }
}
