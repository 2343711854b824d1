//! `cromosim simulate --reference`: the IMUs of a recording again, from its reference motion.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::bail;
use cromosim_bag::{BagOptions, BagReader, BagWriter, Compression};
use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_imu::{
    Covariances, Device, ImuSample, MountedSites, NoiseSource, PlacementSet, Scheme, SensorFrame, SensorTrajectory, simulate,
};
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::{Stamp, uniform_stamps};
use cromosim_virtual_imu::imu_message;
use rayon::prelude::*;

use crate::progress::{self, Interrupt};
use crate::simulate::Arguments;

/// A placement of a recording: its reference, and its real IMU where there is one.
struct Recorded {
    name: String,
    trajectory: SensorTrajectory,
    /// Messages of `/imu/NAME/data_raw`.
    measured: Vec<Imu>,
}

/// Runs `simulate --reference RECORDING`.
pub fn run(recording: &Path, arguments: &Arguments) -> anyhow::Result<()> {
    if let (Ok(from), Ok(to)) = (recording.canonicalize(), arguments.out.canonicalize())
        && from == to
    {
        bail!("{}: --out is the recording itself, which would be lost; give another name", arguments.out.display());
    }
    let scheme: Scheme = arguments.scheme.as_deref().unwrap_or("spline").parse()?;
    let reader = BagReader::open(recording)?;
    let recorded = read(&reader)?;
    let interrupt = Interrupt::watch()?;
    let bar = progress::bar(recorded.len() as u64, "simulating, placements");
    let results: Vec<anyhow::Result<Vec<Imu>>> = recorded
        .par_iter()
        .map(|placement| {
            interrupt.check()?;
            let messages = resimulate(placement, scheme, arguments);
            bar.inc(1);
            messages
        })
        .collect();
    bar.finish_and_clear();
    let simulated = results.into_iter().collect::<anyhow::Result<Vec<_>>>()?;

    let mut bag = BagWriter::create(
        &arguments.out,
        BagOptions { compression: Compression::Zstd, replace: arguments.force, ..BagOptions::default() },
    )?;
    bag.write_metadata("cromosim", metadata(recording, scheme, arguments))?;
    let mut order: Vec<(i64, usize, usize)> = Vec::new();
    for (number, messages) in simulated.iter().enumerate() {
        order.extend(messages.iter().enumerate().map(|(index, message)| (message.header.stamp.nanos(), number, index)));
    }
    order.sort_by_key(|(nanos, ..)| *nanos);
    let topics: Vec<String> = recorded.iter().map(|placement| format!("/imu/{}/data_raw", placement.name)).collect();
    for (nanos, number, index) in order {
        interrupt.check()?;
        bag.write(&topics[number], Stamp::from_nanos(nanos), &simulated[number][index])?;
    }
    let summary = bag.finish()?;
    println!(
        "{}: {} messages of {} placements, from the reference in {}",
        arguments.out.display(),
        summary.message_count(),
        recorded.len(),
        recording.display()
    );
    for placement in &recorded {
        if let Some(line) = outside(placement) {
            println!("  {}: {line}", placement.name);
        }
    }
    Ok(())
}

fn metadata(recording: &Path, scheme: Scheme, arguments: &Arguments) -> BTreeMap<String, String> {
    let entry = |key: &str, value: String| (key.to_owned(), value);
    BTreeMap::from([
        entry("version", env!("CARGO_PKG_VERSION").to_owned()),
        entry("command", "simulate --reference".to_owned()),
        entry("reference", recording.file_name().unwrap_or_default().to_string_lossy().into_owned()),
        entry("scheme", scheme.to_string()),
        entry("seed", arguments.seed.to_string()),
        entry("noise", (!arguments.no_noise).to_string()),
    ])
}

/// Every placement of the recording: from `/reference/NAME`, else from its SMPL states and placements.
fn read(reader: &BagReader) -> anyhow::Result<Vec<Recorded>> {
    let names = |prefix: &str, suffix: &str, type_name: &str| -> Vec<String> {
        let topics = reader.summary().topics.iter().filter(|counted| counted.topic.type_name == type_name);
        topics.filter_map(|counted| Some(counted.topic.name.strip_prefix(prefix)?.strip_suffix(suffix)?.to_owned())).collect()
    };
    let mut references = names("/reference/", "", PoseStamped::TYPE_NAME);
    references.sort();
    let trajectories: Vec<(String, SensorTrajectory)> = if references.is_empty() {
        from_states(reader)?
    } else {
        references.into_iter().map(|name| Ok((name.clone(), from_reference(reader, &name)?))).collect::<anyhow::Result<_>>()?
    };
    let imus = names("/imu/", "/data_raw", Imu::TYPE_NAME);
    trajectories
        .into_iter()
        .map(|(name, trajectory)| {
            let measured = if imus.contains(&name) { reader.read::<Imu>(&format!("/imu/{name}/data_raw"))? } else { Vec::new() };
            Ok(Recorded { name, trajectory, measured: measured.into_iter().map(|(_, message)| message).collect() })
        })
        .collect()
}

fn from_reference(reader: &BagReader, name: &str) -> anyhow::Result<SensorTrajectory> {
    let topic = format!("/reference/{name}");
    let mut frames = Vec::new();
    for (_, message) in reader.read::<PoseStamped>(&topic)? {
        let stamp = Stamp::from_nanos(message.header.stamp.nanos());
        let world_from_sensor = message
            .pose
            .try_into()
            .map_err(|error| anyhow::anyhow!("{}, {topic} at {:.6} s: {error}", reader.path().display(), stamp.as_seconds()))?;
        frames.push(SensorFrame::new(stamp, world_from_sensor));
    }
    frames.sort_by_key(|frame| frame.stamp);
    SensorTrajectory::new(frames).map_err(|error| anyhow::anyhow!("{}, {topic}: {error}", reader.path().display()))
}

/// The sites' poses from the recording's states and its attachment `placements.yaml`.
fn from_states(reader: &BagReader) -> anyhow::Result<Vec<(String, SensorTrajectory)>> {
    let path = reader.path().display();
    let Some(placements) = reader.attachment("placements.yaml") else {
        bail!(
            "{path}: the recording holds neither /reference/NAME (geometry_msgs/msg/PoseStamped) nor an attachment placements.yaml beside SMPL states; there is no reference to simulate from"
        );
    };
    let placements = PlacementSet::parse(&String::from_utf8_lossy(placements), &format!("{path}, attachment placements.yaml"))?;
    let mut states = reader.read::<SmplState>("/smpl/state")?;
    states.sort_by_key(|(_, state)| state.header.stamp.nanos());
    let Some((_, last)) = states.last() else { bail!("{path}: /smpl/state holds no message") };
    let shaped = ShapedBody::new(BodyModel::embedded(), &last.betas)?;
    let sites = MountedSites::new(&shaped, placements.placements())?;
    let stamps: Vec<Stamp> = states.iter().map(|(_, state)| Stamp::from_nanos(state.header.stamp.nanos())).collect();
    let pose =
        |state: &SmplState| state.root_and_rotations().map(|(root_position, local_rotations)| BodyPose { root_position, local_rotations });
    let poses = states.iter().map(|(_, state)| pose(state)).collect::<Result<Vec<_>, _>>()?;
    let trajectories = sites.trajectories(&stamps, &poses)?;
    Ok(placements.placements().iter().map(|placement| placement.name().to_owned()).zip(trajectories).collect())
}

/// One Imu for each measured message, with its stamp; where nothing was measured, at `--rate`.
fn resimulate(placement: &Recorded, scheme: Scheme, arguments: &Arguments) -> anyhow::Result<Vec<Imu>> {
    let trajectory = &placement.trajectory;
    let stamps = match (placement.measured.as_slice(), arguments.rate) {
        ([], Some(rate_hz)) => uniform_stamps(trajectory.start(), trajectory.end(), rate_hz)?,
        ([], None) => {
            bail!("{}: the recording has no /imu/{}/data_raw to take the stamps from; give --rate HZ", placement.name, placement.name)
        }
        (measured, _) => measured.iter().map(|message| Stamp::from_nanos(message.header.stamp.nanos())).collect(),
    };
    let device = declared(&placement.measured, &stamps)?;
    let rate_hz = rate(&stamps);
    let mut noise = NoiseSource::new(&device, rate_hz, arguments.seed, &placement.name)?;
    let covariances = Covariances::of(&device, rate_hz).without_orientation();
    let frame_id = placement.measured.first().map_or_else(|| format!("{}_imu", placement.name), |message| message.header.frame_id.clone());
    let message = |ideal: ImuSample| {
        let sample = if arguments.no_noise { ideal } else { noise.apply(&ideal) };
        imu_message(&sample, &frame_id, &covariances, false)
    };
    Ok(simulate(trajectory, scheme, &stamps)?.into_iter().map(message).collect())
}

/// A device with the white noise that the messages declare: density = sigma / sqrt(rate).
fn declared(measured: &[Imu], stamps: &[Stamp]) -> anyhow::Result<Device> {
    let Some(first) = measured.first() else { return Ok(Device::ideal()) };
    let mean = |covariance: &[f64; 9]| ((covariance[0].max(0.0) + covariance[4].max(0.0) + covariance[8].max(0.0)) / 3.0).sqrt();
    let root = rate(stamps).sqrt();
    let (accel, gyro) = (mean(&first.linear_acceleration_covariance) / root, mean(&first.angular_velocity_covariance) / root);
    Ok(Device::white(accel, gyro))
}

/// Rate of stamps by the median of their intervals, Hz.
fn rate(stamps: &[Stamp]) -> f64 {
    let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).filter(|interval| *interval > 0.0).collect();
    intervals.sort_unstable_by(f64::total_cmp);
    intervals.get(intervals.len() / 2).map_or(1.0, |interval| interval.recip())
}

/// What a user should know of samples that the reference does not cover.
fn outside(placement: &Recorded) -> Option<String> {
    let (start, end) = (placement.trajectory.start(), placement.trajectory.end());
    let covered = |message: &&Imu| (start..=end).contains(&Stamp::from_nanos(message.header.stamp.nanos()));
    let missing = placement.measured.len() - placement.measured.iter().filter(covered).count();
    (missing > 0).then(|| format!("{missing} messages lie outside the reference; they hold what its ends read"))
}
