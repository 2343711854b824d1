//! Writing bags as files and directories.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use cromosim_msgs::RosMessage;
use cromosim_spatial::Stamp;
use tempfile::{TempDir, TempPath};

use crate::error::{BagError, io_error};
use crate::metadata::Information;
use crate::stream::{Compression, StreamWriter, TopicId};
use crate::summary::BagSummary;
use crate::topic::Topic;

/// How a bag is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BagOptions {
    /// How messages are packed.
    pub compression: Compression,
    /// Live: the bag grows in place, and each [`BagWriter::flush`] keeps what came before it even
    /// from kill -9. Otherwise it is written under a temporary name beside its own and takes its
    /// name in [`BagWriter::finish`]; dropped unfinished, it leaves nothing behind.
    pub live: bool,
    /// Takes the place of the file `NAME.mcap`, or of a directory that holds a bag and nothing
    /// else.
    pub replace: bool,
}

/// Writes one bag: the single file `NAME.mcap` where the path ends so, else the directory `NAME`
/// with `NAME_0.mcap` and `metadata.yaml`.
pub struct BagWriter {
    stream: StreamWriter<BufWriter<File>>,
    place: Place,
    target: PathBuf,
    file_name: String,
    /// The file behind the stream, for `sync_data`.
    file: File,
    options: BagOptions,
}

enum Place {
    LiveFile,
    LiveDirectory,
    TemporaryFile(TempPath),
    TemporaryDirectory(TempDir),
}

impl BagWriter {
    /// Starts a bag at `path`.
    ///
    /// # Errors
    /// [`BagError::Exists`] where something is there that `options` does not allow to replace;
    /// [`BagError::Io`].
    pub fn create(path: &Path, options: BagOptions) -> Result<Self, BagError> {
        let single = is_single_file(path);
        check_target(path, single, options.replace)?;
        let file_name = if single {
            name_of(path)
        } else {
            format!("{}_0.mcap", name_of(path))
        };
        let parent = parent_of(path);
        let create = || io_error(path, "create");
        let (file, place) = match (single, options.live) {
            (true, true) if options.replace => {
                (File::create(path).map_err(create())?, Place::LiveFile)
            }
            // Of two that begin at once, one finds the other's.
            (true, true) => (
                File::create_new(path).map_err(taken(path))?,
                Place::LiveFile,
            ),
            (true, false) => {
                let (file, temporary) = temporary(path)
                    .tempfile_in(parent)
                    .map_err(create())?
                    .into_parts();
                (file, Place::TemporaryFile(temporary))
            }
            (false, true) => {
                if options.replace {
                    remove_bag(path)?;
                }
                fs::create_dir(path).map_err(taken(path))?;
                (
                    File::create(path.join(&file_name)).map_err(create())?,
                    Place::LiveDirectory,
                )
            }
            (false, false) => {
                let directory = temporary(path)
                    .permissions(everybody(0o777))
                    .tempdir_in(parent)
                    .map_err(create())?;
                (
                    File::create(directory.path().join(&file_name)).map_err(create())?,
                    Place::TemporaryDirectory(directory),
                )
            }
        };
        let buffered = BufWriter::with_capacity(64 * 1024, file.try_clone().map_err(create())?);
        let stream = StreamWriter::new(buffered, path, options.compression)?;
        Ok(Self {
            stream,
            place,
            target: path.to_owned(),
            file_name,
            file,
            options,
        })
    }

    /// See [`StreamWriter::add_topic`].
    ///
    /// # Errors
    /// As there; [`BagError::RecordingStopped`] in place of [`BagError::Io`] for live bags. So for
    /// all functions below.
    pub fn add_topic(&mut self, topic: &Topic) -> Result<TopicId, BagError> {
        let result = self.stream.add_topic(topic);
        self.placed(result)
    }

    /// See [`StreamWriter::write`].
    ///
    /// # Errors
    /// As there; live bags as [`Self::add_topic`] says.
    pub fn write<M: RosMessage>(
        &mut self,
        topic: &str,
        stamp: Stamp,
        message: &M,
    ) -> Result<(), BagError> {
        let result = self.stream.write(topic, stamp, message);
        self.placed(result)
    }

    /// See [`StreamWriter::write_payload`].
    ///
    /// # Errors
    /// As there; live bags as [`Self::add_topic`] says.
    pub fn write_payload(
        &mut self,
        topic: TopicId,
        payload: &[u8],
        log_time: Stamp,
        publish_time: Stamp,
    ) -> Result<(), BagError> {
        let result = self
            .stream
            .write_payload(topic, payload, log_time, publish_time);
        self.placed(result)
    }

    /// See [`StreamWriter::attach`].
    ///
    /// # Errors
    /// As there; live bags as [`Self::add_topic`] says.
    pub fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        time: Stamp,
        content: &[u8],
    ) -> Result<(), BagError> {
        let result = self.stream.attach(name, media_type, time, content);
        self.placed(result)
    }

    /// See [`StreamWriter::write_metadata`].
    ///
    /// # Errors
    /// As there; live bags as [`Self::add_topic`] says.
    pub fn write_metadata(
        &mut self,
        name: &str,
        values: BTreeMap<String, String>,
    ) -> Result<(), BagError> {
        let result = self.stream.write_metadata(name, values);
        self.placed(result)
    }

    /// Hands everything written so far to the operating system: from here on it survives the end of
    /// this process. A live recorder calls it at least every 250 ms.
    ///
    /// # Errors
    /// [`BagError::RecordingStopped`] for live bags, [`BagError::Io`] for others.
    pub fn flush(&mut self) -> Result<(), BagError> {
        let result = self.stream.flush();
        self.placed(result)
    }

    /// [`Self::flush`], and waits until the disk has it: from here on it survives a loss of power.
    /// Takes milliseconds.
    ///
    /// # Errors
    /// [`BagError::RecordingStopped`] for live bags, [`BagError::Io`] for others.
    pub fn sync(&mut self) -> Result<(), BagError> {
        self.flush()?;
        let result = self
            .file
            .sync_data()
            .map_err(io_error(&self.target, "write"));
        self.placed(result)
    }

    /// What was written so far.
    pub fn summary(&self) -> &BagSummary {
        self.stream.summary()
    }

    /// Where the bag is, or will be once finished.
    pub fn path(&self) -> &Path {
        &self.target
    }

    /// Completes the bag and gives it its name.
    ///
    /// # Errors
    /// [`BagError::RecordingStopped`] for live bags, [`BagError::Io`] for others.
    pub fn finish(self) -> Result<BagSummary, BagError> {
        let Self {
            stream,
            place,
            target,
            file_name,
            file: _,
            options,
        } = self;
        let (_, summary) = stream
            .finish(&file_name)
            .map_err(|error| placed(error, options.live, &target))?;
        let metadata = Information::from_summaries(&[(file_name, &summary)]).yaml();
        let finish = || io_error(&target, "write");
        match place {
            Place::LiveFile => {}
            Place::LiveDirectory => {
                // Whole or not there, whenever the process is killed.
                let path = target.join("metadata.yaml");
                let mut file = temporary(&path).tempfile_in(&target).map_err(finish())?;
                file.write_all(metadata.as_bytes()).map_err(finish())?;
                file.persist(&path).map_err(|error| finish()(error.error))?;
            }
            Place::TemporaryFile(temporary) if options.replace => {
                temporary
                    .persist(&target)
                    .map_err(|error| finish()(error.error))?;
            }
            Place::TemporaryFile(temporary) => match temporary.persist_noclobber(&target) {
                Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => {
                    return Err(BagError::Exists { path: target });
                }
                result => result.map_err(|error| finish()(error.error))?,
            },
            Place::TemporaryDirectory(directory) => {
                fs::write(directory.path().join("metadata.yaml"), metadata).map_err(finish())?;
                remove_bag(&target)?;
                fs::rename(directory.path(), &target).map_err(finish())?;
                // The directory has its name now: nothing temporary is left to remove.
                let _ = directory.keep();
            }
        }
        Ok(summary)
    }

    fn placed<V>(&self, result: Result<V, BagError>) -> Result<V, BagError> {
        result.map_err(|error| placed(error, self.options.live, &self.target))
    }
}

/// Says of a new file or directory that its name is taken.
fn taken(path: &Path) -> impl FnOnce(std::io::Error) -> BagError {
    let create = io_error(path, "create");
    let path = path.to_owned();
    move |error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => BagError::Exists { path },
        _ => create(error),
    }
}

/// Says of a live recording's I/O error what is left and how to mend it.
fn placed(error: BagError, live: bool, target: &Path) -> BagError {
    match error {
        BagError::Io { source, .. } if live => BagError::RecordingStopped {
            path: target.to_owned(),
            source,
        },
        other => other,
    }
}

/// Whether a path names a single MCAP file rather than a bag directory.
pub(crate) fn is_single_file(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
}

/// The last part of a path.
pub(crate) fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(
        || "bag".to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

/// The directory that holds a path.
pub(crate) fn parent_of(path: &Path) -> &Path {
    path.parent()
        .filter(|parent| !parent.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

/// Names `.NAME.….partial` beside `path`, with the permissions that an ordinary new file has.
pub(crate) fn temporary(path: &Path) -> Temporary {
    Temporary {
        prefix: format!(".{}.", name_of(path)),
        permissions: everybody(0o666),
    }
}

/// A pattern for temporary names.
pub(crate) struct Temporary {
    prefix: String,
    permissions: Option<fs::Permissions>,
}

impl Temporary {
    fn permissions(self, permissions: Option<fs::Permissions>) -> Self {
        Self {
            permissions,
            ..self
        }
    }

    fn builder(&self) -> tempfile::Builder<'_, 'static> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(&self.prefix).suffix(".partial");
        if let Some(permissions) = &self.permissions {
            builder.permissions(permissions.clone());
        }
        builder
    }

    pub(crate) fn tempfile_in(&self, directory: &Path) -> std::io::Result<tempfile::NamedTempFile> {
        self.builder().tempfile_in(directory)
    }

    fn tempdir_in(&self, directory: &Path) -> std::io::Result<TempDir> {
        self.builder().tempdir_in(directory)
    }
}

/// `mode` less the user's umask, where the system has such a thing.
fn everybody(mode: u32) -> Option<fs::Permissions> {
    #[cfg(unix)]
    {
        Some(std::os::unix::fs::PermissionsExt::from_mode(mode))
    }
    #[cfg(not(unix))]
    {
        let _ = mode;
        None
    }
}

fn check_target(path: &Path, single: bool, replace: bool) -> Result<(), BagError> {
    let Ok(found) = fs::symlink_metadata(path) else {
        return Ok(());
    };
    let replaceable = if single {
        !found.is_dir()
    } else {
        found.is_dir() && is_bag_directory(path)?
    };
    if replace && replaceable {
        Ok(())
    } else {
        Err(BagError::Exists {
            path: path.to_owned(),
        })
    }
}

/// Whether a directory holds nothing but what a bag consists of: only such a one may be removed.
fn is_bag_directory(path: &Path) -> Result<bool, BagError> {
    for entry in fs::read_dir(path).map_err(io_error(path, "read"))? {
        let entry = entry.map_err(io_error(path, "read"))?.path();
        if entry.is_dir()
            || !(is_single_file(&entry)
                || entry
                    .file_name()
                    .is_some_and(|name| name == "metadata.yaml"))
        {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Removes a bag directory, where there is one; refuses to remove any other.
pub(crate) fn remove_bag(path: &Path) -> Result<(), BagError> {
    if !path.exists() {
        return Ok(());
    }
    if !is_bag_directory(path)? {
        return Err(BagError::Exists {
            path: path.to_owned(),
        });
    }
    fs::remove_dir_all(path).map_err(io_error(path, "replace"))
}
