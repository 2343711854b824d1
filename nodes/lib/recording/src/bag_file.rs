//! Files that are played and read like bags though they are none.

use std::io::Read;
use std::path::Path;

use cromosim_bag::{BagOptions, BagWriter, Compression, starts_like_bag};

use crate::datasets::{DatasetFiles, open_dataset};
use crate::rigid::{RigidContent, parse_rigid};
use crate::trace::{PlacementTrace, first_stamp, seconds_to_first_stamp, write_traces};
use crate::{RecordingError, read_whole};

/// Enough of a file to know a bag by.
const HEAD_BYTES: u64 = 16;

/// Whether the path is a bag by its content: a directory, or a file that begins as MCAP, SQLite or a
/// bag of ROS 1 does. What cannot be read counts as a bag, so that opening it says why.
pub fn is_bag(path: &Path) -> bool {
    if !path.is_file() {
        return true;
    }
    let mut head = Vec::new();
    let read = cromosim_spatial::open_file(path)
        .and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    read.is_err() || head.is_empty() || starts_like_bag(&head)
}

/// Writes a data set's recording, a trajectory or an IMU series as the bag `out`; false where the
/// file is none of these. A rigid body is the placement `body`.
///
/// # Errors
/// What is wrong with the file, and [`RecordingError::NothingRecorded`].
pub fn write_as_bag(path: &Path, out: &Path) -> Result<bool, RecordingError> {
    let name = path.display().to_string();
    if let Some((_, recording)) = open_dataset(path, &DatasetFiles::default())? {
        let traces = recording.traces();
        let shift_s = first_stamp(&traces).map_or(0.0, seconds_to_first_stamp);
        write_bag(&traces, shift_s, &name, out)?;
        return Ok(true);
    }
    let body = |reference, imu| {
        [PlacementTrace {
            name: "body",
            reference,
            imu,
            orientations: &[],
            magnetic_field: &[],
        }]
    };
    match parse_rigid(&read_whole(path)?, &name)? {
        None => return Ok(false),
        Some(RigidContent::Poses(poses)) => {
            write_bag(&body(Some(&poses.trajectory), None), 0.0, &name, out)?
        }
        Some(RigidContent::Imu(series)) => write_bag(&body(None, Some(&series)), 0.0, &name, out)?,
    }
    Ok(true)
}

fn write_bag(
    traces: &[PlacementTrace<'_>],
    shift_s: f64,
    name: &str,
    out: &Path,
) -> Result<(), RecordingError> {
    if first_stamp(traces).is_none() {
        return Err(RecordingError::NothingRecorded {
            name: name.to_owned(),
        });
    }
    let options = BagOptions {
        compression: Compression::Zstd,
        ..BagOptions::default()
    };
    let mut bag = BagWriter::create(out, options)?;
    write_traces(&mut bag, traces, shift_s)?;
    bag.finish()?;
    Ok(())
}
