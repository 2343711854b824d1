//! Several people of one file, on one clock.

use std::path::Path;
use std::sync::Arc;

use cromosim_body::BodyModel;

use super::format::PoseView;
use super::io::{open_poses, source_body};
use crate::{MotionError, MotionOptions, SmplMotion};

/// One of the people in a file.
#[derive(Clone, Debug)]
pub struct Person {
    /// The file's name or number for the person.
    pub name: String,
    /// `person_NAME` in letters, digits and single underscores, unlike everybody else's: a name for
    /// a ROS namespace, a frame prefix or a file.
    pub label: String,
    /// When the motion's first frame stands, s after [`MotionOptions::start_s`] (0: after the first
    /// frame of whoever comes first).
    pub begins_s: f64,
    /// What the person does.
    pub motion: SmplMotion,
}

/// The people that [`MotionOptions::person`] names (`all` or nothing: everybody; else names with
/// commas between, in that order) of a file of SMPL parameters; of any other format its one motion,
/// as person 0. All stand on one clock, that of the video's frames: `start_s` and `duration_s` cut
/// a window out of it, and whoever is not there in that window is left out.
///
/// # Errors
/// As [`read_motion_for`](crate::read_motion_for); [`MotionError::UnknownPerson`] for a name that
/// is not in the file; [`MotionError::Setting`] where nobody is left.
pub fn read_people(
    path: &Path,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<Vec<Person>, MotionError> {
    let Some(file) = open_poses(path, PoseView::World)? else {
        let motion = crate::read_motion_for(path, body, options)?;
        return Ok(vec![Person {
            name: "0".to_owned(),
            label: "person_0".to_owned(),
            begins_s: 0.0,
            motion,
        }]);
    };
    let motions = file.into_motions(body, source_body(options)?.as_ref(), options)?;
    let first_frame =
        |motion: &SmplMotion| motion.poses.as_ref().map_or(0, |report| report.first_frame);
    let earliest = motions.iter().map(first_frame).min().unwrap_or(0);
    let mut people: Vec<Person> = Vec::with_capacity(motions.len());
    let mut nobody = None;
    for motion in motions {
        let arrives_s = first_frame(&motion).saturating_sub(earliest) as f64 / motion.rate_hz;
        let name = motion
            .poses
            .as_ref()
            .map_or_else(String::new, |report| report.person.clone());
        match within(&motion, arrives_s, options) {
            Ok(Some((begins_s, motion))) => {
                let label = label(&name, &people);
                people.push(Person {
                    name,
                    label,
                    begins_s,
                    motion,
                });
            }
            Ok(None) => {}
            Err(error) => nobody = Some(error),
        }
    }
    match nobody {
        Some(error) if people.is_empty() => Err(error),
        _ if people.is_empty() => Err(nobody_there(path, options)),
        _ => Ok(people),
    }
}

fn nobody_there(path: &Path, options: &MotionOptions) -> MotionError {
    let expected = "a time at which somebody is there".to_owned();
    MotionError::Setting {
        name: path.display().to_string(),
        setting: "start_s",
        value: options.start_s,
        expected,
    }
}

/// The part of a motion that begins at `arrives_s` inside the window of the options, and when it
/// begins after the window's start; none where the person comes after the window.
fn within(
    motion: &SmplMotion,
    arrives_s: f64,
    options: &MotionOptions,
) -> Result<Option<(f64, SmplMotion)>, MotionError> {
    if options.start_s.is_nan() || options.start_s < 0.0 {
        motion.slice(options.start_s, options.duration_s)?;
    }
    let lead_s = arrives_s - options.start_s;
    if lead_s <= 0.0 {
        let cut = motion.slice(-lead_s, options.duration_s)?;
        let first = (-lead_s * motion.rate_hz - 1e-6).ceil().max(0.0);
        return Ok(Some((first / motion.rate_hz + lead_s, cut)));
    }
    let left_s = options.duration_s.map(|duration_s| duration_s - lead_s);
    if left_s.is_some_and(|left_s| left_s <= 0.0) {
        return Ok(None);
    }
    Ok(Some((lead_s, motion.slice(0.0, left_s)?)))
}

/// `person_NAME` of what names in ROS may hold; with a number behind where somebody else has it
/// already.
fn label(name: &str, others: &[Person]) -> String {
    let plain: String = name
        .chars()
        .map(|letter| {
            if letter.is_ascii_alphanumeric() {
                letter
            } else {
                '_'
            }
        })
        .collect();
    let words: Vec<&str> = plain.split('_').filter(|word| !word.is_empty()).collect();
    let base = std::iter::once("person")
        .chain(words)
        .collect::<Vec<_>>()
        .join("_");
    let is_free = |label: &String| others.iter().all(|other| &other.label != label);
    let numbered = (2..).map(|number| format!("{base}_{number}"));
    std::iter::once(base.clone())
        .chain(numbered)
        .find(is_free)
        .unwrap_or(base)
}

#[cfg(test)]
#[path = "people_tests.rs"]
mod tests;
