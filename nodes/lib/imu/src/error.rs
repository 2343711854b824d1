//! What can go wrong.

use std::path::PathBuf;

use cromosim_body::BodyError;
use cromosim_spatial::plausible::Oddity;
use cromosim_spatial::{SpatialError, Stamp, meant};
use thiserror::Error;

/// Errors of this crate.
#[derive(Debug, Error)]
pub enum ImuError {
    /// A file that cannot be read.
    #[error("{}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file that is not YAML, or has wrong or unknown fields.
    #[error("{file}: {problem}")]
    Yaml {
        /// The file's name.
        file: String,
        /// Why, with line and column.
        problem: String,
    },
    /// A bandwidth that the frames do not resolve.
    #[error(
        "bandwidth {bandwidth_hz} Hz: expected more than 0 and at most {highest_hz:.1} Hz, half the rate of the motion's frames"
    )]
    Bandwidth {
        /// What was asked for.
        bandwidth_hz: f64,
        /// Half the frames' rate.
        highest_hz: f64,
    },
    /// A file of another kind or version.
    #[error("{file}: schema: expected `{expected}`, found `{found}`")]
    Schema {
        /// The file's name.
        file: String,
        /// The schema that is read here.
        expected: &'static str,
        /// The schema the file names.
        found: String,
    },
    /// A placement that makes no sense.
    #[error("{file}: placement `{placement}`: {field}: {problem}")]
    Placement {
        /// The file's name.
        file: String,
        /// The placement's name, or its number in the list where it has none.
        placement: String,
        /// The field.
        field: &'static str,
        /// What is wrong with it.
        problem: PlacementProblem,
    },
    /// A site that the body does not have.
    #[error("placement `{placement}`: {source}")]
    Site {
        /// The placement's name.
        placement: String,
        /// Why.
        source: Box<BodyError>,
    },
    /// A number that no placement has.
    #[error("placement `{placement}`: {field}: {oddity}")]
    Impossible {
        /// The placement's name.
        placement: String,
        /// The field.
        field: &'static str,
        /// What, and why.
        oddity: Box<Oddity>,
    },
    /// A triangle without area cannot carry a sensor.
    #[error("placement `{placement}`: triangle {triangle} has no area; choose a neighbour")]
    FlatTriangle {
        /// The placement's name.
        placement: String,
        /// The triangle.
        triangle: u32,
    },
    /// An unknown scheme.
    #[error("unknown scheme `{name}`; known are {known}{}", meant(name, known.split(", ")))]
    UnknownScheme {
        /// The name given.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A device that is neither embedded nor a file.
    #[error("unknown device `{name}`; known are {known}, or give the path of a .yaml file{}", meant(name, known.split(", ")))]
    UnknownDevice {
        /// The name given.
        name: String,
        /// The embedded devices.
        known: String,
    },
    /// A device's number that makes no sense.
    #[error("{file}: {field}: {value} is not a finite number of at least zero")]
    DeviceNumber {
        /// The file's name.
        file: String,
        /// The field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// A magnetometer that makes no sense.
    #[error("{file}: {problem}")]
    Magnetometer {
        /// The file's name.
        file: String,
        /// Field, value, what was expected.
        problem: String,
    },
    /// No magnetic field.
    #[error("magnetic field {from}: {problem}")]
    Field {
        /// The file, or what was given.
        from: String,
        /// What is wrong, what was expected.
        problem: String,
    },
    /// An unknown source of orientations.
    #[error("unknown orientation `{name}`; known are {known}{}", meant(name, known.split(", ")))]
    UnknownOrientation {
        /// The name given.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A file of Kalibr's that does not say what it should.
    #[error("{file}: {problem}")]
    Kalibr {
        /// The file's name.
        file: String,
        /// The place, what is wrong, what was expected.
        problem: String,
    },
    /// Readings that do not show a device's noise at rest.
    #[error("{problem}")]
    NotStatic {
        /// What is wrong, and what would help.
        problem: String,
    },
    /// An effect that belongs to a recording, in the file of a live device.
    #[error(
        "{file}: `{effect}` is an effect of a recording's reference; a device has none: take it out here and use it with `simulate --reference --effects`"
    )]
    ReferenceEffect {
        /// The file's name.
        file: String,
        /// The effect.
        effect: &'static str,
    },
    /// Frames that cannot be differentiated.
    #[error("trajectory: {0}")]
    Trajectory(#[from] SpatialError),
    /// A live frame that does not come after the one before.
    #[error("frame at {} ns does not come after {} ns; reset the stream where the source jumps back", next.nanos, previous.nanos)]
    FrameNotIncreasing {
        /// Stamp of the frame before.
        previous: Stamp,
        /// Its own stamp.
        next: Stamp,
    },
    /// A live frame with NaN or infinity.
    #[error("frame at {} ns is not finite", stamp.nanos)]
    FrameNotFinite {
        /// Its stamp.
        stamp: Stamp,
    },
}

/// What is wrong with an effect.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EffectError {
    /// No effect of this name.
    #[error("unknown effect `{effect}`; the nearest is {nearest}")]
    UnknownEffect {
        /// The name given.
        effect: String,
        /// The name that is most like it.
        nearest: &'static str,
    },
    /// The name of what a diagnosis could not explain.
    #[error(
        "`unknown` says that a gap has a cause without a model; it cannot be simulated: take the entry out"
    )]
    NotSimulated,
    /// Two of one kind.
    #[error("a second `{effect}`; give each effect once")]
    Repeated {
        /// The effect.
        effect: &'static str,
    },
    /// A parameter that the effect does not have.
    #[error("{effect}: unknown field `{field}`; expected {expected}{}", meant(field, expected.split(", ")))]
    UnknownField {
        /// The effect.
        effect: &'static str,
        /// The field.
        field: String,
        /// The fields that there are.
        expected: String,
    },
    /// A parameter that is missing or given twice.
    #[error("{effect}: {field}: expected once")]
    NotOnce {
        /// The effect.
        effect: &'static str,
        /// The field.
        field: &'static str,
    },
    /// A parameter of another form.
    #[error("{effect}: {field}: expected {expected}")]
    Malformed {
        /// The effect.
        effect: &'static str,
        /// The field.
        field: String,
        /// What it must be.
        expected: &'static str,
    },
    /// A word that is none of the choices.
    #[error("{effect}: {field}: expected one of {words}")]
    NoChoice {
        /// The effect.
        effect: &'static str,
        /// The field.
        field: &'static str,
        /// The choices.
        words: String,
    },
    /// A wrong number of flat values.
    #[error("{effect}: expected {expected} values, found {found}")]
    Length {
        /// The effect.
        effect: &'static str,
        /// Values of all parameters.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value out of bounds, or NaN.
    #[error("{effect}: {field}: {value} is out of range; expected {lower} to {upper}")]
    OutOfRange {
        /// The effect.
        effect: &'static str,
        /// The field.
        field: &'static str,
        /// The value.
        value: f64,
        /// The least.
        lower: f64,
        /// The greatest.
        upper: f64,
    },
}

/// What is wrong with a placement's field.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlacementProblem {
    /// Wrong type, or an unknown field.
    #[error("{message}")]
    Malformed {
        /// What the reader found.
        message: String,
    },
    /// No value, and no default for it in the file.
    #[error("missing; give it here or under `defaults`")]
    Missing,
    /// None or several of `site`, `triangle` with `barycentrics`, and `point`.
    #[error(
        "{given} of `site`, `triangle` with `barycentrics` and `point` given; give exactly one"
    )]
    OneSite {
        /// How many are given.
        given: usize,
    },
    /// None or several of the forms of a rotation.
    #[error("{given} of `rotvec`, `quaternion_xyzw` and `matrix` given; give exactly one")]
    OneRotation {
        /// How many are given.
        given: usize,
    },
    /// A name that cannot be part of a ROS topic.
    #[error(
        "`{name}` is no ROS name: letters, digits and single underscores, not starting with a digit"
    )]
    BadName {
        /// The name.
        name: String,
    },
    /// Two placements of one name.
    #[error("there is another placement of this name")]
    Duplicate,
    /// A number out of its range.
    #[error("{value} is out of range; {range}")]
    OutOfRange {
        /// The number.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// A rotation that is none.
    #[error("{0}")]
    NotARotation(SpatialError),
    /// A number that no placement has.
    #[error("{0}")]
    Impossible(Oddity),
}
