//! The arguments of `cromosim simulate`: three modes, and which options each of them takes.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use cromosim_imu::{
    AmbientField, Differentiation, MAX_RATE_HZ, OrientationSource, Scheme, TextureSegment, Trim,
};
use cromosim_recording::TextureOn;
use cromosim_recording::batch::{Shard, is_of_many};
use cromosim_recording::convert::ReadOptions;

use crate::list;
use crate::motion_arguments::MotionArguments;
use crate::named::Named;
use crate::topic_arguments::TopicArguments;

// Headings of the help.
const INPUT: &str = "What moves";
const SENSORS: &str = "Sensors";
const READINGS: &str = "How readings are made";

/// Simulate IMUs from motion files, or again from a recording's reference
#[derive(Args)]
pub struct Arguments {
    /// Motion files, folders, patterns or @LIST
    ///
    /// BVH, ASF/AMC, MVNX, C3D, TRC and files of SMPL parameters; folders with all below them, "*.bvh" and the like, and @LIST, a
    /// file with one of these a line. What OUT holds already is left alone
    pub motions: Vec<PathBuf>,
    /// Simulate the walk that comes with the suite, rather than a file
    #[arg(long, help_heading = INPUT)]
    pub walk: bool,
    /// Simulate the IMUs of this recording again, from its reference motion
    #[arg(long, value_name = "RECORDING", help_heading = INPUT)]
    pub reference: Option<PathBuf>,
    /// The namespace of the recording's topics, where there are several
    ///
    /// Such as /robot1; with --reference
    #[arg(long, hide_short_help = true, value_name = "NAME", help_heading = INPUT)]
    pub namespace: Option<String>,
    #[command(flatten)]
    pub topics: TopicArguments,
    /// Simulate an IMU on each rigid body along its trajectory
    ///
    /// A robot or a prop; the trajectory is TUM, EuRoC, CSV, or a motion capture system's export
    /// (OptiTrack, Vicon), of one body or several
    #[arg(long, value_name = "FILE", help_heading = INPUT)]
    pub rigid: Option<PathBuf>,
    /// A placement at a named site, such as left_wrist=left_watch
    ///
    /// At 100 Hz; may be given again; `cromosim body sites` lists the sites. With --rigid the name as in
    /// /imu/NAME/data_raw [default: body], or NAME or NAME=BODY of a file of several [default: all]
    #[arg(long, value_name = "NAME=SITE", help_heading = SENSORS)]
    pub placement: Vec<String>,
    /// A device's name or file, whose noise and effects are what errs
    ///
    /// Default: the placements' own, with --rigid an ideal sensor. `cromosim device show` lists the built-in ones
    #[arg(
        long,
        value_name = "DEVICE",
        help_heading = SENSORS,
        hide_possible_values = true,
        value_parser = Named(list::device_names)
    )]
    pub device: Option<String>,
    /// With --reference or --rigid: the effects of each placement (YAML)
    ///
    /// As a diagnosis writes them, rather than the nominal simulation
    #[arg(long, value_name = "FILE", help_heading = SENSORS)]
    pub effects: Option<PathBuf>,
    /// The bag to write: .mcap, or a rosbag2 directory; columns: .parquet; one placement: .csv
    ///
    /// With several motions a directory for one file each and manifest.jsonl, which says what became of them
    #[arg(long, value_name = "OUT")]
    pub out: PathBuf,
    /// What to write of motion files: bag, parquet or csv; default: as OUT ends
    #[arg(long, value_enum, value_name = "FORMAT", hide_possible_values = true)]
    format: Option<Format>,
    /// Of many motions only each Nth, from the Ith on, such as 2/8
    ///
    /// For one of several machines, which may write into the same OUT
    #[arg(long, value_name = "I/N", hide_short_help = true, help_heading = INPUT)]
    pub shard: Option<Shard>,
    /// Where on the body the sensors are (YAML); default: five places
    ///
    /// Without, left_wrist, right_ankle, pelvis, sternum and head; of motion files
    #[arg(long, value_name = "FILE", help_heading = SENSORS)]
    pub placements: Option<PathBuf>,
    /// Derivative scheme for every placement, such as spline
    ///
    /// adaptive_spline, spline, richardson, triangle, normal_tracking or second_difference; default:
    /// the placements' own, adaptive_spline where they name none. With --reference the default is
    /// the estimate that a diagnosis uses
    #[arg(
        long,
        value_name = "NAME",
        help_heading = READINGS,
        hide_possible_values = true,
        value_parser = Named(list::scheme_names)
    )]
    pub scheme: Option<String>,
    /// Pass what is below this frequency, Hz, whatever the motion, rather than what the poses
    /// resolve: a low-pass without delay in place of a scheme
    #[arg(
        long,
        value_name = "HZ",
        allow_negative_numbers = true,
        help_heading = READINGS,
        hide_short_help = true
    )]
    pub bandwidth: Option<f64>,
    /// Leave out so many seconds at either end; auto: as many as are far more uncertain than the
    /// middle, at most 0.25
    #[arg(
        long,
        value_name = "auto|SECONDS",
        default_value = "auto",
        allow_negative_numbers = true,
        help_heading = READINGS,
        hide_short_help = true
    )]
    pub trim: String,
    /// Draw what real IMUs show beyond what the poses resolve
    ///
    /// Impacts, tremor, soft tissue. --texture alone goes by each placement's segment (a --rigid body
    /// counts as held); --texture=SEGMENT is foot, shank, thigh, trunk, head, arm or held
    #[arg(
        long,
        value_name = "SEGMENT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = AUTO,
        help_heading = READINGS,
        hide_possible_values = true,
        value_parser = Named(list::texture_names)
    )]
    pub texture: Option<String>,
    /// Messages per second, rather than the placements' own rate
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, help_heading = SENSORS)]
    pub rate: Option<f64>,
    /// Body model (npz or pickle) rather than the embedded one
    ///
    /// With --reference that of the recording's SMPL states
    #[arg(long, value_name = "FILE", help_heading = INPUT)]
    pub body: Option<PathBuf>,
    /// Seed of the sensor noise
    #[arg(long, default_value_t = 0, help_heading = SENSORS, hide_short_help = true)]
    pub seed: u64,
    /// Leave out the random part of the sensor errors
    #[arg(long, help_heading = SENSORS)]
    pub no_noise: bool,
    /// How long errors of the poses hold, for the covariances that follow from a motion's
    /// confidence, s; 0: new with each pose
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        help_heading = READINGS,
        hide_short_help = true
    )]
    pub pose_error_correlation: f64,
    /// The magnetic field that devices with a magnetometer read, as /imu/NAME/mag
    ///
    /// A vector in T and world axes (0,1.9e-5,-4.5e-5), a place and a day (52.52N,13.41E,2026-11-24; World Magnetic
    /// Model, with the world's x axis east), or a YAML file, which may say disturbances too [default: no /imu/NAME/mag, but for --reference with the field in --effects]
    #[arg(long, value_name = "FIELD", allow_hyphen_values = true, help_heading = SENSORS, hide_short_help = true)]
    pub magnetic_field: Option<String>,
    /// Where the orientation of /imu/NAME/data comes from
    ///
    /// truth, vqf, madgwick or mahony (fused from the device's own readings), or none
    #[arg(
        long,
        value_name = "SOURCE",
        default_value = OrientationSource::Truth.name(),
        help_heading = SENSORS,
        hide_short_help = true,
        hide_possible_values = true,
        value_parser = Named(list::orientation_names)
    )]
    pub orientation: String,
    /// Write each placement's samples as CSV into this directory too
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Print what was written as JSON: an object and a line for each file
    #[arg(long, hide_short_help = true)]
    pub json: bool,
    /// Replace OUT, and the CSV files of --csv, where they exist
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub motion: MotionArguments,
    /// Networks that correct the readings, such as motion_capture
    ///
    /// motion_capture, motion_capture_60, video, streaming, streaming_video, or a folder that
    /// `cromosim train` wrote. They correct acceleration and angular velocity before the device's
    /// effects; the scheme is then spline unless --scheme or the placements name another than the
    /// default, as in training. Not with --reference
    #[arg(long, value_name = "MODEL", help_heading = READINGS)]
    pub learned: Option<PathBuf>,
    /// Draw people, wearing and devices anew for each motion, as this file says (YAML)
    ///
    /// Several draws a motion where it says so; into columns (--format parquet)
    #[arg(long, value_name = "FILE", help_heading = SENSORS, hide_short_help = true)]
    pub draw: Option<PathBuf>,
    /// Map distributions as a file of `cromosim map` says
    ///
    /// Applied last, to the placements that it names. Not with --reference
    #[arg(long, value_name = "FILE", help_heading = READINGS)]
    pub mapping: Option<PathBuf>,
}

/// What is written of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// A rosbag2 MCAP
    Bag,
    /// Readings in columns, for pandas, polars, DuckDB and others
    Parquet,
    /// A table of one placement
    Csv,
}

impl Format {
    /// How its files' names end.
    pub const fn ending(self) -> &'static str {
        match self {
            Self::Bag => "mcap",
            Self::Parquet => "parquet",
            Self::Csv => "csv",
        }
    }
}

/// The default of `--trim`.
const AUTO: &str = "auto";

/// What is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode<'a> {
    /// The IMUs of a body that moves as motion files say.
    Motions,
    /// The IMUs of this recording again, from its reference.
    Reference(&'a Path),
    /// An IMU on a rigid body that moves along this trajectory.
    Rigid(&'a Path),
}

impl Mode<'_> {
    /// What the user gave to choose it.
    fn name(self) -> &'static str {
        match self {
            Self::Motions => "motion files",
            Self::Reference(_) => "--reference",
            Self::Rigid(_) => "--rigid",
        }
    }
}

impl Arguments {
    /// Whether OUT is a folder of files, even of one.
    pub fn is_of_many(&self) -> bool {
        let ending = self.out.extension().unwrap_or_default();
        let is_file = ending.eq_ignore_ascii_case(self.format().ending());
        match self.motions.as_slice() {
            [] => false,
            [only] => {
                let columns = self.format() == Format::Parquet && !is_file;
                is_of_many(only) || self.shard.is_some() || columns
            }
            _ => true,
        }
    }

    /// The format that is given, or that OUT's ending says.
    pub fn format(&self) -> Format {
        let ending = self.out.extension().unwrap_or_default();
        let is = |format: &Format| ending.eq_ignore_ascii_case(format.ending());
        let said = [Format::Parquet, Format::Csv].into_iter().find(is);
        self.format.or(said).unwrap_or(Format::Bag)
    }

    /// The mode, where the numbers are sound and every option is one that the mode takes.
    ///
    /// # Errors
    /// One line that names the option and what it goes with.
    pub fn mode(&self) -> anyhow::Result<Mode<'_>> {
        if let Some(rate) = self
            .rate
            .filter(|rate| !(*rate > 0.0 && *rate <= MAX_RATE_HZ))
        {
            bail!(
                "--rate {rate}: expected a positive number of messages a second, at most {MAX_RATE_HZ}"
            );
        }
        if !(self.pose_error_correlation >= 0.0 && self.pose_error_correlation.is_finite()) {
            bail!(
                "--pose-error-correlation {}: expected 0 s or more",
                self.pose_error_correlation
            );
        }
        let mode = match (&self.reference, &self.rigid) {
            (None, None) => Mode::Motions,
            (Some(recording), None) => Mode::Reference(recording),
            (None, Some(trajectory)) => Mode::Rigid(trajectory),
            (Some(_), Some(_)) => {
                bail!("--reference and --rigid are two modes of simulate; give one of them")
            }
        };
        if let Some(motion) = self.motions.first().filter(|_| mode != Mode::Motions) {
            bail!(
                "{}: a motion file goes without {}; leave one of them out",
                motion.display(),
                mode.name()
            );
        }
        for (option, modes) in self.given()? {
            if !modes.contains(&mode.name()) {
                bail!(
                    "{option} goes with {}, not with {}; leave it out",
                    modes.join(" and "),
                    mode.name()
                );
            }
        }
        if mode != Mode::Motions && self.format() != Format::Bag {
            bail!(
                "{}: {} writes a bag, which `cromosim convert` makes tables and columns of; give a name in .mcap",
                self.out.display(),
                mode.name()
            );
        }
        if mode == Mode::Motions {
            self.refuse_unnamed_sites()?;
            self.refuse_nothing_to_move()?;
        }
        self.refuse_rivals()?;
        if matches!(mode, Mode::Rigid(_)) && self.rate.is_none() {
            bail!("--rigid needs --rate HZ: the messages of the IMU per second");
        }
        Ok(mode)
    }

    fn refuse_unnamed_sites(&self) -> anyhow::Result<()> {
        if let Some(given) = self.placement.iter().find(|given| !given.contains('=')) {
            bail!(
                "--placement {given}: expected NAME=SITE, such as left_wrist=left_watch; `cromosim body sites` lists the sites"
            );
        }
        Ok(())
    }

    /// A shell's pattern may have found no file: that is no wish for a walk.
    fn refuse_nothing_to_move(&self) -> anyhow::Result<()> {
        match (self.motions.first(), self.walk) {
            (None, false) => bail!(
                "no motion file is given; name files, a folder or a pattern, or give --walk for the walk that comes with the suite"
            ),
            (Some(motion), true) => bail!(
                "{}: --walk moves the body without a file; leave one of them out",
                motion.display()
            ),
            _ => Ok(()),
        }
    }

    /// Options of which one alone can be followed.
    fn refuse_rivals(&self) -> anyhow::Result<()> {
        if !self.placement.is_empty() && self.placements.is_some() {
            bail!("--placement and --placements both say where sensors are; give one of them");
        }
        if self.bandwidth.is_some() && self.scheme.is_some() {
            bail!("--bandwidth takes the place of --scheme; give one of them");
        }
        if self.bandwidth.is_some() && self.learned.is_some() {
            bail!("--learned corrects what a scheme estimates, not a --bandwidth; leave one out");
        }
        if self.texture.is_some() && self.learned.is_some() {
            bail!("--learned corrects what --texture draws anew; leave one out");
        }
        if self.csv.is_some() && self.format() != Format::Bag {
            bail!("--csv is made of a bag, and OUT holds the same columns already; leave it out");
        }
        if self.orientation != OrientationSource::Truth.name() && self.format() != Format::Bag {
            bail!(
                "--orientation is of /imu/NAME/data, and tables hold no orientation; give a name in .mcap"
            );
        }
        if self.magnetic_field.is_some() && self.format() == Format::Parquet {
            bail!("--magnetic-field: columns hold no magnetometer; give a name in .mcap or .csv");
        }
        if self.draw.is_some() && self.format() != Format::Parquet {
            bail!("--draw writes columns, which tell draws apart; give --format parquet");
        }
        if self.device.is_some() && self.effects.is_some() {
            bail!("--device and --effects both say what errs; give one of them");
        }
        Ok(())
    }

    /// What `--scheme` or `--bandwidth` say; none where neither was given.
    ///
    /// # Errors
    /// An unknown scheme.
    pub fn differentiation(&self) -> anyhow::Result<Option<Differentiation>> {
        let scheme = self.scheme.as_deref().map(Scheme::from_str).transpose();
        let scheme = scheme.context("--scheme")?.map(Differentiation::Scheme);
        Ok(scheme.or(self.bandwidth.map(Differentiation::Bandwidth)))
    }

    /// What `--magnetic-field` says; none where it was not given.
    ///
    /// # Errors
    /// No field.
    pub fn field(&self) -> anyhow::Result<Option<AmbientField>> {
        let field = self.magnetic_field.as_deref().map(AmbientField::resolve);
        field.transpose().context("--magnetic-field")
    }

    /// What `--orientation` says.
    ///
    /// # Errors
    /// An unknown name.
    pub fn orientation(&self) -> anyhow::Result<OrientationSource> {
        self.orientation.parse().context("--orientation")
    }

    /// What `--trim` says.
    ///
    /// # Errors
    /// Neither `auto` nor seconds.
    pub fn trim(&self) -> anyhow::Result<Trim> {
        if self.trim == AUTO {
            return Ok(Trim::Uncertain);
        }
        match self.trim.parse() {
            Ok(seconds) if (0.0..f64::INFINITY).contains(&seconds) => Ok(Trim::Seconds(seconds)),
            _ => bail!("--trim {}: expected auto or 0 s or more", self.trim),
        }
    }

    /// What `--texture` says; none where it was not given.
    ///
    /// # Errors
    /// An unknown segment.
    pub fn texture(&self) -> anyhow::Result<Option<TextureOn>> {
        let Some(name) = &self.texture else {
            return Ok(None);
        };
        if name == AUTO {
            return Ok(Some(TextureOn::ItsSegment));
        }
        let names = TextureSegment::ALL.map(TextureSegment::name);
        match names.iter().position(|known| known == name) {
            Some(number) => Ok(Some(TextureOn::Segment(TextureSegment::ALL[number]))),
            None => bail!("--texture={name}: expected {} or nothing", names.join(", ")),
        }
    }

    /// The options that were given and that not every mode takes, with the modes that do.
    fn given(&self) -> anyhow::Result<Vec<(&'static str, &'static [&'static str])>> {
        const MOTION_FILES: &[&str] = &["motion files"];
        const OF_REFERENCE: &[&str] = &["--reference"];
        const RECORDINGS: &[&str] = &["--reference", "--rigid"];
        const NOT_REFERENCE: &[&str] = &["motion files", "--rigid"];
        const NOT_RIGID: &[&str] = &["motion files", "--reference"];
        let motion = ReadOptions {
            motion: self.motion.options()?,
            ..ReadOptions::default()
        };
        // Exports of motion capture may have any axis up, too.
        let modes = |option| match option {
            "--up-axis" => NOT_REFERENCE,
            _ => MOTION_FILES,
        };
        let settings = motion.motion_settings(true);
        let mut given = Vec::from_iter(settings.map(|it| (it, modes(it))));
        let options = [
            (self.walk, "--walk", MOTION_FILES),
            (self.format.is_some(), "--format", MOTION_FILES),
            (self.shard.is_some(), "--shard", MOTION_FILES),
            (self.draw.is_some(), "--draw", MOTION_FILES),
            (self.placements.is_some(), "--placements", MOTION_FILES),
            (self.csv.is_some(), "--csv", MOTION_FILES),
            (
                self.orientation != OrientationSource::Truth.name(),
                "--orientation",
                MOTION_FILES,
            ),
            (
                self.pose_error_correlation != 0.0,
                "--pose-error-correlation",
                MOTION_FILES,
            ),
            (!self.placement.is_empty(), "--placement", NOT_REFERENCE),
            (self.namespace.is_some(), "--namespace", OF_REFERENCE),
            (self.device.is_some(), "--device", NOT_REFERENCE),
            (self.effects.is_some(), "--effects", RECORDINGS),
            (self.trim != AUTO, "--trim", NOT_REFERENCE),
            (self.texture.is_some(), "--texture", NOT_REFERENCE),
            (self.learned.is_some(), "--learned", NOT_REFERENCE),
            (self.mapping.is_some(), "--mapping", NOT_REFERENCE),
            (self.body.is_some(), "--body", NOT_RIGID),
        ];
        given.extend(self.topics.given().map(|it| (it, OF_REFERENCE)));
        let options = options.into_iter().filter(|(is_given, ..)| *is_given);
        given.extend(options.map(|(_, option, modes)| (option, modes)));
        Ok(given)
    }
}
