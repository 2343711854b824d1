//! rosbag2's SQLite storage (`.db3`), its default until Humble.
//!
//! Tables: `topics` (id, name, type, serialization_format, offered_qos_profiles; since Iron
//! type_description_hash), `messages` (id, topic_id, timestamp in ns, data), since Iron
//! `message_definitions` (topic_type, encoding, encoded_message_definition).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_spatial::Stamp;
use rusqlite::{Connection, OpenFlags, Row};

use crate::error::BagError;
use crate::message::{Message, Selection};
use crate::summary::BagSummary;
use crate::topic::{HASH_KEY, QOS_KEY, Topic};

/// How an SQLite file begins.
pub(crate) const MAGIC: &[u8] = b"SQLite format 3\0";

/// A `.db3` file.
#[derive(Debug)]
pub(crate) struct SqliteFile {
    path: PathBuf,
    /// By their ids in the file; none for those outside the namespace that is looked at.
    pub(crate) topics: BTreeMap<i64, Option<Arc<Topic>>>,
    pub(crate) summary: BagSummary,
}

fn database_error(path: &Path) -> impl Fn(rusqlite::Error) -> BagError + '_ {
    move |error| BagError::Database {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}

/// Opens for reading alone. Where no recorder has left a journal beside it, nothing else can be
/// writing to it, and nothing is locked or written: files on read-only disks work.
fn connect(path: &Path) -> Result<Connection, BagError> {
    let beside = |ending: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        std::fs::metadata(PathBuf::from(name)).is_ok_and(|journal| journal.len() > 0)
    };
    let settled = !beside("-wal") && !beside("-journal");
    let mut uri = String::from("file:");
    for byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'/' | b'.' | b'-' | b'_' => uri.push(char::from(*byte)),
            letter if letter.is_ascii_alphanumeric() => uri.push(char::from(*letter)),
            other => uri.push_str(&format!("%{other:02X}")),
        }
    }
    uri.push_str("?mode=ro");
    if settled {
        uri.push_str("&immutable=1");
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
        | OpenFlags::SQLITE_OPEN_URI
        | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    Connection::open_with_flags(uri, flags).map_err(database_error(path))
}

impl SqliteFile {
    pub(crate) fn open(path: &Path) -> Result<Self, BagError> {
        let error = database_error(path);
        let connection = connect(path)?;
        let schemas = if has_table(&connection, "message_definitions").map_err(&error)? {
            read_schemas(&connection).map_err(&error)?
        } else {
            BTreeMap::new()
        };
        let topics = read_topics(&connection, &schemas).map_err(&error)?;
        let mut file = Self {
            path: path.to_owned(),
            topics,
            summary: BagSummary::default(),
        };
        file.summarise(&connection).map_err(&error)?;
        Ok(file)
    }

    fn summarise(&mut self, connection: &Connection) -> rusqlite::Result<()> {
        let mut counts: BTreeMap<i64, i64> = self.topics.keys().map(|id| (*id, 0)).collect();
        let mut statement = connection.prepare(
            "SELECT topic_id, COUNT(*), MIN(timestamp), MAX(timestamp) FROM messages GROUP BY topic_id",
        )?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            counts.insert(row.get(0)?, row.get(1)?);
            for column in [2, 3] {
                let nanos = row.get(column)?;
                self.summary.cover(Stamp { nanos });
            }
        }
        for (id, count) in counts {
            if let Some(Some(topic)) = self.topics.get(&id) {
                self.summary.count(topic, count.unsigned_abs());
            }
        }
        Ok(())
    }
}

fn has_table(connection: &Connection, name: &str) -> rusqlite::Result<bool> {
    let count: i64 = connection.query_row(
        "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = ?",
        [name],
        |row| row.get(0),
    )?;
    Ok(count > 0)
}

/// Encoding and text of each type.
fn read_schemas(connection: &Connection) -> rusqlite::Result<BTreeMap<String, (String, String)>> {
    connection
        .prepare(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions",
        )?
        .query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?
        .collect()
}

fn read_topics(
    connection: &Connection,
    schemas: &BTreeMap<String, (String, String)>,
) -> rusqlite::Result<BTreeMap<i64, Option<Arc<Topic>>>> {
    let topic = |row: &Row<'_>| {
        let (id, name, type_name): (i64, String, String) =
            (row.get("id")?, row.get("name")?, row.get("type")?);
        let mut topic = Topic::named(&name, &type_name);
        if topic.schema.is_empty()
            && let Some((encoding, text)) = schemas.get(&type_name)
        {
            topic.schema_encoding.clone_from(encoding);
            topic.schema = text.clone().into_bytes();
        }
        topic.message_encoding = row.get("serialization_format")?;
        for (column, key) in [
            ("offered_qos_profiles", QOS_KEY),
            ("type_description_hash", HASH_KEY),
        ] {
            // Columns that older versions do not have.
            if let Ok(text) = row.get::<_, String>(column) {
                topic.metadata.insert(key.to_owned(), text);
            }
        }
        Ok((id, Some(Arc::new(topic))))
    };
    connection
        .prepare("SELECT * FROM topics ORDER BY id")?
        .query_map([], topic)?
        .collect()
}

/// The messages of a `.db3` file: times at once, contents when their time comes.
pub(crate) struct SqliteMessages<'a> {
    file: &'a SqliteFile,
    connection: Connection,
    ahead: std::iter::Peekable<std::vec::IntoIter<Head>>,
}

/// A message but for its content.
struct Head {
    timestamp: i64,
    id: i64,
    topic: i64,
}

impl<'a> SqliteMessages<'a> {
    pub(crate) fn new(file: &'a SqliteFile, selection: &Selection) -> Result<Self, BagError> {
        let connection = connect(&file.path)?;
        let wanted = |id: i64| {
            file.topics
                .get(&id)
                .and_then(Option::as_ref)
                .is_some_and(|topic| selection.has_topic(&topic.name))
        };
        let read = || -> rusqlite::Result<Vec<Head>> {
            let mut statement = connection.prepare(
                "SELECT timestamp, id, topic_id FROM messages WHERE timestamp >= ? AND timestamp < ?",
            )?;
            let from = selection.from.map_or(i64::MIN, |from| from.nanos);
            let until = selection.until.map_or(i64::MAX, |until| until.nanos);
            let heads = statement.query_map([from, until], |row| {
                Ok(Head {
                    timestamp: row.get(0)?,
                    id: row.get(1)?,
                    topic: row.get(2)?,
                })
            })?;
            heads
                .filter(|head| head.as_ref().map_or(true, |head| wanted(head.topic)))
                .collect()
        };
        let mut heads = read().map_err(database_error(&file.path))?;
        heads.sort_unstable_by_key(|head| (head.timestamp, head.id));
        Ok(Self {
            file,
            connection,
            ahead: heads.into_iter().peekable(),
        })
    }

    pub(crate) fn peek_time(&mut self) -> Option<Stamp> {
        self.ahead.peek().map(|head| Stamp {
            nanos: head.timestamp,
        })
    }

    pub(crate) fn pop(&mut self) -> Result<Option<Message>, BagError> {
        let Some(head) = self.ahead.next() else {
            return Ok(None);
        };
        let Some(Some(topic)) = self.file.topics.get(&head.topic) else {
            return Ok(None);
        };
        let payload = self
            .connection
            .prepare_cached("SELECT data FROM messages WHERE id = ?")
            .and_then(|mut statement| statement.query_row([head.id], |row| row.get(0)))
            .map_err(database_error(&self.file.path))?;
        let time = Stamp {
            nanos: head.timestamp,
        };
        Ok(Some(Message {
            topic: Arc::clone(topic),
            sequence: 0,
            log_time: time,
            publish_time: time,
            payload,
        }))
    }
}
