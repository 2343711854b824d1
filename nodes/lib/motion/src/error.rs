//! What can go wrong with a motion.

use std::io;
use std::path::PathBuf;

use cromosim_arrays::ArraysError;
use cromosim_body::BodyError;
use cromosim_spatial::meant;
use cromosim_spatial::plausible::Oddity;

/// An error of this crate: one line that names the file, the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The file cannot be opened or read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file is larger than any motion.
    #[error("{}: {bytes} bytes, more than the {limit} that are read; cut the file into parts", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// The largest allowed.
        limit: u64,
    },
    /// The content is no known motion format.
    #[error(
        "{}: not a motion file: expected BVH (first word HIERARCHY), AMC, MVNX, C3D, TRC or SMPL parameters (npz, pickle, pt), found {found}",
        path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// How the content begins.
        found: String,
    },
    /// A suit's recording without a segment that others hang from.
    #[error("{name}: no segment {segment}; there are {}; export the whole body", found.join(", "))]
    Mvnx {
        /// The file.
        name: String,
        /// What is missing.
        segment: String,
        /// The segments that are there.
        found: Vec<String>,
    },
    /// A skeleton without a motion.
    #[error("{}: an Acclaim skeleton has no motion; give the AMC file, and this one as skeleton where it does not lie beside it", path.display())]
    SkeletonOnly {
        /// The file.
        path: PathBuf,
    },
    /// No ASF file belongs to an AMC file.
    #[error(
        "{}: its skeleton is not beside it ({}); set skeleton to the ASF file",
        path.display(),
        if found.is_empty() { "no ASF file there".to_owned() } else { format!("only {}", found.join(", ")) }
    )]
    NoSkeleton {
        /// The AMC file.
        path: PathBuf,
        /// ASF files beside it, with other names.
        found: Vec<String>,
    },
    /// A marker set's name is neither embedded nor a file.
    #[error("marker set {given} is neither a file nor one of {}{}", known.join(", "), meant(given, known.iter().map(String::as_str)))]
    UnknownMarkerSet {
        /// What was given.
        given: String,
        /// The embedded sets.
        known: Vec<String>,
    },
    /// Something else was expected at a line of the file.
    #[error("{name}, line {line}: expected {expected}, found {found}")]
    Syntax {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// What fits.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// Something else was expected at a byte of a binary file.
    #[error("{name}, byte {offset}: expected {expected}, found {found}")]
    Bytes {
        /// The file.
        name: String,
        /// 0-based.
        offset: usize,
        /// What fits.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// Several people in a recording, or none of the given name.
    #[error("{name}: subject {given} asked for, the file has {}; set subject to one of them{}", if known.is_empty() { "no named subjects".to_owned() } else { known.join(", ") }, meant(given, known.iter().map(String::as_str)))]
    Subject {
        /// The file.
        name: String,
        /// What was asked for.
        given: String,
        /// The subjects that the labels name.
        known: Vec<String>,
    },
    /// The recording's labels are not those of the marker set.
    #[error(
        "{name}: {found} of the {total} markers of set {set} found, {needed} needed; labels there: {}; choose or write another marker_set",
        labels.join(", ")
    )]
    MarkerLabels {
        /// The file.
        name: String,
        /// The marker set.
        set: String,
        /// How many of its markers are in the file.
        found: usize,
        /// How many it has.
        total: usize,
        /// How many a fit takes.
        needed: usize,
        /// The first labels of the file.
        labels: Vec<String>,
    },
    /// No frame shows three markers.
    #[error(
        "{name}: no frame shows three markers of the set; check the labels and the recording's gaps"
    )]
    NoMarkers {
        /// The file.
        name: String,
    },
    /// A frame has the wrong number of values.
    #[error("{name}, line {line}: expected {expected} channels, found {found}")]
    ChannelCount {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// As declared by the skeleton.
        expected: usize,
        /// On this line.
        found: usize,
    },
    /// The file holds another number of frames than it declares.
    #[error(
        "{name}, line {line}: expected {expected} frames (as line {declared_at} says), found {found}"
    )]
    FrameCount {
        /// The file.
        name: String,
        /// Where the frames end (too few) or go on (too many); 1-based.
        line: usize,
        /// The declared number.
        expected: usize,
        /// The number that is there.
        found: usize,
        /// The line of `Frames:`.
        declared_at: usize,
    },
    /// A value is NaN, infinite or absurdly large.
    #[error(
        "{name}, line {line}: value {column} is {found}, expected a finite number below {limit:e} in size"
    )]
    Value {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// 1-based position among the line's numbers.
        column: usize,
        /// The text.
        found: String,
        /// The largest allowed.
        limit: f64,
    },
    /// The skeleton is larger than any skeleton.
    #[error("{name}, line {line}: more than {limit} {what}; this is no human skeleton")]
    Limit {
        /// The file.
        name: String,
        /// 1-based.
        line: usize,
        /// Joints or levels.
        what: &'static str,
        /// The largest allowed.
        limit: usize,
    },
    /// No skeleton map fits the joint names.
    #[error(
        "{name}: no skeleton map fits: nearest is {nearest} ({found} of {total} joints), not found: {}; `cromosim inspect FILE --skeleton-map-draft map.yaml` drafts a map, to be named by --skeleton-map (the node's parameter skeleton_map)",
        missing.join(", ")
    )]
    UnknownSkeleton {
        /// The file.
        name: String,
        /// The map that fits best.
        nearest: String,
        /// How many of its joints are in the file.
        found: usize,
        /// How many joints it names.
        total: usize,
        /// Its indispensable joints that are not in the file.
        missing: Vec<String>,
    },
    /// A file without a skeleton of its own.
    #[error("{}: neither BVH nor AMC; only their skeletons need a map", path.display())]
    NoJoints {
        /// The file.
        path: PathBuf,
    },
    /// The chosen skeleton map does not fit.
    #[error("{name}: skeleton map {map} does not fit, not found: {}; choose another by --skeleton-map (the node's parameter skeleton_map) or leave it out", missing.join(", "))]
    MissingJoints {
        /// The file.
        name: String,
        /// The map.
        map: String,
        /// Joints of the map that are not in the file.
        missing: Vec<String>,
    },
    /// A skeleton map's name is neither embedded nor a file.
    #[error("skeleton map {given} is neither a file nor one of {}{}", known.join(", "), meant(given, known.iter().map(String::as_str)))]
    UnknownMap {
        /// What was given.
        given: String,
        /// The embedded maps.
        known: Vec<String>,
    },
    /// A skeleton map cannot be parsed.
    #[error("{origin}: not a skeleton map: {problem}")]
    MapSyntax {
        /// The map's file.
        origin: String,
        /// The reason, with its line.
        problem: String,
    },
    /// A marker set cannot be parsed.
    #[error("{origin}: not a marker set: {problem}")]
    MarkerSetSyntax {
        /// The set's file.
        origin: String,
        /// The reason, with its line.
        problem: String,
    },
    /// A skeleton map or a marker set contradicts itself.
    #[error("{origin}: key {key}: {problem}")]
    MapContent {
        /// The map's file.
        origin: String,
        /// The key.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
    /// No rest pose can be told from the file.
    #[error(
        "{name}: no rest pose found: {problem}; set rest to zero_pose or to a frame that shows a T-pose, or give rest_axes in a map"
    )]
    RestPose {
        /// The file.
        name: String,
        /// What was tried and why it failed.
        problem: String,
    },
    /// The up axis cannot be told from the file.
    #[error("{name}: up axis unclear (mean direction from feet to head {mean:?}); set up_axis")]
    UpAxis {
        /// The file.
        name: String,
        /// In the file's axes.
        mean: [f64; 3],
    },
    /// The unit of length cannot be told from the file.
    #[error(
        "{name}: the skeleton is {height_units:.3} units tall, which is a human in no usual unit; set unit_scale_m (metres per unit)"
    )]
    Unit {
        /// The file.
        name: String,
        /// Estimated height in the file's units.
        height_units: f64,
    },
    /// A setting is out of its range.
    #[error("{name}: {setting} is {value}, expected {expected}")]
    Setting {
        /// The file.
        name: String,
        /// The setting.
        setting: &'static str,
        /// What was given.
        value: f64,
        /// What fits.
        expected: String,
    },
    /// A motion's parts do not fit each other.
    #[error("{name}: frame {frame}: {what} is not finite")]
    NotFinite {
        /// The motion.
        name: String,
        /// 0-based.
        frame: usize,
        /// Which quantity.
        what: &'static str,
    },
    /// Nobody can move so, or be so.
    #[error("{name}: {oddity}")]
    Impossible {
        /// The motion.
        name: String,
        /// What, where and why.
        oddity: Box<Oddity>,
    },
    /// A file of arrays that cannot be read, or an array in it that does not suit.
    #[error(transparent)]
    Arrays(#[from] ArraysError),
    /// What stands under a key contradicts itself or the rest.
    #[error("{}: key {key}: {problem}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// The key.
        key: String,
        /// What is wrong with it, and what to do.
        problem: String,
    },
    /// A body model is given for a motion.
    #[error("{}: an SMPL body model, not a motion; give it as the body (--body FILE)", path.display())]
    BodyFile {
        /// The file.
        path: PathBuf,
    },
    /// The keys are those of no known pose file.
    #[error(
        "{}: no known motion in it (found {found}); known are AMASS (poses, trans), VIBE (pose), WHAM (pose_world), GVHMR (smpl_params_global), TRAM (pred_rotmat), PHALP (tid, smpl), SLAHMR (root_orient, cam_R), DIP-IMU (gt, imu_ori, imu_acc)",
        path.display()
    )]
    UnknownPoses {
        /// The file.
        path: PathBuf,
        /// Its first keys.
        found: String,
    },
    /// Nobody of that name.
    #[error("{}: person {person} is not in it; there are {known}; choose one by person{}", path.display(), meant(person, known.split(", ").filter_map(|one| one.split(" (").next())))]
    UnknownPerson {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        person: String,
        /// The people, with their numbers of frames.
        known: String,
    },
    /// The motion's betas are those of another kind of body.
    #[error("{}: {source}: set source_body to the file of their body for that, or shape to mean", path.display())]
    ForeignShape {
        /// The file.
        path: PathBuf,
        /// Whose betas, and which body.
        source: Box<BodyError>,
    },
    /// A shape is asked of a file that holds none.
    #[error("{name}: shape file asked for, but a skeleton has no betas; set shape to fit or mean")]
    NoBetas {
        /// The file.
        name: String,
    },
    /// The body refuses.
    #[error(transparent)]
    Body(#[from] BodyError),
}
