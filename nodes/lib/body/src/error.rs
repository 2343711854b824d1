//! What can go wrong with a body.

use std::io;
use std::path::PathBuf;

/// An error of this crate; the message names the file, the key and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The file cannot be opened.
    #[error("{}: cannot open the body file: {source}", path.display())]
    Open {
        /// The body file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file is no archive of arrays.
    #[error("{}: not an npz archive ({source}); convert a .pkl model to npz with numpy.savez first", path.display())]
    Archive {
        /// The body file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// An array is missing.
    #[error("{}: key {key} is missing; an SMPL file holds v_template, shapedirs, posedirs, J_regressor, weights, kintree_table and f", path.display())]
    MissingKey {
        /// The body file.
        path: PathBuf,
        /// The array.
        key: String,
    },
    /// An array cannot be decoded.
    #[error("{}: key {key}: unreadable: {source}", path.display())]
    Unreadable {
        /// The body file.
        path: PathBuf,
        /// The array.
        key: String,
        /// The reason.
        source: io::Error,
    },
    /// An array holds elements of a type that does not suit.
    #[error("{}: key {key}: elements are {found}, expected {expected}", path.display())]
    ElementType {
        /// The body file.
        path: PathBuf,
        /// The array.
        key: String,
        /// numpy's type description in the file.
        found: String,
        /// What suits.
        expected: &'static str,
    },
    /// An array has an unsuitable shape.
    #[error("{}: key {key}: shape is {found:?}, expected {expected}", path.display())]
    Shape {
        /// The body file.
        path: PathBuf,
        /// The array.
        key: String,
        /// The shape in the file.
        found: Vec<u64>,
        /// What suits.
        expected: String,
    },
    /// An array is larger than any body.
    #[error("{}: key {key}: {bytes} bytes, more than the {limit} that a body may have", path.display())]
    TooLarge {
        /// The body file.
        path: PathBuf,
        /// The array.
        key: String,
        /// Its size.
        bytes: u64,
        /// The largest allowed.
        limit: u64,
    },
    /// The file holds another kind of body.
    #[error("{}: key posedirs: {columns} columns, so this is {found}; only SMPL (207 columns, 24 joints) can be read", path.display())]
    BodyType {
        /// The body file.
        path: PathBuf,
        /// posedirs' last dimension.
        columns: u64,
        /// The kind of body that has so many.
        found: &'static str,
    },
    /// A value is NaN or infinite.
    #[error("{}: key {key}: element {element} (C order) is {value}", path.display())]
    NotFinite {
        /// The body file.
        path: PathBuf,
        /// The array.
        key: String,
        /// Flat index, last dimension fastest.
        element: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A triangle names a vertex that is not there.
    #[error("{}: key f: triangle {triangle} names vertex {vertex}, but there are {vertex_count} (0-based)", path.display())]
    TriangleVertex {
        /// The body file.
        path: PathBuf,
        /// The triangle.
        triangle: usize,
        /// What it names.
        vertex: i64,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// The skeleton is not SMPL's.
    #[error("{}: key kintree_table: joint {joint} hangs on {found}, in SMPL on {expected}", path.display())]
    Skeleton {
        /// The body file.
        path: PathBuf,
        /// The joint.
        joint: usize,
        /// Its parent in the file.
        found: i64,
        /// Its parent in SMPL.
        expected: i64,
    },
    /// The skin weights of a vertex, or the regressor weights of a joint, do not sum to one.
    #[error("{}: key {key}: row {row} sums to {sum}, expected 1", path.display())]
    WeightSum {
        /// The body file.
        path: PathBuf,
        /// The array.
        key: String,
        /// The vertex (weights) or joint (J_regressor).
        row: usize,
        /// The sum.
        sum: f64,
    },
    /// More shape coefficients than the body has.
    #[error("{given} betas given, but body {body} has {available}; fewer are allowed, the rest is 0")]
    TooManyBetas {
        /// The body's id.
        body: String,
        /// How many were given.
        given: usize,
        /// How many there are.
        available: usize,
    },
    /// A shape coefficient is NaN or infinite.
    #[error("beta {index} is {value}; betas are finite numbers of standard deviations")]
    BetaNotFinite {
        /// Which one.
        index: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A vertex that the body does not have.
    #[error("vertex {vertex} asked for, but body {body} has {vertex_count} (0-based)")]
    UnknownVertex {
        /// The body's id.
        body: String,
        /// The vertex.
        vertex: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A site name that the body does not have.
    #[error("site {name} is unknown on body {body}; nearest name: {nearest}")]
    UnknownSite {
        /// The body's id.
        body: String,
        /// The name.
        name: String,
        /// The known name with the least edits.
        nearest: String,
    },
    /// A triangle that the body does not have.
    #[error("triangle {triangle} asked for, but body {body} has {triangle_count} (0-based)")]
    UnknownTriangle {
        /// The body's id.
        body: String,
        /// The triangle.
        triangle: u32,
        /// Number of triangles.
        triangle_count: usize,
    },
    /// Barycentrics that name no point of the triangle.
    #[error("barycentrics {barycentrics:?} are no point of a triangle; expected three numbers in [0, 1] that sum to 1")]
    Barycentrics {
        /// What was given.
        barycentrics: [f64; 3],
    },
    /// A point from which no nearest surface follows.
    #[error("point {point:?} is not finite; expected metres in the model frame (x left, y up, z forward)")]
    PointNotFinite {
        /// What was given.
        point: [f64; 3],
    },
    /// A name that no joint has.
    #[error("joint {name} is unknown; joints are named as in SMPL: pelvis, left_hip, … right_hand")]
    UnknownJoint {
        /// The name.
        name: String,
    },
    /// A file cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}
