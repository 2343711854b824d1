//! Studies of rigid bodies, as a protocol's file says them.

use serde::Deserialize;

use super::pose_errors::PoseErrors;
use super::truth::{POSITIONS, is_motion};

/// Rigid bodies that are scored together. Either `physics` or `recordings` is given.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigidStudy {
    /// Its name.
    pub name: String,
    /// What its measured side is, for the table.
    pub measured: String,
    /// The humanoid of the physics engine, seen by a source.
    #[serde(default)]
    pub physics: Option<PhysicsSource>,
    /// Recordings of real IMUs on rigid bodies, of a data set; a `*` stands for any part of a file's
    /// name.
    #[serde(default)]
    pub recordings: Vec<String>,
    /// Whether the study is left out, and listed as such, where recordings are not at hand.
    #[serde(default)]
    pub optional: bool,
}

/// How the physics' motions are seen.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhysicsSource {
    /// What errs.
    pub errors: PoseErrors,
    /// Frames per second, Hz; divides 240.
    pub rate_hz: f64,
    /// Draws of the errors for each motion.
    #[serde(default = "one")]
    pub repeats: u64,
    /// What is drawn over time beside the errors.
    #[serde(default)]
    pub picture: Option<RigidPicture>,
}

/// Some seconds of one IMU of the physics.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigidPicture {
    /// The motion, `jump` for example.
    pub motion: String,
    /// Where the IMU is, `pelvis` for example.
    pub position: String,
    /// First and last time, s.
    pub seconds: [f64; 2],
}

fn one() -> u64 {
    1
}

impl RigidPicture {
    fn is_sound(&self) -> bool {
        let [from, to] = self.seconds;
        is_motion(&self.motion)
            && POSITIONS.contains(&self.position.as_str())
            && 0.0 <= from
            && from < to
    }
}

impl RigidStudy {
    /// Whether everything that is needed is there.
    ///
    /// # Errors
    /// A sentence on what is wrong.
    pub(in crate::fidelity) fn check(&self) -> Result<(), String> {
        match &self.physics {
            None if self.recordings.is_empty() => Err("expected physics or recordings".to_owned()),
            Some(_) if !self.recordings.is_empty() => {
                Err("expected either physics or recordings".to_owned())
            }
            Some(source) if !(10.0..=240.0).contains(&source.rate_hz) => {
                Err(format!("rate_hz {}: expected 10 to 240", source.rate_hz))
            }
            Some(PhysicsSource {
                picture: Some(picture),
                ..
            }) if !picture.is_sound() => Err(format!(
                "picture {picture:?}: expected a motion and position of bags/truth, and two times"
            )),
            Some(source) if source.repeats == 0 => Err("repeats 0: expected at least 1".to_owned()),
            _ => Ok(()),
        }
    }
}
