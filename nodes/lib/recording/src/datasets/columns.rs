//! Readings in columns (Parquet), as `simulate` and `convert` write them, or as any table that has
//! columns of these names: `stamp_ns`, `specific_force_x` to `_z` (m/s2) and `angular_velocity_x`
//! to `_z` (rad/s); `placement`, `person`, `draw`, `recording` and `activity` where there are any.
//!
//! Parquet is read by the crate `parquet`: the format is no business of ours. What a damaged file
//! may take of memory is bounded here, by rows.

use std::collections::{BTreeMap, BTreeSet};

use bytes::Bytes;
use cromosim_spatial::Stamp;
use nalgebra::Vector3;
use parquet::basic::{LogicalType, TimeUnit, Type as Physical};
use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::{
    ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type,
};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};

use super::{DatasetRecording, PlacedImu};
use crate::caught::caught;
use crate::columns::{ACTIVITY, CHANNELS, DRAW, PERSON, PLACEMENT, RECORDING_COLUMN, STAMP};
use crate::rigid::{RigidError, median_rate};

/// How Parquet begins.
pub(super) const MAGIC: [u8; 4] = *b"PAR1";
/// Values that are read at once.
const BATCH: usize = 1 << 14;
/// Rows that any file may have; a larger one as many more as it has bytes. A row that compression
/// leaves less than a byte of is no reading.
const FREE_ROWS: u64 = 1 << 20;

/// Reads a table. Several people's placements are named `person_NAME_PLACEMENT`, those of several
/// draws begin with `draw_NUMBER_`. Rows with an empty or infinite value, or not later than the row
/// before of their placement, are left out and counted.
///
/// # Errors
/// [`RigidError::Content`], which names the column; [`RigidError::Empty`].
pub fn parse_columns(bytes: Vec<u8>, name: &str) -> Result<DatasetRecording, RigidError> {
    // The crate takes some numbers of a file for granted, and panics where they are nonsense.
    caught(|| parse(bytes, name))
        .unwrap_or_else(|| Err(content(name, "Parquet", "the file is damaged")))
}

fn parse(bytes: Vec<u8>, name: &str) -> Result<DatasetRecording, RigidError> {
    let whole = |error| content(name, "Parquet", reason(error));
    let most = FREE_ROWS + bytes.len() as u64;
    let file = SerializedFileReader::new(Bytes::from(bytes)).map_err(whole)?;
    let table = Table::of(&file, name)?;
    let counts = file.metadata().row_groups().iter();
    let counts: Vec<u64> = counts
        .map(|group| u64::try_from(group.num_rows()).unwrap_or(u64::MAX))
        .collect();
    let rows = counts.iter().fold(0_u64, |sum, it| sum.saturating_add(*it));
    if rows > most {
        let problem = format!("{rows} rows cannot be in a file of its size; it is damaged");
        return Err(content(name, "Parquet", problem));
    }
    let mut all = Series::default();
    for (number, count) in counts.iter().enumerate() {
        let group = file.get_row_group(number).map_err(whole)?;
        table.read(group.as_ref(), *count as usize, &mut all)?;
    }
    all.into_recording(name)
}

fn content(name: &str, place: &str, problem: impl Into<String>) -> RigidError {
    RigidError::Content {
        name: name.to_owned(),
        place: place.to_owned(),
        problem: problem.into(),
    }
}

/// One line of what the crate says.
fn reason(error: ParquetError) -> String {
    let said = error.to_string().replace(['\n', '\r'], " ");
    format!("{said}; the file is damaged or cut off")
}

/// Where a table's columns are.
struct Table<'a> {
    name: &'a str,
    stamp: usize,
    channels: [(usize, Physical); 6],
    draw: Option<(usize, Physical)>,
    /// Recording, person, placement, activity.
    texts: [Option<usize>; 4],
}

impl<'a> Table<'a> {
    fn of(file: &dyn FileReader, name: &'a str) -> Result<Self, RigidError> {
        let descriptor = file.metadata().file_metadata().schema_descr_ptr();
        let columns = descriptor.columns();
        let names: Vec<String> = columns.iter().map(|it| it.path().string()).collect();
        let find = |wanted: &str, types: &[Physical]| -> Result<Option<_>, RigidError> {
            let Some(index) = names.iter().position(|own| own == wanted) else {
                return Ok(None);
            };
            let (column, physical) = (&columns[index], columns[index].physical_type());
            if !types.contains(&physical) || column.max_rep_level() > 0 {
                let expected = types.iter().map(ToString::to_string);
                let expected = expected.collect::<Vec<_>>().join(" or ");
                return Err(content(
                    name,
                    wanted,
                    format!("expected a column of {expected}, found {physical}"),
                ));
            }
            Ok(Some((index, physical)))
        };
        let need = |wanted: &str, types: &[Physical]| {
            find(wanted, types)?.ok_or_else(|| {
                let problem = format!("no such column; there are {}", names.join(", "));
                content(name, wanted, problem)
            })
        };
        let (stamp, _) = need(STAMP, &[Physical::INT64])?;
        if let Some(LogicalType::Timestamp(stamps)) = columns[stamp].logical_type_ref()
            && stamps.unit != TimeUnit::NANOS
        {
            return Err(content(name, STAMP, "expected nanoseconds"));
        }
        let mut channels = [(0, Physical::FLOAT); 6];
        for (channel, wanted) in channels.iter_mut().zip(CHANNELS) {
            *channel = need(wanted, &[Physical::FLOAT, Physical::DOUBLE])?;
        }
        let mut texts = [None; 4];
        let wanted = [RECORDING_COLUMN, PERSON, PLACEMENT, ACTIVITY];
        for (text, wanted) in texts.iter_mut().zip(wanted) {
            *text = find(wanted, &[Physical::BYTE_ARRAY])?.map(|(index, _)| index);
        }
        Ok(Self {
            name,
            stamp,
            channels,
            draw: find(DRAW, &[Physical::INT32, Physical::INT64])?,
            texts,
        })
    }

    /// Adds the rows of a group.
    fn read(
        &self,
        group: &dyn RowGroupReader,
        count: usize,
        all: &mut Series,
    ) -> Result<(), RigidError> {
        let damaged = |place: &'static str| {
            move |error: ParquetError| content(self.name, place, reason(error))
        };
        let stamps = column::<Int64Type>(group, self.stamp, count).map_err(damaged(STAMP))?;
        let mut channels = Vec::new();
        for ((index, physical), name) in self.channels.iter().zip(CHANNELS) {
            channels.push(numbers(group, *index, *physical, count).map_err(damaged(name))?);
        }
        let draws = self.draw.map(|(index, physical)| match physical {
            Physical::INT64 => column::<Int64Type>(group, index, count),
            _ => column::<Int32Type>(group, index, count)
                .map(|draws| draws.into_iter().map(|draw| draw.map(i64::from)).collect()),
        });
        let draws = draws.transpose().map_err(damaged(DRAW))?;
        let mut texts = Vec::new();
        for index in self.texts {
            let read = index.map(|index| column::<ByteArrayType>(group, index, count));
            texts.push(read.transpose().map_err(damaged("a text"))?);
        }
        for row in 0..count {
            let text = |which: usize| texts[which].as_ref().and_then(|all| all[row].as_ref());
            let key = Key {
                draw: draws.as_ref().and_then(|all| all[row]).unwrap_or(0),
                texts: [text(0), text(1), text(2)].map(Option::<&ByteArray>::cloned),
            };
            let values = channels.iter().map(|channel| channel[row]);
            let values: Option<Vec<f64>> = values.collect();
            let reading = stamps[row].zip(values);
            all.push(key, reading, text(3), self.name)?;
        }
        Ok(())
    }
}

/// All values of a column of a group; none where there is nothing.
fn column<T: DataType>(
    group: &dyn RowGroupReader,
    index: usize,
    count: usize,
) -> Result<Vec<Option<T::T>>, ParquetError> {
    let chunk = group.metadata().column(index);
    let most = chunk.column_descr().max_def_level();
    let mut reader = get_typed_column_reader::<T>(group.get_column_reader(index)?);
    let mut all = Vec::new();
    while all.len() < count {
        let (mut values, mut levels) = (Vec::new(), Vec::new());
        let wanted = BATCH.min(count - all.len());
        let (read, ..) = reader.read_records(wanted, Some(&mut levels), None, &mut values)?;
        if read == 0 {
            break;
        }
        let mut values = values.into_iter();
        if most == 0 {
            all.extend(values.map(Some));
        } else {
            let is_there = |level: i16| level == most;
            all.extend(
                levels
                    .into_iter()
                    .map(|level| is_there(level).then(|| values.next()).flatten()),
            );
        }
    }
    if all.len() == count {
        return Ok(all);
    }
    Err(ParquetError::General(format!(
        "{} rows, expected {count}",
        all.len()
    )))
}

/// Real numbers of either width.
fn numbers(
    group: &dyn RowGroupReader,
    index: usize,
    physical: Physical,
    count: usize,
) -> Result<Vec<Option<f64>>, ParquetError> {
    match physical {
        Physical::DOUBLE => column::<DoubleType>(group, index, count),
        _ => {
            let narrow = column::<FloatType>(group, index, count)?.into_iter();
            Ok(narrow.map(|value| value.map(f64::from)).collect())
        }
    }
}

/// Whose a row is.
#[derive(Clone, PartialEq)]
struct Key {
    draw: i64,
    /// Recording, person, placement.
    texts: [Option<ByteArray>; 3],
}

/// Whose a row is, as text.
type Name = (String, i64, String, String);

/// The series so far.
#[derive(Default)]
struct Series {
    names: BTreeMap<Name, usize>,
    imus: Vec<(Name, PlacedImu)>,
    /// Of the row before: most rows are the same's.
    last: Option<(Key, usize)>,
    /// With the activities of the first series: those of the others are the same.
    recording: DatasetRecording,
}

impl Series {
    fn push(
        &mut self,
        key: Key,
        reading: Option<(i64, Vec<f64>)>,
        activity: Option<&ByteArray>,
        name: &str,
    ) -> Result<(), RigidError> {
        let place = match self.last.take() {
            Some((last, place)) if last == key => place,
            _ => self.place(&key, name)?,
        };
        self.last = Some((key, place));
        let imu = &mut self.imus[place].1;
        let reading = reading.filter(|(stamp, values)| {
            let before = imu.series.stamps.last();
            values.iter().all(|value| value.is_finite())
                && before.is_none_or(|before| before.nanos < *stamp)
        });
        let Some((stamp, values)) = reading else {
            imu.rows_left_out += 1;
            return Ok(());
        };
        let stamp = Stamp::from_nanos(stamp);
        let vector = |first: usize| Vector3::from_row_slice(&values[first..first + 3]);
        imu.series.push(stamp, vector(0), vector(3));
        if let Some(activity) = activity.filter(|_| place == 0) {
            let activity = text(activity, ACTIVITY, name)?;
            self.recording.mark(stamp, &activity);
        }
        Ok(())
    }

    /// Where the series of a key is; a new one at the end.
    fn place(&mut self, key: &Key, name: &str) -> Result<usize, RigidError> {
        let columns = [RECORDING_COLUMN, PERSON, PLACEMENT];
        let mut texts = [String::new(), String::new(), "body".to_owned()];
        for ((own, value), column) in texts.iter_mut().zip(&key.texts).zip(columns) {
            if let Some(value) = value {
                *own = text(value, column, name)?;
            }
        }
        let [recording, person, placement] = texts;
        let full = (recording, key.draw, person, placement);
        let next = self.imus.len();
        let place = *self.names.entry(full.clone()).or_insert(next);
        if place == next {
            self.imus.push((full, PlacedImu::default()));
        }
        Ok(place)
    }

    fn into_recording(self, name: &str) -> Result<DatasetRecording, RigidError> {
        let recordings: BTreeSet<&str> = self.names.keys().map(|it| it.0.as_str()).collect();
        if recordings.len() > 1 {
            let first: Vec<&str> = recordings.iter().take(3).copied().collect();
            let problem = format!(
                "{} recordings ({}, ...); keep the rows of one",
                recordings.len(),
                first.join(", ")
            );
            return Err(content(name, RECORDING_COLUMN, problem));
        }
        let several_draws = self
            .names
            .keys()
            .map(|it| it.1)
            .collect::<BTreeSet<_>>()
            .len()
            > 1;
        let people = self.names.keys().map(|it| &it.2);
        let several_people = people.collect::<BTreeSet<_>>().len() > 1;
        let mut recording = self.recording;
        name.clone_into(&mut recording.name);
        for ((_, draw, person, placement), mut imu) in self.imus {
            let mut called = placement;
            if several_people {
                called = format!("person_{person}_{called}");
            }
            if several_draws {
                called = format!("draw_{draw}_{called}");
            }
            imu.placement = called;
            if !imu.series.stamps.is_empty() {
                recording.imus.push(imu);
            }
        }
        let Some(first) = recording.imus.first() else {
            return Err(RigidError::Empty {
                name: name.to_owned(),
            });
        };
        recording.rate_hz = median_rate(&first.series.stamps).unwrap_or(0.0);
        Ok(recording)
    }
}

fn text(value: &ByteArray, column: &str, name: &str) -> Result<String, RigidError> {
    let text = value.as_utf8().map(str::to_owned);
    text.map_err(|_| content(name, column, "not UTF-8 text"))
}
