//! `cromosim inspect`: what is in a motion, body, trajectory or bag file, found out from its
//! content.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use cromosim_bag::{BagReader, Cadence};
use cromosim_body::Joint;
use cromosim_motion::{MotionOptions, PoseAxes, SkeletonDraft, SmplMotion, read_skeleton};
use cromosim_msgs::printable;
use cromosim_recording::datasets::{DatasetFormat, DatasetRecording};
use cromosim_recording::inspect::{
    BodyInspection, Inspection, PersonInspection, PosesInspection, RigidExtent, RigidInspection,
    inspect, path_length,
};
use cromosim_recording::pose_topics;
use cromosim_spatial::Stamp;

use crate::body;
use crate::files::{refuse_existing, write_whole};
use crate::inspect_json::{self, rigid_kind};
use crate::motion_arguments::MotionArguments;
use crate::output::say;
use crate::progress::working;

/// Part of a bag's time below which a topic's own span is said.
const MOST_OF_BAG: f64 = 0.98;
/// Jitter from which on it is said, as a part of the interval.
const LEAST_JITTER: f64 = 0.005;

/// Say what is in a file
#[derive(Args)]
pub struct Arguments {
    /// Motions, bodies, trajectories, IMU series, recordings or bags
    ///
    /// Motion (BVH, ASF/AMC, MVNX, C3D, TRC, AMASS, video estimates), body (SMPL npz or pickle),
    /// trajectory or IMU series (TUM, EuRoC, CSV), recording of a data set (BROAD, TotalCapture,
    /// PAMAP2, RealWorld, phone and watch) or of a motion capture system or sensor (OptiTrack,
    /// Vicon, Movella DOT, MT Manager), or bag (.mcap, rosbag2 directory)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Body model (npz or pickle) that motions are read for
    ///
    /// Rather than the embedded one
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// Of a BVH or AMC file with joint names of its own: draft a skeleton map
    ///
    /// The draft (YAML) is for you to check, and then for --skeleton-map of every command that reads
    /// the file
    #[arg(long, value_name = "FILE")]
    skeleton_map_draft: Option<PathBuf>,
    /// Replace the draft where it exists
    #[arg(long, requires = "skeleton_map_draft")]
    force: bool,
    /// Print JSON: an object and a line for each file
    #[arg(long, conflicts_with = "skeleton_map_draft")]
    json: bool,
    #[command(flatten)]
    motion: MotionArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let options = arguments.motion.options()?;
    if let Some(out) = &arguments.skeleton_map_draft {
        return draft(arguments, &options, out);
    }
    let model = body::model(arguments.body.as_deref())?;
    for path in &arguments.files {
        let doing = format!("reading {}", path.display());
        let found = working(&doing, || inspect(path, &model, &options))?;
        if arguments.json {
            say!("{}", inspect_json::of(path, &found)?)?;
            continue;
        }
        match found {
            Inspection::Bag(reader) => print_bag(path, &reader)?,
            Inspection::Recording(format, recording) => print_recording(path, format, &recording)?,
            Inspection::Rigid(rigid) => print_rigid(path, &rigid)?,
            Inspection::Body(body) => print_body(path, &body)?,
            Inspection::Poses(poses) => print_poses(path, &poses)?,
            Inspection::Motion(motion) => print_motion(path, &motion)?,
        }
    }
    Ok(())
}

/// Writes a draft of the file's skeleton map.
fn draft(arguments: &Arguments, options: &MotionOptions, out: &Path) -> anyhow::Result<()> {
    let [path] = arguments.files.as_slice() else {
        bail!("--skeleton-map-draft takes one file; a map fits all files of one skeleton");
    };
    refuse_existing(out, arguments.force)?;
    let clip = read_skeleton(path, options)?;
    let name = out.file_stem().unwrap_or_default().to_string_lossy();
    let draft = SkeletonDraft::of(&clip, &name)?;
    write_whole(out, arguments.force, |file| {
        file.write_all(draft.yaml.as_bytes())
            .with_context(|| format!("{}: cannot be written", out.display()))
    })?;
    let out = out.display();
    say!(
        "{out}: a draft with {} of SMPL's joints; check it, left and right above all",
        draft.found
    )?;
    if draft.missing.is_empty() {
        say!("  then: --skeleton-map {out}")
    } else {
        let missing = draft.missing.iter().map(ToString::to_string);
        let missing: Vec<String> = missing.collect();
        say!("  to be added: {}", missing.join(", "))
    }
}

fn print_rigid(path: &Path, rigid: &RigidInspection) -> anyhow::Result<()> {
    let kind = rigid_kind(rigid.format);
    let rate = rigid
        .median_rate_hz
        .map_or_else(String::new, |rate| format!(" at {rate:.3} Hz (median)"));
    say!(
        "{}: {kind}, {} rows{rate}, {:.3} s from {:.6} s on",
        path.display(),
        rigid.rows,
        rigid.duration_s,
        rigid.first.as_seconds()
    )?;
    match rigid.extent {
        RigidExtent::Path(length) => say!("  path of {length:.2} m")?,
        RigidExtent::Means {
            specific_force,
            angular_velocity,
        } => say!(
            "  mean specific force {specific_force:.3} m/s2, mean angular velocity {angular_velocity:.4} rad/s"
        )?,
    }
    Ok(())
}

fn print_recording(
    path: &Path,
    format: DatasetFormat,
    recording: &DatasetRecording,
) -> anyhow::Result<()> {
    let (count, what) = match recording.imus.len() {
        0 => (recording.references.len(), "reference"),
        imus => (imus, "IMU"),
    };
    say!(
        "{}: recording of {format}, {count} {what}{} at {:.3} Hz",
        path.display(),
        if count == 1 { "" } else { "s" },
        recording.rate_hz
    )?;
    for imu in &recording.imus {
        let stamps = &imu.series.stamps;
        let seconds = seconds_of(stamps);
        let reference = recording.reference(&imu.placement);
        let reference = reference.map_or_else(String::new, |poses| {
            format!(", reference of {} poses", poses.stamps.len())
        });
        let left_out = if imu.rows_left_out > 0 {
            format!(", {} rows left out", imu.rows_left_out)
        } else {
            String::new()
        };
        say!(
            "  {}: {} readings, {seconds:.3} s{reference}{left_out}",
            imu.placement,
            stamps.len()
        )?;
    }
    let alone = recording.placements().split_off(recording.imus.len());
    let alone = alone.into_iter();
    for (name, poses) in alone.filter_map(|name| Some((name, recording.reference(name)?))) {
        say!(
            "  {name}: {} poses, {:.3} s, path of {:.2} m",
            poses.stamps.len(),
            seconds_of(&poses.stamps),
            path_length(&poses.positions)
        )?;
    }
    for note in &recording.notes {
        say!("  {}", printable(note))?;
    }
    print_activities(recording)
}

/// From the first to the last, s.
fn seconds_of(stamps: &[Stamp]) -> f64 {
    let ends = stamps.first().zip(stamps.last());
    ends.map_or(0.0, |(first, last)| *last - *first)
}

/// How long each activity was done in all.
fn print_activities(recording: &DatasetRecording) -> anyhow::Result<()> {
    let mut lengths: BTreeMap<&str, f64> = BTreeMap::new();
    for span in &recording.activities {
        *lengths.entry(&span.activity).or_default() += span.end - span.start;
    }
    if !lengths.is_empty() {
        let lengths = lengths.iter();
        let lengths: Vec<String> = lengths
            .map(|(activity, seconds)| format!("{activity} {seconds:.1} s"))
            .collect();
        say!("  {}", lengths.join(", "))?;
    }
    Ok(())
}

fn print_bag(path: &Path, reader: &BagReader) -> anyhow::Result<()> {
    let summary = reader.summary();
    say!(
        "{}: bag, {} messages, {:.3} s",
        path.display(),
        summary.message_count(),
        summary.duration()
    )?;
    let cadences = reader.cadences()?;
    let names = summary.topics.iter();
    let widths = names.map(|counted| printable(&counted.topic.name).chars().count());
    let width = widths.max().unwrap_or(0);
    for counted in &summary.topics {
        let cadence = cadences.get(&counted.topic.name);
        let name = printable(&counted.topic.name);
        let type_name = printable(&counted.topic.type_name);
        let rate = cadence.map_or_else(String::new, |own| format!("{:9.2} Hz", own.rate_hz));
        let regularity =
            cadence.map_or_else(String::new, |own| regularity(own, summary.duration()));
        say!(
            "  {name:width$}  {:8} {rate:12}  {type_name}{regularity}",
            counted.message_count
        )?;
    }
    print_references(reader)?;
    for attachment in reader.attachments() {
        say!(
            "  attachment {} ({} bytes)",
            printable(&attachment.name),
            attachment.content.len()
        )?;
    }
    for (name, values) in reader.metadata_records() {
        say!(
            "  metadata {}: {}",
            printable(name),
            values
                .keys()
                .filter(|key| !key.contains('.'))
                .map(|key| printable(key))
                .collect::<Vec<_>>()
                .join(", ")
        )?;
        // Of single placements.
        for (key, value) in values.iter().filter(|(key, _)| key.contains('.')) {
            say!("    {}: {}", printable(key), printable(value))?;
        }
    }
    Ok(())
}

/// The topics that can be references, and the bodies or frames that they hold.
fn print_references(reader: &BagReader) -> anyhow::Result<()> {
    for topic in pose_topics(reader)? {
        let bodies: Vec<String> = topic
            .bodies
            .iter()
            .map(|body| printable(body).into_owned())
            .collect();
        let bodies = match bodies.len() {
            0 => String::new(),
            _ => format!(":BODY of {}", bodies.join(", ")),
        };
        say!("  reference: {}{bodies}", printable(&topic.topic))?;
    }
    Ok(())
}

/// What is not even about a topic's intervals, where anything is.
fn regularity(cadence: &Cadence, bag_s: f64) -> String {
    let mut said = Vec::new();
    if cadence.span_s < MOST_OF_BAG * bag_s {
        said.push(format!("spans {:.3} s", cadence.span_s));
    }
    if cadence.jitter_s * cadence.rate_hz > LEAST_JITTER {
        said.push(format!("jitter {:.2} ms", 1e3 * cadence.jitter_s));
    }
    if cadence.gaps > 0 {
        let many = if cadence.gaps == 1 { "gap" } else { "gaps" };
        let longest = cadence.longest_gap_s;
        said.push(format!("{} {many} of up to {longest:.3} s", cadence.gaps));
    }
    said.iter().map(|part| format!(", {part}")).collect()
}

fn print_body(path: &Path, body: &BodyInspection) -> anyhow::Result<()> {
    say!(
        "{}: body {}, {} vertices, {} triangles, {} joints, {} betas, gender {}, {:.3} m tall",
        path.display(),
        body.id,
        body.vertices,
        body.triangles,
        Joint::ALL.len(),
        body.betas,
        body.gender.map_or("not stated", |gender| gender.name()),
        body.height_m
    )?;
    Ok(())
}

fn print_poses(path: &Path, poses: &PosesInspection) -> anyhow::Result<()> {
    let people = match poses.people.len() {
        1 => "one person".to_owned(),
        count => format!("{count} people"),
    };
    say!(
        "{}: motion, {} in SMPL's joints, {people}",
        path.display(),
        poses.format
    )?;
    for person in &poses.people {
        say!("  {}", person_line(person))?;
    }
    match &poses.motion {
        Ok(motion) => {
            if let Some(report) = &motion.poses {
                say!(
                    "  played: person {}, {:.3} s at {:.4} Hz, {report}",
                    report.person,
                    motion.duration_s(),
                    motion.rate_hz
                )?;
            }
            say!("  {}", extent(motion))?;
            print_oddities(motion)?;
        }
        Err(error) => say!("  not played as it is: {error}")?,
    }
    Ok(())
}

fn person_line(person: &PersonInspection) -> String {
    let up = match person.axes {
        PoseAxes::Camera => "camera axes (x right, y down, z forward)".to_owned(),
        // No negative zeros.
        PoseAxes::Up(up) => format!(
            "up ({:.2}, {:.2}, {:.2})",
            up.x + 0.0,
            up.y + 0.0,
            up.z + 0.0
        ),
        PoseAxes::Detect => "world axes, up not stated".to_owned(),
    };
    let ids = person.frame_ids.as_ref();
    let ids = ids.map(|ids| format!(" ({} to {})", ids.start(), ids.end()));
    let rate = person
        .rate_hz
        .map_or_else(|| "rate not stated".to_owned(), |hz| format!("{hz} Hz"));
    let trajectory = if person.has_trajectory {
        ""
    } else {
        ", no trajectory"
    };
    let betas = if person.betas.is_empty() {
        String::new()
    } else {
        format!(" {:.2?}", person.betas)
    };
    format!(
        "person {}: {} frames{}, {rate}, gender {}, {up}{trajectory}, {} betas of {}{betas}",
        printable(&person.person),
        person.frames,
        ids.unwrap_or_default(),
        person.gender.map_or("not stated", |gender| gender.name()),
        person.betas.len(),
        person.shape_space,
    )
}

fn print_motion(path: &Path, motion: &SmplMotion) -> anyhow::Result<()> {
    say!(
        "{}: motion, {} frames at {:.4} Hz, {:.3} s",
        path.display(),
        motion.frames.len(),
        motion.rate_hz,
        motion.duration_s()
    )?;
    if let Some(report) = &motion.report {
        say!("  {report}")?;
        say!(
            "  betas {:.2?}, bone lengths within {:.1} mm (RMS)",
            report.betas,
            1e3 * report.bone_length_rms_m
        )?;
    }
    if let Some(report) = &motion.markers {
        say!("  {report}")?;
        say!("  betas {:.2?}", report.betas)?;
        for (what, labels) in [("absent", &report.absent), ("unknown", &report.unknown)] {
            if !labels.is_empty() {
                say!("  {what}: {}", labels.join(", "))?;
            }
        }
    }
    say!("  {}", extent(motion))?;
    print_oddities(motion)
}

fn print_oddities(motion: &SmplMotion) -> anyhow::Result<()> {
    for oddity in motion.oddities() {
        say!("  {oddity}")?;
    }
    Ok(())
}

/// How far the pelvis goes.
fn extent(motion: &SmplMotion) -> String {
    let positions: Vec<_> = motion
        .frames
        .iter()
        .map(|frame| frame.root_position)
        .collect();
    let heights = positions.iter().map(|position| position.z);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
        (low.min(z), high.max(z))
    });
    format!(
        "pelvis: path of {:.2} m, {low:.2} to {high:.2} m above the floor",
        path_length(&positions)
    )
}
