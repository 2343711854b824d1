//! Files that are played and read like bags though they are none.

use std::io::Read;
use std::path::Path;

use cromosim_bag::{BagOptions, BagWriter, Compression};

use crate::datasets::{DatasetFiles, open_dataset};
use crate::rigid::{RigidContent, parse_rigid};
use crate::trace::{PlacementTrace, first_stamp, seconds_to_first_stamp, write_traces};
use crate::{RecordingError, read_whole};

/// How an MCAP file begins.
pub(crate) const MCAP_MAGIC: [u8; 5] = *b"\x89MCAP";

/// Whether the path is a bag by its content: a directory, or a file that begins as MCAP does. What
/// cannot be read counts as a bag, so that opening it says why.
pub fn is_bag(path: &Path) -> bool {
    let mut magic = [0; MCAP_MAGIC.len()];
    !path.is_file()
        || cromosim_spatial::open_file(path)
            .and_then(|mut file| file.read_exact(&mut magic))
            .is_err()
        || magic == MCAP_MAGIC
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
