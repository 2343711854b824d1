//! `cromosim simulate --rigid`: which bodies of the file carry an IMU, and what it is called.

use std::path::Path;

use anyhow::bail;
use cromosim_imu::Placement;
use cromosim_motion::UpAxis;
use cromosim_recording::rigid::PoseTrajectory;
use cromosim_recording::{RecordedPlacement, RigidBodies, read_rigid_bodies};
use cromosim_spatial::meant;

/// What the IMU is called where nobody says it.
const NAMELESS: &str = "body";

/// The bodies that `placements` (`NAME`, or `NAME=BODY`) take from the file, as references, and
/// what a user should know of the file. Without any, all; a body alone takes whatever name is
/// given.
///
/// # Errors
/// What is wrong with the file; bodies that it does not have; names that none can have.
pub fn rigid_placements(
    file: &Path,
    placements: &[String],
    up: UpAxis,
) -> anyhow::Result<(Vec<RecordedPlacement>, Vec<String>)> {
    let RigidBodies { bodies, notes } = read_rigid_bodies(file, up)?;
    let known: Vec<String> = bodies
        .iter()
        .map(|(name, _)| name.clone().unwrap_or_else(|| NAMELESS.to_owned()))
        .collect();
    let mut chosen: Vec<(String, usize)> = Vec::new();
    if placements.is_empty() {
        chosen = known.iter().cloned().zip(0..).collect();
    }
    for placement in placements {
        let (name, body) = placement.split_once('=').unwrap_or((placement, placement));
        let index = match known.iter().position(|own| own == body) {
            Some(index) => index,
            None if known.len() == 1 && name == body => 0,
            None => bail!(
                "--placement {placement}: {} has no such body; it has {}{}",
                file.display(),
                known.join(", "),
                meant(body, known.iter().map(String::as_str))
            ),
        };
        if chosen.iter().any(|(other, _)| other == name) {
            bail!(
                "--placement {placement}: {name} is given twice; give each IMU a name of its own"
            );
        }
        chosen.push((name.to_owned(), index));
    }
    let recorded = chosen.into_iter().map(|(name, index)| {
        if let Err((_, problem)) = Placement::at_site(&name, "left_watch", 1.0) {
            bail!("--placement {name}: {problem}");
        }
        rigid_placement(file, &name, &bodies[index].1)
    });
    Ok((recorded.collect::<Result<_, _>>()?, notes))
}

/// A trajectory as the reference of one placement.
fn rigid_placement(
    file: &Path,
    name: &str,
    poses: &PoseTrajectory,
) -> anyhow::Result<RecordedPlacement> {
    let oddities = poses.oddities();
    if let Some(impossible) = oddities.iter().find(|odd| odd.is_impossible()) {
        bail!("{}: {impossible}", file.display());
    }
    Ok(RecordedPlacement {
        name: name.to_owned(),
        frames: poses.frames(),
        measured: Vec::new(),
        notes: oddities.iter().map(ToString::to_string).collect(),
        set_back: Vec::new(),
        magnetic: Vec::new(),
    })
}
