//! Readings as columns (Parquet), for those who train on them: all placements of a recording in one
//! table, a row a reading. [`crate::datasets::parse_columns`] reads them back.
//!
//! One row group a placement, of a long one a part of 2^20 rows: whoever asks for one placement reads no
//! other. Text columns are dictionaries of one entry a group, stamps are differences, and channels
//! are split by byte before they are compressed, which noise allows least of all numbers. Rows are
//! float32: its 2e-7 is below any device's resolution.

mod channel_pages;
mod people;
mod schema;
mod write;

pub(crate) use schema::{
    ACTIVITY, CHANNELS, DRAW, PERSON, PLACEMENT, RECORDING as RECORDING_COLUMN, STAMP,
};
pub(crate) use write::write_recording_columns;
pub use write::{ColumnsGroup, ColumnsHeader, ColumnsWriter};
