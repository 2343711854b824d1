//! A trajectory and an IMU series as a recording that a diagnosis reads.

use std::collections::BTreeMap;

use anyhow::bail;
use cromosim_bag::{BagOptions, BagWriter, Compression};
use cromosim_imu::Placement;
use cromosim_motion::rigid::{ImuSeries, PoseTrajectory};
use cromosim_msgs::geometry_msgs::{Pose, PoseStamped};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

use super::{Arguments, Content};

/// Writes `/reference/NAME` and `/imu/NAME/data_raw` in order of time.
pub fn write(content: &Content, beside: Option<&ImuSeries>, arguments: &Arguments) -> anyhow::Result<()> {
    let name = &arguments.name;
    // A placement's name is what a topic's part may be.
    if let Err((_, problem)) = Placement::at_site(name, "left_watch", 1.0) {
        bail!("--name {name}: {problem}");
    }
    let (poses, series) = match (content, beside) {
        (Content::Poses(poses), beside) => (Some(&poses.trajectory), beside),
        (Content::Imu(series), None) => (None, Some(series)),
        (Content::Imu(_), Some(_)) => bail!("--imu goes beside a trajectory, but {} is an IMU series itself", arguments.input.display()),
        (Content::Motion(_), _) => bail!("{}: simulate writes a motion's IMUs into a bag", arguments.input.display()),
    };
    let options = BagOptions { compression: Compression::Zstd, replace: arguments.force, ..BagOptions::default() };
    let mut bag = BagWriter::create(&arguments.out, options)?;
    let entry = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    let metadata = BTreeMap::from([entry("version", env!("CARGO_PKG_VERSION")), entry("command", "convert")]);
    bag.write_metadata("cromosim", metadata)?;
    let (reference, raw) = (format!("/reference/{name}"), format!("/imu/{name}/data_raw"));
    let frame_id = poses.map(|poses| poses.frame.as_str()).filter(|frame| !frame.is_empty()).unwrap_or("world");
    for (stamp, what) in in_order_of_time(poses, series) {
        match (what, poses, series) {
            (What::Pose(index), Some(poses), _) => bag.write(&reference, stamp, &pose_message(poses, index, frame_id))?,
            (What::Reading(index), _, Some(series)) => bag.write(&raw, stamp, &imu_message(series, index, &format!("{name}_imu")))?,
            _ => {}
        }
    }
    bag.finish()?;
    Ok(())
}

#[derive(Clone, Copy)]
enum What {
    Pose(usize),
    Reading(usize),
}

/// Of one time, the pose first.
fn in_order_of_time(poses: Option<&PoseTrajectory>, series: Option<&ImuSeries>) -> Vec<(Stamp, What)> {
    let poses = poses.into_iter().flat_map(|poses| poses.stamps.iter().enumerate()).map(|(index, stamp)| (*stamp, What::Pose(index)));
    let readings = series.into_iter().flat_map(|series| series.stamps.iter().enumerate());
    let mut all: Vec<(Stamp, What)> = poses.chain(readings.map(|(index, stamp)| (*stamp, What::Reading(index)))).collect();
    all.sort_by_key(|(stamp, _)| *stamp);
    all
}

fn pose_message(poses: &PoseTrajectory, index: usize, frame_id: &str) -> PoseStamped {
    PoseStamped {
        header: Header::new(poses.stamps[index].nanos, frame_id),
        pose: Pose { position: poses.positions[index].into(), orientation: poses.rotations[index].into() },
    }
}

/// Covariances of zeros: the files do not say how large the noise is.
fn imu_message(series: &ImuSeries, index: usize, frame_id: &str) -> Imu {
    let mut message = Imu {
        header: Header::new(series.stamps[index].nanos, frame_id),
        angular_velocity: series.angular_velocity[index].into(),
        linear_acceleration: series.specific_force[index].into(),
        ..Imu::default()
    };
    // REP-145: there is no orientation.
    message.orientation_covariance[0] = -1.0;
    message
}
