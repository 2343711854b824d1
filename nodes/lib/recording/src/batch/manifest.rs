//! What became of each input, a line of JSON each, beside the outputs.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use cromosim_spatial::in_plain_words;
use serde::{Deserialize, Serialize};

use super::Shard;
use crate::{RecordingError, write_file};

const SCHEMA: &str = "cromosim/manifest/1";
/// Long values are told by their beginning.
const TOLD: usize = 40;

/// The first line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    schema: String,
    /// What the values depend on beside the input.
    settings: BTreeMap<String, String>,
}

/// What became of an input: a further line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
pub enum Outcome {
    /// An output that is complete.
    Written {
        /// The file that was read.
        input: String,
        /// Relative to the folder.
        output: String,
        /// Of the output.
        bytes: u64,
        /// Rows or messages.
        count: u64,
    },
    /// An input that cannot be simulated.
    Failed {
        /// The file.
        input: String,
        /// Relative to the folder; it does not exist.
        output: String,
        /// Why.
        error: String,
    },
}

impl Outcome {
    fn output(&self) -> &str {
        match self {
            Self::Written { output, .. } | Self::Failed { output, .. } => output,
        }
    }
}

/// The outcomes in a folder.
pub struct Manifest {
    folder: PathBuf,
    path: PathBuf,
    settings: BTreeMap<String, String>,
    /// Whether a manifest was there: then outputs without an outcome are of a run that was killed.
    goes_on: bool,
    /// By output, of all manifests in the folder.
    outcomes: BTreeMap<String, Outcome>,
    file: Option<File>,
}

impl Manifest {
    /// Of the outputs in `folder`, which exists: `manifest.jsonl`, of a part of the inputs
    /// `manifest.I-of-N.jsonl`. All manifests there are read, so that the number of parts may
    /// change; `anew` reads none.
    ///
    /// # Errors
    /// [`RecordingError::OtherSettings`] where an output was made otherwise;
    /// [`RecordingError::Unsuitable`] for a manifest that is none.
    pub fn open(
        folder: &Path,
        shard: Option<Shard>,
        settings: BTreeMap<String, String>,
        anew: bool,
    ) -> Result<Self, RecordingError> {
        let name = shard.map_or_else(
            || "manifest.jsonl".to_owned(),
            |shard| format!("manifest.{}.jsonl", shard.to_string().replace('/', "-of-")),
        );
        let mut manifest = Self {
            folder: folder.to_owned(),
            path: folder.join(name),
            settings,
            goes_on: false,
            outcomes: BTreeMap::new(),
            file: None,
        };
        if !anew {
            for path in manifests(folder)? {
                manifest.read(&path)?;
            }
        }
        Ok(manifest)
    }

    fn read(&mut self, path: &Path) -> Result<(), RecordingError> {
        let text = cromosim_spatial::read_text(path).map_err(|source| RecordingError::Read {
            path: path.to_owned(),
            source,
        })?;
        let damaged = |line: usize, error: &dyn std::fmt::Display| RecordingError::Unsuitable {
            path: path.to_owned(),
            problem: format!(
                "line {line}: {}; --force writes all anew",
                in_plain_words(error)
            ),
        };
        let mut lines = text.split_inclusive('\n').enumerate();
        let (_, first) = lines.next().unwrap_or_default();
        let head: Head = serde_json::from_str(first).map_err(|error| damaged(1, &error))?;
        if head.schema != SCHEMA {
            return Err(damaged(1, &format!("expected schema {SCHEMA}")));
        }
        self.compare(path, &head.settings)?;
        self.goes_on = true;
        for (number, line) in lines {
            // The last line of a run that was killed.
            if !line.ends_with('\n') {
                break;
            }
            let outcome: Outcome =
                serde_json::from_str(line).map_err(|error| damaged(number + 1, &error))?;
            let known = self.outcomes.get(outcome.output());
            if !matches!(known, Some(Outcome::Written { .. })) {
                self.outcomes.insert(outcome.output().to_owned(), outcome);
            }
        }
        Ok(())
    }

    /// Refuses settings that are not these.
    fn compare(&self, path: &Path, there: &BTreeMap<String, String>) -> Result<(), RecordingError> {
        let mut keys = self.settings.keys().chain(there.keys());
        let Some(key) = keys.find(|key| self.settings.get(*key) != there.get(*key)) else {
            return Ok(());
        };
        let told = |settings: &BTreeMap<String, String>| {
            let value = settings.get(key).map_or("nothing", String::as_str);
            let one_line = value.replace('\n', " ");
            if one_line.chars().count() <= TOLD {
                one_line
            } else {
                one_line.chars().take(TOLD).chain("...".chars()).collect()
            }
        };
        Err(RecordingError::OtherSettings {
            path: path.to_owned(),
            key: key.clone(),
            there: told(there),
            here: told(&self.settings),
        })
    }

    /// Whether the output, relative to the folder, is there as it was written, and no older than
    /// the input.
    pub fn is_done(&self, input: &Path, output: &str) -> bool {
        let Some(Outcome::Written { bytes, .. }) = self.outcomes.get(output) else {
            return false;
        };
        let Ok(found) = fs::metadata(self.folder.join(output)) else {
            return false;
        };
        let changed =
            |path: &Path| -> Option<SystemTime> { fs::metadata(path).ok()?.modified().ok() };
        let is_newer = |input: SystemTime| found.modified().is_ok_and(|output| output < input);
        found.len() == *bytes && !changed(input).is_some_and(is_newer)
    }

    /// Whether outputs that are not done may be replaced: those of a run that goes on.
    pub const fn replaces(&self) -> bool {
        self.goes_on
    }

    /// Adds an outcome, at once.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn add(&mut self, outcome: Outcome) -> Result<(), RecordingError> {
        if self.file.is_none() {
            // What earlier runs of these inputs did, without a torn last line.
            let own = self.text(self.outcomes.values())?;
            write_file(&self.path, own.as_bytes(), true)?;
            let file = OpenOptions::new().append(true).open(&self.path);
            self.file = Some(file.map_err(self.cannot_write())?);
        }
        let line = line(&outcome, &self.path)?;
        if let Some(file) = &mut self.file {
            let written = file.write_all(line.as_bytes());
            written.map_err(|source| RecordingError::Write {
                path: self.path.clone(),
                source,
            })?;
        }
        self.outcomes.insert(outcome.output().to_owned(), outcome);
        Ok(())
    }

    /// Writes the outcomes of these outputs, in their order, in place of what stands there.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn finish<'a>(
        self,
        outputs: impl Iterator<Item = &'a str>,
    ) -> Result<PathBuf, RecordingError> {
        let text = self.text(outputs.filter_map(|output| self.outcomes.get(output)))?;
        write_file(&self.path, text.as_bytes(), true)?;
        Ok(self.path)
    }

    fn text<'a>(
        &self,
        outcomes: impl Iterator<Item = &'a Outcome>,
    ) -> Result<String, RecordingError> {
        let head = Head {
            schema: SCHEMA.to_owned(),
            settings: self.settings.clone(),
        };
        let mut text = line(&head, &self.path)?;
        for outcome in outcomes {
            text += &line(outcome, &self.path)?;
        }
        Ok(text)
    }

    fn cannot_write(&self) -> impl Fn(std::io::Error) -> RecordingError {
        let path = self.path.clone();
        move |source| RecordingError::Write {
            path: path.clone(),
            source,
        }
    }
}

fn line(value: &impl Serialize, path: &Path) -> Result<String, RecordingError> {
    let text = serde_json::to_string(value).map_err(|error| RecordingError::Write {
        path: path.to_owned(),
        source: error.into(),
    })?;
    Ok(text + "\n")
}

/// The manifests in a folder, by name.
fn manifests(folder: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let cannot = |source| RecordingError::Read {
        path: folder.to_owned(),
        source,
    };
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("manifest.") && name.ends_with(".jsonl") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}
