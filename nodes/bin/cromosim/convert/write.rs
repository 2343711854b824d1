//! What is written: bytes of a file, which takes its name when it is complete.

use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use clap::ValueEnum;
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{SmplMotion, place_markers, write_amass, write_bvh, write_trc};
use cromosim_recording::rigid::{
    write_euroc_ground_truth, write_euroc_imu, write_imu_csv, write_pose_csv, write_tum,
};

use super::{Arguments, Content};
use crate::motion_arguments::MotionArguments;

/// What can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Target {
    /// npz with AMASS' keys
    Amass,
    /// BVH in SMPL's skeleton
    Bvh,
    /// Markers on the body
    Trc,
    /// TUM trajectory
    Tum,
    /// EuRoC/ASL ground truth, or IMU file
    Euroc,
    /// Table with a header: poses, or readings
    Csv,
    /// rosbag2 MCAP with /reference/NAME and /imu/NAME/data_raw; of a motion /smpl/pose with its
    /// confidence
    Bag,
}

/// The result, or that it is written message by message.
pub enum Written {
    Bytes(Vec<u8>),
    Bag,
}

impl Target {
    /// As given, or by the ending of the output.
    pub fn of(given: Option<Self>, out: &Path) -> anyhow::Result<Self> {
        if let Some(target) = given {
            return Ok(target);
        }
        let ending = out
            .extension()
            .map(|ending| ending.to_string_lossy().to_ascii_lowercase())
            .unwrap_or_default();
        Ok(match ending.as_str() {
            "npz" => Self::Amass,
            "bvh" => Self::Bvh,
            "trc" => Self::Trc,
            "tum" | "txt" => Self::Tum,
            "csv" => Self::Csv,
            "mcap" => Self::Bag,
            _ => bail!(
                "{}: the ending does not say what to write (.npz, .bvh, .trc, .tum, .txt, .csv or .mcap do); give --to",
                out.display()
            ),
        })
    }

    /// Whether it holds whole bodies.
    pub const fn takes_motions(self) -> bool {
        matches!(self, Self::Amass | Self::Bvh | Self::Trc | Self::Bag)
    }

    /// What it is, in a few words.
    pub const fn describe(self) -> &'static str {
        match self {
            Self::Amass => "an npz with AMASS' keys",
            Self::Bvh => "a BVH file",
            Self::Trc => "a TRC file",
            Self::Tum => "a TUM trajectory",
            Self::Euroc => "a EuRoC file",
            Self::Csv => "a table",
            Self::Bag => "a bag",
        }
    }
}

/// The content in the target's form.
pub fn written(
    content: &Content,
    target: Target,
    model: &Arc<BodyModel>,
    arguments: &Arguments,
) -> anyhow::Result<Written> {
    let text = match (content, target) {
        (_, Target::Bag) => return Ok(Written::Bag),
        (Content::Motion(motion), _) => {
            return motion_bytes(motion, target, model, &arguments.motion).map(Written::Bytes);
        }
        (Content::Poses(poses), Target::Tum) => write_tum(&poses.trajectory),
        (Content::Poses(poses), Target::Euroc) => write_euroc_ground_truth(poses),
        (Content::Poses(poses), Target::Csv) => write_pose_csv(&poses.trajectory),
        (Content::Imu(series), Target::Euroc) => write_euroc_imu(series),
        (Content::Imu(series), Target::Csv) => write_imu_csv(series),
        (other, target) => bail!(
            "{}: {} cannot become {}",
            arguments.input.display(),
            other.name(),
            target.describe()
        ),
    };
    Ok(Written::Bytes(text.into_bytes()))
}

/// A motion of `model`'s body as bytes; `options` names the marker set.
pub fn motion_bytes(
    motion: &SmplMotion,
    target: Target,
    model: &Arc<BodyModel>,
    options: &MotionArguments,
) -> anyhow::Result<Vec<u8>> {
    let shaped = || ShapedBody::new(model.clone(), &motion.betas);
    Ok(match target {
        Target::Amass => write_amass(motion, &shaped()?, Cursor::new(Vec::new()))?.into_inner(),
        Target::Bvh => write_bvh(motion, &shaped()?).into_bytes(),
        Target::Trc => {
            let set = options.options()?.markers_set()?;
            write_trc(&place_markers(motion, model, &set)?).into_bytes()
        }
        _ => bail!(
            "{}: a motion cannot become {}; give --joint or --site",
            motion.name,
            target.describe()
        ),
    })
}

/// Writes a file under a temporary name beside its own, and gives it its name once it is complete.
pub fn file(path: &Path, bytes: &[u8], replace: bool) -> anyhow::Result<()> {
    let cannot = || format!("{}: cannot be written", path.display());
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    let everybody = <fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(everybody);
    let mut temporary = builder
        .prefix(".convert.")
        .tempfile_in(folder)
        .with_context(cannot)?;
    temporary
        .write_all(bytes)
        .and_then(|()| temporary.flush())
        .with_context(cannot)?;
    let persisted = if replace {
        temporary.persist(path)
    } else {
        temporary.persist_noclobber(path)
    };
    persisted
        .map(drop)
        .map_err(|error| error.error)
        .with_context(cannot)
}
