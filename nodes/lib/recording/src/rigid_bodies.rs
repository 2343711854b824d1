//! The rigid bodies in a file, whatever its format.

use std::path::Path;

use cromosim_motion::UpAxis;

use crate::datasets::{DatasetFiles, open_dataset};
use crate::rigid::{PoseTrajectory, RigidContent, parse_rigid};
use crate::{RecordingError, read_whole};

/// Bodies that move rigidly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RigidBodies {
    /// By the file's names; a trajectory of one body has none.
    pub bodies: Vec<(Option<String>, PoseTrajectory)>,
    /// What a user should know of the file, a line each.
    pub notes: Vec<String>,
}

/// Reads a trajectory (TUM, EuRoC, a table of poses) or the references of a recording, such as the
/// bodies of a motion capture system; `up` is the axis of such a system's file that points up.
///
/// # Errors
/// What is wrong with the file, and [`RecordingError::Unsuitable`] for one without poses.
pub fn read_rigid_bodies(path: &Path, up: UpAxis) -> Result<RigidBodies, RecordingError> {
    let unsuitable = |problem: &str| RecordingError::Unsuitable {
        path: path.to_owned(),
        problem: problem.to_owned(),
    };
    let files = DatasetFiles {
        up_axis: up,
        ..DatasetFiles::default()
    };
    let opened = open_dataset(path, &files)?;
    let has_up_axis = opened
        .as_ref()
        .is_some_and(|(format, _)| format.takes_up_axis());
    if up != UpAxis::Detect && !has_up_axis {
        return Err(unsuitable(
            "--up-axis is for motion files and exports of motion capture; leave it out",
        ));
    }
    if let Some((_, recording)) = opened {
        if recording.references.is_empty() {
            return Err(unsuitable("a recording without poses of its bodies"));
        }
        let references = recording.references.into_iter();
        return Ok(RigidBodies {
            bodies: references
                .map(|(name, poses)| (Some(name), poses))
                .collect(),
            notes: recording.notes,
        });
    }
    match parse_rigid(&read_whole(path)?, &path.display().to_string())? {
        Some(RigidContent::Poses(poses)) => Ok(RigidBodies {
            bodies: vec![(None, poses.trajectory)],
            notes: Vec::new(),
        }),
        _ => Err(unsuitable(
            "not a trajectory of a rigid body: expected TUM, EuRoC ground truth, a table of poses with a header, or an export of a motion capture system",
        )),
    }
}
