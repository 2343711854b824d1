//! A motion in SMPL's joints, whatever file it came from.

use std::ops::RangeInclusive;

use cromosim_body::{BodyPose, Gender, JOINT_COUNT, ShapeSpace};
use cromosim_spatial::PoseSource;
use nalgebra::{UnitQuaternion, Vector3};

use crate::{MarkerReport, MotionError, PoseReport, RetargetReport};

/// The skeleton maps of suits of IMUs, see `maps`.
const SUIT_MAPS: [&str; 2] = ["mvn", "xsens"];

/// A clip: poses at a constant rate, in a world with z up.
#[derive(Clone, Debug)]
pub struct SmplMotion {
    /// Where it comes from: a file's name, or the name of an embedded motion.
    pub name: String,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// The body's gender; neutral where the source does not say.
    pub gender: Gender,
    /// Shape coefficients (standard deviations) for the body that the motion was made for; 10 for
    /// the embedded body.
    pub betas: Vec<f64>,
    /// Whose shapes they tell: that body's.
    pub shape_space: ShapeSpace,
    /// Frame `i` stands at `i / rate_hz` seconds.
    pub frames: Vec<BodyPose>,
    /// One value in [0, 1] per frame where the source says how sure it is.
    pub confidence: Option<Vec<f64>>,
    /// How the source was read, where it was retargeted.
    pub report: Option<RetargetReport>,
    /// How the markers were fitted, where it comes from markers.
    pub markers: Option<MarkerReport>,
    /// How SMPL parameters were read, where it comes from such.
    pub poses: Option<PoseReport>,
}

impl SmplMotion {
    /// Time from the first to the last frame, s: `(frames - 1) / rate`.
    pub fn duration_s(&self) -> f64 {
        self.frames.len().saturating_sub(1) as f64 / self.rate_hz
    }

    /// What the poses' errors are like: SMPL parameters that are not a video's were fitted to markers,
    /// and skeletons of MVN are those of a suit.
    pub fn source(&self) -> PoseSource {
        let of_suit = |report: &RetargetReport| SUIT_MAPS.contains(&report.map.as_str());
        match &self.poses {
            Some(report) if report.format.is_video() => PoseSource::Video,
            Some(_) => PoseSource::Fitted,
            None if self.report.as_ref().is_some_and(of_suit) => PoseSource::InertialSuit,
            None => PoseSource::Tracked,
        }
    }

    /// How the source was read, in a line, where it has a report.
    pub fn how_read(&self) -> Option<String> {
        let skeleton = self.report.as_ref().map(ToString::to_string);
        skeleton
            .or_else(|| Some(self.markers.as_ref()?.to_string()))
            .or_else(|| Some(self.poses.as_ref()?.to_string()))
    }

    /// The part from `start_s` on, `duration_s` long (to the end where absent), frames on or after
    /// the start.
    ///
    /// # Errors
    /// [`MotionError::Setting`] where the part lies outside the motion.
    pub fn slice(&self, start_s: f64, duration_s: Option<f64>) -> Result<Self, MotionError> {
        Ok(self.of_frames(self.part(start_s, duration_s)?))
    }

    /// The frames that [`SmplMotion::slice`] takes.
    ///
    /// # Errors
    /// As [`SmplMotion::slice`].
    pub fn part(
        &self,
        start_s: f64,
        duration_s: Option<f64>,
    ) -> Result<RangeInclusive<usize>, MotionError> {
        let whole_s = self.duration_s();
        if !(start_s >= 0.0 && start_s <= whole_s) {
            return Err(self.setting(
                "start_s",
                start_s,
                format!("0 to {whole_s:.3} s (the motion's end)"),
            ));
        }
        if let Some(duration_s) =
            duration_s.filter(|&seconds| !(seconds > 0.0 && seconds.is_finite()))
        {
            return Err(self.setting("duration_s", duration_s, "more than 0 s".to_owned()));
        }
        // A frame's time is a quotient: half a microframe of slack keeps 0.1 s at 120 Hz on frame
        // 12.
        let first = (start_s * self.rate_hz - 1e-6).ceil().max(0.0) as usize;
        let end_s = duration_s.map_or(whole_s, |seconds| (start_s + seconds).min(whole_s));
        let last =
            ((end_s * self.rate_hz + 1e-6).floor() as usize).clamp(first, self.frames.len() - 1);
        Ok(first..=last)
    }

    /// These frames of it.
    #[must_use]
    pub fn of_frames(&self, range: RangeInclusive<usize>) -> Self {
        Self {
            frames: self.frames[range.clone()].to_vec(),
            confidence: self
                .confidence
                .as_ref()
                .map(|values| values[range].to_vec()),
            ..self.clone_without_frames()
        }
    }

    /// The pose at `time_s` after the first frame, clamped to the motion: spherical linear between
    /// the two frames around it. `None` for a motion without frames.
    pub fn pose_at(&self, time_s: f64) -> Option<BodyPose> {
        let (index, fraction) = self.place(time_s)?;
        let (from, to) = (
            &self.frames[index],
            &self.frames[(index + 1).min(self.frames.len() - 1)],
        );
        Some(BodyPose {
            root_position: from.root_position.lerp(&to.root_position, fraction),
            local_rotations: std::array::from_fn(|joint| {
                slerp(
                    &from.local_rotations[joint],
                    &to.local_rotations[joint],
                    fraction,
                )
            }),
        })
    }

    /// The pose at `time_s`, clamped, by cubic Hermite splines through four frames (Catmull-Rom
    /// tangents; rotations in the tangent space of the frame before): it passes through the frames,
    /// and velocities are continuous up to second order in the rotation per frame. `None` for a
    /// motion without frames.
    pub fn smooth_pose_at(&self, time_s: f64) -> Option<BodyPose> {
        let (index, fraction) = self.place(time_s)?;
        let last = self.frames.len() - 1;
        let around = [
            index.saturating_sub(1),
            index,
            (index + 1).min(last),
            (index + 2).min(last),
        ]
        .map(|frame| &self.frames[frame]);
        let local_rotations = std::array::from_fn(|joint| {
            let base = around[1].local_rotations[joint];
            let tangents =
                around.map(|frame| (base.inverse() * frame.local_rotations[joint]).scaled_axis());
            base * UnitQuaternion::from_scaled_axis(catmull_rom(&tangents, fraction))
        });
        Some(BodyPose {
            root_position: catmull_rom(&around.map(|frame| frame.root_position), fraction),
            local_rotations,
        })
    }

    /// The same motion at `rate_hz`, by [`Self::smooth_pose_at`].
    ///
    /// # Errors
    /// [`MotionError::Setting`] for a rate that is not positive and finite.
    pub fn resampled(&self, rate_hz: f64) -> Result<Self, MotionError> {
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Err(self.setting("rate_hz", rate_hz, "more than 0 Hz".to_owned()));
        }
        let count = (self.duration_s() * rate_hz + 1e-6).floor() as usize + 1;
        let times = (0..count).map(|frame| frame as f64 / rate_hz);
        let confidence = self.confidence.as_ref().map(|values| {
            times
                .clone()
                .filter_map(|time_s| self.place(time_s))
                .map(|(index, _)| values[index])
                .collect()
        });
        let frames: Vec<BodyPose> = times
            .filter_map(|time_s| self.smooth_pose_at(time_s))
            .collect();
        Ok(Self {
            rate_hz,
            frames: continuous(frames),
            confidence,
            ..self.clone_without_frames()
        })
    }

    /// Frame before `time_s` and how far it is to the next one, in [0, 1].
    fn place(&self, time_s: f64) -> Option<(usize, f64)> {
        let last = self.frames.len().checked_sub(1)?;
        let position = (time_s * self.rate_hz).clamp(0.0, last as f64);
        let index = (position.floor() as usize).min(last.saturating_sub(1));
        Some((index, position - index as f64))
    }

    fn clone_without_frames(&self) -> Self {
        Self {
            name: self.name.clone(),
            rate_hz: self.rate_hz,
            gender: self.gender,
            betas: self.betas.clone(),
            shape_space: self.shape_space,
            frames: Vec::new(),
            confidence: None,
            report: self.report.clone(),
            markers: self.markers.clone(),
            poses: self.poses.clone(),
        }
    }

    fn setting(&self, setting: &'static str, value: f64, expected: String) -> MotionError {
        MotionError::Setting {
            name: self.name.clone(),
            setting,
            value,
            expected,
        }
    }
}

/// Quaternions of each joint with signs chosen so that neighbours are near each other (q and -q are
/// the same rotation).
pub fn continuous(mut frames: Vec<BodyPose>) -> Vec<BodyPose> {
    for index in 1..frames.len() {
        for joint in 0..JOINT_COUNT {
            if frames[index].local_rotations[joint]
                .coords
                .dot(&frames[index - 1].local_rotations[joint].coords)
                < 0.0
            {
                let turned = -frames[index].local_rotations[joint].into_inner();
                frames[index].local_rotations[joint] = UnitQuaternion::new_unchecked(turned);
            }
        }
    }
    frames
}

/// Spherical linear interpolation the short way round; at 180 degrees, where the way is not unique,
/// some one of them.
pub fn slerp(
    from: &UnitQuaternion<f64>,
    to: &UnitQuaternion<f64>,
    fraction: f64,
) -> UnitQuaternion<f64> {
    from * UnitQuaternion::from_scaled_axis((from.inverse() * to).scaled_axis() * fraction)
}

/// All numbers of the poses are finite; `name` names the motion in the error.
pub(crate) fn check_finite(name: &str, frames: &[BodyPose]) -> Result<(), MotionError> {
    for (frame, pose) in frames.iter().enumerate() {
        let not_finite = |what| MotionError::NotFinite {
            name: name.to_owned(),
            frame,
            what,
        };
        if !pose.root_position.iter().all(|value| value.is_finite()) {
            return Err(not_finite("the root position"));
        }
        if !pose
            .local_rotations
            .iter()
            .all(|rotation| rotation.coords.iter().all(|value| value.is_finite()))
        {
            return Err(not_finite("a rotation"));
        }
    }
    Ok(())
}

fn catmull_rom(points: &[Vector3<f64>; 4], u: f64) -> Vector3<f64> {
    let (slope_from, slope_to) = (0.5 * (points[2] - points[0]), 0.5 * (points[3] - points[1]));
    let (u2, u3) = (u * u, u * u * u);
    points[1] * (2.0 * u3 - 3.0 * u2 + 1.0)
        + slope_from * (u3 - 2.0 * u2 + u)
        + points[2] * (3.0 * u2 - 2.0 * u3)
        + slope_to * (u3 - u2)
}
