//! Mending bags that a killed recorder, a full disk or a cut left unfinished.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::chunk::{ChunkHeader, HEADER_AT_MOST, inner_records, unpack};
use crate::contents::{Channels, MessageHead, read_metadata};
use crate::error::{BagError, io_error};
use crate::metadata::Information;
use crate::stream::{Compression, StreamWriter};
use crate::summary::BagSummary;
use crate::walk::{Fields, HEADER_BYTES, RecordAt, Step, Walker, op, parse_attachment, stamp};
use crate::writer::{is_single_file, name_of, parent_of, temporary};

/// What [`recover`] found and kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recovery {
    /// Topics, counts and time range of the mended bag.
    pub summary: BagSummary,
    /// Bytes of damaged records from which no message could be taken; counted unpacked inside a
    /// chunk that was cut.
    pub bytes_lost: u64,
    /// The damage, in order; empty where the bag was whole, or lacked its end alone.
    pub damages: Vec<Damage>,
}

/// A place where a bag is damaged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The damaged MCAP file.
    pub path: PathBuf,
    /// Start of the damaged record, bytes from the start of the file.
    pub at: u64,
    /// What is wrong.
    pub reason: String,
}

impl Recovery {
    /// Messages in the mended bag.
    pub fn messages_kept(&self) -> u64 {
        self.summary.message_count()
    }

    fn add(&mut self, other: Self) {
        self.summary.add(&other.summary);
        self.bytes_lost += other.bytes_lost;
        self.damages.extend(other.damages);
    }
}

/// Writes a whole bag with all that is readable in the bag `path` to `output`, which may be `path`
/// itself.
///
/// For a directory, every `.mcap` file in it is mended and `metadata.yaml` made anew. Whole chunks
/// whose checksum fails are left out; of a cut chunk, the messages that are whole are kept.
/// `output` appears only when it is complete.
///
/// # Errors
/// [`BagError::NotMcap`] where not even the start of a bag is there, [`BagError::NoMetadata`] for a
/// directory without `.mcap` files, [`BagError::Exists`] where `output` is another bag,
/// [`BagError::Io`].
pub fn recover(path: &Path, output: &Path) -> Result<Recovery, BagError> {
    let found = fs::canonicalize(path).map_err(io_error(path, "open"))?;
    let in_place = fs::canonicalize(output).is_ok_and(|there| there == found);
    if !in_place && fs::symlink_metadata(output).is_ok() {
        return Err(BagError::Exists {
            path: output.to_owned(),
        });
    }
    if found.is_dir() {
        recover_directory(path, output, in_place)
    } else {
        recover_file(path, output)
    }
}

/// The MCAP files in a directory: `NAME_2` before `NAME_10`.
fn bag_files(directory: &Path) -> Result<Vec<PathBuf>, BagError> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).map_err(io_error(directory, "read"))? {
        let file = entry.map_err(io_error(directory, "read"))?.path();
        // Hidden ones are halves of an earlier attempt.
        if is_single_file(&file) && file.is_file() && !name_of(&file).starts_with('.') {
            files.push(file);
        }
    }
    files.sort_by_key(|file| (name_of(file).len(), name_of(file)));
    if files.is_empty() {
        Err(BagError::NoMetadata {
            path: directory.to_owned(),
        })
    } else {
        Ok(files)
    }
}

fn recover_directory(path: &Path, output: &Path, in_place: bool) -> Result<Recovery, BagError> {
    let files = bag_files(path)?;
    if !in_place {
        fs::create_dir(output).map_err(io_error(output, "create"))?;
    }
    let (mut all, mut summaries) = (Recovery::default(), Vec::new());
    for file in &files {
        let one = recover_file(file, &output.join(name_of(file)))?;
        summaries.push((name_of(file), one.summary.clone()));
        all.add(one);
    }
    let counted: Vec<(String, &BagSummary)> = summaries
        .iter()
        .map(|(name, summary)| (name.clone(), summary))
        .collect();
    let target = output.join("metadata.yaml");
    let mut metadata = temporary(&target)
        .tempfile_in(output)
        .map_err(io_error(&target, "create"))?;
    metadata
        .write_all(Information::from_summaries(&counted).yaml().as_bytes())
        .map_err(io_error(&target, "write"))?;
    metadata
        .persist(&target)
        .map_err(|error| io_error(&target, "write")(error.error))?;
    Ok(all)
}

fn recover_file(path: &Path, output: &Path) -> Result<Recovery, BagError> {
    let input = File::open(path).map_err(io_error(path, "open"))?;
    let mut walker = Walker::new(input)
        .map_err(io_error(path, "read"))?
        .ok_or_else(|| BagError::NotMcap {
            path: path.to_owned(),
        })?;
    let (file, temporary) = temporary(output)
        .tempfile_in(parent_of(output))
        .map_err(io_error(output, "create"))?
        .into_parts();
    let (compression, channels) = preview(path)?;
    let mut rescue = Rescue {
        path: path.to_owned(),
        writer: StreamWriter::new(BufWriter::new(file), output, compression)?,
        channels,
        recovery: Recovery::default(),
        data_ended: false,
    };
    loop {
        let step = walker.step().map_err(io_error(path, "read"))?;
        match step {
            Step::Whole(record) => rescue.whole(record, &mut walker)?,
            Step::Cut(record) => rescue.cut(record, &mut walker)?,
            Step::Ragged(at) => rescue.lose(
                at,
                walker.size() - at,
                "the file ends in the middle of a record",
            ),
            Step::Finished | Step::Ended => {}
        }
        if !matches!(step, Step::Whole(_)) {
            break;
        }
    }
    let Rescue {
        writer,
        mut recovery,
        ..
    } = rescue;
    let (_, summary) = writer.finish(&name_of(output))?;
    temporary
        .persist(output)
        .map_err(|error| io_error(output, "write")(error.error))?;
    recovery.summary = summary;
    Ok(recovery)
}

/// What a first look at a file tells: how it is packed, and the channels that its index repeats, in
/// case the chunk that defines them is damaged.
fn preview(path: &Path) -> Result<(Compression, Channels), BagError> {
    let input = File::open(path).map_err(io_error(path, "open"))?;
    let (mut compression, mut channels) = (None, Channels::default());
    let Some(mut walker) = Walker::new(input).map_err(io_error(path, "read"))? else {
        return Ok((Compression::None, channels));
    };
    loop {
        let step = walker.step().map_err(io_error(path, "read"))?;
        let (Step::Whole(record) | Step::Cut(record)) = step else {
            break;
        };
        match record.opcode {
            op::CHUNK if compression.is_none() => {
                let head = walker
                    .read_body(record, HEADER_AT_MOST)
                    .map_err(io_error(path, "read"))?;
                let packed = ChunkHeader::take(&mut Fields(&head))
                    .is_some_and(|header| !header.compression.is_empty());
                compression = Some(if packed {
                    Compression::Zstd
                } else {
                    Compression::None
                });
            }
            op::SCHEMA | op::CHANNEL => {
                let body = walker
                    .read_body(record, u64::MAX)
                    .map_err(io_error(path, "read"))?;
                // What is wrong with it is said when the data are taken over.
                let _ = channels.take(record.opcode, &body);
            }
            _ => {}
        }
        if matches!(step, Step::Cut(_)) {
            break;
        }
    }
    Ok((compression.unwrap_or_default(), channels))
}

/// Takes records over from a damaged file.
struct Rescue {
    path: PathBuf,
    writer: StreamWriter<BufWriter<File>>,
    channels: Channels,
    recovery: Recovery,
    /// What follows the data is index, which is made anew: no loss.
    data_ended: bool,
}

impl Rescue {
    fn lose(&mut self, at: u64, bytes: u64, reason: &str) {
        if !self.data_ended {
            self.recovery.bytes_lost += bytes;
            self.recovery.damages.push(Damage {
                path: self.path.clone(),
                at,
                reason: reason.to_owned(),
            });
        }
    }

    fn lose_record(&mut self, record: RecordAt, reason: &str) {
        self.lose(record.start, HEADER_BYTES + record.length, reason);
    }

    fn whole(&mut self, record: RecordAt, walker: &mut Walker<File>) -> Result<(), BagError> {
        if !matches!(
            record.opcode,
            op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::ATTACHMENT | op::METADATA
        ) {
            self.data_ended |= record.opcode == op::DATA_END;
            return Ok(());
        }
        let body = walker
            .read_body(record, u64::MAX)
            .map_err(io_error(&self.path, "read"))?;
        match record.opcode {
            op::CHUNK => {
                let unpacked = unpack(&body);
                match unpacked.fault {
                    None => self.inner(record, &unpacked.records)?,
                    Some(reason) => self.lose_record(record, &reason),
                }
            }
            op::ATTACHMENT => match parse_attachment(&body) {
                Some(attachment) => self.writer.attach_again(&attachment)?,
                None => self.lose_record(record, "an attachment that fails its checksum"),
            },
            op::METADATA => match read_metadata(&body) {
                // Ours is written at the end, with the counts of what was kept.
                Some((name, values))
                    if name == "rosbag2" && values.contains_key("serialized_metadata") => {}
                Some((name, values)) => self.writer.write_metadata(&name, values)?,
                None => self.lose_record(record, "metadata that is not well-formed"),
            },
            opcode => {
                if let Some(reason) = self.take(opcode, &body)? {
                    self.lose_record(record, &reason);
                }
            }
        }
        Ok(())
    }

    /// The last record, which is longer than the file.
    fn cut(&mut self, record: RecordAt, walker: &mut Walker<File>) -> Result<(), BagError> {
        let there = walker.size() - record.start;
        if record.opcode != op::CHUNK {
            self.lose(
                record.start,
                there,
                "the file ends in the middle of a record",
            );
            return Ok(());
        }
        let body = walker
            .read_body(record, u64::MAX)
            .map_err(io_error(&self.path, "read"))?;
        let unpacked = unpack(&body);
        let used: usize = inner_records(&unpacked.records)
            .map(|inner| HEADER_BYTES as usize + inner.body.len())
            .sum();
        self.inner(record, &unpacked.records)?;
        // Not even a header: nothing was unpacked, and the bytes in the file are what is lost.
        let lost = if unpacked.records.is_empty() {
            there
        } else {
            (unpacked.records.len() - used) as u64
        };
        self.lose(record.start, lost, "the file ends in the middle of a chunk");
        Ok(())
    }

    fn inner(&mut self, chunk: RecordAt, records: &[u8]) -> Result<(), BagError> {
        for inner in inner_records(records) {
            if let Some(reason) = self.take(inner.opcode, inner.body)? {
                self.lose(chunk.start, HEADER_BYTES + inner.body.len() as u64, &reason);
            }
        }
        Ok(())
    }

    /// Takes a schema, a channel or a message over; says why not, where it cannot.
    fn take(&mut self, opcode: u8, body: &[u8]) -> Result<Option<String>, BagError> {
        let mut fields = Fields(body);
        if opcode != op::MESSAGE {
            if let Err(reason) = self.channels.take(opcode, body) {
                return Ok(Some(reason));
            }
            // Topics without messages are kept too.
            if opcode == op::CHANNEL
                && let Some(topic) = fields.u16().and_then(|id| self.channels.topics.get(&id))
            {
                self.writer.add_channel(topic)?;
            }
            return Ok(None);
        }
        let Some(head) = MessageHead::take(&mut fields) else {
            return Ok(Some("a message without a whole header".to_owned()));
        };
        let Some(topic) = self.channels.topics.get(&head.channel) else {
            return Ok(Some(format!(
                "a message of the unknown channel {}",
                head.channel
            )));
        };
        let id = self.writer.add_channel(topic)?;
        self.writer.write_numbered(
            id,
            head.sequence,
            fields.0,
            stamp(head.log_time),
            stamp(head.publish_time),
        )?;
        Ok(None)
    }
}
