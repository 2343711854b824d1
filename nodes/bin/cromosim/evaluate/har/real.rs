//! The real side: people, their recordings and windows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use cromosim_imu::Reading;
use cromosim_learned::Examples;
use cromosim_recording::datasets::{DatasetFiles, DatasetFormat, DatasetRecording, open_dataset};
use cromosim_spatial::Stamp;

use super::activities::Activities;
use super::signal::{Grid, PER_DEVICE, Series};
use super::wear::{known, wear};

/// Where a device is silent for longer, s, its recording is cut.
const LONGEST_GAP: f64 = 0.25;
/// A label holds so far beyond its last row, s: until the next label's first.
const LABEL_REACH: f64 = 0.05;

/// A person.
pub struct Subject {
    /// Name.
    pub name: String,
    /// Windows, in order of time.
    pub windows: Examples,
    /// Stretches without gaps: of each device its readings, seconds from the stretch's start.
    pub stretches: Vec<Vec<Series>>,
}

/// All people of a data set.
pub struct Real {
    /// In order of their names.
    pub subjects: Vec<Subject>,
    /// Placements that all of them have, in the data set's order.
    pub placements: Vec<String>,
    /// Whose recordings they are.
    pub format: DatasetFormat,
    /// The classes that somebody shows.
    pub activities: Activities,
}

/// Reads recordings.
pub fn read(
    files: &[PathBuf],
    activities: &Activities,
    grid: &Grid,
    most_subjects: usize,
) -> anyhow::Result<Real> {
    let mut people: BTreeMap<String, Vec<DatasetRecording>> = BTreeMap::new();
    let mut told = None;
    for path in files {
        let Some((format, recording)) = open_dataset(path, &DatasetFiles::default())? else {
            bail!(
                "{}: no recording of a data set that is known; see `cromosim inspect --help`",
                path.display()
            );
        };
        if *told.get_or_insert(format) != format {
            bail!(
                "{}: of {format}, the files before are of another data set; give those of one",
                path.display()
            );
        }
        let name = subject_name(path, format);
        if people.contains_key(&name) || people.len() < most_subjects {
            people.entry(name).or_default().push(recording);
        }
    }
    let Some(format) = told else {
        bail!("no recordings were given")
    };
    let placements = common_placements(people.values().flatten());
    if placements.is_empty() {
        bail!(
            "{}: no placement that all recordings have and that is known ({})",
            files[0].display(),
            known()
        );
    }
    let mut there = vec![false; activities.classes().len()];
    for span in people
        .values()
        .flatten()
        .flat_map(|recording| &recording.activities)
    {
        if let Some(class) = activities.class(&span.activity) {
            there[usize::from(class)] = true;
        }
    }
    let activities = activities.without_absent(&there);
    let subject = |(name, recordings): (String, Vec<DatasetRecording>)| {
        subject(name, &recordings, &placements, &activities, grid)
    };
    let mut subjects: Vec<Subject> = people.into_iter().map(subject).collect();
    subjects.retain(|subject| !subject.windows.is_empty());
    if subjects.len() < 3 || activities.classes().len() < 2 {
        let names = subjects
            .iter()
            .map(|subject| subject.name.as_str())
            .collect::<Vec<_>>()
            .join(", ");
        let classes = activities.classes().join(", ");
        bail!(
            "{}: people with labelled windows: {names}; their classes: {classes}; at least 3 people and 2 classes are needed",
            files[0].display()
        )
    }
    Ok(Real {
        subjects,
        placements,
        format,
        activities,
    })
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
        .filter(|name| wear(name).is_some() && everywhere(name))
        .collect()
}

fn subject(
    name: String,
    recordings: &[DatasetRecording],
    placements: &[String],
    activities: &Activities,
    grid: &Grid,
) -> Subject {
    let mut windows = Examples::new(grid.window, placements.len() * PER_DEVICE);
    let mut stretches = Vec::new();
    for recording in recordings {
        for (start, devices) in cut(recording, placements) {
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

/// Stretches in which no device is silent for longer than [`LONGEST_GAP`]: their start, and each
/// device's readings from a little before it on.
fn cut(recording: &DatasetRecording, placements: &[String]) -> Vec<(Stamp, Vec<Series>)> {
    let imus: Vec<_> = placements
        .iter()
        .filter_map(|name| recording.imus.iter().find(|imu| imu.placement == *name))
        .collect();
    // Each device's pieces, then what they have in common.
    let mut common = vec![(Stamp::from_nanos(i64::MIN), Stamp::from_nanos(i64::MAX))];
    for imu in &imus {
        let mut pieces: Vec<(Stamp, Stamp)> = Vec::new();
        for stamp in &imu.series.stamps {
            match pieces
                .last_mut()
                .filter(|piece| *stamp - piece.1 <= LONGEST_GAP)
            {
                Some(piece) => piece.1 = *stamp,
                None => pieces.push((*stamp, *stamp)),
            }
        }
        let both = |(from, to): &(Stamp, Stamp)| {
            let pieces = pieces
                .iter()
                .map(|piece| (piece.0.max(*from), piece.1.min(*to)));
            pieces.filter(|piece| piece.0 < piece.1).collect::<Vec<_>>()
        };
        common = common.iter().flat_map(both).collect();
    }
    let series = |from: Stamp, to: Stamp| -> Vec<Series> {
        let of = |imu: &&cromosim_recording::datasets::PlacedImu| {
            let mut own = Series::default();
            let stamps = &imu.series.stamps;
            let inside = stamps.partition_point(|stamp| *stamp < from)
                ..stamps.partition_point(|stamp| *stamp <= to);
            let both = imu.series.specific_force[inside.clone()]
                .iter()
                .zip(&imu.series.angular_velocity[inside.clone()]);
            for (stamp, (force, rate)) in stamps[inside].iter().zip(both) {
                own.push(
                    *stamp - from,
                    &Reading {
                        specific_force: *force,
                        angular_velocity: *rate,
                    },
                );
            }
            own
        };
        imus.iter().map(of).collect()
    };
    common
        .into_iter()
        .map(|(from, to)| (from, series(from, to)))
        .filter(|(_, devices)| devices.iter().all(|own| own.seconds.len() > 1))
        .collect()
}

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

/// The recordings of har_spsw in a folder.
pub fn default_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| {
        format!(
            "{}: cannot be read; --data names the folder that holds har_spsw and mocap_cmu_har, --real other recordings",
            folder.display()
        )
    })?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|end| end == "npz"))
        .collect();
    files.sort();
    if files.is_empty() {
        bail!("{}: no .npz files", folder.display());
    }
    Ok(files)
}

#[cfg(test)]
#[path = "real_tests.rs"]
mod tests;
