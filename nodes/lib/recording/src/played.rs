//! The people of a motion, and what is simulated of them.

use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_bag::{BagReader, write_imu_csv};
use cromosim_imu::{
    ImuMessages, KinematicSample, Measured, MountedSensors, Reading, SensorFrame, VirtualImu,
};
use cromosim_motion::{MotionError, PersonPart, SmplMotion};
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_spatial::Stamp;

use crate::motion_spill::MotionSpill;
use crate::{
    FIRST_STAMP, MessageHeader, Quality, RecordingError, smpl_state, stamp_of_frame,
    write_file_with,
};

/// One person of a motion file.
pub struct PlayedPerson {
    /// What the person does.
    pub motion: Arc<SmplMotion>,
    /// Before topics (`/person_7`) and frames; empty for a file's only or chosen person.
    pub label: String,
    /// As the states' `body_id`.
    pub body_id: String,
    /// Of the motion's frames.
    pub stamps: Vec<Stamp>,
    /// The frames that are played; those around them are for the derivatives.
    pub played: RangeInclusive<usize>,
}

/// One placement's results.
pub struct SimulatedPlacement {
    /// The placement's name.
    pub name: String,
    /// What the IMU goes through.
    pub motion: MotionSpill,
    /// It makes the messages, in the two forms of REP-145, as they are written.
    pub imu: VirtualImu,
    /// What they are good for.
    pub quality: Quality,
    /// `world_from_sensor` at the frames that are played; empty unless everything stays in memory.
    pub frames: Vec<SensorFrame>,
}

impl SimulatedPlacement {
    /// What the device says of the next sample that it does not lose; none after the last.
    ///
    /// # Errors
    /// [`RecordingError::PutAside`] where what was put aside is lost.
    pub fn next_measured(&mut self) -> Result<Option<Measured>, RecordingError> {
        self.next_read(VirtualImu::read)
    }

    /// Shows `take` what [`SimulatedPlacement::next_measured`] would give, one after the other: copies of it
    /// would cost as much as making it.
    ///
    /// # Errors
    /// As [`SimulatedPlacement::next_measured`].
    pub fn each_measured(&mut self, mut take: impl FnMut(&Measured)) -> Result<(), RecordingError> {
        while let Some(sample) = self.motion.next_sample()? {
            if let Some(measured) = self.imu.read(sample) {
                take(&measured);
            }
        }
        Ok(())
    }

    /// Stamp and channels of the same; whoever takes these takes nothing else of this placement.
    pub(crate) fn next_channels(&mut self) -> Result<Option<(Stamp, Reading)>, RecordingError> {
        self.next_read(VirtualImu::read_channels)
    }

    fn next_read<T>(
        &mut self,
        read: impl Fn(&mut VirtualImu, &KinematicSample) -> Option<T>,
    ) -> Result<Option<T>, RecordingError> {
        while let Some(sample) = self.motion.next_sample()? {
            if let Some(read) = read(&mut self.imu, sample) {
                return Ok(Some(read));
            }
        }
        Ok(None)
    }

    /// The same as messages.
    pub(crate) fn next_messages(&mut self) -> Result<Option<ImuMessages>, RecordingError> {
        let measured = self.next_measured()?;
        Ok(measured.map(|it| self.imu.messages(&it)))
    }
}

/// A person's placements.
pub struct SimulatedPerson {
    /// For the references: where they are at each of the motion's frames.
    pub sites: MountedSensors,
    /// In the order of `sites`.
    pub placements: Vec<SimulatedPlacement>,
}

/// Poses on either side of a part that are differentiated with it, s: several times what neighbours
/// share of their smoothing.
const BESIDE_S: f64 = 0.75;

impl PlayedPerson {
    /// A file's only person, or the chosen one.
    pub fn alone(motion: SmplMotion) -> Self {
        Self {
            stamps: stamps(&motion, 0.0),
            played: 0..=motion.frames.len().saturating_sub(1),
            motion: Arc::new(motion),
            label: String::new(),
            body_id: "0".to_owned(),
        }
    }

    /// A part of [`PlayedPerson::alone`], with the frames beside it that its derivatives need: so
    /// that they are those of the whole.
    ///
    /// # Errors
    /// Where the part lies outside the motion.
    pub fn part(
        motion: &Arc<SmplMotion>,
        start_s: f64,
        duration_s: Option<f64>,
    ) -> Result<Self, MotionError> {
        let frames = motion.part(start_s, duration_s)?;
        Ok(Self::of_frames(motion, frames, 0.0))
    }

    /// The same motion by somebody of another shape, or `speed` times as fast.
    #[must_use]
    pub fn varied(&self, betas: Option<&[f64]>, speed: f64) -> Self {
        let begin = FIRST_STAMP;
        let faster = |stamp: &Stamp| begin.plus_seconds((*stamp - begin) / speed);
        let mut motion = SmplMotion::clone(&self.motion);
        motion.rate_hz *= speed;
        if let Some(betas) = betas {
            betas.clone_into(&mut motion.betas);
        }
        Self {
            motion: Arc::new(motion),
            label: self.label.clone(),
            body_id: self.body_id.clone(),
            stamps: self.stamps.iter().map(faster).collect(),
            played: self.played.clone(),
        }
    }

    /// One of several people, in the part that is asked for, as [`PlayedPerson::part`].
    pub fn of_several(PersonPart { person, frames }: PersonPart) -> Self {
        let begins_s = person.time_of(*frames.start());
        Self {
            label: person.label,
            body_id: person.name,
            ..Self::of_frames(&Arc::new(person.motion), frames, begins_s)
        }
    }

    /// These frames, the first of which stands at `begins_s`, with those beside them; a whole motion is
    /// shared.
    fn of_frames(motion: &Arc<SmplMotion>, frames: RangeInclusive<usize>, begins_s: f64) -> Self {
        let beside = (BESIDE_S * motion.rate_hz) as usize;
        let first = frames.start().saturating_sub(beside);
        let last = (frames.end() + beside).min(motion.frames.len().saturating_sub(1));
        let motion = if last - first + 1 == motion.frames.len() {
            motion.clone()
        } else {
            Arc::new(motion.of_frames(first..=last))
        };
        let lead = frames.start() - first;
        Self {
            stamps: stamps(&motion, begins_s - lead as f64 / motion.rate_hz),
            played: lead..=frames.end() - first,
            motion,
            label: String::new(),
            body_id: "0".to_owned(),
        }
    }

    /// The name of a frame, or of anything that is this person's own.
    pub fn frame(&self, name: &str) -> String {
        if self.label.is_empty() {
            name.to_owned()
        } else {
            format!("{}/{name}", self.label)
        }
    }

    /// The name of a topic.
    pub fn topic(&self, name: &str) -> String {
        format!("/{}", self.frame(name))
    }

    pub(crate) fn state(&self, frame: usize) -> SmplState {
        let header = MessageHeader {
            stamp: self.stamps[frame],
            frame_id: "world",
            body_id: &self.body_id,
        };
        smpl_state(&self.motion, frame, header)
    }
}

fn stamps(motion: &SmplMotion, begins_s: f64) -> Vec<Stamp> {
    (0..motion.frames.len())
        .map(|frame| stamp_of_frame(motion, frame, begins_s))
        .collect()
}

/// DIR/NAME_PLACEMENT.csv; of several people NAME_person_ID_PLACEMENT.csv.
pub fn csv_file(bag: &Path, folder: &Path, person: &PlayedPerson, placement: &str) -> PathBuf {
    let stem = bag.file_stem().unwrap_or_default().to_string_lossy();
    let label = if person.label.is_empty() {
        String::new()
    } else {
        format!("_{}", person.label)
    };
    folder.join(format!("{stem}{label}_{placement}.csv"))
}

/// [`csv_file`] of each placement with the samples of `data`. They are read back from the bag.
///
/// # Errors
/// Where the folder or a file cannot be written, or the bag cannot be read.
pub fn write_people_csv(
    bag: &Path,
    folder: &Path,
    person: &PlayedPerson,
    placements: &[&str],
    replace: bool,
) -> Result<(), RecordingError> {
    fs::create_dir_all(folder).map_err(|source| RecordingError::Make {
        path: folder.to_owned(),
        source,
    })?;
    let reader = BagReader::open(bag)?;
    for placement in placements {
        let path = csv_file(bag, folder, person, placement);
        let topic = person.topic(&format!("imu/{placement}/data"));
        write_file_with(&path, replace, |file| {
            Ok::<_, RecordingError>(write_imu_csv(&reader, &topic, file, &path)?)
        })?;
    }
    Ok(())
}
