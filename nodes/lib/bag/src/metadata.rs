//! rosbag2's own record of what a bag holds: `metadata.yaml`, and the same inside the MCAP file.

use std::path::{Path, PathBuf};

use cromosim_spatial::in_plain_words;
use serde::{Deserialize, Serialize};

use crate::error::{BagError, io_error};
use crate::qos::QosProfile;
use crate::summary::BagSummary;

/// Version of the layout: that of ROS 2 Jazzy.
const VERSION: u32 = 9;

#[derive(Serialize)]
struct File<'a> {
    rosbag2_bagfile_information: &'a Information,
}

/// The content of `metadata.yaml`.
#[derive(Debug, Serialize)]
pub(crate) struct Information {
    version: u32,
    storage_identifier: &'static str,
    duration: Nanoseconds,
    starting_time: SinceEpoch,
    message_count: u64,
    topics_with_message_count: Vec<TopicCount>,
    compression_format: &'static str,
    compression_mode: &'static str,
    relative_file_paths: Vec<String>,
    files: Vec<FileInformation>,
    custom_data: Option<()>,
    ros_distro: &'static str,
}

#[derive(Debug, Serialize)]
struct Nanoseconds {
    nanoseconds: i64,
}

#[derive(Debug, Serialize)]
struct SinceEpoch {
    nanoseconds_since_epoch: i64,
}

#[derive(Debug, Serialize)]
struct TopicCount {
    topic_metadata: TopicMetadata,
    message_count: u64,
}

#[derive(Debug, Serialize)]
struct TopicMetadata {
    name: String,
    r#type: String,
    serialization_format: String,
    offered_qos_profiles: Vec<QosProfile>,
    type_description_hash: String,
}

#[derive(Debug, Serialize)]
struct FileInformation {
    path: String,
    starting_time: SinceEpoch,
    duration: Nanoseconds,
    message_count: u64,
}

impl Information {
    /// The record of a bag of these files, each with what it holds.
    pub(crate) fn from_summaries(files: &[(String, &BagSummary)]) -> Self {
        let mut all = BagSummary::default();
        files.iter().for_each(|(_, summary)| all.add(summary));
        let topics = all.topics.iter().map(|counted| TopicCount {
            topic_metadata: TopicMetadata {
                name: counted.topic.name.clone(),
                r#type: counted.topic.type_name.clone(),
                serialization_format: counted.topic.message_encoding.clone(),
                offered_qos_profiles: counted.topic.qos(),
                type_description_hash: counted.topic.type_hash().to_owned(),
            },
            message_count: counted.message_count,
        });
        Self {
            version: VERSION,
            storage_identifier: "mcap",
            duration: duration(&all),
            starting_time: start(&all),
            message_count: all.message_count(),
            topics_with_message_count: topics.collect(),
            compression_format: "",
            compression_mode: "",
            relative_file_paths: files.iter().map(|(path, _)| path.clone()).collect(),
            files: files
                .iter()
                .map(|(path, summary)| FileInformation {
                    path: path.clone(),
                    starting_time: start(summary),
                    duration: duration(summary),
                    message_count: summary.message_count(),
                })
                .collect(),
            custom_data: None,
            ros_distro: "jazzy",
        }
    }

    /// As it stands inside an MCAP file.
    pub(crate) fn inner_yaml(&self) -> String {
        // Structs of strings and numbers: this cannot fail.
        serde_norway::to_string(self).unwrap_or_default()
    }

    /// As it stands in `metadata.yaml`.
    pub(crate) fn yaml(&self) -> String {
        serde_norway::to_string(&File {
            rosbag2_bagfile_information: self,
        })
        .unwrap_or_default()
    }
}

fn start(summary: &BagSummary) -> SinceEpoch {
    // An empty bag starts at the largest time, as rosbag2 writes it.
    SinceEpoch {
        nanoseconds_since_epoch: summary
            .time_range
            .map_or(i64::MAX, |(start, _)| start.nanos),
    }
}

fn duration(summary: &BagSummary) -> Nanoseconds {
    Nanoseconds {
        nanoseconds: summary
            .time_range
            .map_or(0, |(start, end)| end.nanos - start.nanos),
    }
}

#[derive(Deserialize)]
struct ReadFile {
    rosbag2_bagfile_information: ReadInformation,
}

/// What the reader needs of `metadata.yaml`, of any version; the rest stands in the MCAP files.
#[derive(Deserialize)]
struct ReadInformation {
    storage_identifier: String,
    relative_file_paths: Vec<String>,
    #[serde(default)]
    compression_mode: String,
    #[serde(default)]
    compression_format: String,
}

/// The files of a bag, and whether each is packed as a whole.
pub(crate) struct Listed {
    pub(crate) files: Vec<PathBuf>,
    pub(crate) files_are_packed: bool,
}

impl Listed {
    /// A file by itself.
    pub(crate) fn alone(path: &Path) -> Self {
        Self {
            files: vec![path.to_owned()],
            files_are_packed: false,
        }
    }
}

/// The files of a bag directory, in the order of its `metadata.yaml`.
pub(crate) fn files_of(directory: &Path) -> Result<Listed, BagError> {
    let path = directory.join("metadata.yaml");
    let text = match cromosim_spatial::read_text(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(BagError::NoMetadata {
                path: directory.to_owned(),
            });
        }
        Err(error) => return Err(io_error(&path, "read")(error)),
    };
    let information = match serde_norway::from_str::<ReadFile>(&text) {
        Ok(file) => file.rosbag2_bagfile_information,
        Err(error) => {
            return Err(BagError::Metadata {
                path,
                reason: in_plain_words(error),
            });
        }
    };
    let unsupported = |what: String| BagError::Unsupported {
        path: path.clone(),
        what,
    };
    if !["mcap", "sqlite3"].contains(&information.storage_identifier.as_str()) {
        let storage = &information.storage_identifier;
        return Err(unsupported(format!("storage {storage:?}")));
    }
    let mode = information.compression_mode.to_ascii_lowercase();
    let (is_packed, files_are_packed) = match mode.as_str() {
        "" | "none" => (false, false),
        "file" => (true, true),
        "message" => (true, false),
        other => return Err(unsupported(format!("compression mode {other:?}"))),
    };
    let format = &information.compression_format;
    if is_packed && format != "zstd" {
        return Err(unsupported(format!("compression format {format:?}")));
    }
    let mut files = Vec::with_capacity(information.relative_file_paths.len());
    for relative in information.relative_file_paths {
        // Older bags name the directory too; what leads out of the directory is no file of this
        // bag.
        match Path::new(&relative).file_name() {
            Some(name) => files.push(directory.join(name)),
            None => {
                return Err(BagError::Metadata {
                    path,
                    reason: format!("relative_file_paths: {relative:?} names no file"),
                });
            }
        }
    }
    Ok(Listed {
        files,
        files_are_packed,
    })
}
