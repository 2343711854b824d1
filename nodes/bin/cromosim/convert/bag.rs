//! Trajectories, IMU series, data sets' recordings and motions as bags that the other commands and `replay` read.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use anyhow::{anyhow, bail};
use cromosim_bag::{BagOptions, BagWriter, Compression};
use cromosim_body::BodyModel;
use cromosim_imu::Placement;
use cromosim_motion::SmplMotion;
use cromosim_motion::datasets::DatasetRecording;
use cromosim_motion::rigid::{ImuSeries, PoseTrajectory};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::geometry_msgs::{Pose, PoseStamped};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;
use nalgebra::UnitQuaternion;

use super::{Arguments, Content};
use crate::simulate::BEGINS;

/// What is known of one placement.
struct Placed<'a> {
    name: &'a str,
    poses: Option<&'a PoseTrajectory>,
    series: Option<&'a ImuSeries>,
    /// world_from_sensor of each reading as the device estimated it, or none.
    orientations: &'a [UnitQuaternion<f64>],
}

/// Writes `/reference/NAME` and `/imu/NAME/data_raw` in order of time, and `/imu/NAME/data` where the device gave orientations; of a motion
/// `/smpl/pose`.
pub fn write(content: &Content, beside: Option<&ImuSeries>, model: &BodyModel, arguments: &Arguments) -> anyhow::Result<()> {
    let name = arguments.name.as_deref().unwrap_or("body");
    let placed = |poses, series| Placed { name, poses, series, orientations: &[] };
    if beside.is_some() && !matches!(content, Content::Poses(_)) {
        bail!("--imu goes beside a trajectory, but {} is {}", arguments.input.display(), content.name());
    }
    let (placements, activities) = match content {
        Content::Motion(motion) => return motion_bag(motion, model, "convert", &arguments.out, arguments.force),
        Content::Poses(poses) => (vec![placed(Some(&poses.trajectory), beside)], None),
        Content::Imu(series) => (vec![placed(None, Some(series))], None),
        Content::Recording(recording) => (of_dataset(recording), Some(recording)),
    };
    for placement in &placements {
        // A placement's name is what a topic's part may be.
        Placement::at_site(placement.name, "left_watch", 1.0).map_err(|(_, problem)| anyhow!("--name {}: {problem}", placement.name))?;
    }
    let order = in_order_of_time(&placements);
    let Some((first, ..)) = order.first() else { bail!("{}: no pose and no reading", arguments.input.display()) };
    // A data set's stamps may begin at 0, which TF takes for "the latest".
    let later = if activities.is_some() && *first < BEGINS { BEGINS - *first } else { 0.0 };
    let mut bag = create(&arguments.out, "convert", None, arguments.force)?;
    if let Some(recording) = activities.filter(|recording| !recording.activities.is_empty()) {
        bag.attach("activities.csv", "text/csv", first.plus_seconds(later), activities_csv(recording, later).as_bytes())?;
    }
    let topics: Vec<Topics> = placements.iter().map(Topics::of).collect();
    for (stamp, number, what) in order {
        topics[number].write(&mut bag, &placements[number], what, stamp.plus_seconds(later))?;
    }
    bag.finish()?;
    Ok(())
}

/// Writes a motion's poses and their confidence as `/smpl/pose`, which `replay` plays.
pub fn motion_bag(motion: &SmplMotion, model: &BodyModel, command: &str, out: &Path, replace: bool) -> anyhow::Result<()> {
    let mut bag = create(out, command, Some(model), replace)?;
    for (index, pose) in motion.frames.iter().enumerate() {
        let stamp = BEGINS.plus_seconds(index as f64 / motion.rate_hz);
        let mut message = SmplPose {
            header: Header::new(stamp.nanos, "world"),
            body_id: "0".to_owned(),
            gender: motion.gender.name().to_owned(),
            betas: motion.betas.clone(),
            shape_space: motion.shape_space.name().to_owned(),
            confidence: motion.confidence.as_ref().map_or(1.0, |values| values[index]),
            ..SmplPose::default()
        };
        message.set_root_and_rotations(pose.root_position, &pose.local_rotations);
        bag.write("/smpl/pose", stamp, &message)?;
    }
    bag.finish()?;
    Ok(())
}

fn create(out: &Path, command: &str, model: Option<&BodyModel>, replace: bool) -> anyhow::Result<BagWriter> {
    let mut bag = BagWriter::create(out, BagOptions { compression: Compression::Zstd, replace, ..BagOptions::default() })?;
    let entry = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    let mut metadata = BTreeMap::from([entry("version", env!("CARGO_PKG_VERSION")), entry("command", command)]);
    metadata.extend(model.map(|model| entry("body", model.id())));
    bag.write_metadata("cromosim", metadata)?;
    Ok(bag)
}

/// Every IMU with the reference of its name.
fn of_dataset(recording: &DatasetRecording) -> Vec<Placed<'_>> {
    let reference = |name: &str| recording.references.iter().find(|(of, _)| of == name).map(|(_, poses)| poses);
    let placed = recording.imus.iter().map(|imu| Placed {
        name: &imu.placement,
        poses: reference(&imu.placement),
        series: Some(&imu.series),
        orientations: &imu.world_from_sensor,
    });
    placed.collect()
}

fn activities_csv(recording: &DatasetRecording, later: f64) -> String {
    let mut table = "start_ns,end_ns,activity\n".to_owned();
    for span in &recording.activities {
        let (start, end) = (span.start.plus_seconds(later).nanos, span.end.plus_seconds(later).nanos);
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
        let poses = placement.poses.into_iter().flat_map(|poses| poses.stamps.iter().enumerate());
        all.extend(poses.map(|(index, stamp)| (*stamp, number, What::Pose(index))));
        let readings = placement.series.into_iter().flat_map(|series| series.stamps.iter().enumerate());
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
        let world = placement.poses.map(|poses| poses.frame.as_str()).filter(|frame| !frame.is_empty()).unwrap_or("world");
        Self {
            reference: format!("/reference/{name}"),
            raw: format!("/imu/{name}/data_raw"),
            full: format!("/imu/{name}/data"),
            frame: format!("{name}_imu"),
            world: world.to_owned(),
        }
    }

    fn write(&self, bag: &mut BagWriter, placement: &Placed<'_>, what: What, stamp: Stamp) -> anyhow::Result<()> {
        match (what, placement.poses, placement.series) {
            (What::Pose(index), Some(poses), _) => {
                let pose = Pose { position: poses.positions[index].into(), orientation: poses.rotations[index].into() };
                bag.write(&self.reference, stamp, &PoseStamped { header: Header::new(stamp.nanos, self.world.as_str()), pose })?;
            }
            (What::Reading(index), _, Some(series)) => {
                let message = imu_message(series, index, stamp, &self.frame);
                bag.write(&self.raw, stamp, &message)?;
                if let Some(orientation) = placement.orientations.get(index) {
                    let covariance = [0.0; 9];
                    bag.write(
                        &self.full,
                        stamp,
                        &Imu { orientation: (*orientation).into(), orientation_covariance: covariance, ..message },
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
