//! What the exports of motion capture systems have in common: several bodies side by side, each of
//! which may be lost for a while, with names and an up axis of their own.

use cromosim_motion::UpAxis;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use super::DatasetRecording;
use crate::rigid::{PoseTrajectory, RigidError};

/// A row of a table is on the grid of its frame rate where it is as near as this, s: times are
/// printed with six digits.
const PRINTED_TIME: f64 = 1e-6;
/// Gravity of the world, m/s2: what free acceleration lacks.
const GRAVITY_IN_WORLD: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);

/// Where a body is, m, and how it is turned.
pub(super) type BodyPose = (Vector3<f64>, UnitQuaternion<f64>);

/// Bodies by name, as they are read row by row.
pub(super) struct Bodies {
    world_from_file: UnitQuaternion<f64>,
    tracks: Vec<Track>,
}

struct Track {
    name: String,
    trajectory: PoseTrajectory,
    lost: usize,
}

impl Bodies {
    /// Bodies whose names become those of topics; `up` is the axis of the file that points up.
    pub fn new<'a>(names: impl Iterator<Item = &'a str>, up: UpAxis) -> Self {
        let mut tracks: Vec<Track> = Vec::new();
        for name in names {
            let plain = placement_name(name);
            let same = |candidate: &str| tracks.iter().any(|track| track.name == candidate);
            let mut numbered = (2..).map(|number| format!("{plain}_{number}"));
            let name = if same(&plain) {
                numbered.find(|it| !same(it)).unwrap_or_default()
            } else {
                plain
            };
            let trajectory = PoseTrajectory {
                frame: "world".to_owned(),
                ..PoseTrajectory::default()
            };
            tracks.push(Track {
                name,
                trajectory,
                lost: 0,
            });
        }
        Self {
            world_from_file: world_from_file(up),
            tracks,
        }
    }

    /// A body's pose in the file's axes, or that it was not seen.
    pub fn push(&mut self, body: usize, stamp: Stamp, pose: Option<BodyPose>) {
        let track = &mut self.tracks[body];
        match pose {
            Some((position, rotation)) => track.trajectory.push(
                stamp,
                self.world_from_file * position,
                self.world_from_file * rotation,
            ),
            None => track.lost += 1,
        }
    }

    /// The bodies as references; those that were never seen are left out, with a note.
    ///
    /// # Errors
    /// [`RigidError::Empty`] where none was ever seen.
    pub fn into_recording(
        self,
        name: &str,
        rate_hz: f64,
        mut notes: Vec<String>,
    ) -> Result<DatasetRecording, RigidError> {
        let mut references = Vec::new();
        for track in self.tracks {
            let (name, seen) = (track.name, track.trajectory.stamps.len());
            if seen == 0 {
                notes.push(format!("{name}: never seen; left out"));
                continue;
            }
            if track.lost > 0 {
                let all = seen + track.lost;
                notes.push(format!(
                    "{name}: not seen in {} of {all} frames",
                    track.lost
                ));
            }
            references.push((name, track.trajectory));
        }
        if references.is_empty() {
            return Err(RigidError::Empty {
                name: name.to_owned(),
            });
        }
        Ok(DatasetRecording {
            name: name.to_owned(),
            rate_hz,
            references,
            notes,
            ..DatasetRecording::default()
        })
    }
}

/// The rotation that takes the file's up axis to z, by a quarter turn about one of its axes.
fn world_from_file(up: UpAxis) -> UnitQuaternion<f64> {
    use std::f64::consts::FRAC_PI_2;
    match up {
        UpAxis::X => UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -FRAC_PI_2),
        UpAxis::Y => UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2),
        UpAxis::Z | UpAxis::Detect => UnitQuaternion::identity(),
    }
}

/// A name as it can be part of a topic: `Rigid Body 1` becomes `Rigid_Body_1`, `suit:Hip`
/// `suit_Hip`, `wand:wand` `wand`.
pub(super) fn placement_name(name: &str) -> String {
    let name = match name.split_once(':') {
        Some((subject, part)) if subject == part => part,
        _ => name,
    };
    let is_part = |letter: char| letter.is_ascii_alphanumeric();
    let words = name.split(|letter| !is_part(letter));
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let joined = words.join("_");
    match joined.chars().next() {
        None => "body".to_owned(),
        Some(first) if first.is_ascii_digit() => format!("body_{joined}"),
        Some(_) => joined,
    }
}

/// The time of a frame, s: where the printed one is a frame of the rate but for its last digit,
/// that of the frame.
pub(super) fn on_grid(seconds: f64, rate_hz: f64) -> f64 {
    let grid = (seconds * rate_hz).round() / rate_hz;
    if (grid - seconds).abs() <= PRINTED_TIME {
        grid
    } else {
        seconds
    }
}

/// The order of axes that three letters name, such as XYZ; none where they name none.
pub(super) fn euler_order(letters: &str) -> Option<[usize; 3]> {
    let axes: Vec<usize> = letters
        .chars()
        .filter_map(|letter| "XYZ".find(letter.to_ascii_uppercase()))
        .collect();
    let order: [usize; 3] = axes.try_into().ok()?;
    let each_once = letters.len() == 3 && (0..3).all(|axis| order.contains(&axis));
    each_once.then_some(order)
}

/// Turns about the first axis, then about the second as it is turned, then the third; angles by
/// axis, rad.
pub(super) fn from_euler(order: [usize; 3], angles: Vector3<f64>) -> UnitQuaternion<f64> {
    let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    let turn = |axis: usize| UnitQuaternion::from_axis_angle(&axes[axis], angles[axis]);
    let [first, second, third] = order.map(turn);
    first * second * third
}

/// What an accelerometer reads whose acceleration in the world, without gravity, is known: R^T (a -
/// g).
pub(super) fn specific_force(
    world_from_sensor: UnitQuaternion<f64>,
    free_acceleration_in_world: Vector3<f64>,
) -> Vector3<f64> {
    world_from_sensor.inverse() * (free_acceleration_in_world - GRAVITY_IN_WORLD)
}

/// An error of a place in a file that is neither a row's cell nor a missing column.
pub(super) fn content(
    name: &str,
    place: impl Into<String>,
    problem: impl Into<String>,
) -> RigidError {
    RigidError::Content {
        name: name.to_owned(),
        place: place.into(),
        problem: problem.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_parts_of_topics() {
        for (name, expected) in [
            ("Rigid Body 1", "Rigid_Body_1"),
            ("suit:Hip", "suit_Hip"),
            ("wand:wand", "wand"),
            ("3rd", "body_3rd"),
            ("___", "body"),
            ("Körper", "K_rper"),
        ] {
            assert_eq!(placement_name(name), expected);
        }
        let bodies = Bodies::new(["a b", "a_b", "a-b"].into_iter(), UpAxis::Z);
        let names = bodies.tracks.iter().map(|track| track.name.as_str());
        assert_eq!(names.collect::<Vec<_>>(), ["a_b", "a_b_2", "a_b_3"]);
    }

    #[test]
    fn up_is_up() {
        for (up, axis) in [
            (UpAxis::X, Vector3::x()),
            (UpAxis::Y, Vector3::y()),
            (UpAxis::Z, Vector3::z()),
        ] {
            assert!((world_from_file(up) * axis - Vector3::z()).norm() < 1e-15);
        }
    }

    #[test]
    fn orders_of_axes() {
        assert_eq!(euler_order("ZYX"), Some([2, 1, 0]));
        for letters in ["", "XY", "XXY", "XYZZ", "XYa"] {
            assert_eq!(euler_order(letters), None);
        }
    }

    #[test]
    fn rest_reads_gravity_upwards() {
        let up = specific_force(UnitQuaternion::identity(), Vector3::zeros());
        assert_eq!(up, Vector3::new(0.0, 0.0, 9.80665));
    }
}
