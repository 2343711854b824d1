//! Motions, trajectories of rigid bodies, IMU series and recordings into each other's files.
//!
//! [`convert()`] reads any file by its content and writes any [`Target`]; [`read_content`] does the
//! first half, [`write_motion`] the second for motions that come from elsewhere.

mod bag_topic;
mod content;
mod conversion;
mod dataset;
mod follow;
mod motion_topic;
mod options;
mod read;
mod target;
mod write;

use std::path::Path;

use cromosim_body::BodyModel;

use crate::RecordingError;
use crate::datasets::{DatasetFiles, open_dataset};
use crate::rigid::{EurocGroundTruth, ImuSeries, RigidContent, parse_rigid};

pub use content::{Content, Read};
pub use conversion::{Conversion, Converted};
pub use options::{Followed, ReadOptions};
pub use read::read_content;
pub use target::Target;
pub use write::{MotionFile, write_motion};

/// Reads the input and writes it in the target's form. `out` takes its name when it is complete.
///
/// # Errors
/// What is wrong with the input; options that it or the target does not take.
pub fn convert(conversion: &Conversion) -> Result<Converted, RecordingError> {
    let Conversion {
        input,
        out,
        target,
        options,
        imu,
        replace,
    } = conversion;
    if out.exists() && !replace {
        return Err(RecordingError::Exists { path: out.clone() });
    }
    if imu.is_some() && *target != Target::Bag {
        return Err(RecordingError::ImuBesideNoBag {
            target: target.describe(),
        });
    }
    let model = options.body.clone().unwrap_or_else(BodyModel::embedded);
    let read = read_content(input, options, *target)?;
    let content = followed(read.content, conversion, &model)?;
    let count = content.count();
    let imu = imu.as_deref().map(read_imu_series).transpose()?;
    write::write(&content, conversion, &model, imu.as_ref())?;
    Ok(Converted {
        is_motion: matches!(content, Content::Motion(_)),
        count,
        notes: read.notes,
    })
}

/// A motion's joint or site, where one is asked for.
fn followed(
    content: Content,
    conversion: &Conversion,
    model: &std::sync::Arc<BodyModel>,
) -> Result<Content, RecordingError> {
    let (path, target) = (&conversion.input, conversion.target);
    let Content::Motion(motion) = content else {
        if let Some(followed) = &conversion.options.followed {
            return Err(RecordingError::Unsuitable {
                path: path.clone(),
                problem: format!(
                    "{} has no joint or site {}; leave --joint and --site out",
                    content.name(),
                    followed.name()
                ),
            });
        }
        return Ok(content);
    };
    let trajectory = match &conversion.options.followed {
        Some(Followed::Joint(joint)) => follow::joint(&motion, model, joint)?,
        Some(Followed::Site(site)) => follow::site(&motion, model, site)?,
        None if target.takes_motions() => return Ok(Content::Motion(motion)),
        None => {
            return Err(RecordingError::Unsuitable {
                path: path.clone(),
                problem: format!(
                    "a motion has 24 joints, and {} holds one trajectory; give --joint or --site (simulate writes a motion's IMUs)",
                    target.describe()
                ),
            });
        }
    };
    Ok(Content::Poses(EurocGroundTruth {
        trajectory,
        ..EurocGroundTruth::default()
    }))
}

/// The IMU series beside a trajectory.
fn read_imu_series(path: &Path) -> Result<ImuSeries, RecordingError> {
    if let Some((_, mut recording)) = open_dataset(path, &DatasetFiles::default())? {
        let (imu, others) = (recording.imus.pop(), recording.imus.len());
        return imu.filter(|_| others == 0).map(|imu| imu.series).ok_or_else(|| {
            RecordingError::Unsuitable {
                path: path.to_owned(),
                problem: format!(
                    "a recording of {} IMUs, and --imu takes one; convert it to .csv with --placement first",
                    if others == 0 { 0 } else { others + 1 }
                ),
            }
        });
    }
    let problem = match parse_rigid(&crate::read_whole(path)?, &path.display().to_string())? {
        Some(RigidContent::Imu(series)) => return Ok(series),
        Some(RigidContent::Poses(_)) => "a trajectory; --imu takes an IMU series",
        None => {
            "not an IMU series: expected EuRoC's columns or a table with a header that names them"
        }
    };
    Err(RecordingError::Unsuitable {
        path: path.to_owned(),
        problem: problem.to_owned(),
    })
}
