//! What the input is, by its content, and what it holds.

use std::path::Path;
use std::sync::Arc;

use anyhow::bail;
use cromosim_body::BodyModel;
use cromosim_motion::{MotionFormat, read_motion_for};
use cromosim_recording::datasets::open_dataset;
use cromosim_recording::rigid::sniff_rigid;
use cromosim_recording::rigid::{RigidContent, parse_rigid};
pub use cromosim_recording::{read_head as head, read_whole as bytes};

use super::write::Target;
use super::{Arguments, Content, name, recording};

const MCAP: &[u8] = b"\x89MCAP";

/// Reads whatever the input is.
pub fn read(
    arguments: &Arguments,
    model: &Arc<BodyModel>,
    target: Target,
) -> anyhow::Result<Content> {
    let path = &arguments.input;
    let head = if path.is_dir() {
        MCAP.to_vec()
    } else {
        head(path)?
    };
    if head.starts_with(MCAP) {
        refuse_dataset_options(arguments)?;
        return recording::read(path, arguments, model, target)
            .and_then(|content| without_motion_options(content, arguments));
    }
    if let Some(option) = [(&arguments.topic, "--topic"), (&arguments.frame, "--frame")]
        .iter()
        .find(|(value, _)| value.is_some())
    {
        bail!(
            "{}: {} chooses from a bag, which this file is not",
            path.display(),
            option.1
        );
    }
    if head.is_empty() {
        bail!("{}: the file is empty", path.display());
    }
    if let Some((_, recording)) = open_dataset(path, &arguments.dataset.files())? {
        return arguments.dataset.chosen(recording, target, arguments);
    }
    refuse_dataset_options(arguments)?;
    // Motions first: an AMC's frame can look like a row of numbers.
    if MotionFormat::of(&head).is_none()
        && sniff_rigid(&head).is_some()
        && let Some(content) = rigid(path, &bytes(path)?)?
    {
        return without_motion_options(content, arguments);
    }
    Ok(Content::Motion(Box::new(read_motion_for(
        path,
        model,
        &arguments.motion.options()?,
    )?)))
}

fn without_motion_options(content: Content, arguments: &Arguments) -> anyhow::Result<Content> {
    match arguments.motion.given(true) {
        Some(option) if !matches!(content, Content::Motion(_)) => {
            bail!(
                "{}: {option} is for motions, and this is {}; leave it out",
                arguments.input.display(),
                content.name()
            )
        }
        _ => Ok(content),
    }
}

fn refuse_dataset_options(arguments: &Arguments) -> anyhow::Result<()> {
    match arguments.dataset.given() {
        Some(option) => {
            bail!(
                "{}: {option} is for recordings of data sets, which this file is not; leave it out",
                arguments.input.display()
            )
        }
        None => Ok(()),
    }
}

/// A trajectory or an IMU series; `None` for anything else.
pub fn rigid(path: &Path, bytes: &[u8]) -> anyhow::Result<Option<Content>> {
    Ok(parse_rigid(bytes, &name(path))?.map(|rigid| match rigid {
        RigidContent::Poses(poses) => Content::Poses(poses),
        RigidContent::Imu(series) => Content::Imu(series),
    }))
}
