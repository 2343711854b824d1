//! Studies of rigid bodies, as a protocol's file says them.

use serde::Deserialize;

use super::analytic::RATE_HZ;
use super::pose_errors::PoseErrors;
use super::truth::{POSITIONS, is_motion};
use crate::fidelity::truth_source::TruthSource;

/// Rigid bodies that are scored together. One of `physics`, `analytic` and `recordings` is given.
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
    /// Motions of closed form, seen by a source.
    #[serde(default)]
    pub analytic: Option<AnalyticSource>,
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

/// How motions of closed form are drawn and seen.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnalyticSource {
    /// What errs; none of those that are drawn on a body.
    pub errors: PoseErrors,
    /// Frames per second, Hz; divides 240.
    pub rate_hz: f64,
    /// Draws of each kind of motion, with errors of their own.
    #[serde(default = "one")]
    pub repeats: u64,
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
    /// What the measured side rests on.
    pub fn truth(&self) -> TruthSource {
        match (&self.physics, &self.analytic) {
            (Some(_), _) => TruthSource::Physics,
            (_, Some(_)) => TruthSource::ClosedForm,
            _ => TruthSource::Measured,
        }
    }

    /// Whether everything that is needed is there.
    ///
    /// # Errors
    /// A sentence on what is wrong.
    pub(in crate::fidelity) fn check(&self) -> Result<(), String> {
        match (&self.physics, &self.analytic, self.recordings.is_empty()) {
            (None, None, true) => Err("expected physics, analytic or recordings".to_owned()),
            (None, None, false) => Ok(()),
            (Some(source), None, true) => source.check(),
            (None, Some(source), true) => source.check(),
            _ => Err("expected only one of physics, analytic and recordings".to_owned()),
        }
    }
}

impl PhysicsSource {
    fn check(&self) -> Result<(), String> {
        check_frames(self.rate_hz, self.repeats)?;
        match &self.picture {
            Some(picture) if !picture.is_sound() => Err(format!(
                "picture {picture:?}: expected a motion and position of bags/truth, and two times"
            )),
            _ => Ok(()),
        }
    }
}

impl AnalyticSource {
    fn check(&self) -> Result<(), String> {
        if self.errors.needs_body() {
            return Err(format!(
                "errors {:?}: drawn on a body, which analytic motions lack; expected markers, marker_fit or inertial_suit",
                self.errors
            ));
        }
        check_frames(self.rate_hz, self.repeats)
    }
}

/// Frames per second, Hz, and draws.
fn check_frames(rate_hz: f64, repeats: u64) -> Result<(), String> {
    if !(10.0..=240.0).contains(&rate_hz) {
        return Err(format!("rate_hz {rate_hz}: expected 10 to 240"));
    }
    // Said before any study is run, which may take minutes.
    let every = (RATE_HZ / rate_hz).round();
    if (every * rate_hz - RATE_HZ).abs() > 1e-6 {
        return Err(format!(
            "rate_hz {rate_hz}: the known motions have {RATE_HZ} Hz, of which it must be a whole part"
        ));
    }
    if repeats == 0 {
        return Err("repeats 0: expected at least 1".to_owned());
    }
    Ok(())
}
