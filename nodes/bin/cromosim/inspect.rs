//! `cromosim inspect`: what is in a motion, body, trajectory or bag file, found out from its
//! content.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::bail;
use clap::Args;
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, Joint, ShapedBody};
use cromosim_motion::{
    MotionError, MotionFormat, MotionOptions, PoseAxes, PoseFile, PoseTrack, PoseView, SmplMotion,
    open_poses, read_motion_for,
};
use cromosim_recording::datasets::{DatasetFiles, DatasetFormat, DatasetRecording, open_dataset};
use cromosim_recording::rigid::{RigidFormat, sniff_rigid};
use cromosim_spatial::Stamp;

use crate::body;
use crate::convert::{Content, source};
use crate::motion_arguments::MotionArguments;

/// Say what is in a file
#[derive(Args)]
pub struct Arguments {
    /// Motion (BVH, ASF/AMC, C3D, TRC, AMASS, video estimates), body (SMPL npz or pickle),
    /// trajectory or IMU series (TUM, EuRoC, CSV), recording of a data set (BROAD, TotalCapture,
    /// PAMAP2, RealWorld, phone and watch), or bag (.mcap, rosbag2 directory)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Body model (npz or pickle) that motions are read for, rather than the embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    #[command(flatten)]
    motion: MotionArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let options = arguments.motion.options()?;
    let model = body::model(arguments.body.as_ref())?;
    for path in &arguments.files {
        inspect(path, &model, &options)?;
    }
    Ok(())
}

fn inspect(path: &Path, model: &Arc<BodyModel>, options: &MotionOptions) -> anyhow::Result<()> {
    if path.is_dir() {
        return inspect_bag(path);
    }
    let head = source::head(path)?;
    match head.as_slice() {
        [0x89, b'M', b'C', b'A', b'P', ..] => inspect_bag(path),
        [] => bail!("{}: the file is empty", path.display()),
        _ if let Some((format, recording)) = open_dataset(path, &DatasetFiles::default())? => {
            inspect_recording(path, format, &recording);
            Ok(())
        }
        _ => match open_poses(path, PoseView::World) {
            Err(MotionError::BodyFile { .. }) => inspect_body(path),
            Err(error) => Err(error.into()),
            Ok(Some(file)) => inspect_poses(file, model, options),
            Ok(None) => match sniff_rigid(&head).filter(|_| MotionFormat::of(&head).is_none()) {
                Some(format) => inspect_rigid(path, format),
                None => inspect_motion(path, model, options),
            },
        },
    }
}

/// A trajectory or an IMU series.
fn inspect_rigid(path: &Path, format: RigidFormat) -> anyhow::Result<()> {
    let Some(content) = source::rigid(path, &source::bytes(path)?)? else {
        bail!("{}: the file changed", path.display())
    };
    let kind = match format {
        RigidFormat::Tum => "trajectory (TUM)",
        RigidFormat::EurocGroundTruth => "trajectory (EuRoC ground truth)",
        RigidFormat::PoseCsv => "trajectory (table with a header)",
        RigidFormat::EurocImu => "IMU series (EuRoC)",
        RigidFormat::ImuCsv => "IMU series (table with a header)",
    };
    let (stamps, more) = match &content {
        Content::Poses(poses) => {
            let length: f64 = poses
                .trajectory
                .positions
                .windows(2)
                .map(|pair| (pair[1] - pair[0]).norm())
                .sum();
            let length = length.abs(); // the sum of nothing is -0
            (&poses.trajectory.stamps, format!("path of {length:.2} m"))
        }
        Content::Imu(series) => {
            let mean = |vectors: &[nalgebra::Vector3<f64>]| {
                vectors.iter().map(|v| v.norm()).sum::<f64>() / vectors.len() as f64
            };
            let (force, rate) = (mean(&series.specific_force), mean(&series.angular_velocity));
            (
                &series.stamps,
                format!(
                    "mean specific force {force:.3} m/s2, mean angular velocity {rate:.4} rad/s"
                ),
            )
        }
        Content::Motion(_) | Content::Recording(_) => return Ok(()),
    };
    let [first, last] = [stamps[0], stamps[stamps.len() - 1]];
    let rate =
        median_rate(stamps).map_or_else(String::new, |rate| format!(" at {rate:.3} Hz (median)"));
    println!(
        "{}: {kind}, {} rows{rate}, {:.3} s from {:.6} s on",
        path.display(),
        stamps.len(),
        last - first,
        first.as_seconds()
    );
    println!("  {more}");
    Ok(())
}

fn inspect_recording(path: &Path, format: DatasetFormat, recording: &DatasetRecording) {
    let many = if recording.imus.len() == 1 { "" } else { "s" };
    println!(
        "{}: recording of {format}, {} IMU{many} at {:.3} Hz",
        path.display(),
        recording.imus.len(),
        recording.rate_hz
    );
    for imu in &recording.imus {
        let stamps = &imu.series.stamps;
        let seconds = stamps
            .first()
            .zip(stamps.last())
            .map_or(0.0, |(first, last)| *last - *first);
        let reference = recording
            .references
            .iter()
            .find(|(name, _)| *name == imu.placement);
        let reference = reference.map_or_else(String::new, |(_, poses)| {
            format!(", reference of {} poses", poses.stamps.len())
        });
        let left_out = if imu.rows_left_out > 0 {
            format!(", {} rows left out", imu.rows_left_out)
        } else {
            String::new()
        };
        println!(
            "  {}: {} readings, {seconds:.3} s{reference}{left_out}",
            imu.placement,
            stamps.len()
        );
    }
    let mut lengths: BTreeMap<&str, f64> = BTreeMap::new();
    for span in &recording.activities {
        *lengths.entry(&span.activity).or_default() += span.end - span.start;
    }
    if !lengths.is_empty() {
        let lengths: Vec<String> = lengths
            .iter()
            .map(|(activity, seconds)| format!("{activity} {seconds:.1} s"))
            .collect();
        println!("  {}", lengths.join(", "));
    }
}

fn median_rate(stamps: &[Stamp]) -> Option<f64> {
    let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_unstable_by(f64::total_cmp);
    intervals
        .get(intervals.len() / 2)
        .map(|interval| interval.recip())
}

fn inspect_bag(path: &Path) -> anyhow::Result<()> {
    let reader = BagReader::open(path)?;
    let summary = reader.summary();
    println!(
        "{}: bag, {} messages, {:.3} s",
        path.display(),
        summary.message_count(),
        summary.duration()
    );
    let width = summary
        .topics
        .iter()
        .map(|counted| counted.topic.name.len())
        .max()
        .unwrap_or(0);
    for counted in &summary.topics {
        let (name, rate) = (&counted.topic.name, summary.rate(&counted.topic.name));
        let rate = rate.map_or_else(String::new, |rate| format!("{rate:9.2} Hz"));
        println!(
            "  {name:width$}  {:8} {rate:12}  {}",
            counted.message_count, counted.topic.type_name
        );
    }
    for attachment in reader.attachments() {
        println!(
            "  attachment {} ({} bytes)",
            attachment.name,
            attachment.content.len()
        );
    }
    for (name, values) in reader.metadata_records() {
        println!(
            "  metadata {name}: {}",
            values.keys().cloned().collect::<Vec<_>>().join(", ")
        );
    }
    Ok(())
}

fn inspect_body(path: &Path) -> anyhow::Result<()> {
    let model = BodyModel::read(path)?;
    let body = ShapedBody::new(model.clone(), &[])?;
    let heights = body.rest_vertices().iter().map(|vertex| vertex.y);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    println!(
        "{}: body {}, {} vertices, {} triangles, {} joints, {} betas, gender {}, {:.3} m tall",
        path.display(),
        model.id(),
        model.vertex_count(),
        model.faces().len(),
        Joint::ALL.len(),
        model.beta_count(),
        model.gender().map_or("not stated", |gender| gender.name()),
        high - low
    );
    Ok(())
}

fn inspect_poses(
    file: PoseFile,
    model: &Arc<BodyModel>,
    options: &MotionOptions,
) -> anyhow::Result<()> {
    println!(
        "{}: motion, {} in SMPL's joints, {}",
        file.path.display(),
        file.format,
        people(file.tracks.len())
    );
    for track in &file.tracks {
        println!("  {}", person(track));
    }
    let source = options
        .source_body
        .as_deref()
        .map(BodyModel::read)
        .transpose()?;
    match file.into_motion(model, source.as_ref(), options) {
        Ok(motion) => {
            if let Some(report) = &motion.poses {
                println!(
                    "  played: person {}, {:.3} s at {:.4} Hz, {report}",
                    report.person,
                    motion.duration_s(),
                    motion.rate_hz
                );
            }
            println!("  {}", extent(&motion));
        }
        // What it is, is said; that it lacks a rate, for instance, is for whoever plays it to
        // settle.
        Err(error) => println!("  not played as it is: {error}"),
    }
    Ok(())
}

fn people(count: usize) -> String {
    if count == 1 {
        "one person".to_owned()
    } else {
        format!("{count} people")
    }
}

/// A line about one person of a pose file.
fn person(track: &PoseTrack) -> String {
    let betas = track.mean_betas();
    let up = match track.axes {
        PoseAxes::Camera => "camera axes (x right, y down, z forward)".to_owned(),
        PoseAxes::Up(up) => format!(
            "up ({:.2}, {:.2}, {:.2})",
            up.x + 0.0,
            up.y + 0.0,
            up.z + 0.0
        ),
        PoseAxes::Detect => "world axes, up not stated".to_owned(),
    };
    let ids = track
        .frame_ids
        .as_ref()
        .and_then(|ids| Some(format!(" ({} to {})", ids.first()?, ids.last()?)));
    format!(
        "person {}: {} frames{}, {}, gender {}, {up}{}, {} betas of {}{}",
        track.person,
        track.rotations.len(),
        ids.unwrap_or_default(),
        track.rate_hz.map_or_else(
            || "rate not stated".to_owned(),
            |rate_hz| format!("{rate_hz} Hz")
        ),
        track.gender.map_or("not stated", |gender| gender.name()),
        if track.trans.is_some() {
            ""
        } else {
            ", no trajectory"
        },
        betas.len(),
        track.shape_space,
        if betas.is_empty() {
            String::new()
        } else {
            format!(" {betas:.2?}")
        },
    )
}

fn inspect_motion(
    path: &Path,
    model: &Arc<BodyModel>,
    options: &MotionOptions,
) -> anyhow::Result<()> {
    let motion = read_motion_for(path, model, options)?;
    println!(
        "{}: motion, {} frames at {:.4} Hz, {:.3} s",
        path.display(),
        motion.frames.len(),
        motion.rate_hz,
        motion.duration_s()
    );
    if let Some(report) = &motion.report {
        println!("  {report}");
        println!(
            "  betas {:.2?}, bone lengths within {:.1} mm (RMS)",
            report.betas,
            1e3 * report.bone_length_rms_m
        );
    }
    if let Some(report) = &motion.markers {
        println!("  {report}");
        println!("  betas {:.2?}", report.betas);
        for (what, labels) in [("absent", &report.absent), ("unknown", &report.unknown)]
            .iter()
            .filter(|(_, labels)| !labels.is_empty())
        {
            println!("  {what}: {}", labels.join(", "));
        }
    }
    println!("  {}", extent(&motion));
    Ok(())
}

/// How far the pelvis goes.
fn extent(motion: &SmplMotion) -> String {
    let positions: Vec<_> = motion
        .frames
        .iter()
        .map(|frame| frame.root_position)
        .collect();
    let length: f64 = positions
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .sum();
    let heights = positions.iter().map(|position| position.z);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
        (low.min(z), high.max(z))
    });
    format!("pelvis: path of {length:.2} m, {low:.2} to {high:.2} m above the floor")
}
