//! `cromosim simulate`: motion files to bags, without DDS, on all cores.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use anyhow::{Context, bail};
use clap::Args;
use cromosim_bag::{BagOptions, BagWriter, Compression, write_imu_csv};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_imu::{
    Covariances, Device, MAX_RATE_HZ, MountedSites, PlacementSet, Scheme, SensorTrajectory, StreamingEffects, simulate_kinematics_on,
};
use cromosim_motion::{MotionOptions, SmplMotion, embedded_walk, read_motion_for};
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::{PoseTimes, Stamp, uniform_stamps};
use cromosim_virtual_imu::imu_message;
use indicatif::ProgressBar;
use rayon::prelude::*;

use crate::motion_arguments::MotionArguments;
use crate::progress::Interrupt;
use crate::{body, progress, reference};

/// Stamp of the first frame: not zero, which TF takes for "the latest".
pub const BEGINS: Stamp = Stamp::from_nanos(1_000_000_000);

/// Simulate IMUs from motion files, or again from a recording's reference
#[derive(Args)]
#[command(group = clap::ArgGroup::new("recorded").args(["reference", "rigid"]).multiple(false))]
pub struct Arguments {
    /// Motion files (BVH, ASF/AMC, C3D, TRC); none: the embedded walk
    motions: Vec<PathBuf>,
    /// Re-simulate the IMUs of this recording from its reference motion instead
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["motions", "placements", "body", "csv", "up_axis", "unit", "start", "duration", "skeleton", "motion_rate", "marker_set", "subject", "placements_as_given"])]
    pub reference: Option<PathBuf>,
    /// Simulate an IMU on a rigid body (robot, prop) that moves along this trajectory (TUM, EuRoC or CSV) instead
    #[arg(long, value_name = "FILE", requires = "rate", conflicts_with_all = ["motions", "placements", "body", "csv", "up_axis", "unit", "start", "duration", "skeleton", "motion_rate", "marker_set", "subject", "placements_as_given"])]
    pub rigid: Option<PathBuf>,
    /// With --rigid: the placement's name, in /imu/NAME/data_raw
    #[arg(long, value_name = "NAME", default_value = "body", requires = "rigid")]
    pub placement: String,
    /// With --rigid: a device's name or file, for its noise and effects; default: an ideal sensor
    #[arg(long, value_name = "DEVICE", requires = "rigid", conflicts_with = "effects")]
    pub device: Option<String>,
    /// With --reference or --rigid: the effects of each placement (YAML, as a diagnosis writes them) rather than the nominal simulation
    #[arg(long, value_name = "FILE", requires = "recorded")]
    pub effects: Option<PathBuf>,
    /// The bag to write (.mcap, or a rosbag2 directory); with several motions a directory for one .mcap each
    #[arg(long, value_name = "OUT")]
    pub out: PathBuf,
    /// Sensor placements (YAML) rather than left_wrist, right_ankle, pelvis, sternum and head
    #[arg(long, value_name = "FILE")]
    placements: Option<PathBuf>,
    /// Derivative scheme for every placement: spline, richardson, triangle, normal_tracking or second_difference. With --reference the default is the estimate that a diagnosis uses
    #[arg(long, value_name = "NAME")]
    pub scheme: Option<String>,
    /// Messages per second rather than the placements' own rate, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Body model as npz rather than the embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// Seed of the sensor noise
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Leave out the random part of the sensor errors
    #[arg(long)]
    pub no_noise: bool,
    /// Write the samples of each placement as CSV into this directory too
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    motion: MotionArguments,
    /// Replace OUT where it exists
    #[arg(long)]
    pub force: bool,
}

/// What is the same for all motions of a call.
struct Setup {
    model: Arc<BodyModel>,
    placements: PlacementSet,
    devices: Vec<Device>,
    motion: MotionOptions,
    seed: u64,
    noise: bool,
    force: bool,
    csv: Option<PathBuf>,
    interrupt: Interrupt,
}

/// One placement's results.
struct Simulated {
    name: String,
    reference: Vec<PoseStamped>,
    raw: Vec<Imu>,
    full: Vec<Imu>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if let Some(rate) = arguments.rate.filter(|rate| !(*rate > 0.0 && *rate <= MAX_RATE_HZ)) {
        bail!("--rate {rate}: expected a positive number of messages a second, at most {MAX_RATE_HZ}");
    }
    if let Some(trajectory) = &arguments.rigid {
        return reference::run_rigid(trajectory, arguments);
    }
    if let Some(recording) = &arguments.reference {
        return reference::run(recording, arguments);
    }
    let setup = Setup::new(arguments)?;
    if arguments.motions.len() <= 1 {
        let motion = setup.read(arguments.motions.first())?;
        let bar = progress::bar(setup.placements.placements().len() as u64 + 1, "simulating, placements");
        let line = simulate_one(&setup, &motion, &arguments.out, &bar);
        bar.finish_and_clear();
        println!("{}", line?);
        return Ok(());
    }
    fs::create_dir_all(&arguments.out).with_context(|| format!("{}: cannot be made", arguments.out.display()))?;
    let outs = output_names(&arguments.motions, &arguments.out)?;
    let bar = progress::bar(outs.len() as u64, "simulating, files");
    let results: Vec<anyhow::Result<String>> = arguments
        .motions
        .par_iter()
        .zip(&outs)
        .map(|(path, out)| {
            let result = setup.read(Some(path)).and_then(|motion| simulate_one(&setup, &motion, out, &ProgressBar::hidden()));
            bar.inc(1);
            result
        })
        .collect();
    bar.finish_and_clear();
    let mut failed = 0;
    for result in &results {
        match result {
            Ok(line) => println!("{line}"),
            Err(error) => {
                eprintln!("error: {error:#}");
                failed += 1;
            }
        }
    }
    if failed > 0 {
        bail!("{failed} of {} files failed (above); the others are written", results.len());
    }
    Ok(())
}

/// OUT/NAME.mcap for every motion; two motions of one name would overwrite each other.
fn output_names(motions: &[PathBuf], out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut taken: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    let mut outs = Vec::new();
    for motion in motions {
        let place = out.join(motion.file_stem().unwrap_or_default()).with_extension("mcap");
        if let Some(other) = taken.insert(place.clone(), motion) {
            bail!("{} and {} would both become {}; simulate them into two directories", other.display(), motion.display(), place.display());
        }
        outs.push(place);
    }
    Ok(outs)
}

impl Setup {
    fn new(arguments: &Arguments) -> anyhow::Result<Self> {
        let file = arguments.placements.as_deref();
        let placements = file.map_or_else(|| Ok(PlacementSet::demo()), PlacementSet::read)?;
        let scheme = arguments.scheme.as_deref().map(Scheme::from_str).transpose().context("--scheme")?;
        let placements = placements.map(|placement| {
            let rate_hz = arguments.rate.unwrap_or(placement.rate_hz());
            let scheme = scheme.unwrap_or(placement.scheme());
            placement.with_rate_hz(rate_hz).with_scheme(scheme)
        });
        let folder = file.and_then(Path::parent).unwrap_or(Path::new("."));
        let devices =
            placements.placements().iter().map(|placement| Device::resolve(placement.device(), folder)).collect::<Result<_, _>>()?;
        Ok(Self {
            model: body::model(arguments.body.as_ref())?,
            placements,
            devices,
            motion: arguments.motion.options()?,
            seed: arguments.seed,
            noise: !arguments.no_noise,
            force: arguments.force,
            csv: arguments.csv.clone(),
            interrupt: Interrupt::watch()?,
        })
    }

    fn read(&self, path: Option<&PathBuf>) -> anyhow::Result<SmplMotion> {
        Ok(match path {
            Some(path) => read_motion_for(path, &self.model, &self.motion)?,
            None => embedded_walk().slice(self.motion.start_s, self.motion.duration_s)?,
        })
    }

    /// All placements of a motion, each on whatever core is free.
    fn simulate(&self, motion: &SmplMotion, stamps: &[Stamp], bar: &ProgressBar) -> anyhow::Result<Vec<Simulated>> {
        let shaped = ShapedBody::new(self.model.clone(), &motion.betas)?;
        let sites = MountedSites::new(&shaped, self.placements.placements())?;
        if motion.frames.len() < 2 {
            bail!("{}: {} frame is no motion; at least 2 are needed", motion.name, motion.frames.len());
        }
        let trajectories = sites.trajectories(stamps, &motion.frames)?;
        let times = PoseTimes::new(stamps)?;
        bar.inc(1);
        let one = |(index, trajectory): (usize, &SensorTrajectory)| {
            self.interrupt.check()?;
            let simulated = self.simulate_placement(index, trajectory, &times);
            bar.inc(1);
            simulated
        };
        trajectories.par_iter().enumerate().map(one).collect()
    }

    fn simulate_placement(&self, index: usize, trajectory: &SensorTrajectory, times: &PoseTimes) -> anyhow::Result<Simulated> {
        let (placement, device) = (&self.placements.placements()[index], &self.devices[index]);
        let (name, rate_hz) = (placement.name(), placement.rate_hz());
        let output = uniform_stamps(trajectory.start(), trajectory.end(), rate_hz)?;
        let effects = StreamingEffects::new(device, rate_hz, self.seed, name)?;
        let mut effects = if self.noise { effects } else { effects.without_noise() };
        let covariances = Covariances::of(device, rate_hz);
        let frame_id = format!("{name}_imu");
        let (mut raw, mut full) = (Vec::with_capacity(output.len()), Vec::with_capacity(output.len()));
        for kinematic in simulate_kinematics_on(times, trajectory, placement.scheme(), &output)? {
            let Some(sample) = effects.step(&kinematic) else { continue };
            raw.push(imu_message(&sample, &frame_id, &covariances.without_orientation(), false));
            full.push(imu_message(&sample, &frame_id, &covariances, true));
        }
        let reference = trajectory
            .frames()
            .iter()
            .map(|frame| PoseStamped { header: Header::new(frame.stamp.nanos, "world"), pose: frame.world_from_sensor.into() });
        Ok(Simulated { name: name.to_owned(), reference: reference.collect(), raw, full })
    }

    /// What a bag says about how it was made.
    fn metadata(&self, motion: &SmplMotion) -> BTreeMap<String, String> {
        let entry = |key: &str, value: String| (key.to_owned(), value);
        BTreeMap::from([
            entry("version", env!("CARGO_PKG_VERSION").to_owned()),
            entry("command", "simulate".to_owned()),
            entry(
                "motion",
                Path::new(&motion.name).file_name().map_or_else(|| motion.name.clone(), |name| name.to_string_lossy().into_owned()),
            ),
            entry("body", self.model.id().to_owned()),
            entry("seed", self.seed.to_string()),
            entry("noise", self.noise.to_string()),
            entry("placements", self.placements.to_yaml()),
        ])
    }
}

fn simulate_one(setup: &Setup, motion: &SmplMotion, out: &Path, bar: &ProgressBar) -> anyhow::Result<String> {
    let last = motion.frames.len().saturating_sub(1) as f64 / motion.rate_hz;
    let stamps: Vec<Stamp> = (0..motion.frames.len()).map(|frame| BEGINS.plus_seconds(frame as f64 / motion.rate_hz)).collect();
    let simulated = setup.simulate(motion, &stamps, bar)?;
    let mut bag = BagWriter::create(out, BagOptions { compression: Compression::Zstd, replace: setup.force, ..BagOptions::default() })?;
    bag.write_metadata("cromosim", setup.metadata(motion))?;
    bag.attach("placements.yaml", "application/yaml", BEGINS, setup.placements.to_yaml().as_bytes())?;
    write_in_order_of_time(&mut bag, motion, &stamps, &simulated, &setup.interrupt)?;
    let summary = bag.finish()?;
    if let Some(folder) = &setup.csv {
        write_csv(out, folder, &simulated)?;
    }
    Ok(format!("{}: {} messages, {} placements, {last:.2} s of {}", out.display(), summary.message_count(), simulated.len(), motion.name))
}

/// Messages of one time: the state first, then each placement's.
fn write_in_order_of_time(
    bag: &mut BagWriter,
    motion: &SmplMotion,
    stamps: &[Stamp],
    simulated: &[Simulated],
    interrupt: &Interrupt,
) -> anyhow::Result<()> {
    enum What {
        State,
        Reference(usize),
        Samples(usize),
    }
    let mut schedule: Vec<(i64, What, usize)> = Vec::new();
    schedule.extend(stamps.iter().enumerate().map(|(index, stamp)| (stamp.nanos, What::State, index)));
    for (number, placement) in simulated.iter().enumerate() {
        let references = placement.reference.iter().enumerate();
        schedule.extend(references.map(|(index, message)| (message.header.stamp.nanos(), What::Reference(number), index)));
        schedule
            .extend(placement.raw.iter().enumerate().map(|(index, message)| (message.header.stamp.nanos(), What::Samples(number), index)));
    }
    schedule.sort_by_key(|(nanos, ..)| *nanos);
    let topics = |ending: &str| simulated.iter().map(|placement| format!("/imu/{}/{ending}", placement.name)).collect::<Vec<_>>();
    let (raw, full) = (topics("data_raw"), topics("data"));
    let references: Vec<String> = simulated.iter().map(|placement| format!("/reference/{}", placement.name)).collect();
    for (nanos, what, index) in schedule {
        let stamp = Stamp::from_nanos(nanos);
        interrupt.check()?;
        match what {
            What::State => bag.write("/smpl/state", stamp, &state(motion, index, stamp))?,
            What::Reference(number) => bag.write(&references[number], stamp, &simulated[number].reference[index])?,
            What::Samples(number) => {
                bag.write(&raw[number], stamp, &simulated[number].raw[index])?;
                bag.write(&full[number], stamp, &simulated[number].full[index])?;
            }
        }
    }
    Ok(())
}

fn state(motion: &SmplMotion, frame: usize, stamp: Stamp) -> SmplState {
    let body = &motion.frames[frame];
    let mut state = SmplState {
        header: Header::new(stamp.nanos, "world"),
        body_id: "0".to_owned(),
        gender: motion.gender.name().to_owned(),
        betas: motion.betas.clone(),
        confidence: motion.confidence.as_ref().map_or(1.0, |values| values[frame]),
        ..SmplState::default()
    };
    state.set_root_and_rotations(body.root_position, &body.local_rotations);
    state
}

/// DIR/NAME_PLACEMENT.csv with the samples of `data`.
fn write_csv(bag: &Path, folder: &Path, simulated: &[Simulated]) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    let reader = cromosim_bag::BagReader::open(bag)?;
    let stem = bag.file_stem().unwrap_or_default().to_string_lossy();
    for placement in simulated {
        let path = folder.join(format!("{stem}_{}.csv", placement.name));
        let file = fs::File::create(&path).with_context(|| format!("{}: cannot be written", path.display()))?;
        write_imu_csv(&reader, &format!("/imu/{}/data", placement.name), std::io::BufWriter::new(file), &path)?;
    }
    Ok(())
}
