//! `cromosim simulate --reference`: the IMUs of a recording again, from its reference motion.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, bail};
use cromosim_bag::{BagOptions, BagReader, BagSummary, BagWriter, Compression};
use cromosim_body::BodyModel;
use cromosim_imu::{
    DeclaredNoise, Device, EffectKind, EffectSet, EffectsFile, ImuOptions, Placement,
    PlacementEffects, RecordedMotion, Scheme, SensorFrame, SensorTrajectory, measure_recording,
    simulate_kinematics, track_in_sensor_axes,
};
use cromosim_learned::{LearnedSimulator, MappingFile, SiteMotion};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_recording::rigid::{RigidContent, parse_rigid};
use cromosim_recording::{RecordedPlacement, read_placements, read_whole};
use cromosim_spatial::{KinematicTrack, PoseEstimate, Stamp, uniform_stamps};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::progress::{self, Interrupt};
use crate::simulate::{boxed, read_mapping};
use crate::simulate_arguments::Arguments;

/// How the placements of a recording are simulated.
#[derive(Default)]
struct How {
    /// None: the estimate that a diagnosis uses.
    scheme: Option<Scheme>,
    effects: EffectsFile,
    learned: Option<LearnedSimulator>,
    mapping: MappingFile,
}

/// Runs `simulate --reference RECORDING`.
pub fn run(recording: &Path, arguments: &Arguments) -> anyhow::Result<()> {
    if let (Ok(from), Ok(to)) = (recording.canonicalize(), arguments.out.canonicalize())
        && from == to
    {
        bail!(
            "{}: --out is the recording itself, which would be lost; give another name",
            arguments.out.display()
        );
    }
    let scheme: Option<Scheme> = arguments
        .scheme
        .as_deref()
        .map(str::parse)
        .transpose()
        .context("--scheme")?;
    let reader = BagReader::open(recording)?;
    let body = arguments.body.as_deref().map(BodyModel::read).transpose()?;
    let recorded = read_placements(&reader, body.as_ref())?
        .into_iter()
        .map(|(_, placement)| placement)
        .collect::<Result<Vec<_>, _>>()?;
    let effects = arguments
        .effects
        .as_deref()
        .map(|file| read_effects(file, &recorded))
        .transpose()?
        .unwrap_or_default();
    let (recorded, without_stamps) = with_stamps(recorded, arguments.rate);
    let how = How {
        scheme,
        effects,
        ..How::default()
    };
    let simulated = simulate_all(&recorded, &how, arguments)?;
    let summary = write(
        &arguments.out,
        metadata(recording, &how, arguments),
        &recorded,
        &simulated,
        false,
        arguments,
    )?;
    println!(
        "{}: {} messages of {} placements, from the reference in {}",
        arguments.out.display(),
        summary.message_count(),
        recorded.len(),
        recording.display()
    );
    for placement in &recorded {
        for line in placement.notes.iter().cloned().chain(outside(placement)) {
            println!("  {}: {line}", placement.name);
        }
    }
    if !without_stamps.is_empty() {
        println!(
            "  {}: no messages on /imu/NAME/data_raw to take the stamps from; left out (--rate HZ takes them in)",
            without_stamps.join(", ")
        );
    }
    Ok(())
}

/// Runs `simulate --rigid TRAJECTORY`: the trajectory is the reference of one placement.
pub fn run_rigid(trajectory: &Path, arguments: &Arguments) -> anyhow::Result<()> {
    let scheme: Option<Scheme> = arguments
        .scheme
        .as_deref()
        .map(str::parse)
        .transpose()
        .context("--scheme")?;
    let name = arguments.placement.as_deref().unwrap_or("body");
    if let Err((_, problem)) = Placement::at_site(name, "left_watch", 1.0) {
        bail!("--placement {name}: {problem}");
    }
    let Some(RigidContent::Poses(poses)) =
        parse_rigid(&read_whole(trajectory)?, &trajectory.display().to_string())?
    else {
        bail!(
            "{}: not a trajectory of a rigid body: expected TUM, EuRoC ground truth or a table of poses with a header",
            trajectory.display()
        );
    };
    let poses = poses.trajectory;
    let frame = |((stamp, position), rotation): ((&Stamp, &Vector3<f64>), &UnitQuaternion<f64>)| {
        SensorFrame::new(*stamp, Isometry3::from_parts((*position).into(), *rotation))
    };
    let frames = poses
        .stamps
        .iter()
        .zip(&poses.positions)
        .zip(&poses.rotations)
        .map(frame)
        .collect();
    let recorded = vec![RecordedPlacement {
        name: name.to_owned(),
        frames,
        measured: Vec::new(),
        notes: Vec::new(),
    }];
    let mut effects = arguments
        .effects
        .as_deref()
        .map(|file| read_effects(file, &recorded))
        .transpose()?
        .unwrap_or_default();
    if let Some(device) = &arguments.device {
        let device = Device::resolve(Some(device), Path::new("."))?;
        let declared_noise = DeclaredNoise {
            accel_density: device.accel_density(),
            gyro_density: device.gyro_density(),
        };
        let of_device = PlacementEffects {
            epoch: recorded[0].span().0,
            declared_noise,
            effects: device.effects().clone(),
        };
        effects.placements.insert(name.to_owned(), of_device);
    }
    let learned = arguments
        .learned
        .as_deref()
        .map(LearnedSimulator::find)
        .transpose()?;
    // What the networks learned on top of.
    let scheme = scheme.or(learned.as_ref().map(|_| Scheme::Spline));
    let mapping = read_mapping(arguments.mapping.as_deref(), &[name])?;
    let how = How {
        scheme,
        effects,
        learned,
        mapping,
    };
    let simulated = simulate_all(&recorded, &how, arguments)?;
    let summary = write(
        &arguments.out,
        metadata(trajectory, &how, arguments),
        &recorded,
        &simulated,
        true,
        arguments,
    )?;
    println!(
        "{}: {} messages of {name}, along {}",
        arguments.out.display(),
        summary.message_count(),
        trajectory.display()
    );
    Ok(())
}

/// Each placement on whatever core is free.
fn simulate_all(
    recorded: &[RecordedPlacement],
    how: &How,
    arguments: &Arguments,
) -> anyhow::Result<Vec<Vec<Imu>>> {
    let interrupt = Interrupt::watch()?;
    let bar = progress::bar(recorded.len() as u64, "simulating, placements");
    let one = |placement: &RecordedPlacement| {
        interrupt.check()?;
        let messages = resimulate(placement, how, arguments);
        bar.inc(1);
        messages
    };
    let results: Vec<anyhow::Result<Vec<Imu>>> = recorded.par_iter().map(one).collect();
    bar.finish_and_clear();
    results.into_iter().collect()
}

/// Writes the messages in order of time, with the references where they are wanted.
fn write(
    out: &Path,
    metadata: BTreeMap<String, String>,
    recorded: &[RecordedPlacement],
    simulated: &[Vec<Imu>],
    with_references: bool,
    arguments: &Arguments,
) -> anyhow::Result<BagSummary> {
    let options = BagOptions {
        compression: Compression::Zstd,
        replace: arguments.force,
        ..BagOptions::default()
    };
    let mut bag = BagWriter::create(out, options)?;
    bag.write_metadata("cromosim", metadata)?;
    // Of one time, references first.
    let mut order: Vec<(i64, bool, usize, usize)> = Vec::new();
    for (number, placement) in recorded.iter().enumerate() {
        if with_references {
            order.extend(
                placement
                    .frames
                    .iter()
                    .enumerate()
                    .map(|(index, frame)| (frame.stamp.nanos, false, number, index)),
            );
        }
        order.extend(
            simulated[number]
                .iter()
                .enumerate()
                .map(|(index, message)| (message.header.stamp.nanos(), true, number, index)),
        );
    }
    order.sort_by_key(|(nanos, is_sample, ..)| (*nanos, *is_sample));
    let topics: Vec<String> = recorded
        .iter()
        .map(|placement| format!("/imu/{}/data_raw", placement.name))
        .collect();
    let references: Vec<String> = recorded
        .iter()
        .map(|placement| format!("/reference/{}", placement.name))
        .collect();
    let interrupt = Interrupt::watch()?;
    for (nanos, is_sample, number, index) in order {
        interrupt.check()?;
        let stamp = Stamp::from_nanos(nanos);
        if is_sample {
            bag.write(&topics[number], stamp, &simulated[number][index])?;
        } else {
            let pose = recorded[number].frames[index].world_from_sensor.into();
            bag.write(
                &references[number],
                stamp,
                &PoseStamped {
                    header: Header::new(nanos, "world"),
                    pose,
                },
            )?;
        }
    }
    Ok(bag.finish()?)
}

fn metadata(recording: &Path, how: &How, arguments: &Arguments) -> BTreeMap<String, String> {
    let entry = |key: &str, value: String| (key.to_owned(), value);
    let mut entries = BTreeMap::from([
        entry("version", env!("CARGO_PKG_VERSION").to_owned()),
        entry(
            "command",
            if arguments.rigid.is_some() {
                "simulate --rigid"
            } else {
                "simulate --reference"
            }
            .to_owned(),
        ),
        entry(
            "reference",
            recording
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
        ),
        entry(
            "scheme",
            how.scheme
                .map_or_else(|| "estimate".to_owned(), |scheme| scheme.to_string()),
        ),
        entry("seed", arguments.seed.to_string()),
        entry("noise", (!arguments.no_noise).to_string()),
    ]);
    if arguments.effects.is_some() || arguments.device.is_some() {
        entries.insert("effects".to_owned(), how.effects.to_yaml());
    }
    if let Some(networks) = &how.learned {
        entries.insert("learned".to_owned(), networks.input().name().to_owned());
    }
    if arguments.mapping.is_some() {
        entries.insert(
            "mapping".to_owned(),
            how.mapping
                .placements
                .keys()
                .cloned()
                .collect::<Vec<_>>()
                .join(", "),
        );
    }
    entries
}

/// The placements whose samples have stamps, from messages or by a rate, and the names of the
/// others; all where none has any.
fn with_stamps(
    recorded: Vec<RecordedPlacement>,
    rate_hz: Option<f64>,
) -> (Vec<RecordedPlacement>, Vec<String>) {
    if rate_hz.is_some()
        || recorded
            .iter()
            .all(|placement| placement.measured.is_empty())
    {
        return (recorded, Vec::new());
    }
    let (with, without): (Vec<_>, Vec<_>) = recorded
        .into_iter()
        .partition(|placement| !placement.measured.is_empty());
    (
        with,
        without
            .into_iter()
            .map(|placement| placement.name)
            .collect(),
    )
}

/// The effects file; what it names must be there, while placements that it does not name stay
/// nominal.
fn read_effects(file: &Path, recorded: &[RecordedPlacement]) -> anyhow::Result<EffectsFile> {
    let effects = EffectsFile::read(file)?;
    let names: Vec<&str> = recorded
        .iter()
        .map(|placement| placement.name.as_str())
        .collect();
    if let Some(name) = effects
        .placements
        .keys()
        .find(|name| !names.contains(&name.as_str()))
    {
        bail!(
            "{}: placement `{name}`: the recording has no such placement; it has {}",
            file.display(),
            names.join(", ")
        );
    }
    Ok(effects)
}

/// One Imu for each measured message, with its stamp; where nothing was measured, at `--rate`.
fn resimulate(
    placement: &RecordedPlacement,
    how: &How,
    arguments: &Arguments,
) -> anyhow::Result<Vec<Imu>> {
    let (name, (start, end)) = (&placement.name, placement.span());
    let stamps = match (placement.measured.as_slice(), arguments.rate) {
        ([], Some(rate_hz)) => uniform_stamps(start, end, rate_hz)?,
        ([], None) => bail!(
            "{name}: the recording has no /imu/{name}/data_raw to take the stamps from; give --rate HZ"
        ),
        (measured, _) => measured
            .iter()
            .map(|message| Stamp::from_nanos(message.header.stamp.nanos()))
            .collect(),
    };
    let rate_hz = rate(&stamps);
    let nominal = PlacementEffects {
        epoch: stamps[0],
        declared_noise: declared(placement, rate_hz),
        effects: EffectSet::new(),
    };
    let effects = how.effects.placements.get(name).unwrap_or(&nominal);
    let track = track(placement, how, rate_hz, &effects.effects).with_context(|| name.clone())?;
    let motion = RecordedMotion {
        track: &track,
        stamps: &stamps,
        stamps_are_recorded: !placement.measured.is_empty(),
    };
    let options = ImuOptions {
        rate_hz,
        seed: arguments.seed,
        name: name.clone(),
        noise: !arguments.no_noise,
        frame_id: placement.measured.first().map_or_else(
            || format!("{name}_imu"),
            |message| message.header.frame_id.clone(),
        ),
        mapping: boxed(&how.mapping, name),
    };
    Ok(measure_recording(motion, effects, options)?)
}

/// The reference's motion as the diagnosis estimates it, or by a scheme, at least at 200 Hz and
/// twice the IMU's rate.
fn track(
    placement: &RecordedPlacement,
    how: &How,
    imu_rate_hz: f64,
    effects: &EffectSet,
) -> anyhow::Result<KinematicTrack> {
    let undone_hz = effects
        .get(EffectKind::ReferenceSmoothing)
        .and_then(|smoothing| smoothing.values().first().copied());
    let rate_hz = (2.0 * imu_rate_hz).max(200.0);
    let Some(scheme) = how.scheme else {
        let poses = placement.poses();
        let estimate = PoseEstimate::fit(&poses.stamps, &poses.positions, &poses.rotations)
            .context(
                "the reference's motion cannot be estimated (--scheme spline does with two poses)",
            )?;
        return Ok(undone_hz
            .map(|cutoff_hz| estimate.undoing(cutoff_hz))
            .unwrap_or(estimate)
            .track_for(imu_rate_hz));
    };
    if undone_hz.is_some() {
        bail!("--scheme {scheme} cannot undo reference_smoothing; leave --scheme out");
    }
    differentiated(
        &placement.trajectory()?,
        scheme,
        rate_hz,
        how.learned.as_ref(),
    )
}

/// The motion by a scheme and what networks add to it, on a grid from the first frame to the last.
fn differentiated(
    trajectory: &SensorTrajectory,
    scheme: Scheme,
    least_rate_hz: f64,
    networks: Option<&LearnedSimulator>,
) -> anyhow::Result<KinematicTrack> {
    let (start, seconds) = (trajectory.start(), trajectory.end() - trajectory.start());
    // A whole number of intervals, so that the grid ends where the reference does.
    let rate_hz = (seconds * least_rate_hz).ceil().max(1.0) / seconds;
    let grid = uniform_stamps(start, trajectory.end(), rate_hz)?;
    let mut motion = simulate_kinematics(trajectory, scheme, &grid)?;
    if let Some(networks) = networks {
        motion = networks.correct(&SiteMotion::rigid(trajectory, scheme)?, &motion)?;
    }
    Ok(track_in_sensor_axes(&motion, rate_hz))
}

/// The white noise that the messages declare, none where it is unknown: density = sigma /
/// sqrt(rate).
fn declared(placement: &RecordedPlacement, rate_hz: f64) -> DeclaredNoise {
    let [accel_density, gyro_density] = placement
        .declared()
        .map(|sigma| sigma.unwrap_or(0.0) / rate_hz.sqrt());
    DeclaredNoise {
        accel_density,
        gyro_density,
    }
}

/// Mean rate of stamps in Hz, losses counted by how many medians of the intervals they span: the
/// rate that a diagnosis of them goes by.
fn rate(stamps: &[Stamp]) -> f64 {
    let mut stamps = stamps.to_vec();
    stamps.sort();
    stamps.dedup();
    let intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = intervals.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(median) = sorted.get(sorted.len() / 2) else {
        return 1.0;
    };
    let steps: f64 = intervals
        .iter()
        .map(|interval| (interval / median).round().max(1.0))
        .sum();
    steps / (stamps[stamps.len() - 1] - stamps[0])
}

/// What a user should know of samples that the reference does not cover.
fn outside(placement: &RecordedPlacement) -> Option<String> {
    let (start, end) = placement.span();
    let covered =
        |message: &&Imu| (start..=end).contains(&Stamp::from_nanos(message.header.stamp.nanos()));
    let missing = placement.measured.len() - placement.measured.iter().filter(covered).count();
    (missing > 0).then(|| {
        format!("{missing} messages lie outside the reference; they hold what its ends read")
    })
}
