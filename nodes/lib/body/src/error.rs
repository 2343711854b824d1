//! Errors of this crate.

use std::io;
use std::path::PathBuf;

use cromosim_arrays::ArraysError;

/// An error of this crate; the message names the file, the key and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// A file of arrays that cannot be read, or an array in it that does not suit.
    #[error(transparent)]
    Arrays(ArraysError),
    /// The file holds a body with a number of joints that neither SMPL, SMPL-H nor SMPL-X has.
    #[error("{}: key kintree_table: {joints} joints; bodies have 24 (SMPL), 52 (SMPL-H) or 55 (SMPL-X)", path.display())]
    BodyType {
        /// The body file.
        path: PathBuf,
        /// Joints of its kintree_table.
        joints: usize,
    },
    /// The file lacks an array that every body needs.
    #[error("{}: key {key} is missing; an SMPL file holds v_template, shapedirs, posedirs, J_regressor, weights, kintree_table and f", path.display())]
    MissingKey {
        /// The body file.
        path: PathBuf,
        /// SMPL's key of the array.
        key: String,
    },
    /// A triangle names a vertex that is not there.
    #[error("{}: key f: triangle {triangle} names vertex {vertex}, but there are {vertex_count} (0-based)", path.display())]
    TriangleVertex {
        /// The body file.
        path: PathBuf,
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex index that it holds.
        vertex: i64,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// The skeleton is not SMPL's.
    #[error("{}: key kintree_table: joint {joint} hangs on {found}, in SMPL on {expected}", path.display())]
    Skeleton {
        /// The body file.
        path: PathBuf,
        /// Index of the joint, from 0.
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
        /// `weights` or `J_regressor`.
        key: String,
        /// The vertex (weights) or joint (J_regressor).
        row: usize,
        /// What the row sums to.
        sum: f64,
    },
    /// Shape coefficients of one kind of body are given to another.
    #[error(
        "betas belong to {betas_of}, but body {body} has the shapes of {body_of}; name the file of their body (--body FILE, parameter `body`), or fit this one to their bone lengths (--source-body FILE, parameter `source_body`)"
    )]
    ForeignBetas {
        /// The body's id.
        body: String,
        /// Shape space (and gender) of the body, in words.
        body_of: String,
        /// Shape space (and gender) of the betas, in words.
        betas_of: String,
    },
    /// Shape coefficients without a known shape space.
    #[error(
        "betas of shape space '{given}'; say whose they are: smpl (SMPL and SMPL-H), smplx or cromosim (the embedded body)"
    )]
    UnknownShapeSpace {
        /// The word that was given, maybe empty.
        given: String,
    },
    /// More shape coefficients than the body has.
    #[error(
        "{given} betas given, but body {body} has {available}; fewer are allowed, the rest is 0"
    )]
    TooManyBetas {
        /// The body's id.
        body: String,
        /// Coefficients given.
        given: usize,
        /// Coefficients that the body has.
        available: usize,
    },
    /// A shape coefficient is NaN or infinite.
    #[error("beta {index} is {value}; betas are finite numbers of standard deviations")]
    BetaNotFinite {
        /// Index of the coefficient, from 0.
        index: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A vertex that the body does not have.
    #[error("vertex {vertex} asked for, but body {body} has {vertex_count} (0-based)")]
    UnknownVertex {
        /// The body's id.
        body: String,
        /// Index of the vertex, from 0.
        vertex: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A site name that the body does not have.
    #[error("site {name} is unknown on body {body}; nearest name: {nearest}")]
    UnknownSite {
        /// The body's id.
        body: String,
        /// The name that was asked for.
        name: String,
        /// The known name with the fewest edits.
        nearest: String,
    },
    /// A named site that has no place on a body from a file.
    #[error(
        "site {site} has no place on body {body}: no point of its skin is nearest; its vertices are too far apart"
    )]
    SiteTransfer {
        /// The body's id.
        body: String,
        /// The site's name.
        site: String,
    },
    /// A triangle that the body does not have.
    #[error("triangle {triangle} asked for, but body {body} has {triangle_count} (0-based)")]
    UnknownTriangle {
        /// The body's id.
        body: String,
        /// Index of the triangle, from 0.
        triangle: u32,
        /// Number of triangles.
        triangle_count: usize,
    },
    /// Barycentrics that name no point of the triangle.
    #[error(
        "barycentrics {barycentrics:?} are no point of a triangle; expected three numbers in [0, 1] that sum to 1"
    )]
    Barycentrics {
        /// The weights as given.
        barycentrics: [f64; 3],
    },
    /// A point with a coordinate that is NaN or infinite.
    #[error(
        "point {point:?} is not finite; expected metres in the model frame (x left, y up, z forward)"
    )]
    PointNotFinite {
        /// The point as given, m.
        point: [f64; 3],
    },
    /// A name that no joint has.
    #[error(
        "joint {name} is unknown; joints are named as in SMPL: pelvis, left_hip, … right_hand{meant}"
    )]
    UnknownJoint {
        /// The name as given.
        name: String,
        /// The nearest name, as [`cromosim_spatial::meant`] words it.
        meant: String,
    },
    /// A file cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
}
