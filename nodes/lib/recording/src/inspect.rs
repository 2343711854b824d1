//! What is in a file, found out from its content.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use cromosim_bag::{BagReader, starts_like_bag};
use cromosim_body::{BodyModel, Gender, ShapeSpace, ShapedBody};
use cromosim_motion::{
    MotionError, MotionFormat, MotionOptions, PoseAxes, PoseFile, PoseFormat, PoseTrack, PoseView,
    SmplMotion, open_poses, read_motion_for,
};
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use crate::datasets::{DatasetFiles, DatasetFormat, DatasetRecording, open_dataset};
use crate::rigid::{RigidContent, RigidFormat, median_rate, parse_rigid, sniff_rigid};
use crate::{RecordingError, read_head, read_whole};

/// What a file holds.
#[derive(Debug)]
pub enum Inspection {
    /// A bag, with its topics and attachments.
    Bag(BagReader),
    /// A data set's recording.
    Recording(DatasetFormat, DatasetRecording),
    /// A trajectory or an IMU series.
    Rigid(RigidInspection),
    /// A body model.
    Body(BodyInspection),
    /// People in SMPL's joints.
    Poses(Box<PosesInspection>),
    /// A motion of a skeleton or of markers, on the body.
    Motion(Box<SmplMotion>),
}

/// A file of a rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidInspection {
    /// Its format.
    pub format: RigidFormat,
    /// Poses or readings.
    pub rows: usize,
    /// The inverse of the median interval, Hz; none of a single row.
    pub median_rate_hz: Option<f64>,
    /// Stamp of the first row.
    pub first: Stamp,
    /// From the first row to the last, s.
    pub duration_s: f64,
    /// How much it moves.
    pub extent: RigidExtent,
}

/// How much a rigid body moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RigidExtent {
    /// Length of the trajectory, m.
    Path(f64),
    /// Means of the readings' norms.
    Means {
        /// m/s2.
        specific_force: f64,
        /// rad/s.
        angular_velocity: f64,
    },
}

/// A body model.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyInspection {
    /// The identifier that bags name it by.
    pub id: String,
    /// Vertices of the skin.
    pub vertices: usize,
    /// Triangles of the skin.
    pub triangles: usize,
    /// Shape coefficients.
    pub betas: usize,
    /// Where the file says it.
    pub gender: Option<Gender>,
    /// From the lowest vertex to the highest at rest, m.
    pub height_m: f64,
}

/// A file of SMPL parameters.
#[derive(Debug)]
pub struct PosesInspection {
    /// Its format.
    pub format: PoseFormat,
    /// Everybody in it.
    pub people: Vec<PersonInspection>,
    /// The motion of the chosen person, or why it is not played as it is: that a rate is missing,
    /// for instance, is for whoever plays it to settle.
    pub motion: Result<SmplMotion, MotionError>,
}

/// One person of a file of SMPL parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct PersonInspection {
    /// The file's name or number.
    pub person: String,
    /// Frames with this person.
    pub frames: usize,
    /// First and last number of these frames in the video, where the file says them.
    pub frame_ids: Option<RangeInclusive<i64>>,
    /// Frames per second, Hz, where the file says it.
    pub rate_hz: Option<f64>,
    /// Where the file says it.
    pub gender: Option<Gender>,
    /// The axes that the root is in.
    pub axes: PoseAxes,
    /// Whether the root moves.
    pub has_trajectory: bool,
    /// Mean over frames.
    pub betas: Vec<f64>,
    /// The space of these betas.
    pub shape_space: ShapeSpace,
}

/// Reads a file, or a bag's directory, to say what is in it; motions are read for `model`.
///
/// # Errors
/// What is wrong with the file.
pub fn inspect(
    path: &Path,
    model: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<Inspection, RecordingError> {
    if path.is_dir() {
        return Ok(Inspection::Bag(BagReader::open(path)?));
    }
    let head = read_head(path)?;
    if starts_like_bag(&head) {
        return Ok(Inspection::Bag(BagReader::open(path)?));
    }
    if head.is_empty() {
        return Err(RecordingError::Unsuitable {
            path: path.to_owned(),
            problem: "the file is empty".to_owned(),
        });
    }
    let files = DatasetFiles {
        up_axis: options.up_axis,
        ..DatasetFiles::default()
    };
    if let Some((format, recording)) = open_dataset(path, &files)? {
        return Ok(Inspection::Recording(format, recording));
    }
    match open_poses(path, PoseView::World) {
        Err(MotionError::BodyFile { .. }) => return inspect_body(path).map(Inspection::Body),
        Err(error) => return Err(error.into()),
        Ok(Some(file)) => {
            let poses = inspect_poses(file, model, options)?;
            return Ok(Inspection::Poses(Box::new(poses)));
        }
        Ok(None) => {}
    }
    // Motions first: an AMC's frame can look like a row of numbers.
    match sniff_rigid(&head).filter(|_| MotionFormat::of(&head).is_none()) {
        Some(format) => inspect_rigid(path, format).map(Inspection::Rigid),
        None => {
            let motion = read_motion_for(path, model, options)?;
            Ok(Inspection::Motion(Box::new(motion)))
        }
    }
}

fn inspect_rigid(path: &Path, format: RigidFormat) -> Result<RigidInspection, RecordingError> {
    let mean = |vectors: &[Vector3<f64>]| {
        vectors.iter().map(Vector3::norm).sum::<f64>() / vectors.len() as f64
    };
    let (stamps, extent) = match parse_rigid(&read_whole(path)?, &path.display().to_string())? {
        Some(RigidContent::Poses(poses)) => {
            let length = path_length(&poses.trajectory.positions);
            (poses.trajectory.stamps, RigidExtent::Path(length))
        }
        Some(RigidContent::Imu(series)) => {
            let means = RigidExtent::Means {
                specific_force: mean(&series.specific_force),
                angular_velocity: mean(&series.angular_velocity),
            };
            (series.stamps, means)
        }
        None => {
            return Err(RecordingError::Unsuitable {
                path: path.to_owned(),
                problem: "the file changed".to_owned(),
            });
        }
    };
    let (first, last) = (stamps[0], stamps[stamps.len() - 1]);
    Ok(RigidInspection {
        format,
        rows: stamps.len(),
        median_rate_hz: median_rate(&stamps),
        first,
        duration_s: last - first,
        extent,
    })
}

/// Length of the way from point to point, m.
pub fn path_length(positions: &[Vector3<f64>]) -> f64 {
    let steps = positions.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    // The sum of nothing is -0.
    steps.sum::<f64>().abs()
}

fn inspect_body(path: &Path) -> Result<BodyInspection, RecordingError> {
    let model = BodyModel::read(path)?;
    let body = ShapedBody::new(model.clone(), &[])?;
    let heights = body.rest_vertices().iter().map(|vertex| vertex.y);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    Ok(BodyInspection {
        id: model.id().to_owned(),
        vertices: model.vertex_count(),
        triangles: model.faces().len(),
        betas: model.beta_count(),
        gender: model.gender(),
        height_m: high - low,
    })
}

fn inspect_poses(
    file: PoseFile,
    model: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<PosesInspection, RecordingError> {
    let people = file.tracks.iter().map(inspect_person).collect();
    let source = options.source_body.as_deref().map(BodyModel::read);
    let source = source.transpose()?;
    Ok(PosesInspection {
        format: file.format,
        people,
        motion: file.into_motion(model, source.as_ref(), options),
    })
}

fn inspect_person(track: &PoseTrack) -> PersonInspection {
    let ids = track.frame_ids.as_ref();
    PersonInspection {
        person: track.person.clone(),
        frames: track.rotations.len(),
        frame_ids: ids.and_then(|ids| Some(*ids.first()?..=*ids.last()?)),
        rate_hz: track.rate_hz,
        gender: track.gender,
        axes: track.axes,
        has_trajectory: track.trans.is_some(),
        betas: track.mean_betas(),
        shape_space: track.shape_space,
    }
}
