//! Trajectories of the TUM RGB-D benchmark: `timestamp tx ty tz qx qy qz qw`, seconds and metres,
//! comments begin with `#`.

use std::fmt::Write;

use super::table::{by_blanks, rows, seconds_text, text};
use super::{PoseTrajectory, RigidError};

/// Reads a TUM trajectory.
///
/// # Errors
/// [`RigidError::Columns`], [`RigidError::Value`], [`RigidError::Order`],
/// [`RigidError::Quaternion`], [`RigidError::Empty`].
pub fn parse_tum(bytes: &[u8], name: &str) -> Result<PoseTrajectory, RigidError> {
    let mut trajectory = PoseTrajectory::default();
    for row in rows(text(bytes, name)?, name, by_blanks) {
        row.expect_columns(|count| count == 8, "8 (time, tx ty tz, qx qy qz qw)")?;
        let stamp = row.stamp(0, 0)?;
        row.check_order(stamp, trajectory.stamps.last())?;
        trajectory.push(stamp, row.vector(1)?, row.rotation([4, 5, 6, 7])?);
    }
    if trajectory.stamps.is_empty() {
        return Err(RigidError::Empty {
            name: name.to_owned(),
        });
    }
    Ok(trajectory)
}

/// Writes a trajectory after TUM: the inverse of [`parse_tum`], but for the frame's name, which
/// stands in a comment.
pub fn write_tum(trajectory: &PoseTrajectory) -> String {
    let mut content = "# timestamp tx ty tz qx qy qz qw\n".to_owned();
    if !trajectory.frame.is_empty() {
        let _ = writeln!(
            content,
            "# frame {}",
            trajectory.frame.replace(['\n', '\r'], " ")
        );
    }
    for ((stamp, p), q) in trajectory
        .stamps
        .iter()
        .zip(&trajectory.positions)
        .zip(&trajectory.rotations)
    {
        let _ = writeln!(
            content,
            "{} {} {} {} {} {} {} {}",
            seconds_text(*stamp),
            p.x,
            p.y,
            p.z,
            q.i,
            q.j,
            q.k,
            q.w
        );
    }
    content
}
