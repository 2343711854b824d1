//! Trajectories, IMU series, data sets' recordings and motions as bags that the other commands and
//! `replay` read.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{anyhow, bail};
use cromosim_bag::{BagOptions, BagWriter, Compression};
use cromosim_body::BodyModel;
use cromosim_imu::Placement;
use cromosim_motion::SmplMotion;
use cromosim_motion::rigid::ImuSeries;
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::std_msgs::Header;
use cromosim_replay::recording::{
    Placed, activities_csv, begins, later, of_dataset, write as write_placed,
};

use super::{Arguments, Content};
use crate::simulate::BEGINS;

/// Writes `/reference/NAME` and `/imu/NAME/data_raw` in order of time, and `/imu/NAME/data` where
/// the device gave orientations; of a motion `/smpl/pose`.
pub fn write(
    content: &Content,
    beside: Option<&ImuSeries>,
    model: &BodyModel,
    arguments: &Arguments,
) -> anyhow::Result<()> {
    let name = arguments.name.as_deref().unwrap_or("body");
    let placed = |poses, series| Placed {
        name,
        poses,
        series,
        orientations: &[],
    };
    if beside.is_some() && !matches!(content, Content::Poses(_)) {
        bail!(
            "--imu goes beside a trajectory, but {} is {}",
            arguments.input.display(),
            content.name()
        );
    }
    let (placements, activities) = match content {
        Content::Motion(motion) => {
            return motion_bag(motion, model, "convert", &arguments.out, arguments.force);
        }
        Content::Poses(poses) => (vec![placed(Some(&poses.trajectory), beside)], None),
        Content::Imu(series) => (vec![placed(None, Some(series))], None),
        Content::Recording(recording) => (of_dataset(recording), Some(recording)),
    };
    for placement in &placements {
        // A placement's name is what a topic's part may be.
        Placement::at_site(placement.name, "left_watch", 1.0)
            .map_err(|(_, problem)| anyhow!("--name {}: {problem}", placement.name))?;
    }
    let Some(first) = begins(&placements) else {
        bail!("{}: no pose and no reading", arguments.input.display())
    };
    // A data set's stamps may begin at 0, which TF takes for "the latest".
    let later = if activities.is_some() {
        later(first)
    } else {
        0.0
    };
    let mut bag = create(&arguments.out, "convert", None, arguments.force)?;
    if let Some(recording) = activities.filter(|recording| !recording.activities.is_empty()) {
        bag.attach(
            "activities.csv",
            "text/csv",
            first.plus_seconds(later),
            activities_csv(recording, later).as_bytes(),
        )?;
    }
    write_placed(&mut bag, &placements, later)?;
    bag.finish()?;
    Ok(())
}

/// Writes a motion's poses and their confidence as `/smpl/pose`, which `replay` plays.
pub fn motion_bag(
    motion: &SmplMotion,
    model: &BodyModel,
    command: &str,
    out: &Path,
    replace: bool,
) -> anyhow::Result<()> {
    let mut bag = create(out, command, Some(model), replace)?;
    for (index, pose) in motion.frames.iter().enumerate() {
        let stamp = BEGINS.plus_seconds(index as f64 / motion.rate_hz);
        let mut message = SmplPose {
            header: Header::new(stamp.nanos, "world"),
            body_id: "0".to_owned(),
            gender: motion.gender.name().to_owned(),
            betas: motion.betas.clone(),
            shape_space: motion.shape_space.name().to_owned(),
            confidence: motion
                .confidence
                .as_ref()
                .map_or(1.0, |values| values[index]),
            ..SmplPose::default()
        };
        message.set_root_and_rotations(pose.root_position, &pose.local_rotations);
        bag.write("/smpl/pose", stamp, &message)?;
    }
    bag.finish()?;
    Ok(())
}

fn create(
    out: &Path,
    command: &str,
    model: Option<&BodyModel>,
    replace: bool,
) -> anyhow::Result<BagWriter> {
    let mut bag = BagWriter::create(
        out,
        BagOptions {
            compression: Compression::Zstd,
            replace,
            ..BagOptions::default()
        },
    )?;
    let entry = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    let mut metadata = BTreeMap::from([
        entry("version", env!("CARGO_PKG_VERSION")),
        entry("command", command),
    ]);
    metadata.extend(model.map(|model| entry("body", model.id())));
    bag.write_metadata("cromosim", metadata)?;
    Ok(bag)
}
