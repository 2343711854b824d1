//! Real devices beside a reference motion.

use std::path::Path;
use std::sync::Arc;

use cromosim_bag::BagReader;
use cromosim_imu::{Reading, Scheme, SensorFrame, SensorTrajectory};
use cromosim_learned::{Pair, PairNames, SiteMotion};
use cromosim_recording::datasets::{DatasetFiles, DatasetRecording, open_dataset};
use cromosim_recording::{PlacementTrace, RecordedPlacement, RecordingError, read_placements};
use cromosim_spatial::Stamp;

use super::clips::name_of_file;
use super::source::{DataFolder, DataSource};
use crate::EvaluationError;
use crate::error::At;

/// References are cut at longer gaps, s.
const LONGEST_GAP: f64 = 0.1;
/// Shorter pieces between gaps, s, are left out.
const SHORTEST: f64 = 2.0;

/// A real device beside its reference, where the reference has no gap.
pub struct RecordedPiece {
    /// The recording's name and the number of the piece.
    pub name: String,
    /// Where the device was, as the recording names it.
    pub position: String,
    /// The reference.
    pub trajectory: SensorTrajectory,
    /// Stamps of all readings of the recording.
    stamps: Arc<Vec<Stamp>>,
    readings: Arc<Vec<Reading>>,
}

impl RecordedPiece {
    /// The pair, its motion differentiated by the spline.
    ///
    /// # Errors
    /// As [`Pair::new`].
    pub fn pair(&self, subject: &str) -> Result<Pair, EvaluationError> {
        let motion = SiteMotion::rigid(&self.trajectory, Scheme::Spline)?;
        let names = PairNames {
            name: self.name.clone(),
            subject: subject.to_owned(),
            position: self.position.clone(),
        };
        Pair::new(names, motion.clone(), &motion, &self.stamps, &self.readings)
            .at(|| format!("{}, {}", self.name, self.position))
    }
}

/// A device of a recording, with its whole reference.
struct Device {
    position: String,
    frames: Vec<SensorFrame>,
    stamps: Vec<Stamp>,
    readings: Vec<Reading>,
}

/// The real devices of a source.
///
/// # Errors
/// Recordings that cannot be read, and [`EvaluationError::NoReference`] where one has nothing long
/// enough.
pub fn recorded_pieces(
    source: &DataSource,
    data: &DataFolder,
) -> Result<Vec<RecordedPiece>, EvaluationError> {
    let mut all = Vec::new();
    for path in source.recording_files(&data.folder)? {
        let before = all.len();
        let devices = match open_dataset(&path, &DatasetFiles::default())? {
            Some((_, recording)) => devices_in_dataset(&recording),
            None => devices_in_bag(&path, data)?,
        };
        for device in devices {
            if source.sites.is_empty() || source.sites.contains(&device.position) {
                all.extend(pieces(&name_of_file(&path), device, source)?);
            }
        }
        if all.len() == before {
            let named = if source.sites.is_empty() {
                String::new()
            } else {
                format!(" called {}", source.sites.join(" or "))
            };
            return Err(EvaluationError::NoReference {
                path,
                shortest_s: SHORTEST,
                named,
            });
        }
    }
    Ok(all)
}

/// The devices with a reference.
fn devices_in_dataset(recording: &DatasetRecording) -> Vec<Device> {
    let device = |trace: PlacementTrace<'_>| {
        let (poses, series) = (trace.reference?, trace.imu?);
        Some(Device {
            position: trace.name.to_owned(),
            frames: poses.frames(),
            stamps: series.stamps.clone(),
            readings: series.readings(),
        })
    };
    recording.traces().into_iter().filter_map(device).collect()
}

/// The placements with a reference.
fn devices_in_bag(path: &Path, data: &DataFolder) -> Result<Vec<Device>, EvaluationError> {
    let device = |(position, recorded): (String, Result<RecordedPlacement, RecordingError>)| {
        let recorded = recorded.at(|| format!("{}: {position}", path.display()))?;
        let record = recorded.record();
        Ok(Device {
            position,
            frames: recorded.frames,
            stamps: record.imu.stamps,
            readings: record.imu.readings,
        })
    };
    read_placements(&BagReader::open(path)?, data.body.as_ref())?
        .into_iter()
        .map(device)
        .collect()
}

/// One piece for each stretch of the reference without a gap that is long enough.
fn pieces(
    recording: &str,
    device: Device,
    source: &DataSource,
) -> Result<Vec<RecordedPiece>, EvaluationError> {
    let mut stretches: Vec<Vec<SensorFrame>> = vec![Vec::new()];
    for frame in source.frames_in_part(device.frames) {
        let last = stretches.len() - 1;
        if stretches[last]
            .last()
            .is_some_and(|before| frame.stamp - before.stamp > LONGEST_GAP)
        {
            stretches.push(vec![frame]);
        } else {
            stretches[last].push(frame);
        }
    }
    let (stamps, readings) = (Arc::new(device.stamps), Arc::new(device.readings));
    let long = |stretch: &Vec<SensorFrame>| {
        stretch.len() > 10 && stretch[stretch.len() - 1].stamp - stretch[0].stamp >= SHORTEST
    };
    let piece = |(number, frames): (usize, Vec<SensorFrame>)| {
        Ok(RecordedPiece {
            name: format!("{recording} {number}"),
            position: device.position.clone(),
            trajectory: SensorTrajectory::new(frames)?,
            stamps: stamps.clone(),
            readings: readings.clone(),
        })
    };
    stretches
        .into_iter()
        .filter(long)
        .enumerate()
        .map(piece)
        .collect()
}
