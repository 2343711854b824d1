//! `cromosim convert`: motions, trajectories of rigid bodies, IMU series and recordings into each
//! other's files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::bail;
use clap::Args;
use cromosim_body::BodyModel;
use cromosim_motion::SmplMotion;
use cromosim_recording::datasets::DatasetRecording;
use cromosim_recording::rigid::{EurocGroundTruth, ImuSeries};

use crate::body;
use crate::motion_arguments::MotionArguments;

pub mod bag;
mod dataset;
mod follow;
mod frames;
mod recording;
pub mod source;
mod states;
pub mod write;

use dataset::DatasetArguments;
use write::{Target, Written};

/// Convert a motion, a trajectory of a rigid body, an IMU series or a recording into another format
#[derive(Args)]
pub struct Arguments {
    /// A motion, a trajectory (TUM, EuRoC, CSV), an IMU series (EuRoC, CSV), a recording of a data
    /// set (BROAD, TotalCapture, PAMAP2, RealWorld, phone and watch) or a bag; its content tells
    input: PathBuf,
    /// What to write; the ending decides where --to does not: .npz, .bvh, .trc, .tum or .txt, .csv,
    /// .mcap
    out: PathBuf,
    /// The format to write
    #[arg(long, value_enum, value_name = "FORMAT")]
    to: Option<Target>,
    /// Replace OUT where it exists
    #[arg(long)]
    force: bool,
    /// Of a motion: the trajectory of this joint (SMPL's name)
    #[arg(long, value_name = "NAME", conflicts_with = "site")]
    joint: Option<String>,
    /// Of a motion: the trajectory of a sensor at this named site of the skin
    #[arg(long, value_name = "NAME")]
    site: Option<String>,
    /// Of a bag: the topic to take (SmplState, SmplPose, PoseStamped, TFMessage or Imu); needed
    /// where there are several
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
    /// Of a bag's TF: the frame whose motion to take
    #[arg(long, value_name = "FRAME")]
    frame: Option<String>,
    /// Of a bag's TF: the frame that stands still; default: the root of the tree
    #[arg(long, value_name = "FRAME", requires = "frame")]
    fixed_frame: Option<String>,
    /// Into a bag: name of the placement in /reference/NAME and /imu/NAME/data_raw; default: body,
    /// or as the data set says
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Into a bag: the IMU series (EuRoC, CSV) that was measured along the trajectory
    #[arg(long, value_name = "FILE")]
    imu: Option<PathBuf>,
    /// Body model as npz or pickle rather than the embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    #[command(flatten)]
    dataset: DatasetArguments,
    #[command(flatten)]
    motion: MotionArguments,
}

/// What a file holds.
pub enum Content {
    Motion(Box<SmplMotion>),
    Poses(EurocGroundTruth),
    Imu(ImuSeries),
    Recording(Box<DatasetRecording>),
}

impl Content {
    /// Its kind, with the article.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Motion(_) => "a motion",
            Self::Poses(_) => "a trajectory",
            Self::Imu(_) => "an IMU series",
            Self::Recording(_) => "a recording of a data set",
        }
    }

    /// Frames or rows.
    pub fn count(&self) -> usize {
        match self {
            Self::Motion(motion) => motion.frames.len(),
            Self::Poses(poses) => poses.trajectory.stamps.len(),
            Self::Imu(series) => series.stamps.len(),
            Self::Recording(recording) => recording
                .imus
                .iter()
                .map(|imu| imu.series.stamps.len())
                .sum(),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let target = Target::of(arguments.to, &arguments.out)?;
    if arguments.out.exists() && !arguments.force {
        bail!(
            "{}: exists already; --force replaces it",
            arguments.out.display()
        );
    }
    if arguments.imu.is_some() && target != Target::Bag {
        bail!("--imu goes into a bag; OUT is {}", target.describe());
    }
    let model = body::model(arguments.body.as_ref())?;
    let content = followed(
        source::read(arguments, &model, target)?,
        arguments,
        &model,
        target,
    )?;
    let (is_motion, count) = (matches!(content, Content::Motion(_)), content.count());
    match write::written(&content, target, &model, arguments)? {
        Written::Bytes(bytes) => write::file(&arguments.out, &bytes, arguments.force)?,
        Written::Bag => bag::write(&content, imu(arguments)?.as_ref(), &model, arguments)?,
    }
    println!(
        "{}: {} of {count} {}",
        arguments.out.display(),
        target.describe(),
        if is_motion { "frames" } else { "rows" }
    );
    Ok(())
}

/// A motion's joint or site, where one is asked for.
fn followed(
    content: Content,
    arguments: &Arguments,
    model: &Arc<BodyModel>,
    target: Target,
) -> anyhow::Result<Content> {
    let Content::Motion(motion) = content else {
        if let Some(name) = arguments.joint.as_ref().or(arguments.site.as_ref()) {
            bail!(
                "{}: {} has no joint or site {name}; leave --joint and --site out",
                arguments.input.display(),
                content.name()
            );
        }
        return Ok(content);
    };
    let trajectory = match (&arguments.joint, &arguments.site) {
        (Some(joint), _) => follow::joint(&motion, model, joint)?,
        (None, Some(site)) => follow::site(&motion, model, site)?,
        (None, None) if target.takes_motions() => return Ok(Content::Motion(motion)),
        (None, None) => bail!(
            "{}: a motion has 24 joints, and {} holds one trajectory; give --joint or --site (simulate writes a motion's IMUs)",
            arguments.input.display(),
            target.describe()
        ),
    };
    Ok(Content::Poses(EurocGroundTruth {
        trajectory,
        ..EurocGroundTruth::default()
    }))
}

/// The IMU series beside a trajectory.
fn imu(arguments: &Arguments) -> anyhow::Result<Option<ImuSeries>> {
    let Some(path) = &arguments.imu else {
        return Ok(None);
    };
    match source::rigid(path, &source::bytes(path)?)? {
        Some(Content::Imu(series)) => Ok(Some(series)),
        Some(_) => bail!(
            "{}: a trajectory; --imu takes an IMU series",
            path.display()
        ),
        None => bail!(
            "{}: not an IMU series: expected EuRoC's columns or a table with a header that names them",
            path.display()
        ),
    }
}

/// A file's place in errors.
fn name(path: &Path) -> String {
    path.display().to_string()
}
