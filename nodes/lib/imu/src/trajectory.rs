//! A sensor's frames over time: what the schemes differentiate.

use cromosim_spatial::{PoseSource, SpatialError, Stamp, check_times, relative_seconds};
use nalgebra::{Isometry3, Vector3};

use crate::{ImuError, PoseStd};

/// A sensor's frame at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorFrame {
    /// When.
    pub stamp: Stamp,
    /// The frame, m.
    pub world_from_sensor: Isometry3<f64>,
    /// The skin's outward unit normal, which [`crate::Scheme::NormalTracking`] follows.
    pub normal_in_world: Vector3<f64>,
    /// How far the frame may be off.
    pub pose_std: PoseStd,
}

impl SensorFrame {
    /// A frame without a skin: its own z axis stands for the normal.
    pub fn new(stamp: Stamp, world_from_sensor: Isometry3<f64>) -> Self {
        Self {
            stamp,
            world_from_sensor,
            normal_in_world: world_from_sensor * Vector3::z(),
            pose_std: PoseStd::NONE,
        }
    }

    /// The same frame, off by so much.
    #[must_use]
    pub fn with_pose_std(self, pose_std: PoseStd) -> Self {
        Self { pose_std, ..self }
    }

    pub(crate) fn is_finite(&self) -> bool {
        // All of them, as no number decides alone: that takes one branch.
        let finite = |numbers: &[f64]| numbers.iter().fold(true, |all, x| all & x.is_finite());
        finite(self.world_from_sensor.translation.vector.as_slice())
            & finite(self.world_from_sensor.rotation.coords.as_slice())
            & finite(self.normal_in_world.as_slice())
    }
}

/// At least two frames with increasing stamps, all finite.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorTrajectory {
    frames: Vec<SensorFrame>,
    source: PoseSource,
}

impl SensorTrajectory {
    /// Parses frames: uneven stamps and gaps are welcome, duplicates and time going backwards are
    /// not.
    ///
    /// # Errors
    /// [`ImuError::Trajectory`] with the index of the frame.
    pub fn new(frames: Vec<SensorFrame>) -> Result<Self, ImuError> {
        if frames.len() < 2 {
            return Err(SpatialError::TooFewSamples {
                got: frames.len(),
                needed: 2,
            }
            .into());
        }
        let origin = frames[0].stamp;
        // Most trajectories are sound: seconds are written down only to say where one is not.
        if !frames.is_sorted_by(|one, next| one.stamp - origin < next.stamp - origin) {
            check_times(&seconds(&frames))?;
        }
        if let Some(index) = frames.iter().position(|frame| !frame.is_finite()) {
            return Err(SpatialError::NotFinite {
                index,
                what: "pose",
            }
            .into());
        }
        Ok(Self {
            frames,
            source: PoseSource::default(),
        })
    }

    /// The same frames, off by so much; frames beyond `pose_stds` are taken as they are.
    #[must_use]
    pub fn with_pose_stds(mut self, pose_stds: &[PoseStd]) -> Self {
        self.frames
            .iter_mut()
            .zip(pose_stds)
            .for_each(|(frame, pose_std)| frame.pose_std = *pose_std);
        self
    }

    /// The same frames, whose poses come from there.
    #[must_use]
    pub fn from_source(mut self, source: PoseSource) -> Self {
        self.source = source;
        self
    }

    /// Where the poses come from.
    pub fn source(&self) -> PoseSource {
        self.source
    }

    /// The frames, in order of time.
    pub fn frames(&self) -> &[SensorFrame] {
        &self.frames
    }

    /// The frames alone.
    pub fn into_frames(self) -> Vec<SensorFrame> {
        self.frames
    }

    /// Stamp of the first frame.
    pub fn start(&self) -> Stamp {
        self.frames[0].stamp
    }

    /// Stamp of the last frame.
    pub fn end(&self) -> Stamp {
        self.frames[self.frames.len() - 1].stamp
    }
}

/// Seconds since the first frame.
pub(crate) fn seconds(frames: &[SensorFrame]) -> Vec<f64> {
    let stamps: Vec<_> = frames.iter().map(|frame| frame.stamp).collect();
    relative_seconds(&stamps, stamps.first().copied().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn frame(seconds: f64) -> SensorFrame {
        SensorFrame::new(Stamp::from_seconds(seconds), Isometry3::identity())
    }

    #[test]
    fn frames_are_checked_once() {
        assert!(SensorTrajectory::new(vec![frame(0.0)]).is_err());
        let backwards =
            SensorTrajectory::new(vec![frame(0.0), frame(0.2), frame(0.1)]).unwrap_err();
        assert!(backwards.to_string().contains("sample 2"), "{backwards}");
        let mut broken = vec![frame(0.0), frame(0.1)];
        broken[1].world_from_sensor.translation.vector.y = f64::NAN;
        assert!(
            SensorTrajectory::new(broken)
                .unwrap_err()
                .to_string()
                .contains("sample 1: pose is not finite")
        );
    }
}
