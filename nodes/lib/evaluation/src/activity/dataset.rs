//! Real people of a data set, their recordings and windows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cromosim_imu::Reading;
use cromosim_learned::Examples;
use cromosim_recording::datasets::{
    DatasetFiles, DatasetFormat, DatasetRecording, PlacedImu, open_dataset,
};
use cromosim_spatial::Stamp;

use super::activities::Activities;
use super::wearing::DeviceWearing;
use super::windows::{CHANNELS_PER_DEVICE, DeviceReadings, WindowGrid};
use crate::EvaluationError;
use crate::training_data::entries;
use crate::wanted::not_there;

/// Where a device is silent for longer, s, its recording is cut.
const LONGEST_GAP: f64 = 0.25;
/// A label holds so far beyond its last row, s: until the next label's first.
const LABEL_REACH: f64 = 0.05;

/// A person of a data set.
pub(super) struct Subject {
    /// The name of their file or folder.
    pub name: String,
    /// Windows, in the order of time.
    pub windows: Examples,
    /// Stretches without gaps: of each device its readings, seconds from the stretch's start.
    pub stretches: Vec<Vec<DeviceReadings>>,
}

/// All people of a data set.
pub(super) struct RealDataset {
    /// In the order of their names.
    pub subjects: Vec<Subject>,
    /// Placements that all of them have, in the data set's order.
    pub placements: Vec<String>,
    /// The data set.
    pub format: DatasetFormat,
    /// The classes that somebody shows.
    pub activities: Activities,
}

/// Reads recordings of one data set; of its people at most `most_subjects`.
pub(super) fn read_dataset(
    files: &[PathBuf],
    activities: &Activities,
    grid: &WindowGrid,
    most_subjects: usize,
) -> Result<RealDataset, EvaluationError> {
    let (format, people) = read_people(files, most_subjects)?;
    let placements = common_placements(people.values().flatten());
    if placements.is_empty() {
        return Err(EvaluationError::NoCommonPlacement {
            path: files[0].clone(),
            known: DeviceWearing::known_placements(),
        });
    }
    let activities = shown_activities(activities, people.values().flatten());
    let mut subjects: Vec<Subject> = people
        .into_iter()
        .map(|(name, recordings)| subject(name, &recordings, &placements, &activities, grid))
        .collect();
    subjects.retain(|subject| !subject.windows.is_empty());
    if subjects.len() < 3 || activities.classes().len() < 2 {
        let names: Vec<&str> = subjects
            .iter()
            .map(|subject| subject.name.as_str())
            .collect();
        return Err(EvaluationError::TooFewPeople {
            path: files[0].clone(),
            people: names.join(", "),
            classes: activities.classes().join(", "),
        });
    }
    Ok(RealDataset {
        subjects,
        placements,
        format,
        activities,
    })
}

/// A data set's recordings by the name of the person.
type People = BTreeMap<String, Vec<DatasetRecording>>;

fn read_people(
    files: &[PathBuf],
    most_subjects: usize,
) -> Result<(DatasetFormat, People), EvaluationError> {
    let mut people = People::new();
    let mut first_format = None;
    for path in files {
        let Some((format, recording)) = open_dataset(path, &DatasetFiles::default())? else {
            return Err(EvaluationError::UnknownDataset { path: path.clone() });
        };
        if *first_format.get_or_insert(format) != format {
            return Err(EvaluationError::MixedDatasets {
                path: path.clone(),
                format,
            });
        }
        let name = subject_name(path, format);
        if people.contains_key(&name) || people.len() < most_subjects {
            people.entry(name).or_default().push(recording);
        }
    }
    let format = first_format.ok_or(EvaluationError::NoRecordings)?;
    Ok((format, people))
}

/// The activities without the classes that no recording shows.
fn shown_activities<'a>(
    activities: &Activities,
    recordings: impl Iterator<Item = &'a DatasetRecording>,
) -> Activities {
    let mut shown = vec![false; activities.classes().len()];
    for span in recordings.flat_map(|recording| &recording.activities) {
        if let Some(class) = activities.class(&span.activity) {
            shown[usize::from(class)] = true;
        }
    }
    activities.without_absent(&shown)
}

/// The file's name, or the folder of one person's zips (`proband1/data/acc_walking_csv.zip`).
fn subject_name(path: &Path, format: DatasetFormat) -> String {
    let text =
        |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    if format != DatasetFormat::RealWorld {
        return text(path.file_stem());
    }
    let folders: Vec<String> = path
        .ancestors()
        .skip(1)
        .map(|folder| text(folder.file_name()))
        .collect();
    let numbered = folders
        .iter()
        .find(|folder| folder.ends_with(|last: char| last.is_ascii_digit()));
    numbered.or(folders.first()).cloned().unwrap_or_default()
}

/// Placements that every recording has and that are known.
fn common_placements<'a>(
    recordings: impl Iterator<Item = &'a DatasetRecording> + Clone,
) -> Vec<String> {
    let first = recordings.clone().next().map(|recording| {
        recording
            .imus
            .iter()
            .map(|imu| imu.placement.clone())
            .collect::<Vec<_>>()
    });
    let everywhere = |name: &String| {
        recordings
            .clone()
            .all(|recording| recording.imus.iter().any(|imu| imu.placement == *name))
    };
    first
        .unwrap_or_default()
        .into_iter()
        .filter(|name| DeviceWearing::for_placement(name).is_some() && everywhere(name))
        .collect()
}

/// A person's windows and stretches.
fn subject(
    name: String,
    recordings: &[DatasetRecording],
    placements: &[String],
    activities: &Activities,
    grid: &WindowGrid,
) -> Subject {
    let mut windows = Examples::new(grid.window, placements.len() * CHANNELS_PER_DEVICE);
    let mut stretches = Vec::new();
    for recording in recordings {
        for (start, devices) in stretches_without_gaps(recording, placements) {
            let seconds = devices
                .iter()
                .filter_map(|series| series.seconds.last())
                .copied()
                .fold(f64::INFINITY, f64::min);
            let samples = grid.samples(seconds);
            let labels = labels(recording, start, samples, grid.rate_hz, activities);
            grid.cut(
                &grid.sampled(&devices, 0.0, samples),
                &grid.windows(&labels, 0),
                &mut windows,
            );
            stretches.push(devices);
        }
    }
    Subject {
        name,
        windows,
        stretches,
    }
}

/// A time between two stamps, both included.
type Span = (Stamp, Stamp);

/// Stretches in which no device is silent for longer than [`LONGEST_GAP`]: their start, and each
/// device's readings from a little before it on.
fn stretches_without_gaps(
    recording: &DatasetRecording,
    placements: &[String],
) -> Vec<(Stamp, Vec<DeviceReadings>)> {
    let imus: Vec<&PlacedImu> = placements
        .iter()
        .filter_map(|name| recording.imus.iter().find(|imu| imu.placement == *name))
        .collect();
    let mut common = vec![(Stamp::from_nanos(i64::MIN), Stamp::from_nanos(i64::MAX))];
    for imu in &imus {
        let spans = spans_without_gaps(&imu.series.stamps);
        let overlaps = |(from, to): &Span| {
            let both = spans
                .iter()
                .map(|span| (span.0.max(*from), span.1.min(*to)));
            both.filter(|span| span.0 < span.1).collect::<Vec<_>>()
        };
        common = common.iter().flat_map(overlaps).collect();
    }
    common
        .into_iter()
        .map(|span| {
            let devices = imus.iter().map(|imu| readings_within(imu, span)).collect();
            (span.0, devices)
        })
        .filter(|(_, devices): &(Stamp, Vec<DeviceReadings>)| {
            devices.iter().all(|own| own.seconds.len() > 1)
        })
        .collect()
}

fn spans_without_gaps(stamps: &[Stamp]) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    for stamp in stamps {
        match spans
            .last_mut()
            .filter(|span| *stamp - span.1 <= LONGEST_GAP)
        {
            Some(span) => span.1 = *stamp,
            None => spans.push((*stamp, *stamp)),
        }
    }
    spans
}

/// A device's readings in a span, seconds from the span's start.
fn readings_within(imu: &PlacedImu, (from, to): Span) -> DeviceReadings {
    let mut own = DeviceReadings::default();
    let stamps = &imu.series.stamps;
    let inside =
        stamps.partition_point(|stamp| *stamp < from)..stamps.partition_point(|stamp| *stamp <= to);
    let both = imu.series.specific_force[inside.clone()]
        .iter()
        .zip(&imu.series.angular_velocity[inside.clone()]);
    for (stamp, (specific_force, angular_velocity)) in stamps[inside].iter().zip(both) {
        let reading = Reading {
            specific_force: *specific_force,
            angular_velocity: *angular_velocity,
        };
        own.push(*stamp - from, &reading);
    }
    own
}

/// The class at each of `samples` times from a stretch's start on; none where no activity is known.
fn labels(
    recording: &DatasetRecording,
    start: Stamp,
    samples: usize,
    rate_hz: usize,
    activities: &Activities,
) -> Vec<Option<u8>> {
    let spans = &recording.activities;
    let at = |k: usize| {
        let stamp = start.plus_seconds(k as f64 / rate_hz as f64);
        let after = spans.partition_point(|span| span.end < stamp);
        let here = spans.get(after).filter(|span| span.start <= stamp);
        let span = here.or_else(|| {
            after
                .checked_sub(1)
                .map(|before| &spans[before])
                .filter(|span| stamp - span.end <= LABEL_REACH)
        })?;
        activities.class(&span.activity)
    };
    (0..samples).map(at).collect()
}

/// The npz files of a folder of the default data, har_spsw or mocap_cmu_har.
pub(super) fn default_files(folder: &Path) -> Result<Vec<PathBuf>, EvaluationError> {
    let mut files: Vec<PathBuf> = entries(folder)?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|end| end == "npz"))
        .collect();
    files.sort();
    if files.is_empty() {
        return Err(not_there(folder, "no .npz files"));
    }
    Ok(files)
}

#[cfg(test)]
#[path = "dataset_tests.rs"]
mod tests;
