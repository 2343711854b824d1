//! Mending bags that a killed recorder, a full disk or a cut left unfinished.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use cromosim_spatial::Stamp;

use crate::chunk::{ChunkHeader, HEADER_AT_MOST, inner_records, unpack};
use crate::contents::{Channels, MessageHead, read_metadata};
use crate::error::{BagError, io_error};
use crate::metadata::Information;
use crate::resync::{Index, Search, chunk_length};
use crate::stream::{Compression, StreamWriter};
use crate::summary::BagSummary;
use crate::walk::{Fields, HEADER_BYTES, RecordAt, Step, Walker, op, parse_attachment, stamp};
use crate::writer::{is_single_file, name_of, parent_of, remove_bag, temporary};

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
    /// Messages that the bag held and the mended one does not; unknown where its index is gone.
    pub messages_lost: Option<u64>,
}

/// A place where a bag is damaged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The damaged MCAP file.
    pub path: PathBuf,
    /// Start of the damaged record, bytes from the start of the file.
    pub at: u64,
    /// Bytes of it from which nothing could be taken.
    pub bytes: u64,
    /// When the first and the last message of what is missing were recorded, where a header or the
    /// index says so.
    pub span: Option<[Stamp; 2]>,
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
        let both = self.messages_lost.zip(other.messages_lost);
        self.messages_lost = both.map(|(one, other)| one + other);
    }
}

/// Writes a whole bag with all that is readable in the bag `path` to `output`, which may be `path`
/// itself.
///
/// For a directory, every `.mcap` file in it is mended and `metadata.yaml` made anew. Whole chunks
/// whose checksum fails are left out; of a cut chunk, the messages that are whole are kept. Where a
/// record's header is damaged, it goes on at the next sound record. `output` appears only when it is
/// complete.
///
/// # Errors
/// [`BagError::NotRecoverable`] where not even the start of a bag is there, [`BagError::NoMetadata`] for a
/// directory without `.mcap` files, [`BagError::Exists`] where `output` is another bag,
/// [`BagError::Io`].
pub fn recover(path: &Path, output: &Path) -> Result<Recovery, BagError> {
    recover_over(path, output, false)
}

/// As [`recover`]; with `replace`, in place of a file or a bag directory at `output`.
///
/// # Errors
/// As [`recover`].
pub fn recover_over(path: &Path, output: &Path, replace: bool) -> Result<Recovery, BagError> {
    let found = fs::canonicalize(path).map_err(io_error(path, "open"))?;
    let in_place = fs::canonicalize(output).is_ok_and(|there| there == found);
    if !in_place && fs::symlink_metadata(output).is_ok() {
        if !replace || output.is_dir() != found.is_dir() {
            return Err(BagError::Exists {
                path: output.to_owned(),
            });
        }
        if output.is_dir() {
            remove_bag(output)?;
        }
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
    let mut all = Recovery {
        messages_lost: Some(0),
        ..Recovery::default()
    };
    let mut summaries = Vec::new();
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
    let input = cromosim_spatial::open_file(path).map_err(io_error(path, "open"))?;
    let mut walker = Walker::new(input)
        .map_err(io_error(path, "read"))?
        .ok_or_else(|| BagError::NotRecoverable {
            path: path.to_owned(),
        })?;
    let (file, temporary) = temporary(output)
        .tempfile_in(parent_of(output))
        .map_err(io_error(output, "create"))?
        .into_parts();
    let Preview {
        compression,
        channels,
        index,
        loose_messages,
    } = preview(path)?;
    let mut rescue = Rescue {
        path: path.to_owned(),
        writer: StreamWriter::new(BufWriter::new(file), output, compression)?,
        channels,
        index,
        search: Search::new(loose_messages),
        doubtful: None,
        recovery: Recovery::default(),
        data_ended: false,
    };
    while rescue.step(&mut walker)? {}
    let Rescue {
        writer,
        mut recovery,
        index,
        ..
    } = rescue;
    let (_, summary) = writer.finish(&name_of(output))?;
    recovery.messages_lost = index
        .messages
        .map(|held| held.saturating_sub(summary.message_count()));
    temporary
        .persist(output)
        .map_err(|error| io_error(output, "write")(error.error))?;
    recovery.summary = summary;
    Ok(recovery)
}

/// What a first look at a file tells: how it is packed, and what its index repeats, in case the
/// chunk that defines it is damaged.
struct Preview {
    compression: Compression,
    channels: Channels,
    index: Index,
    loose_messages: bool,
}

fn preview(path: &Path) -> Result<Preview, BagError> {
    let input = cromosim_spatial::open_file(path).map_err(io_error(path, "open"))?;
    let (mut compression, mut channels) = (None, Channels::default());
    let mut loose_messages = false;
    let Some(mut walker) = Walker::new(input).map_err(io_error(path, "read"))? else {
        return Err(BagError::NotRecoverable {
            path: path.to_owned(),
        });
    };
    let index = Index::read(&mut walker, &mut channels).map_err(io_error(path, "read"))?;
    while let Step::Whole(record) | Step::Cut(record) =
        walker.step().map_err(io_error(path, "read"))?
    {
        match record.opcode {
            op::CHUNK => {
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
            op::MESSAGE => loose_messages = true,
            _ => {}
        }
        if compression.is_some() || loose_messages || record.end() > walker.size() {
            break;
        }
    }
    Ok(Preview {
        compression: compression.unwrap_or_default(),
        channels,
        index,
        loose_messages,
    })
}

/// Takes records over from a damaged file.
struct Rescue {
    path: PathBuf,
    writer: StreamWriter<BufWriter<File>>,
    channels: Channels,
    index: Index,
    search: Search,
    /// Start of the record before, where its length may be damaged.
    doubtful: Option<u64>,
    recovery: Recovery,
    /// What follows the data is index, which is made anew: no loss.
    data_ended: bool,
}

impl Rescue {
    /// Takes the next record over, or finds the way again behind damage; `false` at the end.
    fn step(&mut self, walker: &mut Walker<File>) -> Result<bool, BagError> {
        let path = self.path.clone();
        let read = || io_error(&path, "read");
        let (record, whole) = match walker.step().map_err(read())? {
            Step::Whole(record) => (record, true),
            Step::Cut(record) => (record, false),
            Step::Ragged(at) => {
                let reason = "the file ends in the middle of a record";
                self.lose(at..walker.size(), None, reason);
                return Ok(false);
            }
            Step::Finished | Step::Ended => return Ok(false),
        };
        let known = self
            .search
            .continues(walker, record.start)
            .map_err(read())?;
        let follows = whole
            && self
                .search
                .continues(walker, record.end())
                .map_err(read())?;
        let is_chunk = record.opcode == op::CHUNK;
        if whole && is_chunk && !self.claims_a_chunk(record, walker)? {
            // Either of the two lengths is damaged; what follows tells which.
            if let Some(end) = self.of_chunk(record, walker)? {
                let own = self.search.row_begins(walker, end).map_err(read())?;
                walker.go_to(if own { end } else { record.end() });
                return Ok(true);
            }
        }
        let hidden = !is_chunk && self.hides_a_chunk(record, walker)?;
        if whole && known && !hidden && (follows || !is_chunk) {
            // Where nothing can follow, either its length is damaged or the next record.
            self.doubtful = (!follows).then_some(record.start);
            self.whole(record, walker)?;
            return Ok(true);
        }
        self.of_damaged_header(record, whole, walker)
    }

    /// A record whose kind or length is not what was written, or the last one of a file that was
    /// cut: goes on behind it where its content shows how long it is, else at the next sound one.
    fn of_damaged_header(
        &mut self,
        record: RecordAt,
        whole: bool,
        walker: &mut Walker<File>,
    ) -> Result<bool, BagError> {
        if let Some(end) = self.of_chunk(record, walker)? {
            walker.go_to(end);
            return Ok(true);
        }
        let from = self.doubtful.take().unwrap_or(record.start);
        let found = self
            .search
            .next_sound(walker, from + 1)
            .map_err(io_error(&self.path, "read"))?;
        let reason = "a record whose header is damaged";
        match found {
            Some(next) => {
                let start = if next < record.start {
                    from
                } else {
                    record.start
                };
                self.lose(start..next, None, reason);
                walker.go_to(next);
                Ok(true)
            }
            None if whole => {
                self.lose(record.start..walker.size(), None, reason);
                Ok(false)
            }
            None => {
                self.cut(record, walker)?;
                Ok(false)
            }
        }
    }

    /// Whether a record whose kind is damaged has the form of a chunk.
    fn hides_a_chunk(&self, record: RecordAt, walker: &mut Walker<File>) -> Result<bool, BagError> {
        let index_or_unknown = matches!(
            record.opcode,
            op::MESSAGE_INDEX | op::CHUNK_INDEX | op::SUMMARY_OFFSET | op::PRIVATE..
        );
        Ok(index_or_unknown && !self.data_ended && self.claims_a_chunk(record, walker)?)
    }

    /// Whether a record is as long as a chunk's header in it says.
    fn claims_a_chunk(
        &self,
        record: RecordAt,
        walker: &mut Walker<File>,
    ) -> Result<bool, BagError> {
        let head = walker
            .read_body(record, HEADER_AT_MOST)
            .map_err(io_error(&self.path, "read"))?;
        Ok(chunk_length(&head) == Some(record.length))
    }

    /// Where a chunk ends that begins here whatever its record's header says: one whose checksum
    /// is right, which is taken over, or one as long as its own header says, which is not.
    fn of_chunk(
        &mut self,
        record: RecordAt,
        walker: &mut Walker<File>,
    ) -> Result<Option<u64>, BagError> {
        let as_chunk = |length| RecordAt {
            opcode: op::CHUNK,
            length,
            ..record
        };
        let path = self.path.clone();
        let read = || io_error(&path, "read");
        if record.body() >= walker.size() {
            return Ok(None);
        }
        let head = walker
            .read_body(as_chunk(HEADER_AT_MOST), HEADER_AT_MOST)
            .map_err(read())?;
        let own = chunk_length(&head).map(as_chunk);
        let Some(chunk) = own.filter(|chunk| chunk.end() <= walker.size()) else {
            return Ok(None);
        };
        let body = walker.read_body(chunk, u64::MAX).map_err(read())?;
        let unpacked = unpack(&body);
        match unpacked.fault {
            None => self.inner(chunk, &unpacked.records)?,
            Some(_) if chunk == record => self.whole(record, walker)?,
            Some(_) => return Ok(None),
        }
        Ok(Some(chunk.end()))
    }

    /// Notes that a part of the file is lost, which was recorded in `span`, or as the index says.
    fn lose(&mut self, part: Range<u64>, span: Option<[Stamp; 2]>, reason: &str) {
        let bytes = part.end - part.start;
        let span = span.or_else(|| self.index.span(part.clone()));
        self.lose_bytes(part.start, bytes, span, reason);
    }

    fn lose_bytes(&mut self, at: u64, bytes: u64, span: Option<[Stamp; 2]>, reason: &str) {
        if !self.data_ended {
            self.recovery.bytes_lost += bytes;
            self.recovery.damages.push(Damage {
                path: self.path.clone(),
                at,
                bytes,
                span,
                reason: reason.to_owned(),
            });
        }
    }

    fn lose_record(&mut self, record: RecordAt, reason: &str) {
        self.lose(record.start..record.end(), None, reason);
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
                    Some(reason) => {
                        let header = ChunkHeader::take(&mut Fields(&body));
                        let claimed =
                            header.map(|header| [header.start_time, header.end_time].map(stamp));
                        let part = record.start..record.end();
                        let span = self.index.span(part.clone()).or(claimed);
                        self.lose(part, span, &reason);
                    }
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
            let part = record.start..walker.size();
            self.lose(part, None, "the file ends in the middle of a record");
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
        let reason = "the file ends in the middle of a chunk";
        self.lose_bytes(record.start, lost, None, reason);
        Ok(())
    }

    fn inner(&mut self, chunk: RecordAt, records: &[u8]) -> Result<(), BagError> {
        for inner in inner_records(records) {
            if let Some(reason) = self.take(inner.opcode, inner.body)? {
                let bytes = HEADER_BYTES + inner.body.len() as u64;
                self.lose_bytes(chunk.start, bytes, None, &reason);
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
