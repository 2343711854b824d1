//! Trajectories, IMU series and data sets' recordings as the recordings that other nodes and
//! commands know: `/reference/NAME`, `/imu/NAME/data_raw` and, where the device gave orientations,
//! `/imu/NAME/data`.

use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use cromosim_bag::{BagOptions, BagWriter, Compression};
use cromosim_motion::datasets::{DatasetFiles, DatasetRecording, open_dataset};
use cromosim_motion::rigid::{
    EurocGroundTruth, ImuSeries, PoseTrajectory, RigidFormat, parse_euroc_ground_truth,
    parse_euroc_imu, parse_imu_csv, parse_pose_csv, parse_tum, sniff_rigid,
};
use cromosim_msgs::geometry_msgs::{Pose, PoseStamped};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;
use nalgebra::UnitQuaternion;

/// Larger tables are refused: a day of readings at 1 kHz is about as large.
const MAX_BYTES: u64 = 16 << 30;
/// A data set's stamps that begin before this are moved: TF takes 0 for "the latest".
const BEGINS: Stamp = Stamp::from_nanos(1_000_000_000);

/// What is known of one placement.
pub struct Placed<'a> {
    /// Its name.
    pub name: &'a str,
    /// The reference.
    pub poses: Option<&'a PoseTrajectory>,
    /// What was measured.
    pub series: Option<&'a ImuSeries>,
    /// world_from_sensor of each reading as the device estimated it, or none.
    pub orientations: &'a [UnitQuaternion<f64>],
}

/// When the first message is; none without any.
pub fn begins(placements: &[Placed<'_>]) -> Option<Stamp> {
    in_order_of_time(placements)
        .first()
        .map(|(first, ..)| *first)
}

/// Seconds by which a data set's stamps are moved, where they begin at 0.
pub fn later(first: Stamp) -> f64 {
    if first < BEGINS { BEGINS - first } else { 0.0 }
}

/// Writes everything in order of time, its stamps moved by `later` s.
///
/// # Errors
/// What the bag refuses.
pub fn write(bag: &mut BagWriter, placements: &[Placed<'_>], later: f64) -> anyhow::Result<()> {
    let topics: Vec<Topics> = placements.iter().map(Topics::of).collect();
    for (stamp, number, what) in in_order_of_time(placements) {
        topics[number].write(bag, &placements[number], what, stamp.plus_seconds(later))?;
    }
    Ok(())
}

/// A whole file.
///
/// # Errors
/// A file that cannot be read, or is larger than 16 GiB.
pub fn bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes));
    read.with_context(|| format!("{}: cannot be read", path.display()))?;
    if bytes.len() as u64 > MAX_BYTES {
        bail!(
            "{}: more than {MAX_BYTES} bytes; cut the file into parts",
            path.display()
        );
    }
    Ok(bytes)
}

/// A trajectory of a rigid body, or an IMU's series.
#[derive(Debug)]
pub enum Rigid {
    /// Poses, and what else EuRoC's ground truth says.
    Poses(EurocGroundTruth),
    /// Readings.
    Imu(ImuSeries),
}

/// TUM, EuRoC and tables; `None` for anything else. `name` stands in messages.
///
/// # Errors
/// What is wrong with the file, with its line.
pub fn parse_rigid(bytes: &[u8], name: &str) -> anyhow::Result<Option<Rigid>> {
    let poses = |trajectory| {
        Rigid::Poses(EurocGroundTruth {
            trajectory,
            ..EurocGroundTruth::default()
        })
    };
    let Some(format) = sniff_rigid(bytes) else {
        return Ok(None);
    };
    Ok(Some(match format {
        RigidFormat::Tum => poses(parse_tum(bytes, name)?),
        RigidFormat::PoseCsv => poses(parse_pose_csv(bytes, name)?),
        RigidFormat::EurocGroundTruth => Rigid::Poses(parse_euroc_ground_truth(bytes, name)?),
        RigidFormat::EurocImu => Rigid::Imu(parse_euroc_imu(bytes, name)?),
        RigidFormat::ImuCsv => Rigid::Imu(parse_imu_csv(bytes, name)?),
    }))
}

/// The file as a bag at `out`; false where it is neither a data set's recording, nor a trajectory,
/// nor an IMU series. A rigid body is called `body`.
///
/// # Errors
/// What is wrong with the file.
pub fn to_bag(path: &Path, out: &Path) -> anyhow::Result<bool> {
    let name = path.display().to_string();
    if let Some((_, recording)) = open_dataset(path, &DatasetFiles::default())? {
        create(&of_dataset(&recording), true, &name, out)?;
        return Ok(true);
    }
    let body = |poses, series| {
        [Placed {
            name: "body",
            poses,
            series,
            orientations: &[],
        }]
    };
    match parse_rigid(&bytes(path)?, &name)? {
        None => return Ok(false),
        Some(Rigid::Poses(poses)) => {
            create(&body(Some(&poses.trajectory), None), false, &name, out)?
        }
        Some(Rigid::Imu(series)) => create(&body(None, Some(&series)), false, &name, out)?,
    }
    Ok(true)
}

fn create(
    placements: &[Placed<'_>],
    of_dataset: bool,
    name: &str,
    out: &Path,
) -> anyhow::Result<()> {
    let Some(first) = begins(placements) else {
        bail!("{name}: no pose and no reading")
    };
    let mut bag = BagWriter::create(
        out,
        BagOptions {
            compression: Compression::Zstd,
            ..BagOptions::default()
        },
    )?;
    write(
        &mut bag,
        placements,
        if of_dataset { later(first) } else { 0.0 },
    )?;
    bag.finish()?;
    Ok(())
}

/// Every IMU with the reference of its name.
pub fn of_dataset(recording: &DatasetRecording) -> Vec<Placed<'_>> {
    let reference = |name: &str| {
        recording
            .references
            .iter()
            .find(|(of, _)| of == name)
            .map(|(_, poses)| poses)
    };
    let placed = recording.imus.iter().map(|imu| Placed {
        name: &imu.placement,
        poses: reference(&imu.placement),
        series: Some(&imu.series),
        orientations: &imu.world_from_sensor,
    });
    placed.collect()
}

/// What was done when, of a recording whose stamps are `later` by so many seconds: start_ns,
/// end_ns, activity.
pub fn activities_csv(recording: &DatasetRecording, later: f64) -> String {
    let mut table = "start_ns,end_ns,activity\n".to_owned();
    for span in &recording.activities {
        let (start, end) = (
            span.start.plus_seconds(later).nanos,
            span.end.plus_seconds(later).nanos,
        );
        // Writing into a string cannot fail.
        let _ = writeln!(table, "{start},{end},{}", span.activity);
    }
    table
}

#[derive(Clone, Copy)]
enum What {
    Pose(usize),
    Reading(usize),
}

/// Of one time, the placements in their order, poses first.
fn in_order_of_time(placements: &[Placed<'_>]) -> Vec<(Stamp, usize, What)> {
    let mut all = Vec::new();
    for (number, placement) in placements.iter().enumerate() {
        let poses = placement
            .poses
            .into_iter()
            .flat_map(|poses| poses.stamps.iter().enumerate());
        all.extend(poses.map(|(index, stamp)| (*stamp, number, What::Pose(index))));
        let readings = placement
            .series
            .into_iter()
            .flat_map(|series| series.stamps.iter().enumerate());
        all.extend(readings.map(|(index, stamp)| (*stamp, number, What::Reading(index))));
    }
    all.sort_by_key(|(stamp, ..)| *stamp);
    all
}

/// The names that one placement's messages go by.
struct Topics {
    reference: String,
    raw: String,
    full: String,
    frame: String,
    world: String,
}

impl Topics {
    fn of(placement: &Placed<'_>) -> Self {
        let name = placement.name;
        let world = placement
            .poses
            .map(|poses| poses.frame.as_str())
            .filter(|frame| !frame.is_empty())
            .unwrap_or("world");
        Self {
            reference: format!("/reference/{name}"),
            raw: format!("/imu/{name}/data_raw"),
            full: format!("/imu/{name}/data"),
            frame: format!("{name}_imu"),
            world: world.to_owned(),
        }
    }

    fn write(
        &self,
        bag: &mut BagWriter,
        placement: &Placed<'_>,
        what: What,
        stamp: Stamp,
    ) -> anyhow::Result<()> {
        match (what, placement.poses, placement.series) {
            (What::Pose(index), Some(poses), _) => {
                let pose = Pose {
                    position: poses.positions[index].into(),
                    orientation: poses.rotations[index].into(),
                };
                bag.write(
                    &self.reference,
                    stamp,
                    &PoseStamped {
                        header: Header::new(stamp.nanos, self.world.as_str()),
                        pose,
                    },
                )?;
            }
            (What::Reading(index), _, Some(series)) => {
                let message = imu_message(series, index, stamp, &self.frame);
                bag.write(&self.raw, stamp, &message)?;
                if let Some(orientation) = placement.orientations.get(index) {
                    let covariance = [0.0; 9];
                    bag.write(
                        &self.full,
                        stamp,
                        &Imu {
                            orientation: (*orientation).into(),
                            orientation_covariance: covariance,
                            ..message
                        },
                    )?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Covariances of zeros: the files do not say how large the noise is.
fn imu_message(series: &ImuSeries, index: usize, stamp: Stamp, frame_id: &str) -> Imu {
    let mut message = Imu {
        header: Header::new(stamp.nanos, frame_id),
        angular_velocity: series.angular_velocity[index].into(),
        linear_acceleration: series.specific_force[index].into(),
        ..Imu::default()
    };
    // REP-145: there is no orientation.
    message.orientation_covariance[0] = -1.0;
    message
}
