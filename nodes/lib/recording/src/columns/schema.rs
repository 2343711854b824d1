//! Names, types and encodings of the columns.

use std::collections::BTreeMap;
use std::sync::Arc;

use parquet::basic::{Encoding, LogicalType, Repetition, Type as Physical};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::{ColumnPath, Type, TypePtr};

/// The file's or recording's name.
pub const RECORDING: &str = "recording";
/// Who, where a recording has several people; `0` elsewhere.
pub const PERSON: &str = "person";
/// The placement's name.
pub const PLACEMENT: &str = "placement";
/// Which of several simulations of the same motion; 0 elsewhere.
pub const DRAW: &str = "draw";
/// Nanoseconds since 1970, or since a second before the motion's begin.
pub const STAMP: &str = "stamp_ns";
/// m/s2 and rad/s in the sensor's axes.
pub const CHANNELS: [&str; 6] = [
    "specific_force_x",
    "specific_force_y",
    "specific_force_z",
    "angular_velocity_x",
    "angular_velocity_y",
    "angular_velocity_z",
];
/// What was done, where it is known.
pub const ACTIVITY: &str = "activity";

/// The same as Arrow says it, with units and categories, made by `scripts/make_arrow_schema.py`.
const ARROW_SCHEMA: &str = include_str!("arrow_schema.txt");
/// Where readers look for it.
const ARROW_KEY: &str = "ARROW:schema";

/// The table's type.
pub fn schema() -> Result<TypePtr> {
    let column = |name: &str, physical, repetition, logical| {
        let column = Type::primitive_type_builder(name, physical)
            .with_repetition(repetition)
            .with_logical_type(logical);
        column.build().map(Arc::new)
    };
    let text = |name, repetition| {
        column(
            name,
            Physical::BYTE_ARRAY,
            repetition,
            Some(LogicalType::String),
        )
    };
    let number = |name, physical| column(name, physical, Repetition::REQUIRED, None);
    let mut fields = Vec::new();
    for name in [RECORDING, PERSON, PLACEMENT] {
        fields.push(text(name, Repetition::REQUIRED)?);
    }
    fields.push(number(DRAW, Physical::INT32)?);
    fields.push(number(STAMP, Physical::INT64)?);
    for name in CHANNELS {
        fields.push(number(name, Physical::FLOAT)?);
    }
    fields.push(text(ACTIVITY, Repetition::OPTIONAL)?);
    let table = Type::group_type_builder("cromosim").with_fields(fields);
    table.build().map(Arc::new)
}

/// How it is written, with what the file says of itself.
pub fn properties(metadata: &BTreeMap<String, String>) -> Result<WriterProperties> {
    let mut entries = vec![KeyValue::new(ARROW_KEY.to_owned(), ARROW_SCHEMA.to_owned())];
    let said = metadata.iter();
    entries.extend(said.map(|(key, value)| KeyValue::new(key.clone(), value.clone())));
    let mut properties = WriterProperties::builder()
        .set_created_by(format!("cromosim version {}", env!("CARGO_PKG_VERSION")))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_key_value_metadata(Some(entries));
    let stamp = ColumnPath::from(STAMP);
    properties = properties
        .set_column_dictionary_enabled(stamp.clone(), false)
        .set_column_encoding(stamp, Encoding::DELTA_BINARY_PACKED);
    // Their pages are compressed on their way, see [`super::channel_pages`]; what else is small already is not. Nobody looks for readings by their size.
    for channel in CHANNELS.map(ColumnPath::from) {
        properties = properties
            .set_column_dictionary_enabled(channel.clone(), false)
            .set_column_encoding(channel.clone(), Encoding::BYTE_STREAM_SPLIT)
            .set_column_statistics_enabled(channel, EnabledStatistics::None);
    }
    Ok(properties.build())
}
