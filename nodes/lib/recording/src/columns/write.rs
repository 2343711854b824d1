//! The table in a file.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::data_type::{ByteArray, ByteArrayType, DataType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::ColumnDescPtr;

use super::channel_pages::ChannelPages;
use super::schema::{CHANNELS, properties, schema};
use crate::datasets::{ActivitySpan, DatasetRecording};
use crate::{RecordingError, write_file_with};

/// Rows of a group, and of what is in memory at once: 32 MB.
pub const MAX_GROUP: usize = 1 << 20;

/// What a file says of all its rows.
#[derive(Clone, Debug)]
pub struct ColumnsHeader {
    /// The recording's name, in every row.
    pub recording: String,
    /// How the readings were made, by key.
    pub metadata: BTreeMap<String, String>,
}

/// Readings of one placement, in order of time; all lists have the same length.
#[derive(Clone, Debug, Default)]
pub struct ColumnsGroup {
    /// Who.
    pub person: String,
    /// Where.
    pub placement: String,
    /// Which simulation of several.
    pub draw: i32,
    /// ns.
    pub stamps: Vec<i64>,
    /// Specific force x, y, z, m/s2, and angular velocity x, y, z, rad/s.
    pub channels: [Vec<f32>; 6],
    /// What was done at each stamp; empty where nothing is known.
    pub activities: Vec<Option<String>>,
}

impl ColumnsGroup {
    /// Adds a reading at the end.
    pub fn push(&mut self, stamp_ns: i64, values: [f64; 6]) {
        self.stamps.push(stamp_ns);
        for (channel, value) in self.channels.iter_mut().zip(values) {
            channel.push(value as f32);
        }
    }

    /// The same placement, without readings.
    fn clear(&mut self) {
        self.stamps.clear();
        self.activities.clear();
        self.channels.iter_mut().for_each(Vec::clear);
    }
}

/// Writes groups of rows one after the other.
pub struct ColumnsWriter<'a> {
    file: SerializedFileWriter<&'a mut (dyn Write + Send)>,
    /// Of the channels, in their order.
    columns: Vec<ColumnDescPtr>,
    pages: ChannelPages,
    recording: ByteArray,
    rows: u64,
    path: PathBuf,
}

impl<'a> ColumnsWriter<'a> {
    /// Begins the file that will be at `path`.
    ///
    /// # Errors
    /// [`RecordingError::WriteColumns`].
    pub fn new(
        file: &'a mut (dyn Write + Send),
        path: &Path,
        header: &ColumnsHeader,
    ) -> Result<Self, RecordingError> {
        let begin = || {
            let properties = Arc::new(properties(&header.metadata)?);
            let pages = ChannelPages::new(properties.clone())?;
            Ok((
                SerializedFileWriter::new(file, schema()?, properties)?,
                pages,
            ))
        };
        let (file, pages) = begin().map_err(cannot_write(path))?;
        let columns = file.schema_descr().columns().iter();
        Ok(Self {
            columns: columns
                .filter(|it| CHANNELS.contains(&it.name()))
                .cloned()
                .collect(),
            pages,
            file,
            recording: header.recording.as_str().into(),
            rows: 0,
            path: path.to_owned(),
        })
    }

    /// Adds these readings, and takes them out of the group.
    ///
    /// # Errors
    /// [`RecordingError::WriteColumns`].
    pub fn write(&mut self, group: &mut ColumnsGroup) -> Result<(), RecordingError> {
        if group.stamps.is_empty() {
            return Ok(());
        }
        self.write_group(group).map_err(cannot_write(&self.path))?;
        self.rows += group.stamps.len() as u64;
        group.clear();
        Ok(())
    }

    fn write_group(&mut self, group: &ColumnsGroup) -> Result<(), ParquetError> {
        let count = group.stamps.len();
        let mut rows = self.file.next_row_group()?;
        let texts = [&group.person, &group.placement].map(|text| text.as_str().into());
        for text in std::iter::once(&self.recording).chain(&texts) {
            column::<ByteArrayType>(&mut rows, &vec![text.clone(); count], None)?;
        }
        column::<Int32Type>(&mut rows, &vec![group.draw; count], None)?;
        column::<Int64Type>(&mut rows, &group.stamps, None)?;
        for (column, channel) in self.columns.iter().zip(&group.channels) {
            self.pages.write(&mut rows, column.clone(), channel)?;
        }
        let known = group.activities.iter().flatten();
        let known: Vec<ByteArray> = known.map(|activity| activity.as_str().into()).collect();
        let mut levels = vec![0; count];
        for (level, activity) in levels.iter_mut().zip(&group.activities) {
            *level = i16::from(activity.is_some());
        }
        column::<ByteArrayType>(&mut rows, &known, Some(&levels))?;
        rows.close()?;
        Ok(())
    }

    /// Adds to what the file says of itself.
    pub fn note(&mut self, key: &str, value: String) {
        let entry = KeyValue::new(key.to_owned(), value);
        self.file.append_key_value_metadata(entry);
    }

    /// Ends the file; gives the number of its rows.
    ///
    /// # Errors
    /// [`RecordingError::WriteColumns`].
    pub fn finish(self) -> Result<u64, RecordingError> {
        self.file.close().map_err(cannot_write(&self.path))?;
        Ok(self.rows)
    }
}

fn cannot_write(path: &Path) -> impl Fn(ParquetError) -> RecordingError {
    let path = path.to_owned();
    move |source| RecordingError::WriteColumns {
        path: path.clone(),
        source,
    }
}

/// The next column of the group; `levels` are 1 where there is a value.
fn column<T: DataType>(
    rows: &mut SerializedRowGroupWriter<'_, &mut (dyn Write + Send)>,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let missing = || ParquetError::General("more columns than the schema has".to_owned());
    let mut next = rows.next_column()?.ok_or_else(missing)?;
    next.typed::<T>().write_batch(values, levels, None)?;
    next.close()
}

/// Writes every IMU of a recording, with what was done.
pub(crate) fn write_recording_columns(
    recording: &DatasetRecording,
    header: &ColumnsHeader,
    path: &Path,
    replace: bool,
) -> Result<(), RecordingError> {
    write_file_with(path, replace, |file| {
        let mut writer = ColumnsWriter::new(file, path, header)?;
        for imu in &recording.imus {
            let mut group = ColumnsGroup {
                person: "0".to_owned(),
                placement: imu.placement.clone(),
                ..ColumnsGroup::default()
            };
            for (stamp, reading) in imu.series.stamps.iter().zip(imu.series.readings()) {
                let (f, w) = (reading.specific_force, reading.angular_velocity);
                group.push(stamp.nanos, [f.x, f.y, f.z, w.x, w.y, w.z]);
                if !recording.activities.is_empty() {
                    let done = |span: &&ActivitySpan| (span.start..=span.end).contains(stamp);
                    let span = recording.activities.iter().find(done);
                    let activity = span.map(|span| span.activity.clone());
                    group.activities.push(activity);
                }
                if group.stamps.len() == MAX_GROUP {
                    writer.write(&mut group)?;
                }
            }
            writer.write(&mut group)?;
        }
        writer.finish()?;
        Ok(())
    })
}
