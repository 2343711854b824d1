//! What the input is, by its content, and what it holds.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use cromosim_body::BodyModel;
use cromosim_motion::datasets::open_dataset;
use cromosim_motion::rigid::{
    EurocGroundTruth, RigidFormat, parse_euroc_ground_truth, parse_euroc_imu, parse_imu_csv, parse_pose_csv, parse_tum, sniff_rigid,
};
use cromosim_motion::{MotionFormat, read_motion_for};

use super::write::Target;
use super::{Arguments, Content, name, recording};

/// Larger tables are refused: a day of readings at 1 kHz is about as large.
const MAX_BYTES: u64 = 16 << 30;
/// What is looked at to tell what a file is.
const HEAD_BYTES: u64 = 1 << 16;
const MCAP: &[u8] = b"\x89MCAP";

/// Reads whatever the input is.
pub fn read(arguments: &Arguments, model: &Arc<BodyModel>, target: Target) -> anyhow::Result<Content> {
    let path = &arguments.input;
    let head = if path.is_dir() { MCAP.to_vec() } else { head(path)? };
    if head.starts_with(MCAP) {
        refuse_dataset_options(arguments)?;
        return recording::read(path, arguments, model, target).and_then(|content| without_motion_options(content, arguments));
    }
    if let Some(option) = [(&arguments.topic, "--topic"), (&arguments.frame, "--frame")].iter().find(|(value, _)| value.is_some()) {
        bail!("{}: {} chooses from a bag, which this file is not", path.display(), option.1);
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
    Ok(Content::Motion(Box::new(read_motion_for(path, model, &arguments.motion.options()?)?)))
}

fn without_motion_options(content: Content, arguments: &Arguments) -> anyhow::Result<Content> {
    match arguments.motion.given(true) {
        Some(option) if !matches!(content, Content::Motion(_)) => {
            bail!("{}: {option} is for motions, and this is {}; leave it out", arguments.input.display(), content.name())
        }
        _ => Ok(content),
    }
}

fn refuse_dataset_options(arguments: &Arguments) -> anyhow::Result<()> {
    match arguments.dataset.given() {
        Some(option) => {
            bail!("{}: {option} is for recordings of data sets, which this file is not; leave it out", arguments.input.display())
        }
        None => Ok(()),
    }
}

/// The beginning of a file.
pub fn head(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    read.with_context(|| format!("{}: cannot be read", path.display()))?;
    Ok(head)
}

/// A whole file.
pub fn bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes));
    read.with_context(|| format!("{}: cannot be read", path.display()))?;
    if bytes.len() as u64 > MAX_BYTES {
        bail!("{}: more than {MAX_BYTES} bytes; cut the file into parts", path.display());
    }
    Ok(bytes)
}

/// A trajectory or an IMU series; `None` for anything else.
pub fn rigid(path: &Path, bytes: &[u8]) -> anyhow::Result<Option<Content>> {
    let name = name(path);
    let poses = |trajectory| Content::Poses(EurocGroundTruth { trajectory, ..EurocGroundTruth::default() });
    let Some(format) = sniff_rigid(bytes) else { return Ok(None) };
    Ok(Some(match format {
        RigidFormat::Tum => poses(parse_tum(bytes, &name)?),
        RigidFormat::PoseCsv => poses(parse_pose_csv(bytes, &name)?),
        RigidFormat::EurocGroundTruth => Content::Poses(parse_euroc_ground_truth(bytes, &name)?),
        RigidFormat::EurocImu => Content::Imu(parse_euroc_imu(bytes, &name)?),
        RigidFormat::ImuCsv => Content::Imu(parse_imu_csv(bytes, &name)?),
    }))
}
