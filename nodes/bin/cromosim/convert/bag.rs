//! Trajectories, IMU series, data sets' recordings and motions as bags that the other commands and
//! `replay` read.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{anyhow, bail};
use cromosim_bag::{BagOptions, BagWriter, Compression};
use cromosim_body::BodyModel;
use cromosim_imu::Placement;
use cromosim_motion::SmplMotion;
use cromosim_recording::rigid::ImuSeries;
use cromosim_recording::{
    MessageHeader, PlacementTrace, activities_csv, first_stamp, seconds_to_first_stamp, smpl_pose,
    stamp_of_frame, write_traces,
};

use super::{Arguments, Content};

/// Writes `/reference/NAME` and `/imu/NAME/data_raw` in order of time, and `/imu/NAME/data` where
/// the device gave orientations; of a motion `/smpl/pose`.
pub fn write(
    content: &Content,
    beside: Option<&ImuSeries>,
    model: &BodyModel,
    arguments: &Arguments,
) -> anyhow::Result<()> {
    let name = arguments.name.as_deref().unwrap_or("body");
    let placed = |reference, imu| PlacementTrace {
        name,
        reference,
        imu,
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
        Content::Recording(recording) => (recording.traces(), Some(recording)),
    };
    for placement in &placements {
        // A placement's name is what a topic's part may be.
        Placement::at_site(placement.name, "left_watch", 1.0)
            .map_err(|(_, problem)| anyhow!("--name {}: {problem}", placement.name))?;
    }
    let Some(first) = first_stamp(&placements) else {
        bail!("{}: no pose and no reading", arguments.input.display())
    };
    // A data set's stamps may begin at 0, which TF takes for "the latest".
    let later = if activities.is_some() {
        seconds_to_first_stamp(first)
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
    write_traces(&mut bag, &placements, later)?;
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
    for index in 0..motion.frames.len() {
        let stamp = stamp_of_frame(motion, index, 0.0);
        let header = MessageHeader {
            stamp,
            frame_id: "world",
            body_id: "0",
        };
        let message = smpl_pose(motion, index, header);
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
