//! `cromosim convert`: motions, trajectories of rigid bodies, IMU series and recordings into each
//! other's files.

use std::path::PathBuf;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use cromosim_recording::convert::{Conversion, Followed, ReadOptions, Target, convert};
use cromosim_recording::datasets::DatasetFiles;

use crate::body;
use crate::list;
use crate::motion_arguments::MotionArguments;
use crate::named::Named;
use crate::output::{remark, say};
use crate::progress::working;

// Headings of the help: what an option goes with.
const MOTIONS: &str = "Of a motion";
const BAGS: &str = "Of a bag";
const INTO_BAGS: &str = "Into a bag";
const DATA_SETS: &str = "Of a data set";

/// Convert a motion, a trajectory of a rigid body, an IMU series or a recording into another format
#[derive(Args)]
pub struct Arguments {
    /// A motion, a trajectory, an IMU series, a data set's recording or a bag
    ///
    /// Trajectories are TUM, EuRoC, CSV, OptiTrack or Vicon, IMU series EuRoC, CSV, Parquet, Movella DOT or MT
    /// Manager, both MVNX, data sets BROAD, TotalCapture, PAMAP2, RealWorld, phone and watch; the file's content tells
    input: PathBuf,
    /// What to write: .npz, .bvh, .trc, .tum or .txt, .csv, .parquet, .mcap
    ///
    /// The ending decides where --to does not
    out: PathBuf,
    /// The format to write
    #[arg(long, value_enum, value_name = "FORMAT")]
    to: Option<Format>,
    /// Replace OUT where it exists
    #[arg(long)]
    force: bool,
    /// The trajectory of this joint (SMPL's name)
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "site",
        help_heading = MOTIONS,
        hide_possible_values = true,
        value_parser = Named(list::joint_names)
    )]
    joint: Option<String>,
    /// The trajectory of a sensor at this named site of the skin
    #[arg(
        long,
        value_name = "NAME",
        help_heading = MOTIONS,
        hide_possible_values = true,
        value_parser = Named(list::site_names)
    )]
    site: Option<String>,
    /// The topic to take; needed where there are several
    ///
    /// Of type SmplState, SmplPose, Imu, PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped, mocap4r2's
    /// RigidBodies with :BODY, or TF with :FRAME@FIXED (the same as --frame and --fixed-frame)
    #[arg(long, value_name = "TOPIC[:BODY]", help_heading = BAGS)]
    topic: Option<String>,
    /// Of its TF: the frame whose motion to take
    #[arg(long, value_name = "FRAME", help_heading = BAGS)]
    frame: Option<String>,
    /// Of its TF: the frame that stands still; default: the tree's root
    #[arg(long, value_name = "FRAME", requires = "frame", help_heading = BAGS)]
    fixed_frame: Option<String>,
    /// Name of the placement; default: body, or the data set's
    ///
    /// As in /reference/NAME and /imu/NAME/data_raw
    #[arg(long, value_name = "NAME", help_heading = INTO_BAGS)]
    name: Option<String>,
    /// The IMU series that was measured along the trajectory
    ///
    /// EuRoC, CSV, Movella DOT or MT Manager
    #[arg(long, value_name = "FILE", help_heading = INTO_BAGS)]
    imu: Option<PathBuf>,
    /// Body model (npz or pickle) rather than the embedded one
    #[arg(long, value_name = "FILE", help_heading = MOTIONS)]
    body: Option<PathBuf>,
    /// This placement alone
    #[arg(long, value_name = "NAME", help_heading = DATA_SETS)]
    placement: Option<String>,
    /// Of TotalCapture: the folder of the reference's two files
    ///
    /// gt_skel_gbl_pos.txt and gt_skel_gbl_ori.txt; default: looked for beside the file
    #[arg(long, value_name = "DIR", help_heading = DATA_SETS)]
    reference: Option<PathBuf>,
    /// Of RealWorld: the gyroscope's zip
    ///
    /// Default: the one beside the accelerometer's
    #[arg(long, value_name = "FILE", help_heading = DATA_SETS)]
    gyroscope: Option<PathBuf>,
    #[command(flatten)]
    motion: MotionArguments,
}

/// A format, as the command line names it.
#[derive(Clone, Copy)]
pub struct Format(Target);

impl ValueEnum for Format {
    fn value_variants<'a>() -> &'a [Self] {
        const ALL: [Format; Target::ALL.len()] = {
            let mut all = [Format(Target::Bag); Target::ALL.len()];
            let mut k = 0;
            while k < all.len() {
                all[k] = Format(Target::ALL[k]);
                k += 1;
            }
            all
        };
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self.0 {
            Target::Amass => ("amass", "npz with AMASS' keys"),
            Target::Bvh => ("bvh", "BVH in SMPL's skeleton"),
            Target::Trc => ("trc", "Markers on the body"),
            Target::Tum => ("tum", "TUM trajectory"),
            Target::Euroc => ("euroc", "EuRoC/ASL ground truth, or IMU file"),
            Target::Csv => ("csv", "Table with a header: poses, or readings"),
            Target::Columns => (
                "parquet",
                "Columns of readings, for pandas, polars, DuckDB and others",
            ),
            Target::Bag => (
                "bag",
                "rosbag2 MCAP with /reference/NAME and /imu/NAME/data_raw; of a motion /smpl/pose with its confidence",
            ),
        };
        Some(PossibleValue::new(name).help(help))
    }
}

impl Format {
    /// The format that was given, or that the ending of the output says.
    pub fn or_ending(given: Option<Self>, out: &std::path::Path) -> anyhow::Result<Target> {
        Ok(given.map_or_else(|| Target::for_ending(out), |Self(target)| Ok(target))?)
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let target = Format::or_ending(arguments.to, &arguments.out)?;
    let followed = match (&arguments.joint, &arguments.site) {
        (Some(joint), _) => Some(Followed::Joint(joint.clone())),
        (None, site) => site.clone().map(Followed::Site),
    };
    let options = ReadOptions {
        motion: arguments.motion.options()?,
        body: body::given(arguments.body.as_deref())?,
        followed,
        topic: arguments.topic.clone(),
        frame: arguments.frame.clone(),
        fixed_frame: arguments.fixed_frame.clone(),
        placement: arguments.placement.clone(),
        files: DatasetFiles {
            reference: arguments.reference.clone(),
            gyroscope: arguments.gyroscope.clone(),
            ..DatasetFiles::default()
        },
        name: arguments.name.clone(),
    };
    let conversion = Conversion {
        input: arguments.input.clone(),
        out: arguments.out.clone(),
        target,
        options,
        imu: arguments.imu.clone(),
        replace: arguments.force,
    };
    let converted = working("converting", || convert(&conversion))?;
    for note in &converted.notes {
        remark!("{note}");
    }
    say!(
        "{}: {} of {} {}",
        arguments.out.display(),
        target.describe(),
        converted.count,
        if converted.is_motion {
            "frames"
        } else {
            "rows"
        }
    )?;
    Ok(())
}
