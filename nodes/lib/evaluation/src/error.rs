//! What can go wrong.

use std::io;
use std::path::PathBuf;

use cromosim_arrays::ArraysError;
use cromosim_bag::BagError;
use cromosim_body::BodyError;
use cromosim_charts::ChartsError;
use cromosim_imu::{EffectError, ImuError};
use cromosim_learned::LearnedError;
use cromosim_motion::MotionError;
use cromosim_recording::RecordingError;
use cromosim_recording::datasets::DatasetFormat;
use cromosim_recording::rigid::RigidError;
use cromosim_spatial::SpatialError;

/// Errors of this crate; the message names the file, the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// The observer asked for the end.
    #[error("interrupted; what was being written is given up")]
    Interrupted,
    /// A file or folder cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A folder cannot be created.
    #[error("{}: cannot be made", path.display())]
    CreateFolder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// Results cannot be written as JSON.
    #[error("results")]
    Json(#[source] serde_json::Error),
    /// A file that is not YAML, or has wrong or unknown fields.
    #[error("{file}: {problem}")]
    Yaml {
        /// The file's name.
        file: String,
        /// The reason, with line and column.
        problem: String,
    },
    /// A file of another kind or version.
    #[error("{file}: schema: expected `{expected}`, found `{found}`")]
    Schema {
        /// The file's name.
        file: String,
        /// The schema that is read here.
        expected: &'static str,
        /// The schema that the file names.
        found: String,
    },
    /// Something that cannot be drawn.
    #[error("{}: {field}: {problem}", path.display())]
    Draws {
        /// The file.
        path: PathBuf,
        /// The field.
        field: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A data source's fields do not go together, or a number is out of range.
    #[error("data of subject {subject}: {problem}")]
    DataSource {
        /// The subject whose data they are.
        subject: String,
        /// What is wrong.
        problem: String,
    },
    /// A validation subject without data.
    #[error("{file}: validation: no data of subject {subject}")]
    NoSuchSubject {
        /// The training's file.
        file: String,
        /// The subject that it names.
        subject: String,
    },
    /// A study with nothing to score.
    #[error("{file}: study {study}: no test data")]
    NoTestData {
        /// The protocol's file.
        file: String,
        /// The study's name.
        study: String,
    },
    /// A study of rigid bodies whose fields do not go together.
    #[error("{file}: study {study}: {problem}")]
    RigidStudy {
        /// The protocol's file.
        file: String,
        /// The study's name.
        study: String,
        /// What is wrong.
        problem: String,
    },
    /// Poses of a rate at which the known motions have none.
    #[error(
        "rate_hz {rate_hz}: the known motions have {truth_hz} Hz, of which it must be a whole part"
    )]
    TruthRate {
        /// The rate that is asked for, Hz.
        rate_hz: f64,
        /// That of the motions, Hz.
        truth_hz: f64,
    },
    /// A real IMU that has too little in common with its reference.
    #[error("{name}: too few readings beside the reference to find the clock and mount of the IMU")]
    NotAligned {
        /// The recording and the IMU.
        name: String,
    },
    /// Data that are not there.
    #[error("{}: {problem}; {hint}", path.display())]
    NoData {
        /// The file or folder.
        path: PathBuf,
        /// What is missing.
        problem: String,
        /// What to get, from whom, and where to put it.
        hint: String,
    },
    /// A site that cannot carry a sensor.
    #[error("site {site}: {field}: {problem}")]
    Site {
        /// The site's name.
        site: String,
        /// The field of the placement that is wrong.
        field: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// A recording without a stretch long enough to learn from or to score.
    #[error("{}: no reference of {shortest_s} s without a gap beside an IMU{named}", path.display())]
    NoReference {
        /// The recording.
        path: PathBuf,
        /// The least length, s.
        shortest_s: f64,
        /// The names that were asked for, as ` called A or B`; empty where all count.
        named: String,
    },
    /// An engine that this program was built without.
    #[error(
        "training: engine {engine}: this program was built without {library}; build it by `cargo build --features {engine}`"
    )]
    EngineNotBuilt {
        /// The engine's name in a training's file, and of the feature.
        engine: &'static str,
        /// What it needs.
        library: &'static str,
    },
    /// A training's folder that was begun with another file.
    #[error("{}: differs from {}; give another --out, or --force to begin anew", kept.display(), given.display())]
    OtherConfiguration {
        /// The file that the training was begun with.
        kept: PathBuf,
        /// The file that is given now.
        given: PathBuf,
    },
    /// A clip without labels where activities are asked for.
    #[error("{}: no labels; a clip of the virtual side needs `label` and `label_names`", path.display())]
    NoLabels {
        /// The clip.
        path: PathBuf,
    },
    /// Clips that show none of the activities.
    #[error("{}: no clip shows any of {classes}", path.display())]
    NoActivity {
        /// The first clip.
        path: PathBuf,
        /// The classes that are asked for.
        classes: String,
    },
    /// Too few or too many classes of activities.
    #[error("{}: {found} classes, expected 2 to 100", path.display())]
    ClassCount {
        /// The file that maps activities to classes.
        path: PathBuf,
        /// How many it names.
        found: usize,
    },
    /// A recording of no known data set.
    #[error("{}: no recording of a data set that is known; see `cromosim inspect --help`", path.display())]
    UnknownDataset {
        /// The file.
        path: PathBuf,
    },
    /// Recordings of several data sets.
    #[error("{}: of {format}, the files before are of another data set; give those of one", path.display())]
    MixedDatasets {
        /// The first file of another data set.
        path: PathBuf,
        /// Its data set.
        format: DatasetFormat,
    },
    /// No recording of real people.
    #[error("no recordings were given")]
    NoRecordings,
    /// Recordings without a known placement in common.
    #[error("{}: no placement that all recordings have and that is known ({known})", path.display())]
    NoCommonPlacement {
        /// The first recording.
        path: PathBuf,
        /// The placements that are known.
        known: String,
    },
    /// Too few people, or too few classes, to hold people out.
    #[error(
        "{}: people with labelled windows: {people}; their classes: {classes}; at least 3 people and 2 classes are needed", path.display()
    )]
    TooFewPeople {
        /// The first recording.
        path: PathBuf,
        /// Names of those there are.
        people: String,
        /// Classes that they show.
        classes: String,
    },
    /// The learned simulator without networks.
    #[error("no networks were given; name their folder by --learned")]
    NoNetworks,
    /// A recording without IMUs.
    #[error("{}: no topic /imu/NAME/data_raw of sensor_msgs/msg/Imu", path.display())]
    NoImuTopic {
        /// The recording.
        path: PathBuf,
    },
    /// Two recordings without a placement in common.
    #[error(
        "no placement is in both recordings: {} has {simulated_names}; {} has {measured_names}", simulated.display(), measured.display()
    )]
    NoSharedPlacement {
        /// The simulated recording.
        simulated: PathBuf,
        /// Its placements.
        simulated_names: String,
        /// The measured recording.
        measured: PathBuf,
        /// Its placements.
        measured_names: String,
    },
    /// An error with where it happened: a file, a study, a site.
    #[error("{place}")]
    At {
        /// Where.
        place: String,
        /// What.
        source: Box<EvaluationError>,
    },
    /// A bag that cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A body or site that cannot be had.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A picture that cannot be drawn.
    #[error(transparent)]
    Charts(#[from] ChartsError),
    /// An effect beyond its bounds.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// Arrays that cannot be read.
    #[error(transparent)]
    Arrays(#[from] ArraysError),
    /// Kinematics that cannot be had.
    #[error(transparent)]
    Imu(#[from] ImuError),
    /// Networks, training or mapping failed.
    #[error(transparent)]
    Learned(#[from] LearnedError),
    /// A motion file that cannot be read.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A data set's recording that cannot be read.
    #[error(transparent)]
    Dataset(#[from] RigidError),
    /// A recording that cannot be read.
    #[error(transparent)]
    Recording(Box<RecordingError>),
    /// Stamps or splines that make no sense.
    #[error(transparent)]
    Spatial(#[from] SpatialError),
}

// Boxed, so that results stay small.
impl From<RecordingError> for EvaluationError {
    fn from(error: RecordingError) -> Self {
        Self::Recording(Box::new(error))
    }
}

/// Says where an error happened.
pub(crate) trait At<T> {
    /// The error, with its place before it.
    fn at(self, place: impl FnOnce() -> String) -> Result<T, EvaluationError>;
}

impl<T, E: Into<EvaluationError>> At<T> for Result<T, E> {
    fn at(self, place: impl FnOnce() -> String) -> Result<T, EvaluationError> {
        self.map_err(|error| EvaluationError::At {
            place: place(),
            source: Box::new(error.into()),
        })
    }
}
