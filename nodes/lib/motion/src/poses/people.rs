//! Several people of one file, on one clock.

use std::ops::RangeInclusive;
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

/// One of the people in a file with all frames, and which of them are asked for.
#[derive(Clone, Debug)]
pub struct PersonPart {
    /// The whole person; [`Person::begins_s`] is negative where the motion begins before the start.
    pub person: Person,
    /// The frames that are asked for, at least two.
    pub frames: RangeInclusive<usize>,
}

/// The people that [`MotionOptions::person`] names (`all` or nothing: everybody; else names with
/// commas between, in that order) of a file of SMPL parameters; of any other format its one motion,
/// as person 0. All stand on one clock, that of the video's frames: `start_s` and `duration_s` cut
/// a window out of it, and whoever has less than two frames in that window is left out.
///
/// # Errors
/// As [`read_motion_for`](crate::read_motion_for); [`MotionError::UnknownPerson`] for a name that
/// is not in the file; [`MotionError::Setting`] where nobody is left.
pub fn read_people(
    path: &Path,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<Vec<Person>, MotionError> {
    let cut = |PersonPart { person, frames }: PersonPart| Person {
        begins_s: person.time_of(*frames.start()),
        motion: person.motion.of_frames(frames),
        ..person
    };
    let parts = read_people_whole(path, body, options)?;
    Ok(parts.into_iter().map(cut).collect())
}

/// As [`read_people`], with the frames around those that are asked for.
///
/// # Errors
/// As [`read_people`].
pub fn read_people_whole(
    path: &Path,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<Vec<PersonPart>, MotionError> {
    let whole = MotionOptions {
        start_s: 0.0,
        duration_s: None,
        ..options.clone()
    };
    let motions = match open_poses(path, PoseView::World)? {
        Some(file) => file.into_motions(body, source_body(options)?.as_ref(), options)?,
        None => vec![crate::read_motion_for(path, body, &whole)?],
    };
    let first_frame =
        |motion: &SmplMotion| motion.poses.as_ref().map_or(0, |report| report.first_frame);
    let earliest = motions.iter().map(first_frame).min().unwrap_or(0);
    let mut people: Vec<Person> = Vec::with_capacity(motions.len());
    for motion in motions {
        let arrives_s = first_frame(&motion).saturating_sub(earliest) as f64 / motion.rate_hz;
        let name = motion
            .poses
            .as_ref()
            .map_or_else(|| "0".to_owned(), |report| report.person.clone());
        let label = label(&name, &people);
        people.push(Person {
            name,
            label,
            begins_s: arrives_s - options.start_s,
            motion,
        });
    }
    within(path, people, options)
}

/// Those who have at least two frames in the window of the options.
fn within(
    path: &Path,
    people: Vec<Person>,
    options: &MotionOptions,
) -> Result<Vec<PersonPart>, MotionError> {
    let wrong = |setting, value, expected: String| MotionError::Setting {
        name: path.display().to_string(),
        setting,
        value,
        expected,
    };
    let start_s = options.start_s;
    if start_s.is_nan() || start_s < 0.0 {
        return Err(wrong("start_s", start_s, "0 s or more".to_owned()));
    }
    if let Some(duration_s) = options
        .duration_s
        .filter(|seconds| !(*seconds > 0.0 && seconds.is_finite()))
    {
        return Err(wrong("duration_s", duration_s, "more than 0 s".to_owned()));
    }
    let there = |person: &Person| {
        let (from, to) = (person.begins_s + start_s, person.ends_s() + start_s);
        format!("{} from {from:.3} to {to:.3} s", person.name)
    };
    let everybody: Vec<String> = people.iter().map(there).collect();
    let part = |person: Person| {
        let frames = person.frames_within(options.duration_s)?;
        Some(PersonPart { person, frames })
    };
    let parts: Vec<PersonPart> = people.into_iter().filter_map(part).collect();
    if parts.is_empty() {
        let expected = format!(
            "{}at least two frames of somebody; there are {}",
            options
                .duration_s
                .map_or_else(String::new, |duration_s| format!(
                    "in {duration_s} s from there "
                )),
            everybody.join(", ")
        );
        return Err(wrong("start_s", start_s, expected));
    }
    for PersonPart { person, frames } in &parts {
        person.motion.of_frames(frames.clone()).possible()?;
    }
    Ok(parts)
}

impl Person {
    /// Time of a frame, s on the clock of [`Person::begins_s`].
    pub fn time_of(&self, frame: usize) -> f64 {
        self.begins_s + frame as f64 / self.motion.rate_hz
    }

    fn ends_s(&self) -> f64 {
        self.time_of(self.motion.frames.len().saturating_sub(1))
    }

    /// Two frames or more from 0 s on.
    fn frames_within(&self, duration_s: Option<f64>) -> Option<RangeInclusive<usize>> {
        let last = self.motion.frames.len().checked_sub(1)?;
        // A frame's time is a quotient: half a microframe of slack, as in `SmplMotion::part`.
        let place = |time_s: f64| (time_s - self.begins_s) * self.motion.rate_hz;
        let first = (place(0.0) - 1e-6).ceil().max(0.0) as usize;
        let end = duration_s.map_or(f64::INFINITY, |seconds| (place(seconds) + 1e-6).floor());
        let end = end.min(last as f64);
        (end > first as f64).then_some(first..=end as usize)
    }
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
