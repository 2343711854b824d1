//! What can go wrong with a file of a rigid body.

/// An error of [`crate::rigid`] and [`crate::datasets`]: one line that names the file, the place
/// and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RigidError {
    /// The file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: std::path::PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// No text.
    #[error("{name}, byte {offset}: not UTF-8 text")]
    NotText {
        /// The file.
        name: String,
        /// Where the text ends.
        offset: usize,
    },
    /// Something else was expected in a column.
    #[error("{name}, line {line}, column {column}: expected {expected}, found {found}")]
    Value {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// 1-based.
        column: usize,
        /// What fits.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A row has the wrong number of columns.
    #[error("{name}, line {line}: expected {expected} columns, found {found}")]
    Columns {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// What fits.
        expected: String,
        /// On this line.
        found: usize,
    },
    /// The header does not name what is needed.
    #[error("{name}, line {line}: the header names no {missing}; it has {}", found.join(", "))]
    Header {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// Which column.
        missing: String,
        /// The columns that are there.
        found: Vec<String>,
    },
    /// Time goes back or stands still.
    #[error(
        "{name}, line {line}: stamp {stamp_ns} ns is not after the {previous_ns} ns of the row before; sort the rows by time and remove repeated ones"
    )]
    Order {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// Of this row.
        stamp_ns: i64,
        /// Of the row before.
        previous_ns: i64,
    },
    /// A quaternion is no rotation.
    #[error(
        "{name}, line {line}: the quaternion has length {length}, expected 1 within 0.01; check the order of its columns"
    )]
    Quaternion {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// Found.
        length: f64,
    },
    /// No row with data.
    #[error("{name}: no rows of data")]
    Empty {
        /// The file.
        name: String,
    },
    /// An archive or an array that cannot be used.
    #[error("{name}: {place}: {problem}")]
    Content {
        /// The file.
        name: String,
        /// Array, member or sensor.
        place: String,
        /// What is wrong and what fits.
        problem: String,
    },
    /// A table's row.
    #[error("{name}: {source}")]
    Csv {
        /// The file.
        name: String,
        /// The reason, with its line.
        source: csv::Error,
    },
    /// A motion that is a recording, too, refuses.
    #[error(transparent)]
    Motion(Box<cromosim_motion::MotionError>),
    /// An array or its archive refuses.
    #[error(transparent)]
    Arrays(#[from] cromosim_arrays::ArraysError),
}
