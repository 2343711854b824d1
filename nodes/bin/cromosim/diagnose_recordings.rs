//! Which placements of which recordings `cromosim diagnose` looks at.

use cromosim_spatial::meant;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::bail;
use cromosim_body::BodyModel;
use cromosim_gap::PlacementRecord;
use cromosim_recording::{TopicMap, open_mapped, read_mapped_placements};

/// A placement in one recording.
pub struct OneRecording {
    /// Name of the file among several; empty where there is one alone.
    pub file: String,
    /// What it holds of the placement.
    pub record: PlacementRecord,
    /// What a user should know of it.
    pub notes: Vec<String>,
}

/// What is diagnosed, and what is not.
#[derive(Default)]
pub struct Selected {
    /// Each placement's recordings, in the order in which they were given.
    pub placements: BTreeMap<String, Vec<OneRecording>>,
    /// What a user should know of the others.
    pub notes: Vec<String>,
    /// Which cannot be read.
    pub failures: Vec<String>,
}

/// Names of files for people: without folders, where that tells them apart.
pub fn file_names(files: &[PathBuf]) -> Vec<String> {
    let short = |file: &Path| {
        file.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let name = |file: &PathBuf| {
        let own = short(file);
        let same = files.iter().filter(|other| short(other) == own).count();
        if same > 1 {
            file.display().to_string()
        } else {
            own
        }
    };
    files.iter().map(name).collect()
}

/// What is said of a recording, with its name where it has one.
pub fn of_recording(file: &str, text: &str) -> String {
    if file.is_empty() {
        text.to_owned()
    } else {
        format!("{file}: {text}")
    }
}

/// The placements of the recordings, or only those of a list.
pub fn select(
    files: &[PathBuf],
    body: Option<&Arc<BodyModel>>,
    only: &[String],
    (namespace, topics): (Option<&str>, &TopicMap),
) -> anyhow::Result<Selected> {
    refuse_twice(files)?;
    let mut selected = Selected::default();
    let mut known: Vec<String> = Vec::new();
    for (path, name) in files.iter().zip(file_names(files)) {
        let file = if files.len() > 1 { name } else { String::new() };
        let of_file = |text: String| of_recording(&file, &text);
        let (reader, _) = open_mapped(path, namespace, topics)?;
        for (name, placement) in read_mapped_placements(&reader, body, topics)? {
            known.push(name.clone());
            if !only.is_empty() && !only.contains(&name) {
                continue;
            }
            match placement {
                Ok(placement) if placement.measured.is_empty() => {
                    selected.notes.push(of_file(format!(
                        "placement {name}: no messages on {} (sensor_msgs/msg/Imu); skipped",
                        topics.imu_topic(&name)
                    )))
                }
                Ok(placement) => selected
                    .placements
                    .entry(name)
                    .or_default()
                    // The messages themselves go: they are several times as large.
                    .push(OneRecording {
                        file: file.clone(),
                        record: placement.record(),
                        notes: placement.notes,
                    }),
                Err(error) => selected
                    .failures
                    .push(of_file(format!("placement {name}: {error}"))),
            }
        }
    }
    let all = list(files);
    if let Some(name) = only.iter().find(|name| !known.contains(name)) {
        known.sort();
        known.dedup();
        bail!(
            "{all}: placement `{name}` of the config: the recording has no such placement; it has {}{}",
            known.join(", "),
            meant(name, known.iter().map(String::as_str))
        );
    }
    if selected.placements.is_empty() && selected.failures.is_empty() {
        bail!("{all}: {}", selected.nothing());
    }
    Ok(selected)
}

impl Selected {
    /// What is missing where there is no placement.
    fn nothing(&self) -> String {
        let notes = if self.notes.is_empty() {
            "there is none".to_owned()
        } else {
            self.notes.join("; ")
        };
        format!(
            "no placement has both a reference and messages on /imu/NAME/data_raw (sensor_msgs/msg/Imu): {notes}"
        )
    }
}

/// The same recording given again would count as new evidence.
fn refuse_twice(files: &[PathBuf]) -> anyhow::Result<()> {
    let real: Vec<PathBuf> = files
        .iter()
        .map(|file| file.canonicalize().unwrap_or_else(|_| file.clone()))
        .collect();
    for (index, path) in real.iter().enumerate() {
        if real[..index].contains(path) {
            bail!(
                "{}: given twice; give each recording once",
                files[index].display()
            );
        }
    }
    Ok(())
}

fn list(files: &[PathBuf]) -> String {
    let names: Vec<String> = files
        .iter()
        .map(|file| file.display().to_string())
        .collect();
    names.join(", ")
}
